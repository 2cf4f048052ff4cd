// A contact of an impactor that gravity pulls into the buffer meanwhile: how much longer it lasts
// and how much less comes back than of the isolated pair, and the way back from one to the other.
// Not the fit of a trace, which has a pull of its own (trace.h). Used by evaluation_*.c.
#ifndef CORE_DROP_TEST_GRAVITY_CORRECTION_H
#define CORE_DROP_TEST_GRAVITY_CORRECTION_H

#include "core/contact/contact.h"

// What pulls, and how the rebound was read.
typedef struct GravityLoad {
    double gravity; // [m/s^2]
    double speed;   // of approach [m/s]
    Separation separation;
    bool is_by_height; // the rebound's speed is that above the buffer at rest, not at parting
} GravityLoad;

// What e and T_c become; of a contact that does not part e is 0 and T_c infinite.
typedef struct GravityContact {
    double restitution, contact_time;
} GravityContact;
GravityContact gravity_apply(const GravityLoad *pull, double restitution, double contact_time);

// The isolated pair's e and T_c [s] of what was read, with their relative standard uncertainties,
// which may be NAN. False where no contact with 0 < e <= 1 comes to that.
typedef struct GravityCorrected {
    double restitution, contact_time;
    double restitution_uncertainty, contact_time_uncertainty; // relative
} GravityCorrected;
bool gravity_correct(const GravityLoad *pull, const GravityCorrected *read,
                     GravityCorrected *isolated);

// The same where one of the two is not read but known of the isolated pair.
bool gravity_correct_restitution(const GravityLoad *pull, double read, double contact_time,
                                 double *restitution);
bool gravity_correct_contact_time(const GravityLoad *pull, double read, double restitution,
                                  double *contact_time);

#endif
