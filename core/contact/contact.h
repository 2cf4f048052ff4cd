// One contact law: the force between two bodies in contact. contacts.c lists all laws.
#ifndef CORE_CONTACT_CONTACT_H
#define CORE_CONTACT_CONTACT_H

#include "core/base/field.h"

typedef enum ContactForm {
    CONTACT_CHOSEN,    // "auto": the planner chooses another law
    CONTACT_IMPULSIVE, // instantaneous, u' -> -e u'
    CONTACT_LINEAR,    // N = k p + c p'
    CONTACT_POWER,     // N = k p^n with the law's own damping, never tensile
} ContactForm;

// When a linear contact ends. Zero penetration is the rule of Li and Darby 2009: p is back at 0,
// after a short time of tension. Zero force is the rule of a buffer that cannot pull. The other
// forms need no rule: the force of a power law is never tensile and vanishes with p.
typedef enum Separation { SEPARATION_ZERO_PENETRATION, SEPARATION_ZERO_FORCE } Separation;
extern const char *const separation_names[];

// The scene's "contact" object.
typedef struct Contact {
    Variant variant; // its kind is that of a ContactLaw
    int separation;  // Separation; CHOICE_ABSENT if the law does not use it
} Contact;

// Parameters of one impact, constant until it ends.
typedef struct ContactParameters {
    double restitution; // e, under CONTACT_IMPULSIVE
    double stiffness;   // k [N/m], under CONTACT_POWER [N/m^n]
    double damping;     // c [N s/m], under CONTACT_LINEAR
    // Only under CONTACT_POWER:
    double exponent; // n
    double factor;   // damping factor D or xi of the law
    double speed;    // approach speed v0 [m/s]
    double mass;     // effective mass m_e [kg]
} ContactParameters;

// The force at one instant of a contact under CONTACT_POWER.
typedef struct ContactForce {
    double value;          // N, at least 0 [N]
    double by_penetration; // dN/dp [N/m]
    double by_speed;       // dN/dp' [N s/m]
    double strain;         // elastic energy of the buffer [J]
    double kink;           // changes sign where N is not smooth
} ContactForce;

// The terms of N under CONTACT_POWER: k p^n + viscous p^viscous_exponent p' while p' > turn;
// otherwise k p^n or nothing.
typedef struct ContactTerms {
    double stiffness, exponent;       // k [N/m^n], n
    double viscous, viscous_exponent; // 0: no damping
    double turn;                      // [m/s]
    bool is_elastic_below;            // N = k p^n for p' <= turn, else nothing
} ContactTerms;

typedef struct ContactLaw {
    Kind kind;
    ContactForm form;
    // Only under CONTACT_POWER. An isolated contact is in units of P = (m_e v0^2 / k)^(1 / (n + 1))
    // and P / v0, in which k, m_e and v0 are 1.
    double restitution_min;                                // smallest input of factor()
    double (*factor)(double restitution);                  // NULL: conserves energy
    double (*restitution)(double factor, double exponent); // of the contact with this factor
    double (*duration)(double factor, double exponent);    // of the contact
    ContactForce (*force)(const ContactParameters *parameters, double p, double speed);
    ContactTerms (*terms)(const ContactParameters *parameters);
} ContactLaw;

extern const ContactLaw *const contacts[]; // NULL-terminated; "auto" first
extern const KindTable contact_kinds;
extern const Field contact_fields[]; // the rows of every law
extern const ContactLaw contact_auto, contact_impulse, contact_spring_damper, contact_hertz,
    contact_hunt_crossley, contact_hunt_crossley_textbook, contact_lankarani_nikravesh,
    contact_flores, contact_jankowski;

static inline const ContactLaw *contact_law(const Contact *contact) {
    return (const ContactLaw *)(const void *)contact->variant.kind;
}

#endif
