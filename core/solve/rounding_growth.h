// How long a trajectory can be trusted: what rounding does to it, to first order, carried along the
// events. Not an error control: nothing of the motion depends on it, and a per cent is enough here.
//
#ifndef CORE_SOLVE_ROUNDING_GROWTH_H
#define CORE_SOLVE_ROUNDING_GROWTH_H

#include <stdbool.h>
#include <stdint.h>

#include "core/result/response.h"
#include "core/solve/linear_motion.h"

// So many roundings are followed at once, each with signs of its own; the first to part counts.
enum { GROWTH_LANES = 4, GROWTH_NEAR = 64, GROWTH_LEVELS = 26 };

// exp(A D) to the powers 0, 1, 2 ... and from GROWTH_NEAR on to 1, 2, 4 ... times that; made as
// they are needed.
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
    bool is_wide;   // the processor has wide.h's registers
    bool is_spent;  // the estimate has reached the motion's own size: nothing is left to carry
    double time;    // of the last event [s]
    double share;   // m / (M + m) [-]
    double rate;    // the structure's [1/s]
    double reach;   // 1 / rate: a velocity lasts for about this long as a displacement [s]
    double memory;  // the structure remembers for about this long [s]
    double phase;   // by how much a rounded rate turns the phase in a second, in roundings [1/s]
    double lasting; // and for how long [s]
    double largest; // displacement so far [m]
    double worst;   // square of the largest estimate so far [m^2]
    double horizon; // [s]; NAN: not reached
    uint64_t signs;
    double y[4][GROWTH_LANES]; // errors of x, v, r, w
    GrowthStructure flying, resting;
    GrowthContact touching[2];
} RoundingGrowth;

// `touching` by Side. `size` is the clearance [m]; `is_driven`: the base is a sine. Writes all that
// is read later, but keeps the tables of a system that it finds again.
void rounding_growth_start(RoundingGrowth *growth, const Motion *flying, const Motion *touching,
                           const Motion *resting, const State *state, double size, bool is_driven,
                           double duration);

// A stretch ends at `time` in `state`; `largest` is the largest displacement the caller knows of.
void rounding_growth_flight(RoundingGrowth *growth, double time, const State *state,
                            double largest);
void rounding_growth_contact(RoundingGrowth *growth, Side side, double time, const State *state,
                             double largest);
void rounding_growth_rest(RoundingGrowth *growth, double time, const State *state, double largest);

// w becomes -restitution w at once, under the structure's push s; `w` is the one before.
void rounding_growth_bounce(RoundingGrowth *growth, double restitution, double w, double push);
// The free mass stays at its stop: gap and relative speed are exactly 0.
void rounding_growth_stick(RoundingGrowth *growth);

// What the run says of itself in the end.
void rounding_growth_report(const RoundingGrowth *growth, Response *response);

#endif
