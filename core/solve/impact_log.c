#include "core/solve/impact_log.h"

#include <stdlib.h>

void ledger_start(Ledger *ledger, Response *response, size_t most, const EnergyState *energy) {
    *ledger = (Ledger){.response = response, .most = most};
    ledger->energy.initial = energy->kinetic + energy->strain;
    ledger->largest_energy = ledger->energy.initial;
}

static void meet(Approaches *met, double speed) {
    met->least = met->count == 0 ? speed : fmin(met->least, speed);
    met->most = met->count == 0 ? speed : fmax(met->most, speed);
    met->count++;
    met->below += speed < met->from;
    met->above += speed > met->to;
}

// What is told of an impact whether or not it is listed.
static void count(Ledger *ledger, const Impact *impact) {
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
    ledger->impulse[damper] = ledger_larger(ledger->impulse[damper], impact->impulse);
}

static void add(Ledger *ledger, const Impact *impact) {
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

void ledger_open(LedgerRow *row, ImpactKind kind, double time, size_t damper, Side side,
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

void ledger_close(Ledger *ledger, LedgerRow *row, double time, double separation) {
    Impact *open = &row->impact;
    open->end = time;
    open->separation_speed = separation;
    if (open->approach_speed > 0)
        open->restitution = separation / open->approach_speed;
    open->impulse = fabs(open->impulse);
    add(ledger, open);
    row->is_open = false;
}

void ledger_bounce(Ledger *ledger, double time, size_t damper, Side side, double approach,
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

void ledger_balance(Ledger *ledger, const EnergyState *state) {
    const Energy *energy = &ledger->energy;
    const double held = state->kinetic + state->strain;
    const double balance =
        held - energy->initial - energy->input + energy->structural_damping + energy->contact;
    ledger->largest_energy =
        ledger_larger(ledger->largest_energy, ledger_larger(held, fabs(energy->input)));
    ledger->largest_balance = ledger_larger(ledger->largest_balance, fabs(balance));
    ledger->largest_gain = ledger_larger(ledger->largest_gain, balance);
}

void ledger_count(const Ledger *ledger, Work *work) {
    const Response *response = ledger->response;
    work->contacts = response->impact_count - ledger->bounces;
    work->bounces = ledger->bounces;
    work->rests = response->resting_count;
    work->ledger_rows = response->impacts.count;
}

void ledger_forget_peaks(Ledger *ledger, const Moment *at) {
    Response *response = ledger->response;
    response->earlier = ledger_larger(response->earlier, response->peaks.displacement);
    response->peaks = (Peaks){.contact_force = fabs(at->force)};
}

Status ledger_status(const Ledger *ledger, Problem *problem) {
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

Status ledger_finish(Ledger *ledger, LedgerRow *rows, size_t count, const EnergyState *state,
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
    ledger_balance(ledger, state);
    Energy *energy = &ledger->energy;
    energy->kinetic = state->kinetic;
    energy->strain = state->strain;
    energy->residual =
        ledger->largest_energy > 0 ? ledger->largest_balance / ledger->largest_energy : 0;
    ledger->response->energy = *energy;
    return ledger_status(ledger, problem);
}
