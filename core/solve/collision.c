// At the stops that are met at one instant, impulses only press, and each damper parts at least as
// fast as its stop's restitution says (a resting one: not inwards):
//
//   0 <= pressed_d   and   parting speed after >= e_d closing speed before,  one of them equal.
//
// Between stops without clearance the other stop would press where one would have to pull, so there
// the impulse may have any sign. The impulses act through M^-1, so one on any storey may press or
// free a mass on another. The conditions are those of the least squares problem with matrix
// `yield`, positive definite, so they have one solution. It is found as of any such problem with
// signs (Lawson and Hanson 1974): the stop that lacks most joins those that press, these are solved
// for all at once, and whoever would have to pull drops out on the way there. Each round comes
// nearer, so none comes twice. Momentum is conserved whatever the impulses are; no energy is
// gained, for each pressed stop takes pressed (closing - parting) / 2.
#include "core/solve/collision.h"

#include <float.h>
#include <math.h>

// Only rounding could make so many rounds of a few dampers.
enum { ROUNDS_MAX = 100000 };

void modal_state_push(ModalState *state, const double *impulses) {
    for (size_t d = 0; d < state->dampers; d++) {
        const double impulse = impulses[d];
        if (impulse == 0)
            continue;
        const double *shape = state->damper[d].shape;
        for (size_t i = 0; i < state->mode_count; i++)
            state->p[i] += shape[i] * impulse;
        for (size_t e = 0; e < state->dampers; e++)
            state->damper[e].w -= state->delassus[e * state->dampers + d] * impulse;
    }
}

static double coupling(const ModalState *state, size_t d, size_t e) {
    return modal_state_sign(state->damper[d].side) * modal_state_sign(state->damper[e].side) *
           state->delassus[d * state->dampers + e];
}

// Relative speed that stop d lacks with the present impulses; 0 where that is rounding.
static double lack(const ModalState *state, size_t d) {
    const double asked = state->damper[d].approach_speed + state->damper[d].separation_speed;
    double sum = asked, size = asked;
    for (size_t e = 0; e < state->dampers; e++) {
        const double given = coupling(state, d, e) * state->damper[e].impulse;
        sum -= given;
        size += fabs(given);
    }
    return fabs(sum) <= 4 * DBL_EPSILON * size ? 0 : sum;
}

// `wanted` of all stops that press, were it to them alone: coupling = L D L', row after row.
static void solve(ModalState *state) {
    const size_t n = state->dampers;
    double *L = state->scratch;
    for (size_t i = 0; i < n; i++) {
        DamperState *damper = &state->damper[i];
        if (!damper->is_pressing)
            continue;
        damper->wanted = damper->approach_speed + damper->separation_speed;
        for (size_t j = 0; j <= i; j++) {
            if (!state->damper[j].is_pressing)
                continue;
            double sum = coupling(state, i, j);
            for (size_t k = 0; k < j; k++)
                if (state->damper[k].is_pressing)
                    sum -= L[i * n + k] * L[k * n + k] * L[j * n + k];
            L[i * n + j] = i == j ? sum : sum / L[j * n + j];
            if (j < i)
                damper->wanted -= L[i * n + j] * state->damper[j].wanted;
        }
    }
    for (size_t i = n; i-- > 0;) {
        DamperState *damper = &state->damper[i];
        if (!damper->is_pressing)
            continue;
        damper->wanted /= L[i * n + i];
        for (size_t j = i + 1; j < n; j++)
            if (state->damper[j].is_pressing)
                damper->wanted -= L[j * n + i] * state->damper[j].wanted;
    }
}

// From the present impulses as far towards the wanted ones as all only press; false: one that no
// longer does has dropped out.
static bool approach(ModalState *state) {
    double share = 1;
    DamperState *least = NULL;
    for (size_t d = 0; d < state->dampers; d++) {
        DamperState *damper = &state->damper[d];
        if (!damper->is_pressing || damper->plan->clearance == 0 || damper->wanted > 0)
            continue;
        const double part = damper->impulse / (damper->impulse - damper->wanted);
        if (least == NULL || !(part >= share)) { // not a number where both are 0
            share = part > 0 ? part : 0;
            least = damper;
        }
    }
    for (size_t d = 0; d < state->dampers; d++) {
        DamperState *damper = &state->damper[d];
        if (damper->is_pressing)
            damper->impulse = least == NULL
                                  ? damper->wanted
                                  : damper->impulse + share * (damper->wanted - damper->impulse);
    }
    if (least == NULL)
        return true;
    least->impulse = 0;
    least->is_pressing = false;
    return false;
}

// The stop that lacks most; NULL where none does.
static DamperState *find_lacking(ModalState *state) {
    DamperState *most = NULL;
    double largest = 0;
    for (size_t d = 0; d < state->dampers; d++) {
        DamperState *damper = &state->damper[d];
        if (!damper->in_collision || damper->is_pressing || damper->is_finished)
            continue;
        const double weight = lack(state, d) / sqrt(state->delassus[d * state->dampers + d]);
        if (weight > largest) {
            largest = weight;
            most = damper;
        }
    }
    return most;
}

// One stop more presses. Where it would pull, what it lacked was rounding: it stays out until
// another joins.
static void join(ModalState *state, DamperState *damper) {
    damper->is_pressing = true;
    solve(state);
    if (!(damper->wanted > 0)) {
        damper->is_pressing = false;
        damper->is_finished = true;
        return;
    }
    for (size_t d = 0; d < state->dampers; d++)
        state->damper[d].is_finished = false;
    while (!approach(state))
        solve(state);
}

void collision_resolve(ModalState *state) {
    double *impulses = state->scratch;
    for (size_t d = 0; d < state->dampers; d++) {
        DamperState *damper = &state->damper[d];
        damper->impulse = 0;
        damper->is_pressing = damper->in_collision && damper->plan->clearance == 0;
        damper->is_finished = false;
    }
    solve(state);
    (void)approach(state); // these may pull
    DamperState *next = NULL;
    for (size_t i = 0; i < ROUNDS_MAX && (next = find_lacking(state)) != NULL; i++)
        join(state, next);
    for (size_t d = 0; d < state->dampers; d++) {
        const DamperState *damper = &state->damper[d];
        impulses[d] = damper->in_collision ? modal_state_sign(damper->side) * damper->impulse : 0;
    }
    modal_state_push(state, impulses);
    for (size_t d = 0; d < state->dampers; d++) {
        DamperState *damper = &state->damper[d];
        if (damper->in_collision && damper->impulse != 0)
            damper->w = -modal_state_sign(damper->side) * damper->separation_speed;
    }
}
