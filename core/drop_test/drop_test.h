// A drop test as it was done: what fell on what, and what was read. Raw data, never changed. Not
// what follows from it (evaluation.h), nor the contacts in a force trace (trace.h). Used by
// measure/ and by whoever stores tests.
#ifndef CORE_DROP_TEST_DROP_TEST_H
#define CORE_DROP_TEST_DROP_TEST_H

#include "core/base/field.h"

enum { DROPS_MAX = 1000, TRACES_MAX = 100 };
enum { TRACE_SAMPLES_MAX = 1 << 20 }; // in all traces of a test

// By which a height is worth a speed, whatever pulls during contact [m/s^2].
#define STANDARD_GRAVITY 9.80665

// One impact as it was read: heights or speeds, a duration, or some of them. Not known: NAN.
typedef struct Drop {
    double drop_height, rebound_height;   // of the impactor above the buffer at rest [m]
    double approach_speed, rebound_speed; // relative to the base, just before and after [m/s]
    double contact_time;                  // [s]
    char *excluded;                       // why it is not to count; NULL: it counts
    char *note;
} Drop;
typedef struct Drops {
    Drop *at;
    size_t count;
} Drops;

// A force transducer's record with one contact or several, evenly sampled.
typedef struct Trace {
    double interval;      // between samples [s]
    Reals force;          // [N]; either sign, any baseline
    Reals approach_speed; // of its contacts in order, as far as known [m/s]; may be empty
    char *excluded;       // why it is not to count; NULL: it counts
    char *note;
} Trace;
typedef struct Traces {
    Trace *at;
    size_t count;
} Traces;

typedef struct DropTest {
    char *impactor;       // "steel ball, 30 mm"
    double impactor_mass; // [kg]
    int base;             // MaterialBase; CHOICE_ABSENT: nobody says
    double base_mass;     // of a free base [kg]
    char *geometry;       // of the buffer and the set-up
    double gravity;       // that pulls the impactor into the buffer during contact; 0: none, NAN:
                          // nobody says, and then it is not taken out [m/s^2]
    double temperature;   // [degC]
    char *instrument, *date, *person, *source, *notes;
    // Standard uncertainty of one reading, from the instrument; NAN: not known.
    double height_uncertainty; // [m]
    double speed_uncertainty;  // [m/s]
    double time_uncertainty;   // [s]
    Drops drops;
    Traces traces;
} DropTest;

extern const Field drop_test_fields[];

// All faults that rows cannot see, and the rows', below `pointer`: no reading at all, a rebound
// above the drop, heights beside speeds that they contradict, a date that is none, more samples
// than a test may have, a trace that cannot be read ... What is excluded may contradict itself or
// be unreadable: that may be why.
Status drop_test_validate(const DropTest *test, const char *pointer, Problem *problem);

// In all traces.
size_t drop_test_sample_count(const DropTest *test);

// What a drop says of its speeds [m/s]: as read, else by its heights; relative to the base. NAN
// where nothing tells. A free base takes part of a rebound: heights then need both masses.
double drop_approach_speed(const Drop *drop);
double drop_rebound_speed(const DropTest *test, const Drop *drop);

// Of the test's pair; NAN where its masses are not known [kg].
double drop_test_effective_mass(const DropTest *test);

#endif
