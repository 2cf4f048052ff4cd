// All contact laws, the default first, and the laws that need no functions.
#include "core/contact/contact.h"

const ContactLaw contact_auto = {
    .kind = {"auto", "spring_damper wherever a contact time or k, c is known, else impulse",
             contact_fields, sizeof(Contact)},
    .form = CONTACT_CHOSEN,
};

// Impulse-momentum contact: instantaneous, u' -> -e u', momentum conserved.
const ContactLaw contact_impulse = {
    .kind = {"impulse", "instantaneous: the relative velocity turns round, times the restitution",
             contact_fields, sizeof(Contact)},
    .form = CONTACT_IMPULSIVE,
};

// Spring and damper in parallel while the buffer is penetrated: N = k p + c p' (Li and Darby 2009).
const ContactLaw contact_spring_damper = {
    .kind = {"spring_damper", "a linear spring and damper for the time of contact", contact_fields,
             sizeof(Contact)},
    .form = CONTACT_LINEAR,
};

const ContactLaw *const contacts[] = {
    &contact_auto,
    &contact_impulse,
    &contact_spring_damper,
    &contact_hertz,
    &contact_hunt_crossley,
    &contact_hunt_crossley_textbook,
    &contact_lankarani_nikravesh,
    &contact_flores,
    &contact_jankowski,
    NULL,
};

static const Kind *contacts_at(size_t index) {
    return index < COUNT(contacts) - 1 ? &contacts[index]->kind : NULL;
}

const KindTable contact_kinds = {"model", contacts_at, false};
