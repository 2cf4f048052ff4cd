// One isolated contact, y'' + 2 Z w y' + w^2 y = 0 with w = sqrt(k_b / m_e) and L = -ln(e). Ending
// when y is back at 0 (eqs (8) and (9) of Li and Darby 2009, the latter with its sign mended):
//
//   w T_c = hypot(pi, L),  Z = L / hypot(pi, L)
//
// Ending when the force k_b y + c_b y' is 0, h(Z) = w T_c and L = Z h(Z):
//
//   h = 2 arccos(Z) / sqrt(1 - Z^2)  or  2 arccosh(Z) / sqrt(Z^2 - 1)  or, at Z = 1,  2
//
// Both have c_b = 2 m_e L / T_c. L rises with Z and is concave, so Newton's method from below never
// passes the Z that is looked for.
#include "core/contact/identification.h"

#include <float.h>
#include <math.h>
#include <stdbool.h>

static const double pi = 3.14159265358979323846;

double effective_mass(double mass1, double mass2) {
    const double lighter = fmin(mass1, mass2), heavier = fmax(mass1, mass2);
    return lighter / (1 + lighter / heavier);
}

// In long double throughout: e = exp(-Z h) has the absolute error of its exponent. Angle over its
// sine: an error of the root cancels where the root is small.
static long double phase(long double Z) {
    const long double root = sqrtl(fabsl(1 - Z)) * sqrtl(1 + Z);
    if (root == 0)
        return 2;
    return 2 * (Z < 1 ? atan2l(root, Z) : asinhl(root)) / root;
}

double zero_force_phase(double damping_ratio) {
    return (double)phase(damping_ratio);
}

// Z of L = Z h(Z).
static long double zero_force_ratio(long double L) {
    // 2 <= h <= pi below Z = 1; above it L / 2 - 1 <= arccosh(Z).
    long double Z = L <= 2 ? L / (long double)pi : coshl(L / 2 - 1);
    for (int step = 0; step < 60; step++) {
        const long double h = phase(Z), off = 1 - Z;
        const long double slope =
            fabsl(off) < 1e-3L ? 4.0L / 3 + 0.8L * off : (h - 2 * Z) / (off * (1 + Z));
        const long double rise = (L - Z * h) / slope;
        Z += rise;
        if (!(rise > 2 * LDBL_EPSILON * Z))
            break;
    }
    return Z;
}

static Identified zero_force_measured(double m_e, double restitution, double contact_time) {
    const long double L = fabsl(logl(restitution));
    const long double Z = zero_force_ratio(L), w = phase(Z) / contact_time;
    return (Identified){
        .effective_mass = m_e,
        .restitution = restitution,
        .contact_time = contact_time,
        .stiffness = (double)(m_e * w * w),
        .damping = (double)(2 * m_e * L / contact_time),
        .damping_ratio = (double)Z,
    };
}

static Identified zero_force_given(double m_e, double stiffness, double damping) {
    const long double w = sqrtl((long double)stiffness / m_e);
    const long double Z = (long double)damping / m_e / (2 * w), h = phase(Z);
    return (Identified){
        .effective_mass = m_e,
        .restitution = (double)expl(-Z * h),
        .contact_time = (double)(h / w),
        .stiffness = stiffness,
        .damping = damping,
        .damping_ratio = (double)Z,
    };
}

Identified identify_measured(double m_e, double restitution, double contact_time,
                             Separation separation) {
    if (separation == SEPARATION_ZERO_FORCE)
        return zero_force_measured(m_e, restitution, contact_time);
    const double L = fabs(log(restitution));
    const double h = hypot(pi, L), w = h / contact_time;
    return (Identified){
        .effective_mass = m_e,
        .restitution = restitution,
        .contact_time = contact_time,
        .stiffness = m_e * w * w,
        .damping = 2 * m_e * L / contact_time,
        .damping_ratio = L / h,
    };
}

Identified identify_given(double m_e, double stiffness, double damping, Separation separation) {
    if (separation == SEPARATION_ZERO_FORCE)
        return zero_force_given(m_e, stiffness, damping);
    const double w = sqrt(stiffness / m_e);
    const double Z = damping / m_e / (2 * w);
    const double root = sqrt((1 - Z) * (1 + Z));
    const bool is_oscillating = Z < 1;
    return (Identified){
        .effective_mass = m_e,
        .restitution = is_oscillating ? exp(-pi * Z / root) : 0,
        .contact_time = is_oscillating ? pi / (w * root) : (double)INFINITY,
        .stiffness = stiffness,
        .damping = damping,
        .damping_ratio = Z,
    };
}
