// Motion that no closed form describes: explicit Runge-Kutta steps of order 8 whose error is held
// at rounding's edge or at a tolerance, and where functions of the state first fall to zero.
// SUNDIALS lives here alone. Not for linear motion that must be exact (arc.h, frame_arc.h). Used by
// solve/adaptive*.c.
#ifndef CORE_MATH_ODE_H
#define CORE_MATH_ODE_H

#include <stddef.h>

#include "core/base/status.h"

typedef struct Ode Ode;

typedef struct OdeSystem {
    const void *context;
    size_t size;  // of y
    size_t roots; // how many functions are watched
    void (*rate)(const void *context, double t, const double *y, double *rate);
    // Functions of the state, and their time derivatives; a slope of NAN is not known, then the
    // function's minimum inside a step is not looked for.
    void (*progress)(const void *context, double t, const double *y, double *value, double *slope);
    double tolerance; // 0: ODE_TOLERANCE
} OdeSystem;

#define ODE_TOLERANCE 1e-14
enum { ODE_NO_ROOT = -1 };

// One motion at a time, any number of them in turn. NULL without memory. Freed by ode_free.
Ode *ode_new(const OdeSystem *system);
void ode_free(Ode *ode);

// Begins at t = 0 with y. `scale` says of each component what is large for it: errors are held to
// the tolerance of that or of the component itself. `step` is a first guess of the step [s].
Status ode_start(Ode *ode, const double *y, const double *scale, double step, Problem *problem);

// One step, at most until `until` (> the present time), cut short where a function that was above
// zero, or rising from it, falls to zero: *root says which, else it is ODE_NO_ROOT. *t and y are
// those of the step's end. Where several fall in one step it is the first.
Status ode_step(Ode *ode, double until, double *t, double *y, int *root, Problem *problem);

#endif
