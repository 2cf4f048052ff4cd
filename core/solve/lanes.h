// Free flight from sample to sample, eight at once: all of them straight from the state before the
// first, so that no sample waits for the one before. A flight ends
// before the interval in which a stop may be reached: contacts and parts of intervals are
// single_mass.c's.
#ifndef CORE_SOLVE_LANES_H
#define CORE_SOLVE_LANES_H

#include <stdbool.h>
#include <stddef.h>

#include "core/result/channel.h"
#include "core/result/response.h"
#include "core/solve/base_motion_cursor.h"
#include "core/solve/motion_table.h"

enum { LANES = 8, SUM_LANES = 4 };

// Sums over samples: with b the base at a sample and a at the one before, or under a sine its other
// half: a_g is b cos + a sin from there on.
typedef enum LaneSum { XX, XV, VV, XB, XA, VB, VA, BB, AB, AA, LANE_SUMS } LaneSum;

// Largest sizes over samples; the last is the free mass's displacement.
typedef enum LanePeak {
    OF_DISPLACEMENT,
    OF_VELOCITY,
    OF_ACCELERATION,
    OF_DAMPER,
    LANE_PEAKS
} LanePeak;

// Start, limits and accumulated sums of a stretch of free flight.
typedef struct FlightBlock {
    double x, v, r;                 // as in State
    double z;                       // velocity of the free mass relative to the base [m/s]
    double left, right;             // r stays within (-left, right); INFINITY without a damper
    double middle;                  // displacement of the free mass less x and r [m]
    double mass;                    // of the structure [kg]
    double base_max;                // |a_g| is not larger over the whole run [m/s^2]
    const BaseCursor *base;         // of a sine
    double *columns[CHANNEL_COUNT]; // those that flight fills, from sample 0; NULL: not wanted
    _Alignas(64) double sums[LANE_SUMS][SUM_LANES], most[LANE_PEAKS][LANES];
    double ends[3]; // x b, v b and b^2 before the first samples less those at the last ones
} FlightBlock;

// What the processor's vectors hold; the bytes are the same with all.
typedef enum LanesWidth { LANES_PLAIN, LANES_AVX2, LANES_AVX512 } LanesWidth;

typedef struct Lanes Lanes;
typedef size_t LanesRun(const Lanes *lanes, FlightBlock *stretch, size_t sample, size_t count,
                        const double *base);

// What x and v gain over i + 1 steps: from (x, v), and under a sine from its value and slope.
typedef struct LanesMap {
    _Alignas(64) double x_x[LANES], x_v[LANES], v_x[LANES], v_v[LANES], time[LANES];
    double x_s[2][LANES], v_s[2][LANES];
    double z_s[2][LANES], speed_s[2][LANES]; // displacement of the free mass, and its velocity
    double turn[2][LANES];                   // cosine and sine of the sine's angle
} LanesMap;

struct Lanes {
    LanesMap sample;
    // What i + 1 samples on a_g at samples 0 to LANES has given.
    double x_a[LANES + 1][LANES], v_a[LANES + 1][LANES];
    double z_a[LANES + 1][LANES], speed_a[LANES + 1][LANES];
    double base_omega;                   // of a sine, or 0 [rad/s]
    double interval, per_interval;       // [s], [1/s]
    double omega;                        // sqrt(K / M)
    double vv[LANE_SUMS], av[LANE_SUMS]; // integrals of v^2 and a_g v are these times the sums
    Motion motion;
    bool is_sampled;
    LanesWidth width;
    LanesRun *run; // NULL: the interval is too long for the structure
};

LanesWidth lanes_widest(void); // on this processor
// Whether the interval is short enough for the structure and a base of this frequency (or 0).
bool lanes_are_for(const Motion *flying, double base_omega, double interval);
// `one` is the table of flight over one sample interval; `is_sampled`: the base may be linear. All
// zero is no table; one that was made for the same motion is kept.
void lanes_make(Lanes *lanes, const MotionTable *one, bool is_sampled, LanesWidth width);

// Flies from `sample` over at most `count` intervals, as far as surely no stop is reached on the
// way, and returns how many. `base` is a_g at `sample` and after (count + 1 of them), NULL if
// still or a sine.
static inline size_t lanes_fly(const Lanes *lanes, FlightBlock *stretch, size_t sample,
                               size_t count, const double *base) {
    return lanes->run(lanes, stretch, sample, count, base);
}

// The sums over all lanes, or the largest of one kind since it was last asked for; emptied.
void lanes_take_sums(const Lanes *lanes, FlightBlock *stretch, double sums[LANE_SUMS]);
double lanes_take_peak(FlightBlock *stretch, LanePeak which);

#endif
