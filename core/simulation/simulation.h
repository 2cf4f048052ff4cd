// The whole journey: from what was asked (Simulation) to what came of it (Outcome).
// Knows no JSON, files or clock. Used by server/ and tests/.
#ifndef CORE_SIMULATION_SIMULATION_H
#define CORE_SIMULATION_SIMULATION_H

#include "core/base/progress.h"
#include "core/plan/plan.h"
#include "core/result/response.h"
#include "core/result/welch.h"
#include "core/result/work_counters.h"
#include "core/scene/scene.h"
#include "core/solve/solver.h"
#include "core/solve/workspace.h"

// The engine's name and version; part of every result's id. Changes whenever any bit of any result
// may.
extern const char engine_version[];

// "psd" in the output.
typedef struct SpectrumRequest {
    Texts channels;
    uint64_t segment; // COUNT_ABSENT: min(4096, count)
    uint64_t overlap; // COUNT_ABSENT: segment / 2
    int window;       // SpectrumWindow
    int detrend;      // SpectrumDetrend
} SpectrumRequest;

typedef struct Output {
    Texts channels;
    SpectrumRequest psd;
    bool impacts;           // the ledger is kept
    bool reduction;         // what the dampers save is told
    double statistics_from; // [s]
} Output;

// What was asked: the API's "scene".
typedef struct Simulation {
    Scene scene;
    Variant *accuracy; // an Accuracy
    Output output;
    char *title;
    Texts labels;
} Simulation;

extern const Field simulation_fields[];

// Limits that are the caller's policy.
typedef struct SimulationLimits {
    size_t samples; // per channel; 0: none
    size_t impacts; // ledger rows; 0: none
    // Solver steps that a run may be foretold to take; it is refused beyond, and stopped at
    // SIMULATION_PATIENCE times as many where it was foretold too little. 0: none.
    double steps;
    double bytes;  // of memory that a run may be foretold to take; 0: none
    size_t points; // of a sweep; 0: the usual
} SimulationLimits;

#define SIMULATION_PATIENCE 3

// What callers allow a run unless they are told otherwise.
#define SIMULATION_CPU_SECONDS 60
#define SIMULATION_BYTES 4e9

void simulation_clear(
    Simulation *simulation); // fields_clear by another name; defaults by fields_default

// Judges the whole (rows and what rows cannot see), completes it to its canonical form, and
// collects warnings (implausible values, a cut segment). Slugs must be resolved before. All faults
// are added to `problem`; faults already in it, a reader's, fail it too. `limits` and `warnings`
// may be NULL.
Status simulation_complete(Simulation *simulation, const SimulationLimits *limits,
                           Warnings *warnings, Problem *problem);

// The plan alone, for a dry run, of a completed simulation. Cleared by
// fields_clear(plan_report_fields, ...).
Status simulation_plan(const Simulation *simulation, PlanReport *report, Problem *problem);

// The numbers people ask for first; NAN is unknown.
typedef struct Summary {
    double peak_displacement, rms_displacement, peak_acceleration, rms_acceleration;
    uint64_t impacts;
    double peak_contact_force, energy_residual, error_estimate, trust_horizon;
} Summary;
extern const Field summary_fields[];

// By how much the dampers make the summary's numbers smaller: 1 - with over without, where without
// is the same scene with no damper. NAN is unknown, as where nothing moves.
typedef struct Reduction {
    double peak_displacement_reduction, rms_displacement_reduction, peak_acceleration_reduction,
        rms_acceleration_reduction;
} Reduction;
extern const Field reduction_fields[];

// All that a run came to. Frozen once made; counted, because jobs, caches and replies share it.
typedef struct Outcome Outcome;
struct Outcome {
    PlanReport plan;
    Response response; // response.series holds output.channels in that order
    Spectrum spectrum; // of output.psd; empty where none was asked for
    Summary summary;
    bool has_reduction; // it was asked for
    Reduction reduction;
    Warnings warnings; // what only the run could tell
    double steps;      // solver steps, counted
    Work work;         // what was done, kind by kind
};

// Runs a completed simulation. Stops with STATUS_CANCELLED when `progress` says so, with
// STATUS_LIMIT at limits->impacts and STATUS_UNSTABLE where the numbers leave what doubles can hold
// or energy comes out of nothing. The Outcome is the caller's one hold on it, freed by the last
// outcome_unref. `workspace` may be NULL.
Status simulation_run(const Simulation *simulation, const SimulationLimits *limits,
                      const Progress *progress, Workspace *workspace, Outcome **outcome,
                      Problem *problem);
Outcome *
outcome_new(void); // empty, one hold, for whoever has kept the numbers; NULL without memory
Outcome *outcome_ref(Outcome *outcome);
void outcome_unref(Outcome *outcome);
size_t outcome_bytes(const Outcome *outcome); // of memory, for caches

// Expected cost of a completed simulation, before running it.
typedef struct Cost {
    double steps;       // solver steps
    double cpu_seconds; // the same as time [s]
    double bytes;       // of memory while it runs
    double spectra;     // steps of these, for spectra
    double base;        // and for making the base's motion
    bool is_fast;       // most of the rest is for motion within sample intervals
} Cost;
Cost simulation_cost(const Simulation *simulation);

#endif
