// The buffer at a stop, prepared for impacts, and the contact parameters of one impact, which are
// constant during the impact.
#ifndef CORE_CONTACT_CONTACT_PARAMETERS_H
#define CORE_CONTACT_CONTACT_PARAMETERS_H

#include <stddef.h>

#include "core/contact/contact.h"

// Measured values at one approach speed.
typedef struct ContactRow {
    double approach_speed; // [m/s]
    double restitution;    // e [-]
    double contact_time;   // T_c [s]; NAN if the form does not use it
} ContactRow;

typedef struct ContactRows {
    ContactRow *at;
    size_t count;
} ContactRows;

// Values of a buffer, NAN if not given. `rows` are borrowed, have strictly ascending approach
// speeds, and replace restitution and contact time.
typedef struct ContactNumbers {
    double restitution, contact_time;
    double stiffness, damping;
    double exponent;
    ContactRows rows;
} ContactNumbers;

typedef struct ContactStop {
    const ContactLaw *law;
    int separation; // Separation
    // m_e of the pair for which restitution and contact time hold; stiffness and damping identified
    // with it are used for any other pair [kg]
    double mass;
    ContactNumbers numbers;
    // Parameters of every impact, unless there are rows. Under CONTACT_POWER with a contact time
    // the stiffness depends on the approach speed.
    ContactParameters parameters;
    double duration; // of an isolated contact in its units, under CONTACT_POWER
} ContactStop;

// `law` must not be CONTACT_CHOSEN; `own_mass` is m_e of the pair in the scene [kg].
ContactStop contact_stop_prepare(const ContactLaw *law, int separation, double mass,
                                 double own_mass, const ContactNumbers *numbers);

// Linear interpolation in the approach speed; outside the rows the nearest row.
ContactRow contact_rows_interpolate(const ContactRows *rows, double approach_speed);

// Parameters of an impact with this approach speed [m/s]. Power laws divide by it and use at least
// CONTACT_SPEED_MIN.
ContactParameters contact_parameters_at(const ContactStop *stop, double approach_speed);

#define CONTACT_SPEED_MIN 1e-6 // [m/s]

#endif
