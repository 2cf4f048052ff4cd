// Jankowski 2006: N = k p^n + 2 xi sqrt(k m_e p^(n-1)) p' while the bodies approach, N = k p^n
// while they part; xi is his fit for n = 1.5.
//
// In the isolated contact's own units Y = y^((n+1)/2) sqrt(2 / (n+1)) and a time s with
// dY/ds = y' make the approach a linear oscillator of damping ratio z = xi sqrt(2 / (n+1)),
// Y'' + 2 z Y' + Y = 0 with Y'(0) = 1, and the parting one without damping. Its first maximum
// follows at phase arccos(z), so e = exp(-z arccos(z) / sqrt(1 - z^2)).
#include <math.h>

#include "core/contact/identification.h"
#include "core/contact/power_law.h"
#include "core/math/quadrature.h"

static double jankowski_factor(double e) {
    const double pi = 3.14159265358979323846;
    return 4.5 * sqrt(5) * (1 - e) * (1 + e) / (e * (e * (9 * pi - 16) + 16));
}

static double ratio(double factor, double exponent) {
    return factor * sqrt(2 / (exponent + 1));
}

static double jankowski_reached(double factor, double exponent) {
    const double z = ratio(factor, exponent);
    return exp(-z * zero_force_phase(z) / 2);
}

typedef struct Approach {
    double n, z, length;
} Approach;

// The oscillator's sin(w s) / w, also where it does not oscillate.
static double swing(double z, double s) {
    const double square = (1 - z) * (1 + z), w = sqrt(fabs(square));
    if (w * s < 1e-8)
        return s;
    return square > 0 ? sin(w * s) / w : sinh(w * s) / w;
}

// dy / y' = ds / (sqrt((n+1)/2) y^((n-1)/2)), with s = length u^((n+1)/2) against the singularity
// at u = 0.
static double approach_moment(const void *context, double u, double rest) {
    const Approach *at = context;
    (void)rest;
    const double power = (at->n + 1) / 2, s = at->length * pow(u, power);
    if (!(s > 0))
        return 0;
    const double Y = exp(-at->z * s) * swing(at->z, s);
    return power * s / u / (sqrt(power) * pow(Y * sqrt(power), (at->n - 1) / (at->n + 1)));
}

// The same of the parting, Y = cos(s') counted from its end: Y = sin(s), undamped.
static double jankowski_duration(double factor, double exponent) {
    const double z = ratio(factor, exponent), reached = jankowski_reached(factor, exponent);
    const Approach coming = {exponent, z, zero_force_phase(z) / 2};
    const Approach parting = {exponent, 0, 2 * atan(1)};
    return quadrature_unit(approach_moment, &coming) +
           quadrature_unit(approach_moment, &parting) *
               pow(reached, -(exponent - 1) / (exponent + 1));
}

static ContactForce jankowski_force(const ContactParameters *at, double p, double speed) {
    if (!(p > 0))
        return (ContactForce){.kink = speed};
    const double n = at->exponent, spring = at->stiffness * power_of(p, n);
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
    .least_restitution = POWER_LEAST_RESTITUTION,
    .factor = jankowski_factor,
    .reached = jankowski_reached,
    .duration = jankowski_duration,
    .force = jankowski_force,
    .terms = jankowski_terms,
};
