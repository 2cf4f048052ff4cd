// Identification of contact stiffness k_b and damping c_b from measured restitution e and contact
// time T_c, and the reverse, for an isolated pair and a linear contact.
#ifndef CORE_CONTACT_IDENTIFICATION_H
#define CORE_CONTACT_IDENTIFICATION_H

#include "core/contact/contact.h"

// Parameters of one contact between two bodies; NAN if unknown.
typedef struct Identification {
    double effective_mass; // m_e = m1 m2 / (m1 + m2) [kg]
    double restitution;    // e [-]
    double contact_time;   // T_c [s]
    double stiffness;      // k_b = m_e (pi^2 + ln(e)^2) / T_c^2 under zero penetration [N/m]
    double damping;        // c_b = -2 m_e ln(e) / T_c [N s/m]
    double damping_ratio;  // Z = c_b / (2 sqrt(k_b m_e)) [-]
} Identification;

// The effective mass m1 m2 / (m1 + m2) without overflow [kg].
double contact_effective_mass(double mass1, double mass2);

// From e in (0, 1] and T_c > 0.
Identification identification_from_restitution(double effective_mass, double restitution,
                                               double contact_time, Separation separation);

// From k_b > 0 and c_b >= 0. Under zero penetration p never returns to 0 if Z >= 1: then e = 0 and
// T_c = INFINITY.
Identification identification_from_stiffness(double effective_mass, double stiffness,
                                             double damping, Separation separation);

// w T_c of a contact with damping ratio Z >= 0 that ends at zero force; -ln(e) = Z w T_c.
double identification_zero_force_phase(double damping_ratio);

// Relative change of k_b and c_b over the relative error of e and T_c: d ln(k_b) / d ln(e) etc.
// Both are proportional to m_e.
typedef struct IdentificationSensitivity {
    double stiffness_by_restitution;
    double stiffness_by_contact_time; // -2
    double damping_by_restitution;    // NAN at e = 1, where c_b = 0
    double damping_by_contact_time;   // -1
} IdentificationSensitivity;

// In closed form, at e in (0, 1].
IdentificationSensitivity identification_sensitivity(double restitution, Separation separation);

#endif
