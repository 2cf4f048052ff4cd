// The predictability horizon of a run of one mass: rounding errors to first order, carried along
// the events. The motion does not depend on it, and an accuracy of one per cent is enough.
#ifndef CORE_SOLVE_ROUNDING_GROWTH_H
#define CORE_SOLVE_ROUNDING_GROWTH_H

#include <stdbool.h>
#include <stdint.h>

#include "core/result/response.h"
#include "core/solve/linear_motion.h"

// So many errors are followed at once, with different signs; the largest counts.
enum { GROWTH_LANES = 4, GROWTH_NEAR = 64, GROWTH_LEVELS = 26 };

// exp(A D) to the powers 0, 1, 2 ... GROWTH_NEAR - 1 in `near`, and GROWTH_NEAR times 1, 2, 4 ...
// in `power`; made as they are needed.
typedef struct GrowthStructure { // of the structure alone
    double omega2, damping, rate;
    double step, frequency; // D [s], 1 / D
    int known, levels;
    double near[GROWTH_NEAR][2][2];
    double power[GROWTH_LEVELS][2][2];
} GrowthStructure;

typedef struct GrowthContact { // of both bodies
    Motion motion;
    double step, frequency; // D [s], 1 / D
    int known, levels;
    double near[GROWTH_NEAR][4][4];
    double power[GROWTH_LEVELS][4][4];
} GrowthContact;

typedef struct RoundingGrowth {
    bool is_wide;   // the processor has the registers of wide.h
    bool is_spent;  // the estimate is as large as the motion: finished
    double time;    // of the last event [s]
    double share;   // m / (M + m) [-]
    double rate;    // the structure's [1/s]
    double reach;   // 1 / rate: displacement by a velocity [s]
    double memory;  // of the structure's initial state [s]
    double phase;   // phase shift in a second by the rounding of the rate, over the rounding [1/s]
    double lasting; // and for how long [s]
    double largest; // displacement so far [m]
    double worst;   // square of the largest estimate so far [m^2]
    double horizon; // [s]; NAN: not reached
    uint64_t signs;
    double y[4][GROWTH_LANES]; // errors of x, v, r, w
    GrowthStructure flying, resting;
    GrowthContact touching[2];
} RoundingGrowth;

// `touching` by Side. `size` is the clearance [m]; `is_driven`: the base is a sine. Keeps the
// tables of an equal system.
void rounding_growth_start(RoundingGrowth *growth, const Motion *flying, const Motion *touching,
                           const Motion *resting, const State *state, double size, bool is_driven,
                           double duration);

// A phase ends at `time` in `state`; `largest` is the largest displacement so far.
void rounding_growth_flight(RoundingGrowth *growth, double time, const State *state,
                            double largest);
void rounding_growth_contact(RoundingGrowth *growth, Side side, double time, const State *state,
                             double largest);
void rounding_growth_rest(RoundingGrowth *growth, double time, const State *state, double largest);

// w becomes -restitution w; `w` is the one before, `push` is s.
void rounding_growth_bounce(RoundingGrowth *growth, double restitution, double w, double push);
// The mass rests at its stop: gap and relative speed are exactly 0.
void rounding_growth_stick(RoundingGrowth *growth);

// Writes error estimate and horizon into the response.
void rounding_growth_report(const RoundingGrowth *growth, Response *response);

#endif
