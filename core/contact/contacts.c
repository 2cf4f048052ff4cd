// All contact laws, the default first.
#include "core/contact/contact.h"

const ContactLaw contact_auto = {
    .kind = {"auto", "spring_damper wherever a contact time or k, c is known, else impulse",
             contact_fields, sizeof(Contact)},
    .form = CONTACT_CHOSEN,
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
