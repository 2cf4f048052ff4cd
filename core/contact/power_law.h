// What the power laws share: N = k p^n (1 + D p'/v0) with D fixed for one impact (Hunt and
// Crossley's form), of which most differ in D(e) alone. Not a law itself. Used by the laws' files.
#ifndef CORE_CONTACT_POWER_LAW_H
#define CORE_CONTACT_POWER_LAW_H

#include <math.h>

#include "core/contact/contact.h"

#define POWER_EXPONENT 1.5 // of Hertz's contact, where none is given
#define POWER_LEAST_RESTITUTION 1e-3

// The D at which an isolated contact ends with restitution e in [POWER_LEAST_RESTITUTION, 1].
double power_factor(double restitution);

// Hooks of a ContactLaw with N = k p^n (1 + D p'/v0).
double power_reached(double factor, double exponent);
double power_duration(double factor, double exponent);
ContactForce power_force(const ContactParameters *parameters, double p, double speed);
ContactTerms power_terms(const ContactParameters *parameters);

// p^n, sooner where n is one of the usual exponents.
static inline double power_of(double p, double n) {
    return n == POWER_EXPONENT ? p * sqrt(p) : n == 1 ? p : n == 2 ? p * p : pow(p, n);
}

#endif
