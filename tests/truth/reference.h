// A second opinion on whole runs: the same equations in __float128, by a method that shares nothing
// with core/solve. Not a solver of the product and not fast. The same source also runs in plain
// double, to show what a double of that method misses: that says how much a scene amplifies
// rounding. Used by test_reference.c.
#ifndef TESTS_TRUTH_REFERENCE_H
#define TESTS_TRUTH_REFERENCE_H

#include <stdbool.h>
#include <stddef.h>

typedef enum ReferenceBase { REFERENCE_STILL, REFERENCE_SINE, REFERENCE_RECORD } ReferenceBase;

// Sides as in Side: [0] is the left stop.
typedef struct ReferenceScene {
    double mass, stiffness, damping; // of the structure
    double damper_mass, clearance, offset, position, relative_velocity;
    bool is_impulse;
    bool is_zero_force; // contacts end when the force does, not the penetration
    double restitution[2], contact_time[2];
    double displacement, velocity;
    ReferenceBase base;
    double frequency, amplitude; // REFERENCE_SINE [Hz], [m/s^2] or [m]
    bool is_amplitude_displacement;
    const double *samples; // REFERENCE_RECORD, borrowed [m/s^2]
    size_t sample_count;
    double interval; // [s]
    double duration, sample_rate;
} ReferenceScene;

// What is not known is NAN.
typedef struct ReferenceImpact {
    bool is_resting;
    int side;
    double start, end, approach, separation, peak, impulse, lost;
} ReferenceImpact;

enum {
    REFERENCE_DISPLACEMENT,
    REFERENCE_VELOCITY,
    REFERENCE_ACCELERATION,
    REFERENCE_MEAN_ACCELERATION,
    REFERENCE_DAMPER_DISPLACEMENT,
    REFERENCE_DAMPER_VELOCITY,
    REFERENCE_FORCE,
    REFERENCE_CHANNELS
};

typedef struct ReferenceAnswer {
    size_t count;                         // samples
    double *channels[REFERENCE_CHANNELS]; // each of `count`
    ReferenceImpact *impacts;
    size_t impact_count, impact_room;
    bool is_whole; // false: too much work, or memory ran out
    double steps;  // series made
} ReferenceAnswer;

// Both are cleared by reference_clear. A run of more than `most` steps ends unfinished. `stride`
// within (0, 1] is the longest sub-step as an angle of the fastest motion: other strides, other
// roundings.
void reference_quad(const ReferenceScene *scene, double stride, double most,
                    ReferenceAnswer *answer);
void reference_double(const ReferenceScene *scene, double stride, double most,
                      ReferenceAnswer *answer);
void reference_clear(ReferenceAnswer *answer);

#endif
