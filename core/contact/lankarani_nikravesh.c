// Lankarani and Nikravesh 1990: N = k p^n (1 + D p'/v0) with D = (3/4) (1 - e^2), derived from the
// energy loss of a nearly elastic impact.
#include "core/contact/power_law.h"

static double lankarani_nikravesh_factor(double e) {
    return 0.75 * (1 - e) * (1 + e);
}

const ContactLaw contact_lankarani_nikravesh = {
    .kind = {"lankarani_nikravesh",
             "N = k p^n (1 + D p'/v0) with D = 0.75 (1 - e^2), which reaches more than e",
             contact_fields, sizeof(Contact)},
    .form = CONTACT_POWER,
    .factor = lankarani_nikravesh_factor,
    .restitution = power_law_restitution,
    .duration = power_law_duration,
    .force = power_law_force,
    .terms = power_law_terms,
};
