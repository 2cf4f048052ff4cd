// What the reference of frames is made of: its state, and what its files ask of each other.
// Not what the tests ask (frame_reference.h). Used by frame_reference*.c alone.
#ifndef TESTS_TRUTH_FRAME_REFERENCE_WALK_H
#define TESTS_TRUTH_FRAME_REFERENCE_WALK_H

#include <math.h>
#include <quadmath.h>

#include "tests/truth/frame_reference.h"

__extension__ typedef __float128 Quad;

enum { TERMS = 40, IMPACTS_MAX = 20000, N = TRUTH_STOREYS, D = TRUTH_DAMPERS };
enum { FLYING, TOUCHING, INSIDE, RESTING };

typedef struct Mass {
    int phase, side;
    int zeros; // leading coefficients of the condition that are exactly 0
    int at;    // the stop it was last at: there the gap is 0; -1: none
    Quad u, w; // relative to the storey; u from that stop, else from the middle of the stops
    Quad k, c, e;
    Quad force, impulse, lost, peak;
    TruthImpact open;
    bool is_open;
} Mass;

typedef struct ImportContext {
    const Plan *plan;
    const Base *base;
    FrameTruth *truth;
    size_t n, m;
    Quad inverse[N][N], stiff[N][N], viscous[N][N]; // M^-1, M^-1 K, M^-1 C
    Quad yield[D][D];
    Quad x[N], v[N], t;
    Mass mass[D];
    int degree;
    Quad h, xs[N][TERMS], us[D][TERMS], ns[D][TERMS], as[TERMS];
    double flight_rate;
} ImportContext;

static inline Quad walk_sign(int side) {
    return side == SIDE_RIGHT ? 1 : -1;
}

// Of a polynomial in s, at s.
Quad quad_value(const Quad *f, int degree, Quad s);
Quad quad_slope(const Quad *f, int degree, Quad s);
// The first zero of f on [0, 1], whose first `zeros` coefficients are exactly 0.
bool quad_crossing(const Quad *f, int degree, int zeros, Quad *s);

// The state of a plan at t = 0.
void walk_start(ImportContext *walk);
// The base's acceleration now, its rate, and how long that rate holds.
Quad walk_ground(const ImportContext *walk, Quad *rate, Quad *until);
double walk_rate(const ImportContext *walk);
// Forces that take `without` (relative accelerations, or speeds) of those that rest to 0.
void walk_constrain(const ImportContext *walk, const Quad *without, Quad *force);
// The motion from now over h, where the base has acceleration a and that rate.
void walk_series(ImportContext *walk, Quad h, Quad a, Quad rate);
// u'' of a mass now.
Quad walk_acceleration(ImportContext *walk, size_t d);

// Between the mass and that stop where u = 0.
Quad walk_room(const ImportContext *walk, size_t d, int side);
void walk_touch(ImportContext *walk, size_t d, int side);
void walk_end_phase(ImportContext *walk, size_t d, bool is_inwards);
void walk_close_row(ImportContext *walk, size_t d, double end, double separation);

#endif
