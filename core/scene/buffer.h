// What stands at a stop: e and T_c as measured, once or over approach speed, or what is known of
// its force. Not what it comes to for a pair of masses (contact/identify.h), nor a material of the
// store. Used by damper.h and by whoever resolves materials.
#ifndef CORE_SCENE_BUFFER_H
#define CORE_SCENE_BUFFER_H

#include "core/base/field.h"
#include "core/contact/contact_parameters.h"

enum { BUFFER_ROWS = 1000 };

// What is known of the test behind a material's numbers: what of them may be said in a scene. NAN:
// not known.
typedef struct BufferTest {
    double least_speed, most_speed; // approach speeds that were measured [m/s]
    double impactor_mass;           // [kg]
    double base_mass;               // INFINITY: a fixed base [kg]
    // Standard deviations over their values; of a table the root mean square of its rows'.
    double restitution_deviation, contact_time_deviation;
} BufferTest;

// What is not given is NAN. `material` alone is a name yet to be resolved; beside numbers
// ("sponge@1") it says where they come from.
typedef struct Buffer {
    char *material;
    double restitution;  // e [-]
    double contact_time; // T_c [s]
    double stiffness;    // k_b [N/m], under a power law [N/m^n]
    double damping;      // c_b [N s/m]
    double exponent;     // n of a power law
    ContactRows table;   // e and T_c by strictly rising approach speed
    BufferTest test;     // of a resolved material; in no document: the revision stands for it
} Buffer;

extern const Field buffer_fields[];

bool buffer_is_given(const Buffer *buffer);

// The numbers as contact/ takes them; the table is borrowed.
ContactNumbers buffer_numbers(const Buffer *buffer);

// Whether e and T_c are given, which hold for one pair of masses.
bool buffer_is_measured(const Buffer *buffer);

// Whether anything is said of how a contact goes on: a contact time, a stiffness or a damping.
bool buffer_has_contact(const Buffer *buffer);

bool buffer_equals(const Buffer *a, const Buffer *b);

// The approach speeds for which its numbers were measured: those of its material, or its table's
// ends; NAN: not known [m/s].
void buffer_speeds(const Buffer *buffer, double *least, double *most);

// The effective mass of the pair that its material was tested with; NAN: not known [kg].
double buffer_test_mass(const Buffer *buffer);

// Moves `source` into `target` and leaves it absent.
void buffer_move(Buffer *target, Buffer *source);

// Judges a given buffer under a law that is none to be chosen, below `pointer`; silent where there
// is a fault already.
Status buffer_check(const Buffer *buffer, const ContactLaw *law, const char *pointer,
                    Problem *problem);

// Erases what the law does not use and fills the exponent where it uses one.
void buffer_normalise(Buffer *buffer, const ContactLaw *law);

#endif
