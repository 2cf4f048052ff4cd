// y'' + 2 Z w y' + w^2 y = g from y = 0, y' = v0, in units of T_c and v0 T_c, with L = Z w = -ln(e)
// under either rule of separation (identify.h):
//
//   y = e^(-L s) S + (pull / w^2) (1 - e^(-L s) (C + L S)),  F = w^2 y + 2 L y'
//
// T_c is the time unit, so S(1) = 0 under zero penetration: turn = pi^2. Under zero force F(1) = 0
// without pull: with x = sqrt(turn) / 2 that is x cot(x) = L / 2.
#include "core/drop_test/pulse_model.h"

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

double pulse_model_force(const PulseModel *shape, double s) {
    double cosine;
    const double sine = waves(shape->turn, s, &cosine);
    return shape->pull + exp(-shape->decay * s) * (shape->sine * sine + shape->cosine * cosine);
}

// What ends the contact, y or F, as own + pull * pulled at s, and the slope of own. That of pulled
// is own itself, under either rule.
typedef struct Remainder {
    double own, pulled, slope;
} Remainder;

static Remainder remainder_at(double decay, double turn, int separation, double s) {
    double cosine;
    const double sine = waves(turn, s, &cosine), fall = exp(-decay * s);
    if (separation == SEPARATION_ZERO_FORCE) {
        const double on_sine = turn - decay * decay, on_cosine = 2 * decay;
        return (Remainder){
            .own = fall * (on_sine * sine + on_cosine * cosine),
            .pulled = 1 - fall * (cosine - decay * sine),
            .slope = fall * ((on_sine - decay * on_cosine) * cosine -
                             (turn * on_cosine + decay * on_sine) * sine),
        };
    }
    return (Remainder){
        .own = fall * sine,
        .pulled = (1 - fall * (cosine + decay * sine)) / (turn + decay * decay),
        .slope = fall * (cosine - decay * sine),
    };
}

// The pull lengthens a contact, and may end it no more: then INFINITY. `push` is the pull, or, if
// it is `of_length`, the pull times the length that is sought.
//
// Without pull the end is at 1, and own is below 0 for half an oscillation from there on. In it
// own' / own falls without end, so what is left falls, from above 0 at 1, until where its own slope
// at that pull is 0, and rises behind. Either the end is before that, and the only one, or there is
// none: Newton's method between bounds that come together about the one or the other.
static double length_under_pull(double decay, double turn, int separation, double push,
                                bool of_length) {
    double s = 1, low = 1, high = turn > 0 ? fmin(1 + pi / sqrt(turn), 8) : 8;
    for (int step = 0; step < 100; step++) {
        const Remainder at = remainder_at(decay, turn, separation, s);
        const double pull = of_length ? push / s : push;
        const double left = at.own + pull * at.pulled, falls = at.slope + pull * at.own;
        const double change = left / (of_length ? falls - pull * at.pulled / s : falls);
        const double next = s - change;
        if (falls < 0 && fabs(change) < 1e-9)
            return fmax(next, 1);
        *(left > 0 && falls < 0 ? &low : &high) = s;
        if (high - low < 1e-8)
            break;
        s = falls < 0 && next > low && next < high ? next : low + (high - low) / 2;
    }
    return (double)INFINITY;
}

static PulseModel shape_of(double decay, double turn, double pull, double length) {
    return (PulseModel){
        .decay = decay,
        .turn = turn,
        .pull = pull,
        .sine = turn - decay * decay + pull * decay,
        .cosine = 2 * decay - pull,
        .length = length,
    };
}

static double turn_of(double decay, int separation) {
    return separation == SEPARATION_ZERO_FORCE ? zero_force_turn(decay) : pi * pi;
}

PulseModel pulse_model_make(double decay, double pull, int separation) {
    const double turn = turn_of(decay, separation);
    return shape_of(decay, turn, pull,
                    pull > 0 ? length_under_pull(decay, turn, separation, pull, false) : 1);
}

PulseModel pulse_model_make_lasting(double decay, double pull, int separation) {
    const double turn = turn_of(decay, separation);
    const double length = pull > 0 ? length_under_pull(decay, turn, separation, pull, true) : 1;
    return shape_of(decay, turn, pull / length, length);
}

// The change of momentum, v0 less the speed at the end, and what was pulled meanwhile.
double pulse_model_impulse(const PulseModel *shape) {
    const double s = shape->length;
    double cosine;
    const double sine = waves(shape->turn, s, &cosine), fall = exp(-shape->decay * s);
    const double speed = fall * (cosine - shape->decay * sine) + shape->pull * fall * sine;
    return 1 - speed + shape->pull * s;
}

PulseVisible pulse_model_visible(const PulseModel *shape, double level) {
    enum { PLACES = 400 };
    PulseVisible visible = {.from = shape->length};
    double forces[PLACES + 1], peak = 0;
    for (int i = 0; i <= PLACES; i++) {
        forces[i] = pulse_model_force(shape, shape->length * i / PLACES);
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
