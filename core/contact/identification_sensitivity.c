// With L = -ln(e), c_b = 2 m_e L / T_c under both rules, so that c_b to e is -1 / L = 1 / ln(e).
//
// Zero penetration: k_b = m_e (pi^2 + L^2) / T_c^2, so that k_b to e is -2 L / (pi^2 + L^2).
//
// Zero force: k_b = m_e h^2 / T_c^2 with L = Z h(Z) of identify.c, so that k_b to e is
// -2 h' / (h (h + Z h')), the slopes by Z: d ln(k_b) / dL is 2 h' / h over dL / dZ = h + Z h'.
// (1 - Z^2) h' = Z h - 2.
#include "core/contact/identification_sensitivity.h"

#include <math.h>

#include "core/contact/identification.h"

static const double pi = 3.14159265358979323846;

// h'(Z); near Z = 1 both sides of its equation vanish, and its series does.
static double phase_slope(double Z) {
    const double off = 1 - Z;
    if (fabs(off) < 1e-4)
        return -(2.0 / 3 + off * (8.0 / 15 + off * 12.0 / 35));
    return (Z * zero_force_phase(Z) - 2) / (off * (1 + Z));
}

Propagation propagate(double restitution, Separation separation) {
    const double L = -log(restitution);
    Propagation told = {.stiffness_by_contact_time = -2,
                        .damping_by_restitution = L > 0 ? -1 / L : (double)NAN,
                        .damping_by_contact_time = -1};
    if (separation == SEPARATION_ZERO_PENETRATION) {
        told.stiffness_by_restitution = -2 * L / (pi * pi + L * L);
        return told;
    }
    // The damping ratio is the same for every mass and contact time.
    const double Z = identify_measured(1, restitution, 1, separation).damping_ratio;
    const double h = zero_force_phase(Z), slope = phase_slope(Z);
    told.stiffness_by_restitution = -2 * slope / (h * (h + Z * slope));
    return told;
}
