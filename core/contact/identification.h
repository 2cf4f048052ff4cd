// Identification: measured restitution e and contact time T_c to contact stiffness k_b and damping
// c_b, and back, for one isolated pair and constant k_b, c_b. Not the power laws (power.h). Used by
// freeze.c, plan/ and by whoever shows what a buffer means for a pair of masses.
#ifndef CORE_CONTACT_IDENTIFICATION_H
#define CORE_CONTACT_IDENTIFICATION_H

#include "core/contact/contact.h"

// Parameters of one contact between two bodies, SI units; what is not known is NAN.
typedef struct Identified {
    double effective_mass; // m_e = m1 m2 / (m1 + m2) [kg]
    double restitution;    // e [-]
    double contact_time;   // T_c [s]
    double stiffness;      // k_b = m_e (pi^2 + ln(e)^2) / T_c^2 under zero penetration [N/m]
    double damping;        // c_b = -2 m_e ln(e) / T_c [N s/m]
    double damping_ratio;  // Z = c_b / (2 sqrt(k_b m_e)) [-]
} Identified;

// m1 m2 / (m1 + m2) without overflow [kg].
double effective_mass(double mass1, double mass2);

// From e in (0, 1] and T_c > 0.
Identified identify_measured(double effective_mass, double restitution, double contact_time,
                             Separation separation);

// From k_b > 0 and c_b >= 0. Under zero penetration e = 0 and T_c = INFINITY where Z >= 1, for then
// p never comes back to 0.
Identified identify_given(double effective_mass, double stiffness, double damping,
                          Separation separation);

// w T_c of a contact with damping ratio Z >= 0 that ends at zero force; L = Z w T_c is -ln(e).
double zero_force_phase(double damping_ratio);

#endif
