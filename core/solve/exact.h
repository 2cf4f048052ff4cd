// Settings of the exact solver, the scene's "accuracy" object.
#ifndef CORE_SOLVE_EXACT_H
#define CORE_SOLVE_EXACT_H

#include "core/solve/solver.h"

typedef struct AccuracyExact {
    Accuracy accuracy;
    double tolerance; // relative error of a contact under a power law; NAN: none but rounding's
} AccuracyExact;
extern const Field accuracy_exact_fields[];

// What a contact under a power law may be wrong by; `accuracy` is the exact solver's, or NULL.
double exact_tolerance(const Accuracy *accuracy);

// Samples of one damper's contact at evenly spaced instants of a run.
typedef struct ContactPoint {
    double time; // [s]
    // Force of the stop on the damper away from the stop [N], penetration [m], speed towards it
    // [m/s]
    double force, penetration, speed;
} ContactPoint;
typedef struct OutputWindow {
    size_t first; // sample at which the plan's initial state is
    double start; // the first instant is `interval` later [s]
    double interval;
    size_t count; // instants; 0: only the impacts are of interest
    double end;   // of the run, not before the last instant [s]
    size_t damper;
    Side side;
    ContactPoint *points; // count of them
} OutputWindow;

// A run by the event engine over part of the plan's time, sampled at the window's instants only.
// The response holds its impacts.
Status exact_run_window(Run *run, const OutputWindow *window, Response *response, Problem *problem);

// As Solver.run, but by the event engine for every plan, also where single_mass.h is faster.
Status exact_run_engine(Run *run, Response *response, Problem *problem);

#endif
