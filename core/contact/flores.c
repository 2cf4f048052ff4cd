// Flores, Machado, Silva and Martins 2011: N = k p^n (1 + D p'/v0) with D = 8 (1 - e) / (5 e),
// valid for soft buffers as well.
#include "core/contact/power_law.h"

static double flores_factor(double e) {
    return 8 * (1 - e) / (5 * e);
}

const ContactLaw contact_flores = {
    .kind = {"flores", "N = k p^n (1 + D p'/v0) with D = 8 (1 - e) / (5 e), which reaches about e",
             contact_fields, sizeof(Contact)},
    .form = CONTACT_POWER,
    .restitution_min = POWER_LAW_RESTITUTION_MIN,
    .factor = flores_factor,
    .restitution = power_law_restitution,
    .duration = power_law_duration,
    .force = power_law_force,
    .terms = power_law_terms,
};
