// A solver computes the response of a plan to the motion of its base. solvers.c lists all of them.
#ifndef CORE_SOLVE_SOLVER_H
#define CORE_SOLVE_SOLVER_H

#include "core/base/field.h"
#include "core/base/progress.h"
#include "core/excitation/base_motion.h"
#include "core/math/fft.h"
#include "core/plan/plan.h"
#include "core/result/response.h"

// First member of every solver's settings, the scene's "accuracy" object.
typedef struct Accuracy {
    Variant variant; // kind is a Solver's
    uint64_t modes;  // of a structure with several storeys, the lowest; COUNT_ABSENT: all
} Accuracy;
extern const Field accuracy_fields[]; // the rows that every solver has

// Number of modes that a run keeps of a structure with so many storeys.
static inline size_t accuracy_modes(const Accuracy *accuracy, size_t storeys) {
    return accuracy == NULL || accuracy->modes >= storeys ? storeys : (size_t)accuracy->modes;
}

// Settings of "auto", which has no run of its own.
typedef struct AccuracyAuto {
    Accuracy accuracy;
    double target; // NAN: none
    int metric;    // Metric
} AccuracyAuto;

// Destination of the samples of one channel.
typedef struct RunColumn {
    ChannelId channel;
    size_t number;  // of the storey or damper, from 0
    double *values; // plan->count of them
} RunColumn;

// Work is predicted and counted in solver steps for all solvers: about the CPU time of one on a
// typical machine [s].
#define SOLVER_STEP 3e-8

// Solver steps of the event engine's parts, as measured on frames of 1 to 200 storeys.
typedef enum StepWorkKind {
    STEP_WORK_FLIGHT,    // a sample interval of flight
    STEP_WORK_SUSTAINED, // an attempt at a long step of contact
    STEP_WORK_ARC,
    STEP_WORK_EVENT,
    STEP_WORK_POWER, // a contact under a power law; for predictions only
} StepWorkKind;
double step_work_steps(StepWorkKind kind, size_t storeys, size_t dampers, bool is_coupled);

// Message of a run that exceeds its predicted work: steps, seconds, and the time reached.
#define SOLVER_STOPPED                                                                             \
    "more than %.3g solver steps, about %.3g s of CPU, far more than predicted; stopped at "

// Peaks and rms of a scene without its dampers, and the work of that run.
typedef struct Baseline {
    char *key; // canonical form of the scene; NULL: none
    size_t key_size;
    double peak_displacement, rms_displacement, peak_acceleration, rms_acceleration;
    double peak_storey_drift, peak_base_shear;
    double steps;
    WorkCounters work;
} Baseline;

enum { BASELINES = 8 };

// Memory of a run that the next run can use again. It never changes a result. One per worker, used
// by one run at a time. All zero is empty.
typedef struct Workspace {
    FftCache transforms;
    struct SingleMass *single;     // tables of the last system of one mass
    Baseline baselines[BASELINES]; // the last ones that were dear to compute
    size_t next_baseline;
} Workspace;
void workspace_clear(Workspace *workspace);

// One run: borrowed inputs, and the destination of samples.
typedef struct Run {
    const Plan *plan;
    const Base *base;
    const Progress *progress;
    const Accuracy *accuracy; // the solver's settings; NULL: its defaults
    Workspace *workspace;     // or NULL
    const RunColumn *columns; // wanted channels, each once
    size_t column_count;
    double statistics_from; // [s]
    size_t impacts_max;     // listed impacts; 0: no limit
    double steps_max;       // solver steps; 0: no limit
    bool is_clear;          // no mass reaches a stop
    double steps;           // out: work counted, in solver steps of SOLVER_STEP
    WorkCounters work;      // out: work of the solver by kind
} Run;

// Between steps at `time`: STATUS_UNSTABLE where the motion is not finite, STATUS_LIMIT or
// STATUS_CANCELLED. `step` is that of a fixed step [s], or 0.
Status run_check(const Run *run, double time, double step, bool is_finite, Problem *problem);

// What a run is expected to ask of a solver.
typedef struct SolverDemand {
    double base_interval; // of a base known by samples, else 0 [s]
    double base_rate;     // of a base in closed form [rad/s]; 0: slow
    double impacts;       // of all masses
    double pressed;       // time that the mass pressed longest is pressed against a stop [s]
    double radians;       // of the fastest motion in contacts
} SolverDemand;

// One solver. Its functions are called with the solver itself.
typedef struct Solver {
    Kind kind;
    // Fills everything of `response` but its series. The caller clears it, also after a failure.
    Status (*run)(const struct Solver *solver, Run *run, Response *response, Problem *problem);
    // Validates the settings for a scene made ready and adds its decisions to the plan's report;
    // `base_interval` is that of a base known by samples, else 0 [s]. NULL: nothing to decide.
    Status (*decide)(const struct Solver *solver, const Accuracy *accuracy, double base_interval,
                     Plan *plan, Problem *problem);
    // What a run costs, in solver steps. NULL: as the exact solver's.
    double (*cost)(const struct Solver *solver, const Accuracy *accuracy,
                   const SolverDemand *demand, const Plan *plan);
    // Erases the settings that a scene without a power law has no use for. NULL: there are none.
    void (*forget_unused)(Accuracy *accuracy, bool has_power_law);
    bool is_linear_only;           // serves no contact under a power law
    const struct Stepper *stepper; // of a solver by time steps (time_stepping.h), else NULL
} Solver;

extern const Solver solver_exact, solver_precise, solver_rk4, solver_newmark, solver_adaptive;

// All solvers, in the order they are offered, NULL-terminated. "auto" is first and has no run of
// its own: the planner chooses.
extern const Solver *const solvers[];
extern const KindTable solver_kinds;

#endif
