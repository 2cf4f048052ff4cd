// Identification: measured restitution e and contact time T_c to contact stiffness k_b and damping
// c_b, and back. Li and Darby 2009, eqs (8)-(10), with the printed sign of eq. (9) mended. One
// isolated pair, constant k_b, c_b. Used by plan/ and by whoever shows what a buffer means for a
// pair of masses.
#ifndef CORE_CONTACT_IDENTIFY_H
#define CORE_CONTACT_IDENTIFY_H

// Parameters of one contact between two bodies, SI units; what is not known is NAN.
typedef struct Identified {
    double effective_mass; // m_e = m1 m2 / (m1 + m2) [kg]
    double restitution;    // e [-]
    double contact_time;   // T_c [s]
    double stiffness;      // k_b = m_e (pi^2 + ln(e)^2) / T_c^2 [N/m]
    double damping;        // c_b = -2 m_e ln(e) / T_c [N s/m]
    double damping_ratio;  // Z = c_b / (2 sqrt(k_b m_e)) [-]
} Identified;

// m1 m2 / (m1 + m2) without overflow [kg].
double effective_mass(double mass1, double mass2);

// From e in (0, 1] and T_c > 0, zero-penetration separation.
Identified identify_measured(double effective_mass, double restitution, double contact_time);

// From k_b > 0 and c_b >= 0; e = 0 and T_c = INFINITY where Z >= 1, for then p never comes back to
// 0.
Identified identify_given(double effective_mass, double stiffness, double damping);

#endif
