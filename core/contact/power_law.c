// An isolated contact in its units: y'' = -y^n (1 + D y'), y(0) = 0, y'(0) = 1. From
// y' dy' / (1 + D y') = -y^n dy, with A(x) = x - ln(1 + x):
//
//   y^(n+1) / (n+1) = (A(D) - A(D y')) / D^2,  and the contact ends where  A(-D e) = A(D).
//
// With S = -ln(1 - D e) this is  S - 1 + exp(-S) = A(D), which is accurate even for D e close to 1.
// With 1 + D y' = exp(-D s) time is the integral of ds / y^n. With o = s counted from either end
//
//   y^(n+1) / (n+1) = o - (1 + D) o^2 X(-D o)      from the start, up to o = ln(1 + D) / D
//   y^(n+1) / (n+1) = e o - (1 - e D) o^2 X(D o)   from the end, up to o = S / D
//
// where X(x) = (exp(x) - 1 - x) / x^2, so that D = 0 is no special case. The logarithms are in long
// double, because their differences cancel.
#include "core/contact/power_law.h"

#include <math.h>

#include "core/math/quadrature.h"

// (x^2 / 2 - x + ln(1 + x)) / x^3, for -1 < x.
static long double power_law_cubic_rest(long double x) {
    if (fabsl(x) > 0.1L)
        return (x * x / 2 - x + log1pl(x)) / (x * x * x);
    long double sum = 0;
    for (int i = 22; i >= 3; i--)
        sum = 1.0L / i - x * sum;
    return sum;
}

// S - 1 + exp(-S).
static long double power_law_end_side(long double S) {
    return S + expm1l(-S);
}

// The root of a rising function; 100 halvings reach the resolution of a double.
static long double power_law_bisect(long double (*f)(long double x, long double e), long double e,
                                    long double low, long double high) {
    for (int i = 0; i < 100; i++) {
        const long double middle = (low + high) / 2;
        if (middle <= low || middle >= high)
            break;
        *(f(middle, e) < 0 ? &low : &high) = middle;
    }
    return (low + high) / 2;
}

// A(D) - A(-D e) divided by D^2, with the leading term -(1 - e^2) / 2 separated.
static long double power_law_factor_residual(long double D, long double e) {
    return D * (power_law_cubic_rest(D) + e * e * e * power_law_cubic_rest(-e * D)) -
           (1 - e) * (1 + e) / 2;
}

static long double power_law_end_residual(long double S, long double e) {
    const long double D = -expm1l(-S) / e;
    return power_law_end_side(S) - (D - log1pl(D));
}

double power_law_factor(double restitution) {
    const long double e = restitution;
    if (restitution >= 1)
        return 0;
    // D = (3/2) (1 - e^2) / (1 + e^3) to first order; at e = 1/2 it is 1.43.
    if (restitution > 0.5)
        return (double)power_law_bisect(power_law_factor_residual, e, 0.5L * (1 - e) * (1 + e),
                                        2 * (1 - e) * (1 + e));
    return (double)(-expm1l(-power_law_bisect(power_law_end_residual, e, 1, 2 + 1 / e)) / e);
}

// S - 1 + exp(-S) = A(D).
static long double power_law_reach_residual(long double S, long double D) {
    return power_law_end_side(S) - (D - log1pl(D));
}

// A(x) / x^2
static long double power_law_half_rest(long double x) {
    return 0.5L - x * power_law_cubic_rest(x);
}

// e and S of a contact; for small D, S cannot be found first because of cancellation.
static void power_law_end(double D, double *e, double *S) {
    if (D > 0.1) {
        const long double end =
            power_law_bisect(power_law_reach_residual, D, 0, 1 + (long double)D);
        *S = (double)end;
        *e = (double)(-expm1l(-end) / D);
        return;
    }
    // e^2 A(-D e) / (D e)^2 = A(D) / D^2 by iteration; each step reduces the error by D / 3.
    long double found = 1;
    for (int i = 0; i < 24; i++)
        found = sqrtl(power_law_half_rest(D) / power_law_half_rest(-found * D));
    *e = (double)found;
    *S = (double)-log1pl(-found * D);
}

double power_law_restitution(double D, double exponent) {
    double e, S;
    (void)exponent;
    power_law_end(D, &e, &S);
    return e;
}

typedef struct PowerLawHalf {
    double n, D, e, b; // b = 1 - e D
    double length;     // in s
    double end;        // S
    bool is_leaving;
} PowerLawHalf;

// (exp(x) - 1 - x) / x^2
static double power_law_square_rest(double x) {
    if (fabs(x) > 0.5)
        return (expm1(x) - x) / (x * x);
    double sum = 0;
    for (int i = 18; i >= 2; i--)
        sum = (1 + x * sum) / i;
    return sum;
}

