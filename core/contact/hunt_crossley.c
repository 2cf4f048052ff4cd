// Hunt and Crossley 1975: N = k p^n (1 + D p'/v0), once with the D that gives exactly the
// restitution asked for, D (1 + e) = ln((1 + D) / (1 - e D)), and once with the first-order D of
// their paper, which gives a higher one.
#include "core/contact/power_law.h"

const ContactLaw contact_hunt_crossley = {
    .kind = {"hunt_crossley",
             "N = k p^n (1 + D p'/v0) with the D that gives exactly this restitution",
             contact_fields, sizeof(Contact)},
    .form = CONTACT_POWER,
    .least_restitution = POWER_LEAST_RESTITUTION,
    .factor = power_factor,
    .reached = power_reached,
    .duration = power_duration,
    .force = power_force,
    .terms = power_terms,
};

static double textbook_factor(double e) {
    return 1.5 * (1 - e);
}

const ContactLaw contact_hunt_crossley_textbook = {
    .kind = {"hunt_crossley_textbook",
             "N = k p^n (1 + D p'/v0) with D = 1.5 (1 - e), which reaches more than e",
             contact_fields, sizeof(Contact)},
    .form = CONTACT_POWER,
    .factor = textbook_factor,
    .reached = power_reached,
    .duration = power_duration,
    .force = power_force,
    .terms = power_terms,
};
