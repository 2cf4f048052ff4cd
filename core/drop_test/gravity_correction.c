// In units of T_c and of the approach speed v, gravity G = g T_c / v acts on the isolated pair:
//
//   y'' + 2 Z w y' + w^2 y = G,  y(0) = 0,  y'(0) = 1.
//
// About the equilibrium G / w^2 this is a free vibration. A constant matrix advances it by one
// stride at a time until the contact ends: y is 0 again, or the force w^2 y + 2 Z w y' is.
// Bisection locates the end within the stride. Newton's method in ln e and ln T_c inverts the
// effect.
#include "core/drop_test/gravity_correction.h"

#include "core/contact/identification.h"

static const double stride = 1.0 / 48;
enum { STRIDES = 48 * 60, NEWTON = 60, HALVINGS = 52 };

// y from its equilibrium, and y'.
typedef struct SwingState {
    double off, speed;
} SwingState;

typedef struct Swing {
    double w, Z, equilibrium;
    Separation separation;
} Swing;

// The free vibration at `time` after `from`.
static SwingState gravity_swing(const Swing *of, SwingState from, double time) {
    const double q = of->w * of->w * (1 - of->Z) * (1 + of->Z), x = sqrt(fabs(q)) * time;
    const double cosine = q >= 0 ? cos(x) : cosh(x);
    const double sine = x < 1e-4 ? time * (1 - copysign(x * x, q) / 6)
                        : q > 0  ? time * sin(x) / x
                                 : time * sinh(x) / x;
    const double fade = exp(-of->Z * of->w * time), slow = of->Z * of->w;
    return (SwingState){
        fade * ((cosine + slow * sine) * from.off + sine * from.speed),
        fade * (-of->w * of->w * sine * from.off + (cosine - slow * sine) * from.speed),
    };
}

// Positive during the contact.
static double gravity_pressure(const Swing *of, SwingState at) {
    const double y = of->equilibrium + at.off;
    return of->separation == SEPARATION_ZERO_FORCE ? of->w * y + 2 * of->Z * at.speed : y;
}

GravityContact gravity_apply(const GravityLoad *load, double restitution, double contact_time) {
    const GravityContact endless = {0, (double)INFINITY};
    const Identification isolated =
        identification_from_restitution(1, restitution, 1, load->separation);
    const double G = load->gravity * contact_time / load->speed, w = sqrt(isolated.stiffness);
    const Swing of = {w, isolated.damping_ratio, G / (w * w), load->separation};
    const SwingState start = {-of.equilibrium, 1};
    // The columns of the matrix of one stride.
    const SwingState by_off = gravity_swing(&of, (SwingState){1, 0}, stride);
    const SwingState by_speed = gravity_swing(&of, (SwingState){0, 1}, stride);
    SwingState at = start;
    int strides = 0;
    for (;;) {
        const SwingState next = {by_off.off * at.off + by_speed.off * at.speed,
                                 by_off.speed * at.off + by_speed.speed * at.speed};
        if (gravity_pressure(&of, next) < 0)
            break;
        at = next;
        if (++strides == STRIDES)
            return endless;
    }
    double least = 0, most = stride;
    for (int i = 0; i < HALVINGS; i++) {
        const double middle = (least + most) / 2;
        if (gravity_pressure(&of, gravity_swing(&of, at, middle)) < 0)
            most = middle;
        else
            least = middle;
    }
    const SwingState end = gravity_swing(&of, at, most);
    const double depth = fmax(of.equilibrium + end.off, 0), up = -end.speed;
    // An impactor that separates inside the buffer has to rise out of it.
    const double square = up * up - (load->is_by_height ? 2 * G * depth : 0);
    if (!(up > 0) || !(square > 0))
        return (GravityContact){0, (strides * stride + most) * contact_time};
    return (GravityContact){sqrt(square), (strides * stride + most) * contact_time};
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
