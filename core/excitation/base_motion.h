// The base's acceleration a_g(t) for the solvers: still, linear between samples, a sine, or a few
// pieces. Each form is exact.
#ifndef CORE_EXCITATION_BASE_MOTION_H
#define CORE_EXCITATION_BASE_MOTION_H

#include <stddef.h>
#include <stdlib.h>

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
    // BASE_SAMPLED: owned, a_g at t = i * interval [m/s^2]; still after the last one
    double *values;
    size_t count;
    double interval;  // [s]
    double amplitude; // BASE_SINE: a_g = amplitude * sin(omega t) [m/s^2]
    double omega;     // BASE_SINE, and BASE_PIECES, where 0 means linear pieces [rad/s]
    BasePiece pieces[BASE_PIECES_MAX]; // BASE_PIECES: by time; still before the first
    size_t piece_count;
} Base;

static inline void base_clear(Base *base) {
    if (base == NULL)
        return;
    free(base->values);
    *base = (Base){0};
}

#endif
