// The simulation of one scene: the request (Simulation), its validation, plan and cost, its run and
// the result (Outcome). Knows no JSON, files or clock.
#ifndef CORE_SIMULATION_SIMULATION_H
#define CORE_SIMULATION_SIMULATION_H

#include "core/base/progress.h"
#include "core/plan/plan.h"
#include "core/result/response.h"
#include "core/result/welch.h"
#include "core/scene/scene.h"
#include "core/solve/solver.h"

// Name and version of the engine, part of the id of every result. It must change with every change
// that may alter any bit of any result.
extern const char engine_version[];

// "psd" in the output.
typedef struct SpectrumRequest {
    Texts channels;
    uint64_t segment; // COUNT_ABSENT: min(4096, count)
    uint64_t overlap; // COUNT_ABSENT: segment / 2
    int window;       // WelchWindow
    int detrend;      // WelchDetrend
} SpectrumRequest;

typedef struct Output {
    Texts channels;
    SpectrumRequest psd;
    bool impacts;           // the list of impacts is kept
    bool reduction;         // peaks and rms are compared with the scene without dampers
    double statistics_from; // [s]
} Output;

// The API's "scene".
typedef struct Simulation {
    Scene scene;
    Variant *accuracy; // an Accuracy
    Output output;
    char *title;
    Texts labels;
} Simulation;

extern const Field simulation_fields[];

// Limits set by the caller; 0: no limit.
typedef struct SimulationLimits {
    size_t samples; // per channel
    size_t impacts; // listed
    // Predicted solver steps. A run is refused above this number, and stopped at
    // SIMULATION_PATIENCE times this number if the prediction was too low.
    double steps;
    double bytes;          // predicted memory of a run, and that of its list of impacts
    double document_bytes; // predicted size of the spectra in a database
    size_t points;         // of a sweep; 0: the default
} SimulationLimits;

#define SIMULATION_PATIENCE 3

// Default limits of a run.
#define SIMULATION_CPU_SECONDS 60
#define SIMULATION_BYTES 4e9

void simulation_clear(Simulation *simulation);

// Whether accuracy.target asks for the cheapest settings that keep an error.
bool simulation_has_target(const Simulation *simulation);

// Validates the whole simulation, completes it to its canonical form and collects warnings
// (implausible values, a shortened segment). Slugs must be resolved before. All faults are added to
// `problem`; faults that are already in it make the call fail too. `limits` and `warnings` may be
// NULL.
Status simulation_complete(Simulation *simulation, const SimulationLimits *limits,
                           Warnings *warnings, Problem *problem);

// Replaces the contact law of a completed simulation by impulses. Buffers that are given by
// stiffness and damping get the restitution derived from them. It has to be completed again.
Status simulation_use_impulses(Simulation *simulation, Problem *problem);

// Whether the contacts of the simulation have a force.
bool simulation_has_force(const Simulation *simulation);

// Validates that the scene can have a metric, which is the value at `pointer`.
Status simulation_check_metric(const Simulation *simulation, const char *metric,
                               const char *pointer, Problem *problem);

// The plan of a completed simulation, without a run. Cleared by
// fields_clear(plan_report_fields, ...).
Status simulation_plan(const Simulation *simulation, PlanReport *report, Problem *problem);

// Warns of dampers whose masses are far from those of the tests that measured their materials.
// These warnings need no run. STATUS_OK or STATUS_NO_MEMORY.
Status scene_warnings_of_pairs(const Scene *scene, const DerivedList *derived, Warnings *warnings);

// The main numbers of a result; NAN is unknown.
typedef struct Summary {
    double peak_displacement, rms_displacement, peak_acceleration, rms_acceleration;
    uint64_t impacts;
    double peak_contact_force, peak_storey_drift, peak_base_shear;
    double energy_residual, error_estimate, trust_horizon;
} Summary;
extern const Field summary_fields[];

// Reduction of the summary's numbers by the dampers: 1 - with / without dampers. NAN is unknown,
// for example where nothing moves.
typedef struct Reduction {
    double peak_displacement_reduction, rms_displacement_reduction, peak_acceleration_reduction,
        rms_acceleration_reduction, peak_storey_drift_reduction, peak_base_shear_reduction;
} Reduction;
extern const Field reduction_fields[];

