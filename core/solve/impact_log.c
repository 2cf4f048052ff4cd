#include "core/solve/impact_log.h"

#include <stdlib.h>

void impact_log_start(ImpactLog *ledger, Response *response, size_t most,
                      const EnergyState *energy) {
    *ledger = (ImpactLog){.response = response, .most = most};
    ledger->energy.initial = energy->kinetic + energy->strain;
    ledger->largest_energy = ledger->energy.initial;
}

static void meet(ApproachSpeeds *met, double speed) {
    met->min = met->count == 0 ? speed : fmin(met->min, speed);
    met->max = met->count == 0 ? speed : fmax(met->max, speed);
    met->count++;
    met->below += speed < met->from;
    met->above += speed > met->to;
}

// What is told of an impact whether or not it is listed.
static void count(ImpactLog *ledger, const Impact *impact) {
    Response *response = ledger->response;
    const size_t damper = (size_t)impact->damper - 1;
    if (impact->kind != IMPACT_IMPACT) {
        response->resting_count++;
    } else {
        response->impact_count++;
        if (response->approaches != NULL && !impact->is_resumed &&
            response->approaches[2 * damper + (size_t)impact->side].is_ranged)
            meet(&response->approaches[2 * damper + (size_t)impact->side], impact->approach_speed);
    }
    ledger->impulse[damper] = impact_log_larger(ledger->impulse[damper], impact->impulse);
}

static void add(ImpactLog *ledger, const Impact *impact) {
    Impacts *impacts = &ledger->response->impacts;
    if (ledger->status != STATUS_OK)
        return;
    if (ledger->response->is_unlisted) {
        count(ledger, impact);
        return;
    }
    if (ledger->most > 0 && impacts->count >= ledger->most) {
        ledger->status = STATUS_LIMIT;
        return;
    }
    if (impacts->count == ledger->room) {
        const size_t wanted = ledger->room == 0 ? 64 : 2 * ledger->room;
        Impact *grown = realloc(impacts->at, wanted * sizeof *grown);
        if (grown == NULL) {
            ledger->status = STATUS_NO_MEMORY;
            return;
        }
        impacts->at = grown;
        ledger->room = wanted;
    }
    impacts->at[impacts->count++] = *impact;
    count(ledger, impact);
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

void impact_log_close(ImpactLog *ledger, ImpactRow *row, double time, double separation) {
    Impact *open = &row->impact;
    open->end = time;
    open->separation_speed = separation;
    if (open->approach_speed > 0)
        open->restitution = separation / open->approach_speed;
    open->impulse = fabs(open->impulse);
    add(ledger, open);
    row->is_open = false;
}

void impact_log_bounce(ImpactLog *ledger, double time, size_t damper, Side side, double approach,
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
    ledger->energy.contact += impact.energy_lost;
    ledger->bounces++;
    add(ledger, &impact);
}

void impact_log_balance(ImpactLog *ledger, const EnergyState *state) {
    const Energy *energy = &ledger->energy;
    const double held = state->kinetic + state->strain;
    const double balance =
        held - energy->initial - energy->input + energy->structural_damping + energy->contact;
    ledger->largest_energy =
        impact_log_larger(ledger->largest_energy, impact_log_larger(held, fabs(energy->input)));
    ledger->largest_balance = impact_log_larger(ledger->largest_balance, fabs(balance));
    ledger->largest_gain = impact_log_larger(ledger->largest_gain, balance);
}

void impact_log_count(const ImpactLog *ledger, WorkCounters *work) {
    const Response *response = ledger->response;
    work->contacts = response->impact_count - ledger->bounces;
    work->bounces = ledger->bounces;
    work->rests = response->resting_count;
    work->ledger_rows = response->impacts.count;
}

void impact_log_forget_peaks(ImpactLog *ledger, const Instant *at) {
    Response *response = ledger->response;
    response->peak_before_window =
        impact_log_larger(response->peak_before_window, response->peaks.displacement);
    response->peaks = (Peaks){.contact_force = fabs(at->force)};
}

Status impact_log_status(const ImpactLog *ledger, Problem *problem) {
    if (ledger->status == STATUS_LIMIT)
        return problem_set(problem, STATUS_LIMIT,
                           "more than %zu impacts; the last one kept was at t = %.6g s",
                           ledger->most, ledger->response->impacts.at[ledger->most - 1].start);
    if (ledger->status == STATUS_NO_MEMORY)
        return problem_set(problem, STATUS_NO_MEMORY, "no memory for more than %zu impacts",
                           ledger->response->impacts.count);
    if (ledger->gain_max > 0 && ledger->largest_gain > ledger->gain_max * ledger->largest_energy)
        return problem_set(problem, STATUS_UNSTABLE,
                           "the motion gained %.3g J that neither the base nor the start gave it, "
                           "more than %.3g of its largest energy, %.3g J: its numbers are too far "
                           "apart for double precision",
                           ledger->largest_gain, ledger->gain_max, ledger->largest_energy);
    return STATUS_OK;
}

static int by_start(const void *a, const void *b) {
    const Impact *first = a, *second = b;
    if (first->start != second->start)
        return first->start < second->start ? -1 : 1;
    if (first->damper != second->damper)
        return first->damper < second->damper ? -1 : 1;
    return (first->side > second->side) - (first->side < second->side);
}

Status impact_log_finish(ImpactLog *ledger, ImpactRow *rows, size_t count, const EnergyState *state,
                         Problem *problem) {
    for (size_t i = 0; i < count; i++) {
        if (!rows[i].is_open)
            continue;
        rows[i].impact.duration = NAN;
        rows[i].impact.impulse = fabs(rows[i].impact.impulse);
        add(ledger, &rows[i].impact);
    }
    // One damper's rows are in order: each ends before the next begins.
    Impacts *impacts = &ledger->response->impacts;
    if (count > 1 && impacts->count > 1)
        qsort(impacts->at, impacts->count, sizeof *impacts->at, by_start);
    impact_log_balance(ledger, state);
    Energy *energy = &ledger->energy;
    energy->kinetic = state->kinetic;
    energy->strain = state->strain;
    energy->residual =
        ledger->largest_energy > 0 ? ledger->largest_balance / ledger->largest_energy : 0;
    ledger->response->energy = *energy;
    return impact_log_status(ledger, problem);
}
