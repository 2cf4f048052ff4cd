// Free flight over part of a sample interval under a base that is still or linear: a short Taylor
// series. Not for intervals that are long for the structure, nor for a sine: those are arcs. Used
// by the exact solver on its way to a stop and away from one.
#ifndef CORE_SOLVE_HOP_H
#define CORE_SOLVE_HOP_H

#include "core/solve/arc.h"

enum { HOP_DEGREE = 8 };

// The longest interval, as a share of 1 / rate of the structure, that the series is right for.
#define HOP_REACH 0.04

// What a unit of each start gives to the series' terms above the first: of x, v unit, a_g unit^2
// and its slope unit^3.
typedef struct HopTable {
    double unit, per_unit; // of s = t / unit [s], [1/s]
    double of[4][HOP_DEGREE - 1];
} HopTable;

void hop_table_make(HopTable *table, const Motion *flying, double unit);

typedef struct Hop {
    double unit, per_unit;
    double x[HOP_DEGREE + 1]; // of the structure's displacement in s
    double z1, z2, z3;        // of the free mass's
    double r;                 // at the start
    double value, slope;      // a_g = value + slope t
} Hop;

static inline void hop_make(Hop *hop, const HopTable *table, const State *start,
                            const Slice *slice) {
    const double unit = table->unit, square = unit * unit, speed = start->v * unit;
    const double a = slice->value * square, s = slice->slope * (square * unit);
    for (int k = 2; k <= HOP_DEGREE; k++)
        hop->x[k] = (table->of[0][k - 2] * start->x + table->of[1][k - 2] * speed) +
                    (table->of[2][k - 2] * a + table->of[3][k - 2] * s);
    hop->x[0] = start->x;
    hop->x[1] = speed;
    hop->unit = unit;
    hop->per_unit = table->per_unit;
    hop->z1 = (start->v + start->w) * unit;
    hop->z2 = -a / 2;
    hop->z3 = -s / 6;
    hop->r = start->r;
    hop->value = slice->value;
    hop->slope = slice->slope;
}

// x less its start, over s.
static inline double hop_moved(const Hop *hop, double s) {
    const double *x = hop->x, s2 = s * s;
    return (x[1] + s * x[2]) +
           s2 * ((x[3] + s * x[4]) + s2 * ((x[5] + s * x[6]) + s2 * (x[7] + s * x[8])));
}

// v unit.
static inline double hop_speed(const Hop *hop, double s) {
    const double *x = hop->x, s2 = s * s;
    return (x[1] + s * (2 * x[2])) +
           s2 * ((3 * x[3] + s * (4 * x[4])) +
                 s2 * ((5 * x[5] + s * (6 * x[6])) + s2 * (7 * x[7] + s * (8 * x[8]))));
}

static inline State hop_at(const Hop *hop, double s) {
    const double x = hop_moved(hop, s), v = hop_speed(hop, s);
    const double z = hop->z1 + s * (2 * hop->z2 + s * (3 * hop->z3));
    return (State){hop->x[0] + s * x, v * hop->per_unit,
                   hop->r + s * (hop->z1 + s * (hop->z2 + s * hop->z3) - x),
                   (z - v) * hop->per_unit};
}

// From the start to s: all but ww; aw is for the free mass, of a_g (v + w), minus av.
static inline ArcIntegrals hop_integrals(const Hop *hop, const State *start, double s) {
    // Gauss-Legendre: over so short a way three points are right to rounding.
    static const double node[3] = {0.1127016653792583, 0.5, 0.8872983346207417};
    static const double weight[3] = {0.2777777777777778, 0.4444444444444444, 0.2777777777777778};
    ArcIntegrals out = {0, 0, 0, 0, 0};
    const double length = s * hop->unit;
    for (int i = 0; i < 3; i++) {
        const double v = hop_speed(hop, s * node[i]);
        out.vv += weight[i] * v * v;
        out.av += weight[i] * v * (hop->value + hop->slope * length * node[i]);
    }
    out.vv *= length * (hop->per_unit * hop->per_unit);
    out.av *= s;
    out.a = length * (hop->value + hop->slope * length / 2);
    out.aw = out.a * (start->v + start->w - out.a / 2) - out.av;
    return out;
}

// r at s; w unit and half of its derivative by s there.
static inline double hop_gap(const Hop *hop, double s, double *slope, double *bend) {
    *slope = hop->z1 + s * (2 * hop->z2 + s * (3 * hop->z3)) - hop_speed(hop, s);
    *bend = (hop->z2 - hop->x[2]) + s * (3 * (hop->z3 - hop->x[3]) - s * (6 * hop->x[4]));
    return hop->r + s * (hop->z1 + s * (hop->z2 + s * hop->z3) - hop_moved(hop, s));
}

#endif
