// The base's acceleration a_g(t) as a solver meets it: still, linear between samples, a sine, or a
// few pieces; exact in each form. Not an excitation: how the samples came about is the excitation's
// business. Used by excite/, solve/ and simulation/.
#ifndef CORE_EXCITATION_BASE_MOTION_H
#define CORE_EXCITATION_BASE_MOTION_H

#include <stddef.h>

typedef enum BaseForm { BASE_STILL, BASE_SAMPLED, BASE_SINE, BASE_PIECES } BaseForm;

enum { BASE_PIECES_MAX = 4 };

// From `time` on, t seconds later: value + slope t or, where the base has an omega, value cos(omega
// t) + slope sin(omega t).
typedef struct BasePiece {
    double time;         // [s]
    double value, slope; // [m/s^2], [m/s^3] or [m/s^2]
} BasePiece;

// All zero is a still base.
typedef struct Base {
    BaseForm form;
    double
        *values; // BASE_SAMPLED: owned, a_g at t = i * interval [m/s^2]; still after the last one
    size_t count;
    double interval;  // [s]
    double amplitude; // BASE_SINE: a_g = amplitude * sin(omega t) [m/s^2]
    double omega;     // of all that turns: BASE_SINE, and BASE_PIECES (0: they are linear) [rad/s]
    BasePiece pieces[BASE_PIECES_MAX]; // BASE_PIECES: by time; still before the first one
    size_t piece_count;
} Base;

void base_clear(Base *base);

#endif
