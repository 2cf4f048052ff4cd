// Hertz: N = k p^n with n = 1.5 for two spheres, which gives all energy back.
#include "core/contact/power_law.h"

const ContactLaw contact_hertz = {
    .kind = {"hertz", "an elastic contact, N = k p^n: restitution 1", contact_fields,
             sizeof(Contact)},
    .form = CONTACT_POWER,
    .least_restitution = 1,
    .reached = power_reached,
    .duration = power_duration,
    .force = power_force,
    .terms = power_terms,
};
