// Lankarani and Nikravesh 1990: N = k p^n (1 + D p'/v0) with D = (3/4) (1 - e^2), from the energy
// that a nearly elastic impact loses.
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
    .reached = power_reached,
    .duration = power_duration,
    .force = power_force,
    .terms = power_terms,
};
