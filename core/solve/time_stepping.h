// Driver of the solvers that integrate the modal state by time steps. A Stepper is one method
// (rk4.c, newmark.c, precise_integration.c, adaptive.c); the driver chooses the step, switches
// contacts at step ends, keeps the logs and runs a companion for the error estimate.
#ifndef CORE_SOLVE_TIME_STEPPING_H
#define CORE_SOLVE_TIME_STEPPING_H

#include "core/solve/engine.h"
#include "core/solve/step_contact.h"

// The "accuracy" object of a solver with fixed steps.
typedef struct AccuracyStep {
    Accuracy accuracy;
    double step; // [s]; NAN: chosen by time_stepping_decide
} AccuracyStep;
extern const Field accuracy_step_fields[];

// The "accuracy" object of a solver with error control.
typedef struct AccuracyTolerance {
    Accuracy accuracy;
    double tolerance;
} AccuracyTolerance;

typedef struct TimeStepping TimeStepping;

// One method. It has either `step`, for fixed steps, or `interval`.
typedef struct Stepper {
    int order;              // of the error between contacts
    const char *between;    // a clause for the plan's report that states this error
    bool is_by_place;       // see StepContact
    double stability_limit; // of |eigenvalue| times step; 0: unconditionally stable
    // Sets `method`, which the driver frees.
    Status (*make)(TimeStepping *stepping);
    // Advances y by `length` seconds and adds to the step's integrals.
    Status (*step)(TimeStepping *stepping, double length);
    // Advances the state itself by `length` seconds from the last sample, with steps of its own.
    Status (*interval)(TimeStepping *stepping, double length);
    void (*clear)(TimeStepping *stepping); // what `method` refers to; NULL: nothing
    // Solver steps that a step costs; *setup is the cost of the tables.
    double (*cost)(size_t modes, size_t dampers, bool is_coupled, double *setup);
    double equations;    // of contacts in a step: what they cost, per dampers^3
    bool is_by_contacts; // each set of contacts has tables of its own
} Stepper;

struct TimeStepping {
    ModalState state;
    Recorder recorder;
    const Solver *solver;
    const Stepper *stepper; // of the solver
    void *method;           // the stepper's data
    size_t share;           // steps in a sample interval
    double length;          // of a step [s]
    double tolerance;       // relative error of a step under error control, else 0
    double unchecked_cost;  // work since the last check of limits and progress [multiplications]

    size_t size;      // of y
    size_t row;       // of y and its integrals
    double *y;        // q, p, r, w of all modes and dampers
    double ground[3]; // a_g at the step's start, middle and end [m/s^2]
    // Of one step: N [N s] and N r' [J] of the dampers, work of the base and loss in the structure.
    double *integrals;
    StepContact contact;  // the first two of these
    double *force;        // scratch: N of the dampers [N]
    double *elastic;      // scratch: D p + W^2 q
    double *rows;         // scratch of time_stepping_integrate
    double largest_input; // largest |work of the base| [J]
    double *block;
};

// Solver.run, .decide and .cost of a solver with fixed steps.
Status time_stepping_run(const Solver *solver, Run *run, Response *response, Problem *problem);
Status time_stepping_decide(const Solver *solver, const Accuracy *accuracy, double base_interval,
                            Plan *plan, Problem *problem);
double time_stepping_cost(const Solver *solver, const Accuracy *accuracy,
                          const SolverDemand *demand, const Plan *plan);

// A run with `share` steps in a sample interval and its companion. `kinks` divides `share`: kinks
// of the base in a sample interval. `tolerance` is that of error control, 0 for fixed steps.
Status time_stepping_run_pair(const Solver *solver, Run *run, size_t share, size_t kinks,
                              double tolerance, Response *response, Problem *problem);

// Shortest period or decay time of a mode [s].
double time_stepping_mode_time(const Plan *plan);
// Whether damping couples the modes, or may couple modes that are not computed yet.
bool time_stepping_may_couple(const Plan *plan);

// out = D p + W^2 q.
void time_stepping_elastic(const ModalState *state, const double *q, const double *p,
                           double *restrict out);
// out = y' under the dampers' forces `force`, then the rates of the integrals, `row` values;
// `elastic` becomes that of y.
void time_stepping_rate(TimeStepping *stepping, const double *y, double ground,
                        double *restrict out);
// `force` becomes N of the dampers that are in contact at the step's start.
void time_stepping_forces(TimeStepping *stepping, const double *y);
// Copies the state to y. A step begins with integrals of zero.
void time_stepping_begin(TimeStepping *stepping, double *y);
// Adds the integrals of a step from the states at its two ends: by the trapezoidal rule, or by
// Simpson's with the middle of the cubic through both, which is of order 4.
void time_stepping_integrate(TimeStepping *stepping, const double *from, const double *to,
                             double length, bool is_order_4);
// Sets `method` to `size` bytes of zeros.
Status time_stepping_make_method(TimeStepping *stepping, size_t size);
// Updates peaks and energy balance after a step of `cost` solver steps. STATUS_UNSTABLE where the
// energy has no bound; STATUS_LIMIT and STATUS_CANCELLED as for the run.
Status time_stepping_note(TimeStepping *stepping, double cost);

#endif
