// What ONE solver is; solvers.c lists all. A solver turns a plan and a base's motion into a
// response.
#ifndef CORE_SOLVE_SOLVER_H
#define CORE_SOLVE_SOLVER_H

#include "core/base/field.h"
#include "core/base/progress.h"
#include "core/excitation/base_motion.h"
#include "core/plan/plan.h"
#include "core/result/response.h"
#include "core/result/work_counters.h"
#include "core/solve/workspace.h"

// First member of every solver's settings, the scene's "accuracy" object.
typedef struct Accuracy {
    Variant variant; // kind is a Solver's
    uint64_t modes;  // of a structure with several storeys, the lowest; COUNT_ABSENT: all
} Accuracy;
extern const Field accuracy_fields[]; // the rows that every solver has

// How many modes a run keeps of a structure with so many storeys.
static inline size_t accuracy_modes(const Accuracy *accuracy, size_t storeys) {
    return accuracy == NULL || accuracy->modes >= storeys ? storeys : (size_t)accuracy->modes;
}

// Of "auto", which has no run of its own.
typedef struct AccuracyAuto {
    Accuracy accuracy;
    double target; // NAN: none
    int metric;    // Metric
} AccuracyAuto;

// Where the samples of one channel go.
typedef struct RunColumn {
    ChannelId channel;
    size_t number;  // of the storey or damper, from 0
    double *values; // plan->count of them
} RunColumn;

// Work is predicted and counted in solver steps, whatever the solver: each stands for about this
// much CPU time on a middling machine [s].
#define SOLVER_STEP 3e-8

// Message for a run that takes more steps than predicted: steps, the same in seconds, and when.
#define SOLVER_STOPPED                                                                             \
    "more than %.3g solver steps, about %.3g s of CPU, far more than predicted; stopped at "

// One run: borrowed inputs, and where samples go.
typedef struct Run {
    const Plan *plan;
    const Base *base;
    const Progress *progress;
    const Accuracy *accuracy; // the solver's settings; NULL: its defaults
    Workspace *workspace;     // or NULL
    const RunColumn *columns; // what is wanted, each once
    size_t column_count;
    double statistics_from; // [s]
    size_t impacts_max;     // ledger rows; 0: no limit
    double steps_max;       // solver steps; 0: no limit
    bool is_clear;          // no mass comes to a stop: none has to be searched for
    double steps;           // out: work counted, in solver steps of SOLVER_STEP
    WorkCounters work;      // out: what was done, kind by kind, but for what is not the solver's
} Run;

typedef struct Solver {
    Kind kind;
    // Fills everything of `response` but its series. The caller clears it, also after a failure.
    Status (*run)(Run *run, Response *response, Problem *problem);
    // Judges the settings for a scene made ready and adds what it decides of them to the plan's
    // report; `base_interval` is that of a base known by samples, else 0 [s]. NULL: nothing to
    // decide.
    Status (*decide)(const Accuracy *accuracy, double base_interval, Plan *plan, Problem *problem);
    // What a run costs, in solver steps. NULL: as the exact solver's.
    double (*cost)(const Accuracy *accuracy, double base_interval, const Plan *plan);
    // Erases the settings that a scene without a power law has no use for. NULL: there are none.
    void (*forget_unused)(Accuracy *accuracy, bool has_power_law);
    bool is_linear_only; // serves no contact under a power law
} Solver;

extern const Solver solver_exact, solver_precise, solver_rk4, solver_newmark, solver_adaptive;

#endif
