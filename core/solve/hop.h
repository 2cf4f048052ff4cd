// Free flight over part of a sample interval under a base that is still or linear: a short Taylor
// series. Not for intervals that are long for the structure, nor for a sine: those are arcs. Used
// by the exact solver on its way to a stop and away from one.
#ifndef CORE_SOLVE_HOP_H
#define CORE_SOLVE_HOP_H

#include "core/solve/arc.h"

enum { HOP_DEGREE = 9 };

// The longest interval, as a share of 1 / rate of the structure, that the series is right for.
#define HOP_REACH 0.04

typedef struct Hop {
    double unit;              // of s = t / unit [s]
    double x[HOP_DEGREE + 1]; // of the structure's displacement in s
    double z1, z2, z3;        // of the free mass's
    double r;                 // at the start
    double value, slope;      // a_g = value + slope t
} Hop;

void hop_make(Hop *hop, const Motion *flying, const State *start, const Slice *slice, double unit);
State hop_at(const Hop *hop, double s);

// From the start to s: all but ww; aw is for the free mass, of a_g (v + w), minus av.
ArcIntegrals hop_integrals(const Hop *hop, const State *start, double s);

// r and w unit at s.
static inline double hop_gap(const Hop *hop, double s, double *slope) {
    double x = hop->x[HOP_DEGREE], v = 0;
    for (int k = HOP_DEGREE; k-- > 1;) {
        v = v * s + x;
        x = x * s + hop->x[k];
    }
    v = v * s + x;
    *slope = hop->z1 + s * (2 * hop->z2 + s * (3 * hop->z3)) - v;
    return hop->r + s * (hop->z1 + s * (hop->z2 + s * hop->z3) - x);
}

#endif
