// What ONE contact law is; contacts.c lists all. A law says what force two bodies feel in contact.
// The motion during contact is the solver's, the numbers of one impact are freeze.h's, the scene's
// rows are scene/buffer.h. Used by plan/, solve/ and by every walker of the scene's table.
#ifndef CORE_CONTACT_CONTACT_H
#define CORE_CONTACT_CONTACT_H

#include "core/base/field.h"

typedef enum ContactForm {
    CONTACT_CHOSEN,    // "auto": the planner picks another row
    CONTACT_IMPULSIVE, // instantaneous, u' -> -e u'
    CONTACT_LINEAR,    // N = k p + c p'
    CONTACT_POWER,     // N = k p^n with a damping of the law's own, never tensile
} ContactForm;

// When a linear contact ends. Zero penetration is the paper's rule (p back at 0, after a last
// stretch of tension), zero force that of a buffer that cannot pull. The other forms need no rule:
// a power law's force is never tensile and vanishes with p.
typedef enum Separation { SEPARATION_ZERO_PENETRATION, SEPARATION_ZERO_FORCE } Separation;
extern const char *const separation_names[];

// The scene's "contact" object.
typedef struct Contact {
    Variant variant; // kind is a ContactLaw's
    int separation;  // Separation; CHOICE_ABSENT where the law does not use it
} Contact;

// The numbers of one impact, which stay what they are until it ends.
typedef struct ContactParameters {
    double restitution; // e, under CONTACT_IMPULSIVE
    double stiffness;   // k [N/m], under CONTACT_POWER [N/m^n]
    double damping;     // c [N s/m], under CONTACT_LINEAR
    // Under CONTACT_POWER:
    double exponent; // n
    double factor;   // what the law makes of e: D or xi
    double speed;    // of approach, v0 [m/s]
    double mass;     // m_e [kg]
} ContactParameters;

// What is felt at one instant of contact under CONTACT_POWER.
typedef struct ContactForce {
    double value;          // N, at least 0 [N]
    double by_penetration; // dN/dp [N/m]
    double by_speed;       // dN/dp' [N s/m]
    double strain;         // energy that the buffer holds [J]
    double kink;           // changes its sign where N is not smooth
} ContactForce;

// What N is made of under CONTACT_POWER: k p^n + viscous p^viscous_exponent p' while p' > turn, and
// else k p^n or nothing.
typedef struct ContactTerms {
    double stiffness, exponent;       // k [N/m^n], n
    double viscous, viscous_exponent; // 0: no damping
    double turn;                      // [m/s]
    bool is_elastic_below;            // k p^n there, else nothing
} ContactTerms;

typedef struct ContactLaw {
    Kind kind;
    ContactForm form;
    // Under CONTACT_POWER. An isolated contact is meant in units of
    // P = (m_e v0^2 / k)^(1 / (n + 1)) and P / v0: there k, m_e and v0 are 1.
    double least_restitution;                           // asked for, at which factor() is sound
    double (*factor)(double restitution);               // NULL: conserves energy
    double (*reached)(double factor, double exponent);  // the restitution it really has
    double (*duration)(double factor, double exponent); // of the contact
    ContactForce (*force)(const ContactParameters *parameters, double p, double speed);
    ContactTerms (*terms)(const ContactParameters *parameters);
} ContactLaw;

extern const ContactLaw *const contacts[]; // NULL-terminated; "auto" first
extern const KindTable contact_kinds;
extern const Field contact_fields[]; // the rows that every law has
extern const ContactLaw contact_auto, contact_impulse, contact_spring_damper, contact_hertz,
    contact_hunt_crossley, contact_hunt_crossley_textbook, contact_lankarani_nikravesh,
    contact_flores, contact_jankowski;

static inline const ContactLaw *contact_law(const Contact *contact) {
    return (const ContactLaw *)(const void *)contact->variant.kind;
}

#endif
