// y'' + 2 Z w y' + w^2 y = g from y = 0, y' = v0, in units of T_c and v0 T_c, with L = Z w = -ln(e)
// under both separation rules (contact/identification.h):
//
//   y = e^(-L s) S + (pull / w^2) (1 - e^(-L s) (C + L S)),  F = w^2 y + 2 L y'
//
// T_c is the time unit: S(1) = 0 under zero penetration, hence turn = pi^2. Under zero force and
// without gravity F(1) = 0: with x = sqrt(turn) / 2 that is x cot(x) = L / 2.
//
// With the duration of the contact under gravity as the time unit of the pull, e of the isolated
// pair is the one unknown of its inverse.
#include "core/drop_test/pulse_model.h"

#include <math.h>

static const double pi = 3.14159265358979323846;

enum { HALVINGS = 52 };

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

PulseModel pulse_model_make(double decay, double pull, bool is_total, int separation) {
    const double turn = pulse_turn(decay, separation);
    const double length = pulse_length(decay, turn, separation, pull, is_total);
    if (is_total)
        pull /= length;
    return (PulseModel){
        .decay = decay,
        .turn = turn,
        .pull = pull,
        .sine = turn - decay * decay + pull * decay,
        .cosine = 2 * decay - pull,
        .length = length,
    };
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

// e with gravity of a contact; 0: it does not end, or the impactor stays in the buffer.
static double gravity_rebound(const GravityLoad *load, const PulseModel *model) {
    if (!isfinite(model->length))
        return 0;
    double speed;
    const double depth = fmax(pulse_end(model, &speed), 0);
    // An impactor that separates inside the buffer has to rise out of it.
    const double square = speed * speed - (load->is_by_height ? 2 * model->pull * depth : 0);
    return speed < 0 && square > 0 ? sqrt(square) : 0;
}

GravityContact gravity_apply(const GravityLoad *load, double restitution, double contact_time) {
    const double pull = load->gravity * contact_time / load->speed;
    const PulseModel model =
        pulse_model_make(-log(restitution), pull, false, (int)load->separation);
    return (GravityContact){gravity_rebound(load, &model), model.length * contact_time};
}

// e and T_c of the isolated pair from e with gravity and `time`, T_c with gravity or, unless
// is_total, without it. False: there is none.
static bool gravity_find(const GravityLoad *load, double read, double time, bool is_total,
                         double *restitution, double *contact_time) {
    const double pull = load->gravity * time / load->speed;
    double least = read, most = 1; // gravity only lowers e
    PulseModel model = pulse_model_make(0, pull, is_total, (int)load->separation);
    if (!(gravity_rebound(load, &model) >= read * (1 - 1e-12)))
        return false;
    for (int i = 0; i < HALVINGS; i++) {
        const double middle = (least + most) / 2;
        model = pulse_model_make(-log(middle), pull, is_total, (int)load->separation);
        *(gravity_rebound(load, &model) < read ? &least : &most) = middle;
    }
    model = pulse_model_make(-log(most), pull, is_total, (int)load->separation);
    *restitution = most;
    *contact_time = is_total ? time / model.length : time;
    return most > 0 && *contact_time > 0;
}

bool gravity_correct(const GravityLoad *load, const GravityCorrected *read,
                     GravityCorrected *isolated) {
    // Errors of the readings by differences towards less e and a shorter contact.
    const double h = 1e-5, factor = exp(-h);
    double e, T, by_e[2], by_T[2];
    if (!gravity_find(load, read->restitution, read->contact_time, true, &e, &T) ||
        !gravity_find(load, read->restitution * factor, read->contact_time, true, &by_e[0],
                      &by_T[0]) ||
        !gravity_find(load, read->restitution, read->contact_time * factor, true, &by_e[1],
                      &by_T[1]))
        return false;
    const double r_e = read->restitution_uncertainty / h, r_T = read->contact_time_uncertainty / h;
    *isolated = (GravityCorrected){e, T, hypot(log(e / by_e[0]) * r_e, log(e / by_e[1]) * r_T),
                                   hypot(log(T / by_T[0]) * r_e, log(T / by_T[1]) * r_T)};
    return true;
}

bool gravity_correct_one(const GravityLoad *load, bool is_time, double read, double other,
                         double *isolated) {
    double ignored;
    if (!is_time)
        return gravity_find(load, read, other, false, isolated, &ignored);
    const double pull = load->gravity * read / load->speed;
    *isolated = read / pulse_model_make(-log(other), pull, true, (int)load->separation).length;
    return *isolated > 0;
}
