// Effect of gravity during contact on e and T_c of a drop, and its correction.
#ifndef CORE_DROP_TEST_GRAVITY_CORRECTION_H
#define CORE_DROP_TEST_GRAVITY_CORRECTION_H

#include "core/contact/contact.h"

// Gravity that presses the impactor into the buffer, and how the rebound was read.
typedef struct GravityLoad {
    double gravity; // [m/s^2]
    double speed;   // of approach [m/s]
    Separation separation;
    bool is_by_height; // the rebound speed is that above the buffer at rest, not at separation
} GravityLoad;

// e and T_c [s] with gravity; e is 0 and T_c INFINITY where the contact does not end.
typedef struct GravityContact {
    double restitution, contact_time;
} GravityContact;
GravityContact gravity_apply(const GravityLoad *load, double restitution, double contact_time);

// e and T_c [s] of the isolated pair from those that were read, with relative standard
// uncertainties, which may be NAN. False: no contact with 0 < e <= 1 has these readings.
typedef struct GravityCorrected {
    double restitution, contact_time;
    double restitution_uncertainty, contact_time_uncertainty; // relative
} GravityCorrected;
bool gravity_correct(const GravityLoad *load, const GravityCorrected *read,
                     GravityCorrected *isolated);

// T_c or e of the isolated pair from the reading of it and the isolated pair's value of the other.
bool gravity_correct_one(const GravityLoad *load, bool is_time, double read, double other,
                         double *isolated);

#endif
