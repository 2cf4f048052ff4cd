// Hertz: N = k p^n with n = 1.5 for two spheres; elastic.
#include "core/contact/power_law.h"

const ContactLaw contact_hertz = {
    .kind = {"hertz", "an elastic contact, N = k p^n: restitution 1", contact_fields,
             sizeof(Contact)},
    .form = CONTACT_POWER,
    .restitution_min = 1,
    .restitution = power_law_restitution,
    .duration = power_law_duration,
    .force = power_law_force,
    .terms = power_law_terms,
};
