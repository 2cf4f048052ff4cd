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
    ImpactRow row;
    impact_log_open(&row, IMPACT_IMPACT, time, damper, side, approach);
    row.impact.peak_force = NAN;
    impact_log_stretch(log, &row, 0, mass * (approach + separation),
                       0.5 * mass * (approach - separation) * (approach + separation));
    log->bounces++;
    impact_log_close(log, &row, time, separation);
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

void impact_log_restart_peaks(ImpactLog *log, double force) {
    Response *response = log->response;
    response->peak_before_window =
        impact_log_larger(response->peak_before_window, response->peaks.displacement);
    response->peaks = (Peaks){.contact_force = fabs(force)};
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

void impact_log_end(ImpactLog *log, ImpactRow *row) {
    if (!row->is_open)
        return;
    row->impact.duration = NAN;
    row->impact.impulse = fabs(row->impact.impulse);
    impact_log_add(log, &row->impact);
}

Status impact_log_finish(ImpactLog *log, size_t dampers, const EnergyState *state,
                         WorkCounters *work, Problem *problem) {
    Response *response = log->response;
    // The rows of one damper are in order: each ends before the next begins.
    if (dampers > 1 && response->impacts.count > 1)
        qsort(response->impacts.at, response->impacts.count, sizeof *response->impacts.at,
              impact_log_compare);
    impact_log_balance(log, state);
    log->energy.kinetic = state->kinetic;
    log->energy.strain = state->strain;
    log->energy.residual = log->largest_energy > 0 ? log->largest_balance / log->largest_energy : 0;
    response->energy = log->energy;
    work->contacts = response->impact_count - log->bounces;
    work->bounces = log->bounces;
    work->rests = response->resting_count;
    work->ledger_rows = response->impacts.count;
    return impact_log_status(log, problem);
}
