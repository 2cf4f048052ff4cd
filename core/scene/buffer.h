// The buffer at a stop: measured restitution e and contact time T_c, at one approach speed or
// several, or the parameters of its contact force.
#ifndef CORE_SCENE_BUFFER_H
#define CORE_SCENE_BUFFER_H

#include "core/base/field.h"
#include "core/contact/contact_parameters.h"

enum { BUFFER_ROWS = 1000 };

// The test in which the values of a resolved material were measured. NAN: unknown.
typedef struct BufferTest {
    double least_speed, most_speed; // range of measured approach speeds [m/s]
    double impactor_mass;           // [kg]
    double base_mass;               // INFINITY: a fixed base [kg]
    // Standard deviations relative to the values; for a table, the root mean square of its rows.
    double restitution_deviation, contact_time_deviation;
} BufferTest;

// Values that are not given are NAN. `material` alone is a name to be resolved; with values
// ("sponge@1") it is their source.
typedef struct Buffer {
    char *material;
    double restitution;  // e [-]
    double contact_time; // T_c [s]
    double stiffness;    // k_b [N/m], under a power law [N/m^n]
    double damping;      // c_b [N s/m]
    double exponent;     // n of a power law
    ContactRows table;   // e and T_c by strictly ascending approach speed
    BufferTest test;     // of a resolved material; not part of any document
} Buffer;

extern const Field buffer_fields[];

bool buffer_is_given(const Buffer *buffer);

// The values as contact parameters; the table is borrowed.
ContactNumbers buffer_numbers(const Buffer *buffer);

// Whether e or T_c is given, which are valid for one pair of masses.
bool buffer_is_measured(const Buffer *buffer);

// Whether a contact time, a stiffness or a damping is given.
bool buffer_has_contact_data(const Buffer *buffer);

bool buffer_equals(const Buffer *a, const Buffer *b);

// The approach speeds at which the values were measured: those of the material, or the ends of the
// table; NAN: unknown [m/s].
void buffer_speed_range(const Buffer *buffer, double *least, double *most);

// The effective mass of the pair in the test of the material; NAN: unknown [kg].
double buffer_test_mass(const Buffer *buffer);

// Moves `source` to `target` and makes it absent.
void buffer_move(Buffer *target, Buffer *source);

// Checks a given buffer under `law`, which must not be CONTACT_CHOSEN. Adds faults below `pointer`,
// not where there is one already.
Status buffer_validate(const Buffer *buffer, const ContactLaw *law, const char *pointer,
                       Problem *problem);

// Removes the values that the law does not use, and sets the default exponent.
void buffer_normalise(Buffer *buffer, const ContactLaw *law);

#endif
