// Jankowski 2006: N = k p^n + 2 xi sqrt(k m_e p^(n-1)) p' during approach, N = k p^n during
// separation; xi is his fit for n = 1.5.
//
// In the units of the isolated contact, with Y = y^((n+1)/2) sqrt(2 / (n+1)) and a time s with
// dY/ds = y', the approach is a linear oscillator of damping ratio z = xi sqrt(2 / (n+1)),
// Y'' + 2 z Y' + Y = 0 with Y'(0) = 1, and the separation is undamped. The first maximum is at
// phase arccos(z), so e = exp(-z arccos(z) / sqrt(1 - z^2)).
#include <math.h>

#include "core/contact/identification.h"
#include "core/contact/power_law.h"
#include "core/math/quadrature.h"

static double jankowski_factor(double e) {
    const double pi = 3.14159265358979323846;
    return 4.5 * sqrt(5) * (1 - e) * (1 + e) / (e * (e * (9 * pi - 16) + 16));
}

static double jankowski_damping_ratio(double factor, double exponent) {
    return factor * sqrt(2 / (exponent + 1));
}

static double jankowski_restitution(double factor, double exponent) {
    const double z = jankowski_damping_ratio(factor, exponent);
    return exp(-z * identification_zero_force_phase(z) / 2);
}

typedef struct JankowskiPhase {
    double n, z, length;
} JankowskiPhase;

// sin(w s) / w, also in the overdamped case.
static double jankowski_sine(double z, double s) {
    const double square = (1 - z) * (1 + z), w = sqrt(fabs(square));
    if (w * s < 1e-8)
        return s;
    return square > 0 ? sin(w * s) / w : sinh(w * s) / w;
}

// dt / du: dt = dy / y' = ds / (sqrt((n+1)/2) y^((n-1)/2)), where s = length u^((n+1)/2) removes
// the singularity at u = 0.
static double jankowski_time_density(const void *context, double u, double rest) {
    const JankowskiPhase *at = context;
    (void)rest;
    const double power = (at->n + 1) / 2, s = at->length * pow(u, power);
    if (!(s > 0))
        return 0;
    const double Y = exp(-at->z * s) * jankowski_sine(at->z, s);
    return power * s / u / (sqrt(power) * pow(Y * sqrt(power), (at->n - 1) / (at->n + 1)));
}

// In the separation, with s counted from its end, Y = sin(s).
static double jankowski_duration(double factor, double exponent) {
    const double z = jankowski_damping_ratio(factor, exponent),
                 reached = jankowski_restitution(factor, exponent);
    const JankowskiPhase coming = {exponent, z, identification_zero_force_phase(z) / 2};
    const JankowskiPhase parting = {exponent, 0, 2 * atan(1)};
    return quadrature_unit(jankowski_time_density, &coming) +
           quadrature_unit(jankowski_time_density, &parting) *
               pow(reached, -(exponent - 1) / (exponent + 1));
}

static ContactForce jankowski_force(const ContactParameters *at, double p, double speed) {
    if (!(p > 0))
        return (ContactForce){.kink = speed};
    const double n = at->exponent, spring = at->stiffness * power_law_pow(p, n);
    ContactForce force = {.value = spring,
                          .by_penetration = n * spring / p,
                          .strain = spring * p / (n + 1),
                          .kink = speed};
    if (speed > 0) {
        force.by_speed = 2 * at->factor * sqrt(spring / p * at->mass);
        force.value += force.by_speed * speed;
        force.by_penetration += (n - 1) / 2 * force.by_speed * speed / p;
    }
    return force;
}

static ContactTerms jankowski_terms(const ContactParameters *at) {
    return (ContactTerms){.stiffness = at->stiffness,
                          .exponent = at->exponent,
                          .viscous = 2 * at->factor * sqrt(at->stiffness * at->mass),
                          .viscous_exponent = (at->exponent - 1) / 2,
                          .is_elastic_below = true};
}

const ContactLaw contact_jankowski = {
    .kind = {"jankowski", "N = k p^n, and damping on approach only, which reaches about e",
             contact_fields, sizeof(Contact)},
    .form = CONTACT_POWER,
    .restitution_min = POWER_LAW_RESTITUTION_MIN,
    .factor = jankowski_factor,
    .restitution = jankowski_restitution,
    .duration = jankowski_duration,
    .force = jankowski_force,
    .terms = jankowski_terms,
};
