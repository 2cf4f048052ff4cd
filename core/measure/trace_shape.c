// y'' + 2 Z w y' + w^2 y = g from y = 0, y' = v0, in units of T_c and v0 T_c, with L = Z w = -ln(e)
// under either rule of separation (identify.h):
//
//   y = e^(-L s) S + (pull / w^2) (1 - e^(-L s) (C + L S)),  F = w^2 y + 2 L y'
//
// T_c is the time unit, so S(1) = 0 under zero penetration: turn = pi^2. Under zero force F(1) = 0
// without pull: with x = sqrt(turn) / 2 that is x cot(x) = L / 2.
#include "core/measure/trace_shape.h"

#include <math.h>

static const double pi = 3.14159265358979323846;

// x cot(x) of x^2 = u, also below 0, and its derivative.
static double cotangent(double u, double *slope) {
    if (fabs(u) < 1e-3) {
        *slope = -1.0 / 3 - u * (2.0 / 45 + u * (2.0 / 315));
        return 1 - u * (1.0 / 3 + u * (1.0 / 45 + u * (2.0 / 945)));
    }
    const double x = sqrt(fabs(u));
    const double value = u > 0 ? x / tan(x) : x / tanh(x);
    const double root = u > 0 ? x / sin(x) : x / sinh(x);
    *slope = (value - root * root) / (2 * u);
    return value;
}

// x cot(x) falls from infinity to -infinity at u = pi^2, and is concave: from the right Newton's
// method never passes the root.
static double zero_force_turn(double decay) {
    double u = fmin(pi * pi / 4 * (1 - decay / 2), 9);
    for (int step = 0; step < 30; step++) {
        double slope;
        const double change = (cotangent(u, &slope) - decay / 2) / slope;
        u = fmin(u - change, 9.8);
        if (fabs(change) < 1e-14 * (1 + fabs(u)))
            break;
    }
    return 4 * u;
}

// S and C.
static double waves(double turn, double s, double *cosine) {
    const double x = sqrt(fabs(turn)) * s;
    *cosine = turn > 0 ? cos(x) : cosh(x);
    if (x < 1e-4)
        return s * (1 - turn * s * s / 6);
    return s * (turn > 0 ? sin(x) : sinh(x)) / x;
}

double trace_shape_force(const TraceShape *shape, double s) {
    double cosine;
    const double sine = waves(shape->turn, s, &cosine);
    return shape->pull + exp(-shape->decay * s) * (shape->sine * sine + shape->cosine * cosine);
}

// What ends the contact: y, or F, at s.
static double remainder_at(const TraceShape *shape, double s, int separation) {
    if (separation == SEPARATION_ZERO_FORCE)
        return trace_shape_force(shape, s);
    double cosine;
    const double sine = waves(shape->turn, s, &cosine), fall = exp(-shape->decay * s);
    const double rest = shape->pull / (shape->turn + shape->decay * shape->decay);
    return fall * sine + rest * (1 - fall * (cosine + shape->decay * sine));
}

// The pull lengthens a contact, and may end it no more: then what is left does not come below 0
// within the oscillation.
static double length_under_pull(const TraceShape *shape, int separation) {
    enum { STEPS = 64 };
    const double most = shape->turn > 0 ? fmin(2 * pi / sqrt(shape->turn), 8) : 8;
    double before = 1, after = 1;
    for (int i = 0; remainder_at(shape, after, separation) > 0; i++) {
        if (i == STEPS || after > most)
            return (double)INFINITY;
        before = after;
        after += (most - 1) / STEPS + 1e-3;
    }
    for (int i = 0; i < 60; i++) {
        const double middle = before + (after - before) / 2;
        *(remainder_at(shape, middle, separation) > 0 ? &before : &after) = middle;
    }
    return after;
}

TraceShape trace_shape(double decay, double pull, int separation) {
    const double turn = separation == SEPARATION_ZERO_FORCE ? zero_force_turn(decay) : pi * pi;
    TraceShape shape = {
        .decay = decay,
        .turn = turn,
        .pull = pull,
        .sine = turn - decay * decay + pull * decay,
        .cosine = 2 * decay - pull,
        .length = 1,
    };
    if (pull > 0)
        shape.length = length_under_pull(&shape, separation);
    return shape;
}

// The change of momentum, v0 less the speed at the end, and what was pulled meanwhile.
double trace_shape_impulse(const TraceShape *shape) {
    const double s = shape->length;
    double cosine;
    const double sine = waves(shape->turn, s, &cosine), fall = exp(-shape->decay * s);
    const double speed = fall * (cosine - shape->decay * sine) + shape->pull * fall * sine;
    return 1 - speed + shape->pull * s;
}

TraceVisible trace_shape_visible(const TraceShape *shape, double level) {
    enum { PLACES = 400 };
    TraceVisible visible = {.from = shape->length};
    double forces[PLACES + 1], peak = 0;
    for (int i = 0; i <= PLACES; i++) {
        forces[i] = trace_shape_force(shape, shape->length * i / PLACES);
        peak = fmax(peak, forces[i]);
    }
    for (int i = 0; i <= PLACES; i++) {
        const double s = shape->length * i / PLACES, force = forces[i];
        if (fabs(force) < level * peak)
            continue;
        visible.from = fmin(visible.from, s);
        visible.to = s;
        if (force > 0)
            visible.pressed = s;
    }
    return visible;
}
