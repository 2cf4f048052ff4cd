// What the exact solver may be asked for: its "accuracy" object. Not its engines (exact*.c,
// frame*.c). Used by exact.c, frame.c, simulation/ and tests.
#ifndef CORE_SOLVE_EXACT_H
#define CORE_SOLVE_EXACT_H

#include "core/solve/solver.h"

typedef struct AccuracyExact {
    Accuracy accuracy;
    double tolerance; // relative error of a contact under a power law; NAN: none but rounding's
} AccuracyExact;

// What a contact under a power law may be wrong by; `accuracy` is the exact solver's, or NULL.
double exact_tolerance(const Accuracy *accuracy);

#endif
