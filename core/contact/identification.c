// An isolated contact, y'' + 2 Z w y' + w^2 y = 0 with w = sqrt(k_b / m_e) and L = -ln(e). If it
// ends when y is back at 0 (eqs (8) and (9) of Li and Darby 2009, the latter with corrected sign):
//
//   w T_c = hypot(pi, L),  Z = L / hypot(pi, L)
//
// If it ends when the force k_b y + c_b y' is 0, h(Z) = w T_c and L = Z h(Z):
//
//   h = 2 arccos(Z) / sqrt(1 - Z^2)  or  2 arccosh(Z) / sqrt(Z^2 - 1)  or, at Z = 1,  2
//
// In both cases c_b = 2 m_e L / T_c. L is rising and concave in Z, so that Newton's method from
// below never passes the solution.
#include "core/contact/identification.h"

#include <float.h>
#include <math.h>
#include <stdbool.h>

static const double pi = 3.14159265358979323846;

double contact_effective_mass(double mass1, double mass2) {
    const double lighter = fmin(mass1, mass2), heavier = fmax(mass1, mass2);
    return lighter / (1 + lighter / heavier);
}

// In long double, because the relative error of e = exp(-Z h) is the absolute error of Z h. An
// angle over its sine: an error of a small root cancels.
static long double identification_phase(long double Z) {
    const long double root = sqrtl(fabsl(1 - Z)) * sqrtl(1 + Z);
    if (root == 0)
        return 2;
    return 2 * (Z < 1 ? atan2l(root, Z) : asinhl(root)) / root;
}

double identification_zero_force_phase(double damping_ratio) {
    return (double)identification_phase(damping_ratio);
}

// Z of L = Z h(Z).
static long double identification_zero_force_ratio(long double L) {
    // 2 <= h <= pi below Z = 1; above it L / 2 - 1 <= arccosh(Z).
    long double Z = L <= 2 ? L / (long double)pi : coshl(L / 2 - 1);
    for (int step = 0; step < 60; step++) {
        const long double h = identification_phase(Z), off = 1 - Z;
        const long double slope =
            fabsl(off) < 1e-3L ? 4.0L / 3 + 0.8L * off : (h - 2 * Z) / (off * (1 + Z));
        const long double rise = (L - Z * h) / slope;
        Z += rise;
        if (!(rise > 2 * LDBL_EPSILON * Z))
            break;
    }
    return Z;
}

static Identification identification_zero_force_measured(double m_e, double restitution,
                                                         double contact_time) {
    const long double L = fabsl(logl(restitution));
    const long double Z = identification_zero_force_ratio(L),
                      w = identification_phase(Z) / contact_time;
    return (Identification){
        .effective_mass = m_e,
        .restitution = restitution,
        .contact_time = contact_time,
        .stiffness = (double)(m_e * w * w),
        .damping = (double)(2 * m_e * L / contact_time),
        .damping_ratio = (double)Z,
    };
}

static Identification identification_zero_force_given(double m_e, double stiffness,
                                                      double damping) {
    const long double w = sqrtl((long double)stiffness / m_e);
    const long double Z = (long double)damping / m_e / (2 * w), h = identification_phase(Z);
    return (Identification){
        .effective_mass = m_e,
        .restitution = (double)expl(-Z * h),
        .contact_time = (double)(h / w),
        .stiffness = stiffness,
        .damping = damping,
        .damping_ratio = (double)Z,
    };
}

Identification identification_from_restitution(double m_e, double restitution, double contact_time,
                                               Separation separation) {
    if (separation == SEPARATION_ZERO_FORCE)
        return identification_zero_force_measured(m_e, restitution, contact_time);
    const double L = fabs(log(restitution));
    const double h = hypot(pi, L), w = h / contact_time;
    return (Identification){
        .effective_mass = m_e,
        .restitution = restitution,
        .contact_time = contact_time,
        .stiffness = m_e * w * w,
        .damping = 2 * m_e * L / contact_time,
        .damping_ratio = L / h,
    };
}

Identification identification_from_stiffness(double m_e, double stiffness, double damping,
                                             Separation separation) {
    if (separation == SEPARATION_ZERO_FORCE)
        return identification_zero_force_given(m_e, stiffness, damping);
    const double w = sqrt(stiffness / m_e);
    const double Z = damping / m_e / (2 * w);
    const double root = sqrt((1 - Z) * (1 + Z));
    const bool is_oscillating = Z < 1;
    return (Identification){
        .effective_mass = m_e,
        .restitution = is_oscillating ? exp(-pi * Z / root) : 0,
        .contact_time = is_oscillating ? pi / (w * root) : (double)INFINITY,
        .stiffness = stiffness,
        .damping = damping,
        .damping_ratio = Z,
    };
}

// Sensitivities with L = -ln(e). From c_b = 2 m_e L / T_c: d ln(c_b) / d ln(e) = -1 / L.
//
// Zero penetration: k_b = m_e (pi^2 + L^2) / T_c^2, hence d ln(k_b) / d ln(e) = -2 L / (pi^2 +
// L^2).
//
// Zero force: k_b = m_e h^2 / T_c^2 with L = Z h(Z). Hence d ln(k_b) / d ln(e) = -2 h' / (h (h + Z
// h')), where h' = dh / dZ and (1 - Z^2) h' = Z h - 2.

// h'(Z); near Z = 1 both sides of its equation vanish, and a series is used.
static double identification_phase_slope(double Z) {
    const double off = 1 - Z;
    if (fabs(off) < 1e-4)
        return -(2.0 / 3 + off * (8.0 / 15 + off * 12.0 / 35));
    return (Z * identification_zero_force_phase(Z) - 2) / (off * (1 + Z));
}

IdentificationSensitivity identification_sensitivity(double restitution, Separation separation) {
    const double L = -log(restitution);
    IdentificationSensitivity sensitivity = {.stiffness_by_contact_time = -2,
                                             .damping_by_restitution = L > 0 ? -1 / L : (double)NAN,
                                             .damping_by_contact_time = -1};
    if (separation == SEPARATION_ZERO_PENETRATION) {
        sensitivity.stiffness_by_restitution = -2 * L / (pi * pi + L * L);
        return sensitivity;
    }
    // The damping ratio does not depend on mass and contact time.
    const double Z = identification_from_restitution(1, restitution, 1, separation).damping_ratio;
    const double h = identification_zero_force_phase(Z), slope = identification_phase_slope(Z);
    sensitivity.stiffness_by_restitution = -2 * slope / (h * (h + Z * slope));
    return sensitivity;
}
