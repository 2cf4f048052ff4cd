#include "core/solve/exact_state.h"

#include <math.h>
#include <stdlib.h>

void exact_forget(Exact *exact) {
    exact->has_lanes = exact->has_flight = false;
    for (int side = 0; side < 2; side++) {
        exact->has_pulse[side] = false;
        free(exact->holds[side]);
        exact->holds[side] = NULL;
    }
}

// Room between the free mass and a stop at r = 0 of the present origin [m].
double exact_room(const Exact *exact, Side side) {
    if (exact->origin == ORIGIN_MIDDLE)
        return exact->damper->clearance / 2;
    return exact->origin == (Origin)side ? 0 : exact->damper->clearance;
}

// u = x-relative displacement of the free mass [m].
double exact_relative(const Exact *exact) {
    const double stop = exact->damper->clearance / 2;
    const double origin =
        exact->origin == ORIGIN_MIDDLE ? 0 : exact_sign((Side)exact->origin) * stop;
    return exact->damper->offset + origin + exact->state.r;
}

double exact_time(const Exact *exact) {
    return (double)exact->sample / exact->plan->sample_rate + exact->offset;
}

double exact_effective_mass(const Exact *exact) {
    return exact->plan->mass[0] *
           exact->resting.share; // 1 - share would lose digits where m is the larger
}

// s = (C v + K x) / M: what pushes the free mass to the right, seen from the structure [m/s^2].
double exact_push(const Exact *exact) {
    return exact->flying.damping * exact->state.v + exact->flying.omega2 * exact->state.x;
}

// Contact force on the structure, positive to the right [N].
double exact_force(const Exact *exact) {
    if (exact->phase == CONTACT)
        return exact->damper->stops[exact->side].stiffness * exact->state.r +
               exact->damper->stops[exact->side].damping * exact->state.w;
    if (exact->phase == RESTING)
        return exact_effective_mass(exact) * exact_push(exact);
    return 0;
}

Moment exact_moment(const Exact *exact) {
    const double n = exact_force(exact);
    Moment moment = {.x = exact->state.x,
                     .v = exact->state.v,
                     .acceleration = n / exact->plan->mass[0] - exact_push(exact),
                     .force = n};
    if (exact->plan->damper_count > 0) {
        moment.damper_x = exact->state.x + exact_relative(exact);
        moment.damper_v = exact->state.v + exact->state.w;
        moment.penetration =
            exact->phase == CONTACT ? fmax(exact_sign(exact->side) * exact->state.r, 0) : 0;
    }
    return moment;
}

EnergyState exact_energy(const Exact *exact) {
    const Plan *plan = exact->plan;
    const State *state = &exact->state;
    const double z = state->v + state->w;
    const double k = exact->phase == CONTACT ? exact->damper->stops[exact->side].stiffness : 0;
    return (EnergyState){
        0.5 * plan->mass[0] * state->v * state->v + 0.5 * exact->damper->mass * z * z,
        0.5 * plan->stiffness[0] * state->x * state->x + 0.5 * k * state->r * state->r};
}

const Motion *exact_motion(const Exact *exact) {
    return exact->phase == FLIGHT    ? &exact->flying
           : exact->phase == CONTACT ? &exact->touching[exact->side]
                                     : &exact->resting;
}
