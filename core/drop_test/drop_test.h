// Raw data of a drop test: what fell on what, and what was read. It is never changed.
#ifndef CORE_DROP_TEST_DROP_TEST_H
#define CORE_DROP_TEST_DROP_TEST_H

#include "core/base/field.h"

enum { DROPS_MAX = 1000, TRACES_MAX = 100 };
enum { TRACE_SAMPLES_MAX = 1 << 20 }; // in all traces of a test

// Converts heights to speeds, whatever the gravity during contact [m/s^2].
#define STANDARD_GRAVITY 9.80665

// One impact as it was read: heights or speeds, a duration, or some of them. Unknown: NAN.
typedef struct Drop {
    double drop_height, rebound_height;   // of the impactor above the buffer at rest [m]
    double approach_speed, rebound_speed; // relative to the base, just before and after [m/s]
    double contact_time;                  // [s]
    char *excluded;                       // why it does not count; NULL: it counts
    char *note;
} Drop;
typedef struct Drops {
    Drop *at;
    size_t count;
} Drops;

// The record of a force transducer with one contact or several, evenly sampled.
typedef struct Trace {
    double interval;      // between samples [s]
    Reals force;          // [N]; either sign, any baseline
    Reals approach_speed; // of its contacts in order, as far as known [m/s]; may be empty
    char *excluded;       // why it does not count; NULL: it counts
    char *note;
} Trace;
typedef struct DropTest {
    char *impactor;       // "steel ball, 30 mm"
    double impactor_mass; // [kg]
    int base;             // MaterialBase; CHOICE_ABSENT: not stated
    double base_mass;     // of a free base [kg]
    char *geometry;       // of the buffer and the set-up
    double gravity;       // that presses the impactor into the buffer during contact; 0: none, NAN:
                          // not stated, and not corrected [m/s^2]
    double temperature;   // [degC]
    char *instrument, *date, *person, *source, *notes;
    // Standard uncertainty of one reading, from the instrument; NAN: unknown.
    double height_uncertainty; // [m]
    double speed_uncertainty;  // [m/s]
    double time_uncertainty;   // [s]
    Drops drops;
    struct {
        Trace *at;
        size_t count;
    } traces;
} DropTest;

extern const Field drop_test_fields[];

// Adds all faults below `pointer`, those of the fields and those between fields: no reading at all,
// a rebound above the drop, heights that contradict speeds, a wrong date, too many samples, a trace
// that cannot be read ... Excluded readings may contradict themselves. STATUS_OK or STATUS_INVALID.
Status drop_test_validate(const DropTest *test, const char *pointer, Problem *problem);

// Number of samples in all traces.
size_t drop_test_sample_count(const DropTest *test);

// Speeds relative to the base, as read, else from the heights; NAN: unknown [m/s]. A free base
// takes part of a rebound: heights then need both masses.
double drop_approach_speed(const Drop *drop);
double drop_rebound_speed(const DropTest *test, const Drop *drop);

// Effective mass of the test's pair; NAN: its masses are unknown [kg].
double drop_test_effective_mass(const DropTest *test);

#endif
