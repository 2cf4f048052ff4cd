// What the exact solver knows while it runs, and how it looks from outside: origin, room, forces,
// energies. Not the stepping (exact.c) nor the events (exact_events.c). Used by core/solve/exact*.c
// and press*.
#ifndef CORE_SOLVE_EXACT_STATE_H
#define CORE_SOLVE_EXACT_STATE_H

#include <math.h>

#include "core/solve/arc.h"
#include "core/solve/base_motion_cursor.h"
#include "core/solve/exact_flight.h"
#include "core/solve/exact_hold.h"
#include "core/solve/exact_record.h"
#include "core/solve/hop.h"
#include "core/solve/impact_log.h"
#include "core/solve/lanes.h"
#include "core/solve/pulse.h"
#include "core/solve/rounding_growth.h"
#include "core/solve/solver.h"

// Solver steps of a sample among many, and of a stretch to or of a contact in closed form.
#define EXACT_SAMPLE_STEPS 0.1
#define EXACT_HOP_STEPS 5

typedef enum ExactPhase { FLIGHT, CONTACT, RESTING } ExactPhase;
typedef enum Origin { ORIGIN_LEFT = SIDE_LEFT, ORIGIN_RIGHT = SIDE_RIGHT, ORIGIN_MIDDLE } Origin;

// All that the tables are made from.
typedef struct ExactKey {
    double omega2, damping, share;
    double contact_omega2[2], contact_damping[2]; // by Side
    double interval, base_omega;
} ExactKey;

typedef struct Exact {
    Run *run;
    const Plan *plan;
    const PlanDamper *damper; // all zero where there is none
    Problem *problem;
    Motion flying, touching[2], resting;
    Stretch stretch;
    bool has_stops;    // that a mass may reach
    bool has_hops;     // intervals are short enough for hop.h
    double base_slope; // of the base, no larger over the whole run: [m/s^3], of a sine [m/s^2]
    size_t pending;    // samples whose sums wait in `stretch`
    double free_work; // integral of a_g times the free mass's relative velocity over them [m^2/s^2]
    ExactPhase phase;
    Side side;       // of CONTACT and RESTING
    Origin origin;   // what state.r is counted from
    bool is_leaving; // released from rest a moment ago: gap, its speed and its acceleration are
                     // exactly 0
    State state;
    size_t sample; // the last one passed
    double offset; // time since then [s]
    double interval;
    BaseCursor base;
    Slice sine;         // at sample sine_sample - 1: looked up once for all that happens after it
    size_t sine_sample; // 0: none yet
    ImpactLog ledger;
    ImpactRow row; // of the present contact or rest
    ExactRecord recorder;
    size_t contact_arcs; // since it began
    size_t arcs;         // since the progress was asked
    size_t events;       // all so far
    size_t still_events; // in a row, without time passing
    // From here on what the next run of the same system finds ready; a run begins with all above
    // empty. Each is made when it is first needed.
    ExactKey key;
    bool has_lanes, has_flight, has_pulse[2];
    ExactFlight flight;
    Lanes lanes;
    HopTable hops;   // with the lanes
    Pulse pulses[2]; // by Side
    Hold *holds[2];  // by Side; made when a contact first lasts long
    Trust trust;     // its tables
} Exact;

// Forgets all tables. The Exact itself stays.
void exact_forget(Exact *exact);

// +1 for the right stop, -1 for the left.
static inline double exact_sign(Side side) {
    return side == SIDE_RIGHT ? 1 : -1;
}

// Room between the free mass and a stop at r = 0 of the present origin [m].
static inline double exact_room(const Exact *exact, Side side) {
    if (exact->origin == ORIGIN_MIDDLE)
        return exact->damper->clearance / 2;
    return exact->origin == (Origin)side ? 0 : exact->damper->clearance;
}

// u = x-relative displacement of the free mass [m].
static inline double exact_relative(const Exact *exact) {
    const double stop = exact->damper->clearance / 2;
    const double origin =
        exact->origin == ORIGIN_MIDDLE ? 0 : exact_sign((Side)exact->origin) * stop;
    return exact->damper->offset + origin + exact->state.r;
}

