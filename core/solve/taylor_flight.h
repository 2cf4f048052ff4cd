// Free flight over part of a sample interval under a base that is still, linear or a sine: a short
// Taylor series. Not for intervals that are long for the structure or the sine: those are arcs.
//
#ifndef CORE_SOLVE_TAYLOR_FLIGHT_H
#define CORE_SOLVE_TAYLOR_FLIGHT_H

#include "core/solve/arc.h"
#include "core/solve/wide.h"

enum { TAYLOR_FLIGHT_DEGREE = 8 };

// The longest interval, as a share of 1 / rate of the structure and of the sine, that the series is
// right for.
#define TAYLOR_FLIGHT_REACH 0.04

typedef struct PieceSums {
    double vv, ww, av, aw; // integrals of v^2, w^2, a_g v, a_g w [m^2/s], [m^2/s^2]
    double a;              // of a_g [m/s]
} PieceSums;

// What a unit of each start gives to the terms of s^2 and above, each row from s on: to the
// structure's displacement of x, v unit, a_g unit^2 and its slope unit^3 (of a sine: its other half
// unit^2), and to the free mass's of the last two.
typedef struct TaylorFlightTable {
    double unit, per_unit; // of s = t / unit [s], [1/s]
    double square, slope;  // what a_g and its slope are multiplied by
    bool is_sine;
    double x[4][TAYLOR_FLIGHT_DEGREE], z[2][TAYLOR_FLIGHT_DEGREE];
} TaylorFlightTable;

// `omega` is the base's (0: linear).
void taylor_flight_table_make(TaylorFlightTable *table, const Motion *flying, double omega,
                              double unit);

typedef struct TaylorFlight {
    const TaylorFlightTable *table;
    State start;
    Slice slice;
    double x[TAYLOR_FLIGHT_DEGREE], r[TAYLOR_FLIGHT_DEGREE]; // from s on
    double z[TAYLOR_FLIGHT_DEGREE];                          // of the free mass, but for its speed
} TaylorFlight;

INLINE void taylor_flight_make(TaylorFlight *flight, const TaylorFlightTable *table,
                               const State *start, const Slice *slice) {
    const double speed = start->v * table->unit, gap = start->w * table->unit;
    const double a = slice->value * table->square, s = slice->slope * table->slope;
    for (int k = 0; k < TAYLOR_FLIGHT_DEGREE; k += 4) {
        const Four z = FOUR(table->z[0] + k) * a + FOUR(table->z[1] + k) * s;
        Four x = (FOUR(table->x[0] + k) * start->x + FOUR(table->x[1] + k) * speed) +
                 (FOUR(table->x[2] + k) * a + FOUR(table->x[3] + k) * s);
        Four r = z - x;
        if (k == 0) {
            x[0] = speed;
            r[0] = gap;
        }
        PUT_FOUR(flight->x + k, x);
        PUT_FOUR(flight->r + k, r);
        PUT_FOUR(flight->z + k, z);
    }
    flight->table = table;
    flight->start = *start;
    flight->slice = *slice;
}

INLINE void taylor_flight_at(const TaylorFlight *flight, double s, State *end) {
    static const double factors[TAYLOR_FLIGHT_DEGREE] = {1, 2, 3, 4, 5, 6, 7, 8};
    const double s2 = s * s;
    const Four low = {1, s, s2, s2 * s}, high = low * (s2 * s2);
    const Four low_slope = low * FOUR(factors), high_slope = high * FOUR(factors + 4);
    const Four x = FOUR(flight->x) * low + FOUR(flight->x + 4) * high;
    const Four v = FOUR(flight->x) * low_slope + FOUR(flight->x + 4) * high_slope;
    const Four r = FOUR(flight->r) * low + FOUR(flight->r + 4) * high;
    const Four w = FOUR(flight->r) * low_slope + FOUR(flight->r + 4) * high_slope;
    Four sum;
    wide_sum(&x, &v, &r, &w, &sum);
    const double per_unit = flight->table->per_unit;
    end->x = flight->start.x + s * sum[0];
    end->v = per_unit * sum[1];
    end->r = flight->start.r + s * sum[2];
    end->w = per_unit * sum[3];
}

// From the start to s: all but ww; aw is for the free mass, of a_g (v + w), minus av.
INLINE void taylor_flight_integrals(const TaylorFlight *flight, double s, PieceSums *out) {
    // Gauss-Legendre: over so short a way three points are right to rounding.
    static const double nodes[4] = {0.1127016653792583, 0.5, 0.8872983346207417, 0};
    static const double weights[4] = {0.2777777777777778, 0.4444444444444444, 0.2777777777777778,
                                      0};
    const TaylorFlightTable *table = flight->table;
    const double length = s * table->unit, *x = flight->x, *z = flight->z;
    const Four t = s * FOUR(nodes), t2 = t * t;
    const Four v = (x[0] + t * (2 * x[1])) +
                   t2 * ((3 * x[2] + t * (4 * x[3])) +
                         t2 * ((5 * x[4] + t * (6 * x[5])) + t2 * (7 * x[6] + t * (8 * x[7]))));
    Four a = flight->slice.value + flight->slice.slope * (length * FOUR(nodes));
    out->a = length * (flight->slice.value + flight->slice.slope * length / 2);
    if (table->is_sine) {
        const double per_square = -table->per_unit * table->per_unit, s2 = s * s;
        a = (2 * z[1] + t * (6 * z[2])) +
            t2 * ((12 * z[3] + t * (20 * z[4])) +
                  t2 * ((30 * z[5] + t * (42 * z[6])) + t2 * (56 * z[7])));
        a *= per_square;
        out->a = -table->per_unit * s *
                 ((2 * z[1] + s * (3 * z[2])) +
                  s2 * ((4 * z[3] + s * (5 * z[4])) +
                        s2 * ((6 * z[5] + s * (7 * z[6])) + s2 * (8 * z[7]))));
    }
    const Four vv = FOUR(weights) * v * v, av = FOUR(weights) * v * a;
    out->vv = ((vv[0] + vv[2]) + vv[1]) * (length * (table->per_unit * table->per_unit));
    out->av = ((av[0] + av[2]) + av[1]) * s;
    out->ww = 0;
    out->aw = out->a * (flight->start.v + flight->start.w - out->a / 2) - out->av;
}

// r at s; w unit and half of its derivative by s there.
INLINE double taylor_flight_gap(const TaylorFlight *flight, double s, double *slope, double *bend) {
    const double *r = flight->r, s2 = s * s;
    *slope = (r[0] + s * (2 * r[1])) +
             s2 * ((3 * r[2] + s * (4 * r[3])) +
                   s2 * ((5 * r[4] + s * (6 * r[5])) + s2 * (7 * r[6] + s * (8 * r[7]))));
    *bend = r[1] + s * (3 * r[2] + s * (6 * r[3]));
    return flight->start.r +
           s * ((r[0] + s * r[1]) +
                s2 * ((r[2] + s * r[3]) + s2 * ((r[4] + s * r[5]) + s2 * (r[6] + s * r[7]))));
}

#endif
