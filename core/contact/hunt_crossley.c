// Hunt and Crossley 1975: N = k p^n (1 + D p'/v0). hunt_crossley uses the D that gives exactly the
// restitution e, D (1 + e) = ln((1 + D) / (1 - e D)); hunt_crossley_textbook the first-order D of
// their paper, which gives a higher restitution.
#include "core/contact/power_law.h"

const ContactLaw contact_hunt_crossley = {
    .kind = {"hunt_crossley",
             "N = k p^n (1 + D p'/v0) with the D that gives exactly this restitution",
             contact_fields, sizeof(Contact)},
    .form = CONTACT_POWER,
    .restitution_min = POWER_LAW_RESTITUTION_MIN,
    .factor = power_law_factor,
    .restitution = power_law_restitution,
    .duration = power_law_duration,
    .force = power_law_force,
    .terms = power_law_terms,
};

static double hunt_crossley_textbook_factor(double e) {
    return 1.5 * (1 - e);
}

const ContactLaw contact_hunt_crossley_textbook = {
    .kind = {"hunt_crossley_textbook",
             "N = k p^n (1 + D p'/v0) with D = 1.5 (1 - e), which reaches more than e",
             contact_fields, sizeof(Contact)},
    .form = CONTACT_POWER,
    .factor = hunt_crossley_textbook_factor,
    .restitution = power_law_restitution,
    .duration = power_law_duration,
    .force = power_law_force,
    .terms = power_law_terms,
};