static inline double exact_time(const Exact *exact) {
    return (double)exact->sample / exact->plan->sample_rate + exact->offset;
}

static inline double exact_effective_mass(const Exact *exact) {
    return exact->plan->mass[0] *
           exact->resting.share; // 1 - share would lose digits where m is the larger
}

// s = (C v + K x) / M: what pushes the free mass to the right, seen from the structure [m/s^2].
static inline double exact_push(const Exact *exact) {
    return exact->flying.damping * exact->state.v + exact->flying.omega2 * exact->state.x;
}

// Contact force on the structure, positive to the right [N].
static inline double exact_force(const Exact *exact) {
    if (exact->phase == CONTACT)
        return exact->damper->stops[exact->side].stiffness * exact->state.r +
               exact->damper->stops[exact->side].damping * exact->state.w;
    if (exact->phase == RESTING)
        return exact_effective_mass(exact) * exact_push(exact);
    return 0;
}

static inline Instant exact_moment(const Exact *exact) {
    const double n = exact_force(exact);
    Instant moment = {.x = exact->state.x,
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

static inline EnergyState exact_energy(const Exact *exact) {
    const Plan *plan = exact->plan;
    const State *state = &exact->state;
    const double z = state->v + state->w;
    const double k = exact->phase == CONTACT ? exact->damper->stops[exact->side].stiffness : 0;
    return (EnergyState){
        0.5 * plan->mass[0] * state->v * state->v + 0.5 * exact->damper->mass * z * z,
        0.5 * plan->stiffness[0] * state->x * state->x + 0.5 * k * state->r * state->r};
}

// A sine seen from t on; t is at most an interval that has_hops is for.
static inline void exact_turn(const Slice *slice, double t, Slice *turned) {
    const double angle = slice->omega * t, square = angle * angle, fourth = square * square;
    const double sine = angle - angle * (square * (1.0 / 6 - square * (1.0 / 120)) +
                                         fourth * square * (1.0 / 5040));
    const double less = square * (1.0 / 2 - square * (1.0 / 24)) +
                        fourth * square * (1.0 / 720 - square * (1.0 / 40320)); // 1 less the cosine
    *turned = (Slice){slice->value - (slice->value * less - slice->slope * sine),
                      slice->slope - (slice->slope * less + slice->value * sine), slice->omega};
}

// Its integral.
static inline double exact_turned(const Slice *slice, double t) {
    const double angle = slice->omega * t, square = angle * angle, fourth = square * square;
    const double sine = 1 - square * (1.0 / 6 - square * (1.0 / 120)) -
                        fourth * square * (1.0 / 5040); // over the angle
    const double less = angle * (1.0 / 2 - square * (1.0 / 24) + fourth * (1.0 / 720));
    return t * (slice->value * sine + slice->slope * less);
}

// The base from this instant on, to the next sample; for strides alone, where the grids coincide.
static inline void exact_slice(Exact *exact, Slice *slice) {
    const Base *base = exact->run->base;
    if (exact->stretch.base_max == 0 ||
        (base->form == BASE_SAMPLED && exact->sample + 1 >= base->count)) {
        *slice = (Slice){0, 0, 0};
    } else if (base->form == BASE_SAMPLED) {
        const double *a = base->values + exact->sample;
        const double slope = (a[1] - a[0]) * exact->plan->sample_rate;
        *slice = (Slice){a[0] + slope * exact->offset, slope, 0};
    } else {
        if (exact->sine_sample != exact->sample + 1) {
            (void)base_cursor_interval(&exact->base, exact->sample, &exact->sine);
            exact->sine_sample = exact->sample + 1;
        }
        exact_turn(&exact->sine, exact->offset, slice);
    }
}

static inline void exact_count_flight(Exact *exact, size_t samples) {
    Work *work = &exact->run->work;
    *(exact->run->base->form == BASE_STILL ? &work->unforced_samples : &work->flight_samples) +=
        samples;
}

static inline const Motion *exact_motion(const Exact *exact) {
    return exact->phase == FLIGHT    ? &exact->flying
           : exact->phase == CONTACT ? &exact->touching[exact->side]
                                     : &exact->resting;
}

#endif
