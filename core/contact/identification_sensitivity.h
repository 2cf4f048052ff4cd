// How errors of e and T_c reach k_b and c_b: the relative change of the parameter over the relative
// error of the measurement, in closed form. Not the identification itself (identify.h). Used by the
// study sensitivity.
#ifndef CORE_CONTACT_IDENTIFICATION_SENSITIVITY_H
#define CORE_CONTACT_IDENTIFICATION_SENSITIVITY_H

#include "core/contact/contact.h"

// d ln(k_b) / d ln(e) and so on. Both are in proportion to m_e: 1 by it.
typedef struct Propagation {
    double stiffness_by_restitution;
    double stiffness_by_contact_time; // -2
    double damping_by_restitution;    // NAN at e = 1, where there is no damping
    double damping_by_contact_time;   // -1
} Propagation;

// At e in (0, 1].
Propagation propagate(double restitution, Separation separation);

#endif
