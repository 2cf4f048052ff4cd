// What stands at a stop: e and T_c as measured, or k_b and c_b as known.
// Not what it comes to for a pair of masses (contact/identify.h), nor a material of the store.
// Used by damper.h and by whoever resolves materials.
#ifndef CORE_SCENE_BUFFER_H
#define CORE_SCENE_BUFFER_H

#include "core/base/field.h"
#include "core/contact/contact.h"

// What is not given is NAN. `material` alone is a name yet to be resolved; beside numbers
// ("sponge@1") it says where they come from.
typedef struct Buffer {
    char *material;
    double restitution;  // e [-]
    double contact_time; // T_c [s]
    double stiffness;    // k_b [N/m]
    double damping;      // c_b [N s/m]
} Buffer;

extern const Field buffer_fields[];

bool buffer_is_given(const Buffer *buffer);

// Whether anything is said of how a contact goes on: a contact time, a stiffness or a damping.
bool buffer_has_contact(const Buffer *buffer);

bool buffer_equals(const Buffer *a, const Buffer *b);

// Moves `source` into `target` and leaves it absent.
void buffer_move(Buffer *target, Buffer *source);

// Judges a given buffer under a form of contact, below `pointer`; silent where there is a fault
// already.
Status buffer_check(const Buffer *buffer, ContactForm form, const char *pointer, Problem *problem);

// Makes contact time, stiffness and damping absent.
void buffer_erase_contact(Buffer *buffer);

#endif
