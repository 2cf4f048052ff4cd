// The collision of all masses that reach their stops at one instant. Impulses only press, and each
// damper parts at least as fast as the restitution of its stop demands (a resting one: not
// inwards):
//
//   impulse_d >= 0   and   separation speed >= e_d approach speed,   one of them equal.
//
// Between stops without clearance the other stop presses where one would have to pull, so there the
// impulse may have any sign. The impulses act through M^-1, so one on any storey may press or free
// a mass on another. These are the conditions of a least squares problem with the positive definite
// matrix `delassus`, so the solution is unique. It is found by the active set method of Lawson and
// Hanson (1974): the stop that lacks most speed joins those that press, all of these are solved for
// at once, and a stop that would have to pull leaves. Each round reduces the residual, so no set
// occurs twice. Momentum is conserved for any impulses. No energy is gained, for each stop that
// presses takes impulse (approach - separation) / 2.
#include "core/solve/engine.h"

#include <float.h>
#include <math.h>

#include "core/math/linear_system.h"

// Never reached but for rounding.
enum { ROUNDS_MAX = 100000 };

void collision_push(ModalState *state, const double *impulses) {
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

static double collision_coupling(const ModalState *state, size_t d, size_t e) {
    return modal_state_sign(state->damper[d].side) * modal_state_sign(state->damper[e].side) *
           state->delassus[d * state->dampers + e];
}

// Relative speed that stop d lacks with the present impulses; 0 where that is rounding.
static double collision_lack(const ModalState *state, size_t d) {
    const double asked = state->damper[d].approach_speed + state->damper[d].separation_speed;
    double sum = asked, size = asked;
    for (size_t e = 0; e < state->dampers; e++) {
        const double given = collision_coupling(state, d, e) * state->damper[e].impulse;
        sum -= given;
        size += fabs(given);
    }
    return fabs(sum) <= 4 * DBL_EPSILON * size ? 0 : sum;
}

// The impulses that all stops that press would have without the condition that impulses only press.
static void collision_solve(ModalState *state) {
    double *matrix = state->scratch, wanted[SCENE_DAMPERS];
    size_t count = 0, pressing[SCENE_DAMPERS];
    for (size_t d = 0; d < state->dampers; d++)
        if (state->damper[d].is_pressing)
            pressing[count++] = d;
    for (size_t i = 0; i < count; i++) {
        const DamperState *damper = &state->damper[pressing[i]];
        wanted[i] = damper->approach_speed + damper->separation_speed;
        for (size_t j = 0; j < count; j++)
            matrix[i * count + j] = collision_coupling(state, pressing[i], pressing[j]);
    }
    (void)linear_system_solve(matrix, wanted, count, 1); // positive definite
    for (size_t i = 0; i < count; i++)
        state->damper[pressing[i]].wanted = wanted[i];
}

// Moves the impulses towards the wanted ones until the first of them is 0. False: that one has left
// the set.
static bool collision_approach(ModalState *state) {
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

// The stop that lacks most speed; NULL where none does.
static DamperState *collision_find_lacking(ModalState *state) {
    DamperState *most = NULL;
    double largest = 0;
    for (size_t d = 0; d < state->dampers; d++) {
        DamperState *damper = &state->damper[d];
        if (!damper->in_collision || damper->is_pressing || damper->is_finished)
            continue;
        const double weight =
            collision_lack(state, d) / sqrt(state->delassus[d * state->dampers + d]);
        if (weight > largest) {
            largest = weight;
            most = damper;
        }
    }
    return most;
}

// Adds a stop to the set. If it would pull, what it lacked was rounding: it stays out until another
// one joins.
static void collision_join(ModalState *state, DamperState *damper) {
    damper->is_pressing = true;
    collision_solve(state);
    if (!(damper->wanted > 0)) {
        damper->is_pressing = false;
        damper->is_finished = true;
        return;
    }
    for (size_t d = 0; d < state->dampers; d++)
        state->damper[d].is_finished = false;
    while (!collision_approach(state))
        collision_solve(state);
}

void collision_resolve(ModalState *state) {
    double *impulses = state->scratch;
    for (size_t d = 0; d < state->dampers; d++) {
        DamperState *damper = &state->damper[d];
        damper->impulse = 0;
        damper->is_pressing = damper->in_collision && damper->plan->clearance == 0;
        damper->is_finished = false;
    }
    collision_solve(state);
    (void)collision_approach(state); // these may pull
    DamperState *next = NULL;
    for (size_t i = 0; i < ROUNDS_MAX && (next = collision_find_lacking(state)) != NULL; i++)
        collision_join(state, next);
    for (size_t d = 0; d < state->dampers; d++) {
        const DamperState *damper = &state->damper[d];
        impulses[d] = damper->in_collision ? modal_state_sign(damper->side) * damper->impulse : 0;
    }
    collision_push(state, impulses);
    for (size_t d = 0; d < state->dampers; d++) {
        DamperState *damper = &state->damper[d];
        if (damper->in_collision && damper->impulse != 0)
            damper->w = -modal_state_sign(damper->side) * damper->separation_speed;
    }
}
