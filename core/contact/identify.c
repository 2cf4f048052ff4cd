// One isolated contact, y'' + 2 Z w y' + w^2 y = 0 with w = sqrt(k_b / m_e), ends when y is back at
// 0: w T_c sqrt(1 - Z^2) = pi and e = exp(-pi Z / sqrt(1 - Z^2)). Solved for k_b and c_b these are
// eqs (8) and (9) of Li and Darby 2009, the latter with its sign mended. With L = -ln(e):
//
//   w = hypot(pi, L) / T_c,  Z = L / hypot(pi, L)
#include "core/contact/identify.h"

#include <math.h>
#include <stdbool.h>

static const double pi = 3.14159265358979323846;

double effective_mass(double mass1, double mass2) {
    const double lighter = fmin(mass1, mass2), heavier = fmax(mass1, mass2);
    return lighter / (1 + lighter / heavier);
}

Identified identify_measured(double m_e, double restitution, double contact_time) {
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

Identified identify_given(double m_e, double stiffness, double damping) {
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
