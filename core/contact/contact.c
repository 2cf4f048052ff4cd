// The members and names that all contact laws share.
#include "core/contact/contact.h"

const char *const separation_names[] = {[SEPARATION_ZERO_PENETRATION] = "zero_penetration",
                                        [SEPARATION_ZERO_FORCE] = "zero_force",
                                        NULL};

// clang-format off
const Field contact_fields[] = {
    FIELD_CHOICE(Contact, separation, separation_names, SEPARATION_ZERO_PENETRATION, "when a contact ends"),
    FIELD_END
};
// clang-format on
