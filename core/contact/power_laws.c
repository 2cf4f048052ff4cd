// Power laws N = k p^n (1 + D p'/v0) that differ in D as a function of the restitution e.
#include "core/contact/power_law.h"

#define POWER_LAW(name_, doc_, restitution_min_, factor_)                                          \
    {                                                                                              \
        .kind = {name_, doc_, contact_fields, sizeof(Contact)}, .form = CONTACT_POWER,             \
        .restitution_min = restitution_min_, .factor = factor_,                                    \
        .restitution = power_law_restitution, .duration = power_law_duration,                      \
        .force = power_law_force, .terms = power_law_terms,                                        \
    }

// With n = 1.5 for two spheres.
const ContactLaw contact_hertz =
    POWER_LAW("hertz", "an elastic contact, N = k p^n: restitution 1", 1, NULL);

// Hunt and Crossley 1975, with the D that gives exactly the restitution e,
// D (1 + e) = ln((1 + D) / (1 - e D)), and with the first-order D of their paper.
const ContactLaw contact_hunt_crossley = POWER_LAW(
    "hunt_crossley", "N = k p^n (1 + D p'/v0) with the D that gives exactly this restitution",
    POWER_LAW_RESTITUTION_MIN, power_law_factor);

static double hunt_crossley_textbook_factor(double e) {
    return 1.5 * (1 - e);
}

const ContactLaw contact_hunt_crossley_textbook =
    POWER_LAW("hunt_crossley_textbook",
              "N = k p^n (1 + D p'/v0) with D = 1.5 (1 - e), which reaches more than e", 0,
              hunt_crossley_textbook_factor);

// Lankarani and Nikravesh 1990, from the energy loss of a nearly elastic impact.
static double lankarani_nikravesh_factor(double e) {
    return 0.75 * (1 - e) * (1 + e);
}

const ContactLaw contact_lankarani_nikravesh =
    POWER_LAW("lankarani_nikravesh",
              "N = k p^n (1 + D p'/v0) with D = 0.75 (1 - e^2), which reaches more than e", 0,
              lankarani_nikravesh_factor);

// Flores, Machado, Silva and Martins 2011, valid for soft buffers as well.
static double flores_factor(double e) {
    return 8 * (1 - e) / (5 * e);
}

const ContactLaw contact_flores =
    POWER_LAW("flores", "N = k p^n (1 + D p'/v0) with D = 8 (1 - e) / (5 e), which reaches about e",
              POWER_LAW_RESTITUTION_MIN, flores_factor);
