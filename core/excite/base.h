// The base's acceleration a_g(t) as a solver meets it: still, linear between samples, or a sine;
// exact in each form. Not an excitation: how the samples came about is the excitation's business.
// Used by excite/, solve/ and simulation/.
#ifndef CORE_EXCITE_BASE_H
#define CORE_EXCITE_BASE_H

#include <stddef.h>

typedef enum BaseForm { BASE_STILL, BASE_SAMPLED, BASE_SINE } BaseForm;

// All zero is a still base.
typedef struct Base {
    BaseForm form;
    double
        *values; // BASE_SAMPLED: owned, a_g at t = i * interval [m/s^2]; still after the last one
    size_t count;
    double interval;  // [s]
    double amplitude; // BASE_SINE: a_g = amplitude * sin(omega t) [m/s^2]
    double omega;     // [rad/s]
} Base;

void base_clear(Base *base);

// a_g at time t >= 0 [m/s^2]; right-continuous at the end of the samples.
double base_at(const Base *base, double time);

#endif
