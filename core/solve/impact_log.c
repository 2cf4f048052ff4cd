#include "core/solve/impact_log.h"

#include <stdlib.h>

void impact_log_start(ImpactLog *log, Response *response, size_t most, const EnergyState *energy) {
    *log = (ImpactLog){.response = response, .most = most};
    log->energy.initial = energy->kinetic + energy->strain;
    log->largest_energy = log->energy.initial;
}

static void impact_log_add_approach(ApproachSpeeds *met, double speed) {
    met->min = met->count == 0 ? speed : fmin(met->min, speed);
    met->max = met->count == 0 ? speed : fmax(met->max, speed);
    met->count++;
    met->below += speed < met->from;
    met->above += speed > met->to;
}

// Counts an impact, whether or not it is listed.
static void impact_log_count_impact(ImpactLog *log, const Impact *impact) {
    Response *response = log->response;
    const size_t damper = (size_t)impact->damper - 1;
    if (impact->kind != IMPACT_IMPACT) {
        response->resting_count++;
    } else {
        response->impact_count++;
        if (response->approaches != NULL && !impact->is_resumed &&
            response->approaches[2 * damper + (size_t)impact->side].is_ranged)
            impact_log_add_approach(&response->approaches[2 * damper + (size_t)impact->side],
                                    impact->approach_speed);
    }
    log->impulse[damper] = impact_log_larger(log->impulse[damper], impact->impulse);
}

static void impact_log_add(ImpactLog *log, const Impact *impact) {
    Impacts *impacts = &log->response->impacts;
    if (log->status != STATUS_OK)
        return;
    if (log->response->is_unlisted) {
        impact_log_count_impact(log, impact);
        return;
    }
    if (log->most > 0 && impacts->count >= log->most) {
        log->status = STATUS_LIMIT;
        return;
    }
    if (impacts->count == log->room) {
        const size_t wanted = log->room == 0 ? 64 : 2 * log->room;
        Impact *grown = realloc(impacts->at, wanted * sizeof *grown);
        if (grown == NULL) {
            log->status = STATUS_NO_MEMORY;
            return;
        }
        impacts->at = grown;
        log->room = wanted;
    }
    impacts->at[impacts->count++] = *impact;
    impact_log_count_impact(log, impact);
}

void impact_log_open(ImpactRow *row, ImpactKind kind, double time, size_t damper, Side side,
                     double approach) {
    row->is_open = true;
    row->impact = (Impact){.kind = (int)kind,
                           .start = time,
                           .end = NAN,
                           .damper = damper + 1,
                           .side = (int)side,
                           .approach_speed = approach,
                           .separation_speed = NAN,
                           .restitution = NAN};
}

void impact_log_close(ImpactLog *log, ImpactRow *row, double time, double separation) {
    Impact *open = &row->impact;
    open->end = time;
    open->separation_speed = separation;
    if (open->approach_speed > 0)
        open->restitution = separation / open->approach_speed;
    open->impulse = fabs(open->impulse);
    impact_log_add(log, open);
    row->is_open = false;
}

void impact_log_bounce(ImpactLog *log, double time, size_t damper, Side side, double approach,
                       double separation, double mass) {
    const Impact impact = {.kind = IMPACT_IMPACT,
                           .start = time,
                           .end = time,
                           .damper = damper + 1,
                           .side = (int)side,
                           .approach_speed = approach,
                           .separation_speed = separation,
                           .restitution = approach > 0 ? separation / approach : NAN,
                           .peak_force = NAN,
                           .impulse = mass * (approach + separation),
                           .energy_lost =
                               0.5 * mass * (approach - separation) * (approach + separation)};
    log->energy.contact += impact.energy_lost;
    log->bounces++;
    impact_log_add(log, &impact);
}

void impact_log_balance(ImpactLog *log, const EnergyState *state) {
    const Energy *energy = &log->energy;
    const double held = state->kinetic + state->strain;
    const double balance =
        held - energy->initial - energy->input + energy->structural_damping + energy->contact;
    log->largest_energy =
        impact_log_larger(log->largest_energy, impact_log_larger(held, fabs(energy->input)));
    log->largest_balance = impact_log_larger(log->largest_balance, fabs(balance));
    log->largest_gain = impact_log_larger(log->largest_gain, balance);
}

void impact_log_count(const ImpactLog *log, WorkCounters *work) {
    const Response *response = log->response;
    work->contacts = response->impact_count - log->bounces;
    work->bounces = log->bounces;
    work->rests = response->resting_count;
    work->ledger_rows = response->impacts.count;
}

void impact_log_forget_peaks(ImpactLog *log, const Instant *at) {
    Response *response = log->response;
    response->peak_before_window =
        impact_log_larger(response->peak_before_window, response->peaks.displacement);
    response->peaks = (Peaks){.contact_force = fabs(at->force)};
}

Status impact_log_status(const ImpactLog *log, Problem *problem) {
    if (log->status == STATUS_LIMIT)
        return problem_set(problem, STATUS_LIMIT,
                           "more than %zu impacts; the last one kept was at t = %.6g s", log->most,
                           log->response->impacts.at[log->most - 1].start);
    if (log->status == STATUS_NO_MEMORY)
        return problem_set(problem, STATUS_NO_MEMORY, "no memory for more than %zu impacts",
                           log->response->impacts.count);
    if (log->gain_max > 0 && log->largest_gain > log->gain_max * log->largest_energy)
        return problem_set(problem, STATUS_UNSTABLE,
                           "the motion gained %.3g J that neither the base nor the start gave it, "
                           "more than %.3g of its largest energy, %.3g J: its numbers are too far "
                           "apart for double precision",
                           log->largest_gain, log->gain_max, log->largest_energy);
    return STATUS_OK;
}

static int impact_log_compare(const void *a, const void *b) {
    const Impact *first = a, *second = b;
    if (first->start != second->start)
        return first->start < second->start ? -1 : 1;
    if (first->damper != second->damper)
        return first->damper < second->damper ? -1 : 1;
    return (first->side > second->side) - (first->side < second->side);
}

Status impact_log_finish(ImpactLog *log, ImpactRow *rows, size_t count, const EnergyState *state,
                         Problem *problem) {
    for (size_t i = 0; i < count; i++) {
        if (!rows[i].is_open)
            continue;
        rows[i].impact.duration = NAN;
        rows[i].impact.impulse = fabs(rows[i].impact.impulse);
        impact_log_add(log, &rows[i].impact);
    }
    // The rows of one damper are in order: each ends before the next begins.
    Impacts *impacts = &log->response->impacts;
    if (count > 1 && impacts->count > 1)
        qsort(impacts->at, impacts->count, sizeof *impacts->at, impact_log_compare);
    impact_log_balance(log, state);
    Energy *energy = &log->energy;
    energy->kinetic = state->kinetic;
    energy->strain = state->strain;
    energy->residual = log->largest_energy > 0 ? log->largest_balance / log->largest_energy : 0;
    log->response->energy = *energy;
    return impact_log_status(log, problem);
}
