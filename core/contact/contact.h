// What ONE contact law is; contacts.c lists all. A law says how a buffer's numbers become contact
// parameters. The motion during contact is the solver's; the scene's rows are scene/buffer.h. Used
// by plan/ and by every walker of the scene's table.
#ifndef CORE_CONTACT_CONTACT_H
#define CORE_CONTACT_CONTACT_H

#include "core/base/field.h"

typedef enum ContactForm {
    CONTACT_CHOSEN,    // "auto": the planner picks another row
    CONTACT_IMPULSIVE, // instantaneous, u' -> -e u'
    CONTACT_LINEAR,    // N = k p + c p'
} ContactForm;

// When a contact ends. Zero penetration is the paper's rule (p back at 0); zero force ends it before
// N would pull.
typedef enum Separation { SEPARATION_ZERO_PENETRATION, SEPARATION_ZERO_FORCE } Separation;
extern const char *const separation_names[];

// The scene's "contact" object.
typedef struct Contact {
    Variant variant; // kind is a ContactLaw's
    int separation;  // Separation; CHOICE_ABSENT where the law does not use it
} Contact;

typedef struct ContactLaw {
    Kind kind;
    ContactForm form;
} ContactLaw;

extern const ContactLaw *const contacts[]; // NULL-terminated; "auto" first
extern const KindTable contact_kinds;
extern const Field contact_fields[]; // the rows that every law has
extern const ContactLaw contact_auto, contact_impulse, contact_spring_damper;

static inline const ContactLaw *contact_law(const Contact *contact) {
    return (const ContactLaw *)(const void *)contact->variant.kind;
}

#endif
