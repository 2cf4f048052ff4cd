// y'' + 2 Z w y' + w^2 y = g from y = 0, y' = v0, in units of T_c and v0 T_c, with L = Z w = -ln(e)
// under both separation rules (contact/identification.h):
//
//   y = e^(-L s) S + (pull / w^2) (1 - e^(-L s) (C + L S)),  F = w^2 y + 2 L y'
//
// T_c is the time unit: S(1) = 0 under zero penetration, hence turn = pi^2. Under zero force and
// without gravity F(1) = 0: with x = sqrt(turn) / 2 that is x cot(x) = L / 2.
//
// Newton's method in ln e and ln T_c inverts the effect of gravity on both.
#include "core/drop_test/pulse_model.h"

#include <math.h>

static const double pi = 3.14159265358979323846;

enum { NEWTON = 60, HALVINGS = 52 };

// x cot(x) of x^2 = u, which may be negative, and its derivative.
static double pulse_cotangent(double u, double *slope) {
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

// x cot(x) falls from infinity to -infinity at u = pi^2 and is concave: Newton's method from the
// right does not pass the root.
static double pulse_turn(double decay, int separation) {
    if (separation != SEPARATION_ZERO_FORCE)
        return pi * pi;
    double u = fmin(pi * pi / 4 * (1 - decay / 2), 9);
    for (int step = 0; step < 30; step++) {
        double slope;
        const double change = (pulse_cotangent(u, &slope) - decay / 2) / slope;
        u = fmin(u - change, 9.8);
        if (fabs(change) < 1e-14 * (1 + fabs(u)))
            break;
    }
    return 4 * u;
}

// S and C.
static double pulse_waves(double turn, double s, double *cosine) {
    const double x = sqrt(fabs(turn)) * s;
    *cosine = turn > 0 ? cos(x) : cosh(x);
    if (x < 1e-4)
        return s * (1 - turn * s * s / 6);
    return s * (turn > 0 ? sin(x) : sinh(x)) / x;
}

double pulse_model_force(const PulseModel *model, double s) {
    double cosine;
    const double sine = pulse_waves(model->turn, s, &cosine);
    return model->pull + exp(-model->decay * s) * (model->sine * sine + model->cosine * cosine);
}

// y or F, whichever ends the contact, is own + pull * pulled. The derivative of `pulled` is `own`
// under both rules.
typedef struct Separating {
    double own, pulled, slope; // slope: of own
} Separating;

static Separating pulse_separating(double decay, double turn, int separation, double s) {
    double cosine;
    const double sine = pulse_waves(turn, s, &cosine), fall = exp(-decay * s);
    if (separation == SEPARATION_ZERO_FORCE) {
        const double on_sine = turn - decay * decay, on_cosine = 2 * decay;
        return (Separating){
            .own = fall * (on_sine * sine + on_cosine * cosine),
            .pulled = 1 - fall * (cosine - decay * sine),
            .slope = fall * ((on_sine - decay * on_cosine) * cosine -
                             (turn * on_cosine + decay * on_sine) * sine),
        };
    }
    return (Separating){
        .own = fall * sine,
        .pulled = (1 - fall * (cosine + decay * sine)) / (turn + decay * decay),
        .slope = fall * (cosine - decay * sine),
    };
}

// The length of a contact under gravity [T_c]; INFINITY: it does not end. `push` is the pull, or,
// if is_total, the pull times the length.
//
// Without gravity the end is at 1, and `own` is negative for half an oscillation from there on. In
// that range own' / own falls without bound; so the function falls from a positive value at 1 to
// its only minimum and rises behind it. The end is the root before the minimum, if there is one:
// Newton's method between bounds that close in on the root or on the minimum.
static double pulse_length(double decay, double turn, int separation, double push, bool is_total) {
    if (!(push > 0))
        return 1;
    double s = 1, low = 1, high = turn > 0 ? fmin(1 + pi / sqrt(turn), 8) : 8;
    for (int step = 0; step < 100; step++) {
        const Separating at = pulse_separating(decay, turn, separation, s);
        const double pull = is_total ? push / s : push;
        const double value = at.own + pull * at.pulled, slope = at.slope + pull * at.own;
        const double change = value / (is_total ? slope - pull * at.pulled / s : slope);
        const double next = s - change;
        if (slope < 0 && fabs(change) < 1e-9)
            return fmax(next, 1);
        *(value > 0 && slope < 0 ? &low : &high) = s;
        if (high - low < 1e-8)
            break;
        s = slope < 0 && next > low && next < high ? next : low + (high - low) / 2;
    }
    return (double)INFINITY;
}

static PulseModel pulse_model_of(double decay, double push, int separation, bool is_total) {
    const double turn = pulse_turn(decay, separation);
    const double length = pulse_length(decay, turn, separation, push, is_total);
    const double pull = is_total ? push / length : push;
    return (PulseModel){
        .decay = decay,
        .turn = turn,
        .pull = pull,
        .sine = turn - decay * decay + pull * decay,
        .cosine = 2 * decay - pull,
        .length = length,
    };
}

PulseModel pulse_model_make(double decay, double pull, int separation) {
    return pulse_model_of(decay, pull, separation, false);
}

PulseModel pulse_model_make_lasting(double decay, double pull, int separation) {
    return pulse_model_of(decay, pull, separation, true);
}

// y [v0 T_c] and y' [v0] where the contact ends.
static double pulse_end(const PulseModel *model, double *speed) {
    const Separating at =
        pulse_separating(model->decay, model->turn, SEPARATION_ZERO_PENETRATION, model->length);
    *speed = at.slope + model->pull * at.own;
    return at.own + model->pull * at.pulled;
}

// The change of momentum, v0 less the final speed, and the impulse of gravity.
double pulse_model_impulse(const PulseModel *model) {
    double speed;
    (void)pulse_end(model, &speed);
    return 1 - speed + model->pull * model->length;
}

PulseVisible pulse_model_visible(const PulseModel *model, double level) {
    enum { PLACES = 400 };
    PulseVisible visible = {.from = model->length};
    double forces[PLACES + 1], peak = 0;
    for (int i = 0; i <= PLACES; i++) {
        forces[i] = pulse_model_force(model, model->length * i / PLACES);
        peak = fmax(peak, forces[i]);
    }
    for (int i = 0; i <= PLACES; i++) {
        const double s = model->length * i / PLACES, force = forces[i];
        if (fabs(force) < level * peak)
            continue;
        visible.from = fmin(visible.from, s);
        visible.to = s;
        if (force > 0)
            visible.pressed = s;
    }
    return visible;
}

GravityContact gravity_apply(const GravityLoad *load, double restitution, double contact_time) {
    const double pull = load->gravity * contact_time / load->speed;
    const PulseModel model = pulse_model_make(-log(restitution), pull, (int)load->separation);
    if (!isfinite(model.length))
        return (GravityContact){0, (double)INFINITY};
    double speed;
    const double depth = fmax(pulse_end(&model, &speed), 0);
    // An impactor that separates inside the buffer has to rise out of it.
    const double square = speed * speed - (load->is_by_height ? 2 * pull * depth : 0);
    return (GravityContact){speed < 0 && square > 0 ? sqrt(square) : 0,
                            model.length * contact_time};
}

// ln of e and T_c with gravity over those read; false: the contact does not end.
static bool gravity_residual(const GravityLoad *load, const double x[2],
                             const GravityCorrected *read, double off[2]) {
    const GravityContact with = gravity_apply(load, exp(x[0]), exp(x[1]));
    off[0] = log(with.restitution / read->restitution);
    off[1] = log(with.contact_time / read->contact_time);
    return isfinite(off[0]) && isfinite(off[1]);
}

// d(off) / d(ln e, ln T_c), by differences towards shorter contacts, which end.
static bool gravity_jacobian(const GravityLoad *load, const double x[2],
                             const GravityCorrected *read, const double off[2], double by[2][2]) {
    const double h = 1e-5;
    for (int i = 0; i < 2; i++) {
        const double low[2] = {x[0] - (i == 0 ? h : 0), x[1] - (i == 1 ? h : 0)};
        double there[2];
        if (!gravity_residual(load, low, read, there))
            return false;
        by[0][i] = (off[0] - there[0]) / h;
        by[1][i] = (off[1] - there[1]) / h;
    }
    return true;
}

bool gravity_correct(const GravityLoad *load, const GravityCorrected *read,
                     GravityCorrected *isolated) {
    // Starts with less damping and shorter until the contact ends.
    double x[2] = {log(read->restitution), log(read->contact_time)}, off[2], by[2][2];
    for (int i = 0; !gravity_residual(load, x, read, off); i++) {
        x[0] /= 2;
        x[1] -= 0.5;
        if (i == 20)
            return false;
    }
    for (int step = 0; step < NEWTON; step++) {
        const double before = hypot(off[0], off[1]);
        if (!gravity_jacobian(load, x, read, off, by))
            return false;
        const double area = by[0][0] * by[1][1] - by[0][1] * by[1][0];
        const double move[2] = {-(by[1][1] * off[0] - by[0][1] * off[1]) / area,
                                -(by[0][0] * off[1] - by[1][0] * off[0]) / area};
        if (before < 1e-9)
            break;
        double share = 1, next[2];
        for (;; share /= 2) {
            next[0] = fmin(x[0] + share * move[0], 0);
            next[1] = x[1] + share * move[1];
            if (gravity_residual(load, next, read, off) && hypot(off[0], off[1]) < before)
                break;
            if (share < 1e-6)
                return false;
        }
        x[0] = next[0];
        x[1] = next[1];
    }
    if (!(hypot(off[0], off[1]) < 1e-6))
        return false;
    const double area = fabs(by[0][0] * by[1][1] - by[0][1] * by[1][0]);
    const double e = read->restitution_uncertainty, T = read->contact_time_uncertainty;
    *isolated = (GravityCorrected){exp(x[0]), exp(x[1]), hypot(by[1][1] * e, by[0][1] * T) / area,
                                   hypot(by[0][0] * T, by[1][0] * e) / area};
    return isfinite(isolated->restitution) && isfinite(isolated->contact_time);
}

bool gravity_correct_one(const GravityLoad *load, bool is_time, double read, double other,
                         double *isolated) {
    if (!is_time && gravity_apply(load, 1, other).restitution < read)
        return false;
    // Gravity only lowers e and only lengthens T_c.
    double least = is_time ? 0 : read, most = is_time ? read : 1;
    for (int i = 0; i < HALVINGS; i++) {
        const double middle = (least + most) / 2;
        const bool is_low = is_time ? gravity_apply(load, other, middle).contact_time < read
                                    : gravity_apply(load, middle, other).restitution < read;
        *(is_low ? &least : &most) = middle;
    }
    *isolated = most;
    return most > 0;
}