static double power_law_height(const PowerLawHalf *half, double o) {
    const double x = half->D * o;
    if (!half->is_leaving)
        return half->D > 1 ? (-(1 + half->D) * expm1(-x) - x) / (half->D * half->D)
                           : o - (1 + half->D) * o * o * power_law_square_rest(-x);
    if (half->end <= 1)
        return half->e * o - half->b * o * o * power_law_square_rest(x);
    // b exp(x), of which one factor may overflow.
    const double rise = x < 1 ? half->b * expm1(x) : exp(x - half->end) - half->b;
    return (x - rise) / (half->D * half->D);
}

// dt / du: dt = ds / y^n, where o = length u^(n+1) removes the singularity at u = 0.
static double power_law_time_density(const void *context, double u, double rest) {
    const PowerLawHalf *half = context;
    (void)rest;
    const double n = half->n, share = pow(u, n), o = half->length * share * u;
    if (!(o > 0))
        return 0;
    return (n + 1) * half->length * share / pow((n + 1) * power_law_height(half, o), n / (n + 1));
}

double power_law_duration(double D, double exponent) {
    double e, S;
    power_law_end(D, &e, &S);
    const bool is_damped = D > 0;
    PowerLawHalf half = {.n = exponent, .D = D, .e = e, .b = exp(-S), .end = S};
    half.length = is_damped ? log1p(D) / D : 1;
    const double coming = quadrature_unit(power_law_time_density, &half);
    half.is_leaving = true;
    half.length = is_damped ? S / D : 1;
    return coming + quadrature_unit(power_law_time_density, &half);
}

ContactForce power_law_force(const ContactParameters *at, double p, double speed) {
    // A buffer cannot pull: the force is 0 where 1 + D p'/v0 < 0.
    const double pull = 1 + at->factor * speed / at->speed;
    if (!(p > 0))
        return (ContactForce){.kink = pull};
    const double spring = at->stiffness * power_law_pow(p, at->exponent);
    ContactForce force = {.strain = spring * p / (at->exponent + 1), .kink = pull};
    if (pull > 0) {
        force.value = spring * pull;
        force.by_penetration = at->exponent * force.value / p;
        force.by_speed = spring * at->factor / at->speed;
    }
    return force;
}

ContactTerms power_law_terms(const ContactParameters *at) {
    const double damping = at->factor / at->speed;
    return (ContactTerms){.stiffness = at->stiffness,
                          .exponent = at->exponent,
                          .viscous = at->stiffness * damping,
                          .viscous_exponent = at->exponent,
                          .turn = -1 / damping};
}

// The laws that differ only in D as a function of e.
#define POWER_LAW(name_, doc_, restitution_min_, factor_)                                          \
    {                                                                                              \
        .kind = {name_, doc_, contact_fields, sizeof(Contact)}, .form = CONTACT_POWER,             \
        .restitution_min = restitution_min_, .factor = factor_,                                    \
        .restitution = power_law_restitution, .duration = power_law_duration,                      \
        .force = power_law_force, .terms = power_law_terms,                                        \
    }

// With n = 1.5 for two spheres.
const ContactLaw contact_hertz =
    POWER_LAW("hertz", "an elastic contact, N = k p^n: restitution 1", 1, NULL);

// Hunt and Crossley 1975, with the D that gives exactly the restitution e,
// D (1 + e) = ln((1 + D) / (1 - e D)), and with the first-order D of their paper.
const ContactLaw contact_hunt_crossley = POWER_LAW(
    "hunt_crossley", "N = k p^n (1 + D p'/v0) with the D that gives exactly this restitution",
    POWER_LAW_RESTITUTION_MIN, power_law_factor);

static double hunt_crossley_textbook_factor(double e) {
    return 1.5 * (1 - e);
}

const ContactLaw contact_hunt_crossley_textbook =
    POWER_LAW("hunt_crossley_textbook",
              "N = k p^n (1 + D p'/v0) with D = 1.5 (1 - e), which reaches more than e", 0,
              hunt_crossley_textbook_factor);

// Lankarani and Nikravesh 1990, from the energy loss of a nearly elastic impact.
static double lankarani_nikravesh_factor(double e) {
    return 0.75 * (1 - e) * (1 + e);
}

const ContactLaw contact_lankarani_nikravesh =
    POWER_LAW("lankarani_nikravesh",
              "N = k p^n (1 + D p'/v0) with D = 0.75 (1 - e^2), which reaches more than e", 0,
              lankarani_nikravesh_factor);

// Flores, Machado, Silva and Martins 2011, valid for soft buffers as well.
static double flores_factor(double e) {
    return 8 * (1 - e) / (5 * e);
}

const ContactLaw contact_flores =
    POWER_LAW("flores", "N = k p^n (1 + D p'/v0) with D = 8 (1 - e) / (5 e), which reaches about e",
              POWER_LAW_RESTITUTION_MIN, flores_factor);
