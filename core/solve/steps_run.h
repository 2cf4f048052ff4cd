// Whole runs by steps: how long a step is and why, a second run with longer ones beside it that
// tells the error, and what all that costs. Not the steps themselves (steps.h). Used by the solvers
// that step (rk4.c, newmark.c, precise.c, adaptive.c).
#ifndef CORE_SOLVE_STEPS_RUN_H
#define CORE_SOLVE_STEPS_RUN_H

#include "core/solve/solver.h"
#include "core/solve/time_stepping.h"

// The "accuracy" object of a solver with steps of one length.
typedef struct AccuracyStep {
    Accuracy accuracy;
    double step; // [s]; NAN: the scene's own
} AccuracyStep;
extern const Field accuracy_step_fields[];

// The "accuracy" object of a solver whose steps keep a tolerance.
typedef struct AccuracyTolerance {
    Accuracy accuracy;
    double tolerance;
} AccuracyTolerance;

// Solver.run, .decide and .cost of such a solver.
Status steps_run(Run *run, const Stepper *stepper, Response *response, Problem *problem);
Status steps_decide(const Accuracy *accuracy, const Stepper *stepper, double base_interval,
                    Plan *plan, Problem *problem);
double steps_cost(const Accuracy *accuracy, const Stepper *stepper, double base_interval,
                  const Plan *plan);

// A run of `share` steps in a sample interval, a multiple of the base's `kinks` there, and its
// coarser neighbour; `tolerance` is what steps of no fixed length keep, else 0.
Status steps_run_pair(Run *run, const Stepper *stepper, size_t share, size_t kinks,
                      double tolerance, Response *response, Problem *problem);

// The shortest time in which a mode swings or dies away [s].
double steps_mode_time(const Plan *plan);

// Whether damping couples the modes, or may where they are not known yet.
bool steps_may_couple(const Plan *plan);

// The shortest time that a contact lasts, or about that where it depends on its speed [s];
// INFINITY without any.
double steps_contact_time(const Plan *plan);

#endif
