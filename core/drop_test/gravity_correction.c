// In units of T_c and of the approach speed v the isolated pair is pulled by G = g T_c / v:
//
//   y'' + 2 Z w y' + w^2 y = G,  y(0) = 0,  y'(0) = 1.
//
// About its rest at G / w^2 it is a free vibration, which a constant matrix carries over each
// stride of a scan for the first end: y back at 0, or the force w^2 y + 2 Z w y' gone. The end is
// then halved down inside its stride. Newton's method in ln e and ln T_c goes the way back.
#include "core/drop_test/gravity_correction.h"

#include "core/contact/identification.h"

static const double stride = 1.0 / 48;
enum { STRIDES = 48 * 60, NEWTON = 60, HALVINGS = 52 };

// y less its rest, and y'.
typedef struct Motion {
    double off, speed;
} Motion;

typedef struct Swing {
    double w, Z, rest;
    Separation separation;
} Swing;

// The free vibration after `time`, from `from` on.
static Motion swing(const Swing *of, Motion from, double time) {
    const double q = of->w * of->w * (1 - of->Z) * (1 + of->Z), x = sqrt(fabs(q)) * time;
    const double cosine = q >= 0 ? cos(x) : cosh(x);
    const double sine = x < 1e-4 ? time * (1 - copysign(x * x, q) / 6)
                        : q > 0  ? time * sin(x) / x
                                 : time * sinh(x) / x;
    const double fade = exp(-of->Z * of->w * time), slow = of->Z * of->w;
    return (Motion){
        fade * ((cosine + slow * sine) * from.off + sine * from.speed),
        fade * (-of->w * of->w * sine * from.off + (cosine - slow * sine) * from.speed),
    };
}

// Positive as long as the contact lasts.
static double hold(const Swing *of, Motion at) {
    const double y = of->rest + at.off;
    return of->separation == SEPARATION_ZERO_FORCE ? of->w * y + 2 * of->Z * at.speed : y;
}

GravityContact gravity_apply(const GravityLoad *pull, double restitution, double contact_time) {
    const GravityContact never = {0, (double)INFINITY};
    const Identified isolated = identify_measured(1, restitution, 1, pull->separation);
    const double G = pull->gravity * contact_time / pull->speed, w = sqrt(isolated.stiffness);
    const Swing of = {w, isolated.damping_ratio, G / (w * w), pull->separation};
    const Motion start = {-of.rest, 1};
    // The columns of the matrix of one stride.
    const Motion by_off = swing(&of, (Motion){1, 0}, stride);
    const Motion by_speed = swing(&of, (Motion){0, 1}, stride);
    Motion at = start;
    int strides = 0;
    for (;;) {
        const Motion next = {by_off.off * at.off + by_speed.off * at.speed,
                             by_off.speed * at.off + by_speed.speed * at.speed};
        if (hold(&of, next) < 0)
            break;
        at = next;
        if (++strides == STRIDES)
            return never;
    }
    double least = 0, most = stride;
    for (int i = 0; i < HALVINGS; i++) {
        const double middle = (least + most) / 2;
        if (hold(&of, swing(&of, at, middle)) < 0)
            most = middle;
        else
            least = middle;
    }
    const Motion end = swing(&of, at, most);
    const double deep = fmax(of.rest + end.off, 0), up = -end.speed;
    // What is still inside the buffer at parting has to rise out of it.
    const double square = up * up - (pull->is_by_height ? 2 * G * deep : 0);
    if (!(up > 0) || !(square > 0))
        return (GravityContact){0, (strides * stride + most) * contact_time};
    return (GravityContact){sqrt(square), (strides * stride + most) * contact_time};
}

// The logarithms of what is read over those of what should be; false where nothing comes back.
static bool miss(const GravityLoad *pull, double log_e, double log_T, const GravityCorrected *read,
                 double off[2]) {
    const GravityContact told = gravity_apply(pull, exp(log_e), exp(log_T));
    off[0] = log(told.restitution / read->restitution);
    off[1] = log(told.contact_time / read->contact_time);
    return isfinite(off[0]) && isfinite(off[1]);
}

// d(off) / d(ln e, ln T_c), by differences towards what surely parts.
static bool slopes(const GravityLoad *pull, const double x[2], const GravityCorrected *read,
                   double by[2][2]) {
    const double h = 1e-5;
    for (int i = 0; i < 2; i++) {
        const double low[2] = {x[0] - (i == 0 ? h : 0), x[1] - (i == 1 ? h : 0)};
        double here[2], there[2];
        if (!miss(pull, x[0], x[1], read, here) || !miss(pull, low[0], low[1], read, there))
            return false;
        by[0][i] = (here[0] - there[0]) / h;
        by[1][i] = (here[1] - there[1]) / h;
    }
    return true;
}

bool gravity_correct(const GravityLoad *pull, const GravityCorrected *read,
                     GravityCorrected *isolated) {
    // What was read is more damped and longer than what is looked for.
    double x[2] = {log(read->restitution), log(read->contact_time)}, off[2], by[2][2];
    for (int i = 0; !miss(pull, x[0], x[1], read, off); i++) {
        x[0] /= 2;
        x[1] -= 0.5;
        if (i == 20)
            return false;
    }
    for (int step = 0; step < NEWTON; step++) {
        const double before = hypot(off[0], off[1]);
        if (!slopes(pull, x, read, by))
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
            if (miss(pull, next[0], next[1], read, off) && hypot(off[0], off[1]) < before)
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

bool gravity_correct_restitution(const GravityLoad *pull, double read, double contact_time,
                                 double *restitution) {
    if (gravity_apply(pull, 1, contact_time).restitution < read)
        return false;
    double least = read, most = 1; // the pull only takes away
    for (int i = 0; i < HALVINGS; i++) {
        const double middle = (least + most) / 2;
        if (gravity_apply(pull, middle, contact_time).restitution < read)
            least = middle;
        else
            most = middle;
    }
    *restitution = most;
    return most > 0;
}

bool gravity_correct_contact_time(const GravityLoad *pull, double read, double restitution,
                                  double *contact_time) {
    double least = 0, most = read; // the pull only lengthens
    for (int i = 0; i < HALVINGS; i++) {
        const double middle = (least + most) / 2;
        if (middle <= 0 || gravity_apply(pull, restitution, middle).contact_time < read)
            least = middle;
        else
            most = middle;
    }
    *contact_time = most;
    return most > 0;
}
