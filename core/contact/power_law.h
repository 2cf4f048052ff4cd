// Functions that the power laws share: N = k p^n (1 + D p'/v0), the form of Hunt and Crossley, with
// D constant during an impact. Most of these laws differ only in D(e).
#ifndef CORE_CONTACT_POWER_LAW_H
#define CORE_CONTACT_POWER_LAW_H

#include <math.h>

#include "core/contact/contact.h"

#define POWER_LAW_EXPONENT 1.5 // of a Hertzian contact; the default
#define POWER_LAW_RESTITUTION_MIN 1e-3

// The D that gives an isolated contact the restitution e in [POWER_LAW_RESTITUTION_MIN, 1].
double power_law_factor(double restitution);

// Members of a ContactLaw with N = k p^n (1 + D p'/v0).
double power_law_restitution(double factor, double exponent);
double power_law_duration(double factor, double exponent);
ContactForce power_law_force(const ContactParameters *parameters, double p, double speed);
ContactTerms power_law_terms(const ContactParameters *parameters);

// p^n, faster for common exponents.
static inline double power_law_pow(double p, double n) {
    return n == POWER_LAW_EXPONENT ? p * sqrt(p) : n == 1 ? p : n == 2 ? p * p : pow(p, n);
}

#endif
