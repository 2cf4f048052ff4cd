// An isolated contact in its own units: y'' = -y^n (1 + D y'), y(0) = 0, y'(0) = 1. As
// y' dy' / (1 + D y') = -y^n dy, with A(x) = x - ln(1 + x):
//
//   y^(n+1) / (n+1) = (A(D) - A(D y')) / D^2,  and it ends where  A(-D e) = A(D).
//
// S = -ln(1 - D e) turns this into  S - 1 + exp(-S) = A(D), sound however near D e is to 1.
// With 1 + D y' = exp(-D s) time is the integral of ds / y^n, and counted in s from either end
//
//   y^(n+1) / (n+1) = o - (1 + D) o^2 X(-D o)      since the touch, to o = ln(1 + D) / D
//   y^(n+1) / (n+1) = e o - (1 - e D) o^2 X(D o)   until the end, to o = S / D
//
// where X(x) = (exp(x) - 1 - x) / x^2, so that D = 0 is nothing special. The logarithms are taken
// in long double: their differences cancel.
#include "core/contact/power_law.h"

#include <math.h>

#include "core/math/quadrature.h"

// (x^2 / 2 - x + ln(1 + x)) / x^3, for -1 < x.
static long double cubic_rest(long double x) {
    if (fabsl(x) > 0.1L)
        return (x * x / 2 - x + log1pl(x)) / (x * x * x);
    long double sum = 0;
    for (int i = 22; i >= 3; i--)
        sum = 1.0L / i - x * sum;
    return sum;
}

// S - 1 + exp(-S).
static long double end_side(long double S) {
    return S + expm1l(-S);
}

// Where a rising function turns positive. 1e2 halvings of a double's interval leave nothing.
static long double bisect(long double (*f)(long double x, long double e), long double e,
                          long double least, long double most) {
    for (int i = 0; i < 100; i++) {
        const long double middle = (least + most) / 2;
        if (middle <= least || middle >= most)
            break;
        *(f(middle, e) < 0 ? &least : &most) = middle;
    }
    return (least + most) / 2;
}

// A(D) = A(-D e) with D^2 / 2 (1 - e^2) taken out of it and D^2 divided away.
static long double by_factor(long double D, long double e) {
    return D * (cubic_rest(D) + e * e * e * cubic_rest(-e * D)) - (1 - e) * (1 + e) / 2;
}

static long double by_end(long double S, long double e) {
    const long double D = -expm1l(-S) / e;
    return end_side(S) - (D - log1pl(D));
}

double power_factor(double restitution) {
    const long double e = restitution;
    if (restitution >= 1)
        return 0;
    // D = (3/2) (1 - e^2) / (1 + e^3) to first order; at e = 1/2 it is 1.43.
    if (restitution > 0.5)
        return (double)bisect(by_factor, e, 0.5L * (1 - e) * (1 + e), 2 * (1 - e) * (1 + e));
    return (double)(-expm1l(-bisect(by_end, e, 1, 2 + 1 / e)) / e);
}

// S - 1 + exp(-S) = A(D).
static long double by_reach(long double S, long double D) {
    return end_side(S) - (D - log1pl(D));
}

// A(x) / x^2
static long double half_rest(long double x) {
    return 0.5L - x * cubic_rest(x);
}

// e and S of a contact; S by itself cancels where D is small.
static void reach(double D, double *e, double *S) {
    if (D > 0.1) {
        const long double end = bisect(by_reach, D, 0, 1 + (long double)D);
        *S = (double)end;
        *e = (double)(-expm1l(-end) / D);
        return;
    }
    // e^2 A(-D e) / (D e)^2 = A(D) / D^2, each time D / 3 nearer.
    long double found = 1;
    for (int i = 0; i < 24; i++)
        found = sqrtl(half_rest(D) / half_rest(-found * D));
    *e = (double)found;
    *S = (double)-log1pl(-found * D);
}

double power_reached(double D, double exponent) {
    double e, S;
    (void)exponent;
    reach(D, &e, &S);
    return e;
}

typedef struct Half {
    double n, D, e, b; // b = 1 - e D
    double length;     // in s
    double end;        // S
    bool is_leaving;
} Half;

// (exp(x) - 1 - x) / x^2
static double square_rest(double x) {
    if (fabs(x) > 0.5)
        return (expm1(x) - x) / (x * x);
    double sum = 0;
    for (int i = 18; i >= 2; i--)
        sum = (1 + x * sum) / i;
    return sum;
}

static double height(const Half *half, double o) {
    const double x = half->D * o;
    if (!half->is_leaving)
        return half->D > 1 ? (-(1 + half->D) * expm1(-x) - x) / (half->D * half->D)
                           : o - (1 + half->D) * o * o * square_rest(-x);
    if (half->end <= 1)
        return half->e * o - half->b * o * o * square_rest(x);
    // b exp(x), where one factor may leave what numbers can hold.
    const double rise = x < 1 ? half->b * expm1(x) : exp(x - half->end) - half->b;
    return (x - rise) / (half->D * half->D);
}

// ds / y^n with o = length u^(n+1), which takes the singularity at u = 0 away.
static double moment(const void *context, double u, double rest) {
    const Half *half = context;
    (void)rest;
    const double n = half->n, share = pow(u, n), o = half->length * share * u;
    if (!(o > 0))
        return 0;
    return (n + 1) * half->length * share / pow((n + 1) * height(half, o), n / (n + 1));
}

double power_duration(double D, double exponent) {
    double e, S;
    reach(D, &e, &S);
    const bool is_damped = D > 0;
    Half half = {.n = exponent, .D = D, .e = e, .b = exp(-S), .end = S};
    half.length = is_damped ? log1p(D) / D : 1;
    const double coming = quadrature_unit(moment, &half);
    half.is_leaving = true;
    half.length = is_damped ? S / D : 1;
    return coming + quadrature_unit(moment, &half);
}

ContactForce power_force(const ContactParameters *at, double p, double speed) {
    // A buffer cannot pull: where the mass leaves it faster than 1 + D p'/v0 = 0 it feels nothing.
    const double pull = 1 + at->factor * speed / at->speed;
    if (!(p > 0))
        return (ContactForce){.kink = pull};
    const double spring = at->stiffness * power_of(p, at->exponent);
    ContactForce force = {.strain = spring * p / (at->exponent + 1), .kink = pull};
    if (pull > 0) {
        force.value = spring * pull;
        force.by_penetration = at->exponent * force.value / p;
        force.by_speed = spring * at->factor / at->speed;
    }
    return force;
}

ContactTerms power_terms(const ContactParameters *at) {
    const double damping = at->factor / at->speed;
    return (ContactTerms){.stiffness = at->stiffness,
                          .exponent = at->exponent,
                          .viscous = at->stiffness * damping,
                          .viscous_exponent = at->exponent,
                          .turn = -1 / damping};
}
