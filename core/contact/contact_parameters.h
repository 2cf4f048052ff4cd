// A buffer made ready for impacts, and the parameters of one of them: frozen at the approach speed
// with which it began. Not the buffer as the user gives it (scene/buffer.h). Used by plan/ and by
// solve/ at every touch.
#ifndef CORE_CONTACT_CONTACT_PARAMETERS_H
#define CORE_CONTACT_CONTACT_PARAMETERS_H

#include <stddef.h>

#include "core/contact/contact.h"

// What was measured at one approach speed.
typedef struct ContactRow {
    double approach_speed; // [m/s]
    double restitution;    // e [-]
    double contact_time;   // T_c [s]; NAN where the form does not use it
} ContactRow;

typedef struct ContactRows {
    ContactRow *at;
    size_t count;
} ContactRows;

// What a buffer says; NAN where it does not. `rows`, by strictly rising approach speed, are
// borrowed and stand in place of restitution and contact time.
typedef struct ContactNumbers {
    double restitution, contact_time;
    double stiffness, damping;
    double exponent;
    ContactRows rows;
} ContactNumbers;

typedef struct ContactStop {
    const ContactLaw *law;
    int separation; // Separation
    // m_e of the pair for which restitution and contact time hold; what they come to there is
    // carried over to any other pair [kg]
    double mass;
    ContactNumbers numbers;
    // The same for every impact, unless there are rows; under CONTACT_POWER and a contact time but
    // for the stiffness.
    ContactParameters parameters;
    double duration; // of an isolated contact in its own units, under CONTACT_POWER
} ContactStop;

// `law` is none that is CONTACT_CHOSEN; `own_mass` is m_e of the pair that meets.
ContactStop contact_prepare(const ContactLaw *law, int separation, double mass, double own_mass,
                            const ContactNumbers *numbers);

// Between the rows linear in the approach speed, beyond them the nearest row's.
ContactRow contact_row(const ContactRows *rows, double approach_speed);

// Parameters of an impact that begins with this approach speed. Power laws, which divide by it,
// take no less than CONTACT_SPEED_MIN.
ContactParameters contact_freeze(const ContactStop *stop, double approach_speed);

#define CONTACT_SPEED_MIN 1e-6 // [m/s]

#endif
