// Error estimate and predictability horizon of a run of one mass: rounding errors to first order,
// carried along the events. The motion does not depend on it, and an accuracy of one per cent is
// enough.
#ifndef CORE_SOLVE_ROUNDING_GROWTH_H
#define CORE_SOLVE_ROUNDING_GROWTH_H

#include <stdbool.h>
#include <stdint.h>

#include "core/result/response.h"
#include "core/solve/linear_motion.h"
#include "core/solve/modal_state.h"
#include "core/solve/wide.h"

// So many errors are followed at once, with different signs; the largest counts.
enum { GROWTH_LANES = 4, GROWTH_LEVELS = 32 };

// The systems: contacts by Side, flight, and rest.
enum { GROWTH_FLIGHT = SIDE_RIGHT + 1, GROWTH_REST, GROWTH_SYSTEMS };

typedef struct GrowthSystem {
    Motion motion;
    double step, frequency;            // D of rounding_growth.c [s], 1 / D
    int levels;                        // of `power` so far; made as they are needed
    double power[GROWTH_LEVELS][4][4]; // exp(A D) to the powers 1, 2, 4 ...
} GrowthSystem;

typedef struct RoundingGrowth {
    bool is_wide;   // the processor has the registers of wide.h
    bool is_spent;  // the estimate is as large as the motion: finished
    double time;    // of the last event [s]
    double rate;    // the structure's [1/s]
    double reach;   // 1 / rate: displacement by a velocity [s]
    double memory;  // of the structure's initial state [s]
    double phase;   // phase shift in a second by the rounding of the rate, over the rounding [1/s]
    double lasting; // and for how long [s]
    double largest; // displacement so far [m]
    double worst;   // square of the largest estimate so far [m^2]
    double horizon; // [s]; NAN: not reached
    uint64_t signs;
    Four y[4]; // errors of x, v, r, w
    GrowthSystem systems[GROWTH_SYSTEMS];
} RoundingGrowth;

// `touching` by Side. `size` is the clearance [m]; `is_driven`: the base is a sine. Keeps the
// tables of an equal system.
void rounding_growth_start(RoundingGrowth *growth, const Motion *flying, const Motion *touching,
                           const State *state, double size, bool is_driven, double duration);

// A phase, a contact at `side`, ends at `time` in `state`; `largest` is the largest displacement so
// far.
void rounding_growth_end_phase(RoundingGrowth *growth, ContactPhase phase, Side side, double time,
                               const State *state, double largest);

// A bounce: w becomes -restitution w. `w` is the speed before it, `push` is s of Motion.
void rounding_growth_bounce(RoundingGrowth *growth, double restitution, double w, double push);
// The mass rests at its stop: gap and relative speed are exactly 0.
void rounding_growth_stick(RoundingGrowth *growth);

// Writes error estimate and horizon into the response.
void rounding_growth_report(const RoundingGrowth *growth, Response *response);

#endif
