// Flores, Machado, Silva and Martins 2011: N = k p^n (1 + D p'/v0) with D = 8 (1 - e) / (5 e), made
// for soft buffers too.
#include "core/contact/power_law.h"

static double flores_factor(double e) {
    return 8 * (1 - e) / (5 * e);
}

const ContactLaw contact_flores = {
    .kind = {"flores", "N = k p^n (1 + D p'/v0) with D = 8 (1 - e) / (5 e), which reaches about e",
             contact_fields, sizeof(Contact)},
    .form = CONTACT_POWER,
    .least_restitution = POWER_LEAST_RESTITUTION,
    .factor = flores_factor,
    .reached = power_reached,
    .duration = power_duration,
    .force = power_force,
    .terms = power_terms,
};
