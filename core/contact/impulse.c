// Impulse-momentum contact: instantaneous, u' -> -e u', momentum conserved.
#include "core/contact/contact.h"

const ContactLaw contact_impulse = {
    .kind = {"impulse", "instantaneous: the relative velocity turns round, times the restitution",
             contact_fields, sizeof(Contact)},
    .form = CONTACT_IMPULSIVE,
};
