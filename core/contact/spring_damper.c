// Spring and damper in parallel while the buffer is penetrated: N = k p + c p' (Li and Darby 2009).
#include "core/contact/contact.h"

const ContactLaw contact_spring_damper = {
    .kind = {"spring_damper", "a linear spring and damper for the time of contact", contact_fields,
             sizeof(Contact)},
    .form = CONTACT_LINEAR,
};
