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
    const char *name;       // of its solver
    int order;              // of the error between contacts
    const char *between;    // a clause for the plan's report that states this error
    bool is_by_place;       // see StepContact
    double stability_limit; // of |eigenvalue| times step; 0: unconditionally stable
    // Sets `method` to an allocated block, or leaves it NULL. The driver frees it.
    Status (*make)(TimeStepping *stepping);
    // Advances y by `length` seconds and sets the step's integrals.
    Status (*step)(TimeStepping *stepping, double length);
    // Advances the state itself by `length` seconds from the last sample, with steps of its own.
    Status (*interval)(TimeStepping *stepping, double length);
    void (*clear)(TimeStepping *stepping); // what `method` refers to; NULL: nothing
    // Solver steps that a step costs; *setup is the cost of the tables.
    double (*cost)(size_t modes, size_t dampers, bool is_coupled, double *setup);
} Stepper;

struct TimeStepping {
    ModalState state;
    Recorder recorder;
    const Stepper *stepper;
    void *method;          // the stepper's data
    size_t share;          // steps in a sample interval
    double length;         // of a step [s]
    double tolerance;      // relative error of a step under error control, else 0
    double unchecked_cost; // work since the last check of limits and progress [multiplications]

    size_t size;           // of y
    double *y;             // q, p, r, w of all modes and dampers
    double ground[3];      // a_g at the step's start, middle and end [m/s^2]
    double input, damping; // work of the base and loss in the structure in one step [J]
    StepContact contact;   // the same step's contact integrals
    double *force;         // scratch: N of the dampers [N], then one derivative of y
    double *elastic;       // scratch: D p + W^2 q
    // Ground velocity that a step's quadrature misses where a pulse begins or ends within the step:
    // now and at most so far [m/s], and the time of the first miss [s].
    double missed_velocity, max_missed_velocity, missed_since;
    double largest_input; // largest |work of the base| [J]
    double *block;
};

// Solver.run, .decide and .cost of a solver with fixed steps.
Status time_stepping_run(const Solver *solver, Run *run, Response *response, Problem *problem);
Status time_stepping_decide(const Solver *solver, const Accuracy *accuracy, double base_interval,
                            Plan *plan, Problem *problem);
double time_stepping_cost(const Solver *solver, const Accuracy *accuracy, double base_interval,
                          const Plan *plan);

// A run with `share` steps in a sample interval and its companion. `kinks` divides `share`: kinks
// of the base in a sample interval. `tolerance` is that of error control, 0 for fixed steps.
Status time_stepping_run_pair(const Stepper *stepper, Run *run, size_t share, size_t kinks,
                              double tolerance, Response *response, Problem *problem);

// Shortest period or decay time of a mode [s].
double time_stepping_mode_time(const Plan *plan);
// Whether damping couples the modes, or may couple modes that are not computed yet.
bool time_stepping_may_couple(const Plan *plan);

// out = D p + W^2 q.
void time_stepping_elastic(const ModalState *state, const double *q, const double *p,
                           double *restrict out);
// out = y' under the forces N of the dampers; `elastic` becomes that of y.
void time_stepping_rate(TimeStepping *stepping, const double *y, double ground, const double *force,
                        double *restrict out);
// The rates of the energy integrals at y, after time_stepping_rate: N and N r' of the dampers, then
// the power of the base and the loss in the structure; 2 dampers + 2 values.
void time_stepping_powers(const TimeStepping *stepping, const double *y, double ground,
                          const double *force, double *restrict out);
// Copies the state to y, and y to the state.
void time_stepping_gather(const ModalState *state, double *y);
void time_stepping_scatter(ModalState *state, const double *y);
// Adds the energy integrals of a step from the states at its two ends: by the trapezoidal rule, or
// with its end correction (Euler-Maclaurin), which is of order 4.
void time_stepping_integrate(TimeStepping *stepping, const double *from, const double *to,
                             double length, bool is_corrected);
// Updates peaks and energy balance after a step of `cost` solver steps. STATUS_UNSTABLE where the
// energy has no bound; STATUS_LIMIT and STATUS_CANCELLED as for the run.
Status time_stepping_note(TimeStepping *stepping, double cost);

#endif
