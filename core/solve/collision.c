// The collision of all masses that reach their stops at one instant. Impulses only press, and each
// damper parts at least as fast as the restitution of its stop demands (a resting one: not
// inwards):
//
//   impulse_d >= 0   and   separation speed >= e_d approach speed,   one of them equal.
//
// Between stops without clearance the other stop presses where one would have to pull, so there the
// impulse may have any sign. The impulses act through M^-1, so one on any storey may press or free
// a mass on another. These are the conditions of a least squares problem with the positive definite
// matrix `delassus`, so the solution is unique. It is found by block principal pivoting (Judice and
// Pires 1994): all stops that press are solved for at once; those that would have to pull leave the
// set, and those that lack speed join it. Where this does not go on, one stop at a time does
// (Murty's rule), so no set occurs twice. Momentum is conserved for any impulses. No energy is
// gained, for each stop that presses takes impulse (approach - separation) / 2.
#include "core/solve/engine.h"

#include <float.h>
#include <math.h>

#include "core/math/linear_system.h"

// Never reached but for rounding.
enum { ROUNDS_MAX = 1000, BLOCK_TRIES = 10 };

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

// The impulses that all stops that press would have without the condition that impulses only press.
static void collision_solve(ModalState *state) {
    double *matrix = state->scratch, impulses[SCENE_DAMPERS];
    size_t count = 0, pressing[SCENE_DAMPERS];
    for (size_t d = 0; d < state->dampers; d++) {
        state->damper[d].impulse = 0;
        if (state->damper[d].is_pressing)
            pressing[count++] = d;
    }
    for (size_t i = 0; i < count; i++) {
        const DamperState *damper = &state->damper[pressing[i]];
        impulses[i] = damper->approach_speed + damper->separation_speed;
        for (size_t j = 0; j < count; j++)
            matrix[i * count + j] = collision_coupling(state, pressing[i], pressing[j]);
    }
    (void)linear_system_solve(matrix, impulses, count, 1); // positive definite
    for (size_t i = 0; i < count; i++)
        state->damper[pressing[i]].impulse = impulses[i];
}

// Whether a stop that presses would have to pull, or one that does not lacks speed, by more than
// rounding.
static bool collision_is_wrong(const ModalState *state, size_t d) {
    const DamperState *damper = &state->damper[d];
    if (!damper->in_collision || damper->plan->clearance == 0)
        return false;
    const double asked = damper->approach_speed + damper->separation_speed;
    double lack = asked, size = asked;
    for (size_t e = 0; e < state->dampers; e++) {
        const double given = collision_coupling(state, d, e) * state->damper[e].impulse;
        lack -= given;
        size += fabs(given);
    }
    const double rounding = 4 * DBL_EPSILON * size;
    return damper->is_pressing
               ? damper->impulse < -rounding / state->delassus[d * state->dampers + d]
               : lack > rounding;
}

static void collision_apply(ModalState *state) {
    double *impulses = state->scratch;
    for (size_t d = 0; d < state->dampers; d++)
        impulses[d] = modal_state_sign(state->damper[d].side) * state->damper[d].impulse;
    collision_push(state, impulses);
    for (size_t d = 0; d < state->dampers; d++) {
        DamperState *damper = &state->damper[d];
        if (damper->in_collision && damper->impulse != 0)
            damper->w = -modal_state_sign(damper->side) * damper->separation_speed;
    }
}

void collision_resolve(ModalState *state) {
    for (size_t d = 0; d < state->dampers; d++) {
        DamperState *damper = &state->damper[d];
        damper->is_pressing =
            damper->in_collision &&
            (damper->plan->clearance == 0 || damper->approach_speed + damper->separation_speed > 0);
    }
    size_t fewest = SCENE_DAMPERS + 1, tries = BLOCK_TRIES;
    for (size_t round = 0; round < ROUNDS_MAX; round++) {
        size_t wrong[SCENE_DAMPERS], count = 0;
        collision_solve(state);
        for (size_t d = 0; d < state->dampers; d++)
            if (collision_is_wrong(state, d))
                wrong[count++] = d;
        if (count == 0)
            break;
        if (count < fewest) {
            fewest = count;
            tries = BLOCK_TRIES;
        } else if (tries > 0) {
            tries--;
        } else {
            wrong[0] = wrong[count - 1];
            count = 1;
        }
        for (size_t i = 0; i < count; i++)
            state->damper[wrong[i]].is_pressing = !state->damper[wrong[i]].is_pressing;
    }
    for (size_t d = 0; d < state->dampers; d++) {
        DamperState *damper = &state->damper[d];
        if (damper->plan->clearance > 0 && !(damper->impulse > 0))
            damper->impulse = 0;
    }
    collision_apply(state);
}

void collision_transmit(ModalState *state) {
    for (size_t d = 0; d < state->dampers; d++)
        state->damper[d].in_collision = state->damper[d].is_pressing;
    collision_solve(state);
    collision_apply(state);
}
