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

// As Solver.run, but by the event engine for every plan, also where single_mass.h is faster.
Status exact_run_engine(Run *run, Response *response, Problem *problem);

#endif