// The result of a run. Immutable once made; reference counted, because jobs, caches and replies
// share it.
typedef struct Outcome Outcome;
struct Outcome {
    PlanReport plan;
    Response response; // response.series holds output.channels in that order
    Spectrum spectrum; // of output.psd; empty if none was requested
    Summary summary;
    bool has_reduction; // it was requested
    Reduction reduction;
    Warnings warnings; // those that depend on the run
    double steps;      // solver steps, counted
    WorkCounters work; // counted by kind
};

// Runs a completed simulation. Errors: STATUS_CANCELLED when `progress` asks to stop, STATUS_LIMIT
// at a limit, STATUS_UNSTABLE where numbers overflow or energy appears from nothing. The caller
// owns one reference to the Outcome. `limits`, `progress` and `workspace` may be NULL.
Status simulation_run(const Simulation *simulation, const SimulationLimits *limits,
                      const Progress *progress, Workspace *workspace, Outcome **outcome,
                      Problem *problem);
Outcome *outcome_new(void); // empty, with one reference; NULL without memory
Outcome *outcome_ref(Outcome *outcome);
void outcome_unref(Outcome *outcome);
size_t outcome_bytes(const Outcome *outcome);   // memory in use, for caches
bool outcome_has_force(const Outcome *outcome); // whether its contacts have a force

// The motion of a completed simulation with a sine base over its cycles, by the exact solver
// whatever the scene's solver is. `from` as in cycle_flow_new, of a simulation with as many storeys
// and dampers. STATUS_INVALID, with a fault, where the base has no sine. `limits` and `progress`
// may be NULL.
struct CycleFlow;
Status simulation_cycle_flow(const Simulation *simulation, const SimulationLimits *limits,
                             const Progress *progress, const struct CycleFlow *from,
                             struct CycleFlow **flow, Problem *problem);

// Predicted cost of a run.
typedef struct Cost {
    double steps;          // solver steps
    double cpu_seconds;    // the same as time [s]
    double bytes;          // peak memory of the run and its stored form
    double spectra_bytes;  // the part of `bytes` for spectra and their stored form
    double document_bytes; // size of that form
    double spectra;        // the part of `steps` for spectra
    double base;           // the part of `steps` for the motion of the base
    double output;         // the part of `steps` for channels
    bool is_fast;          // motion within sample intervals dominates
} Cost;
Cost simulation_cost(const Simulation *simulation);

// Appends the name of a channel in a completed scene to a list that does not have it yet; `number`
// is that of the storey or damper, from 1. STATUS_OK or STATUS_NO_MEMORY.
Status channel_names_add(const Scene *scene, ChannelId channel, size_t number, Texts *names);

// One impact at full detail: force, penetration and speed of the contact from its start to its end.
enum {
    IMPACT_HISTORY_POINTS = 401, // default
    IMPACT_HISTORY_POINTS_MIN = 5,
    IMPACT_HISTORY_POINTS_MAX = 100001,
};

typedef struct ImpactHistory {
    Impact impact; // as the run lists it
    // "time" of the scene [s]; "contact_force", positive where the stop pushes [N]; "penetration"
    // [m]; "approach_speed", positive into the stop [m/s]. About as many rows as points were
    // requested, equally spaced from start to end, and one at the peak.
    Columns columns;
} ImpactHistory;

// The history of impact `number`, from 1, of a completed simulation. STATUS_NOT_FOUND where there
// is no such impact or where contacts have no duration, STATUS_CANCELLED when `progress` asks to
// stop. `limits`, `progress` and `workspace` may be NULL. Cleared by impact_history_clear.
Status impact_history_make(const Simulation *simulation, size_t number, size_t points,
                           const SimulationLimits *limits, const Progress *progress,
                           Workspace *workspace, ImpactHistory *history, Problem *problem);
void impact_history_clear(ImpactHistory *history);

// Predicted solver steps of that call.
double impact_history_steps(const Simulation *simulation);

#endif
