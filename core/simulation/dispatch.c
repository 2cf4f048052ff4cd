// Entry points: each decides between a plain scene, an accuracy target and a comparison with the
// scene without dampers.
#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "core/base/canonical.h"
#include "core/simulation/internal.h"

// The scene without its dampers, run for comparison. It samples no channels, because only its
// summary is used. An accuracy target is about the dampers, so without them the exact solver runs.
// The view borrows all other members.
typedef struct UndampedBaseline {
    Simulation view;
    Contact contact; // of any scene without dampers
    AccuracyExact accuracy;
} UndampedBaseline;

static void undamped_baseline_set(const Simulation *simulation, UndampedBaseline *undamped) {
    *undamped = (UndampedBaseline){
        .view = *simulation,
        .contact = {{&contact_auto.kind}, SEPARATION_ZERO_PENETRATION},
        .accuracy = {{{&solver_exact.kind}, COUNT_ABSENT}, (double)NAN},
    };
    Simulation *view = &undamped->view;
    view->scene.dampers = (Dampers){NULL, 0};
    view->scene.contact = &undamped->contact.variant;
    view->output.channels = view->output.psd.channels = (Texts){NULL, 0};
    if (simulation_has_target(simulation))
        view->accuracy = &undamped->accuracy.accuracy.variant;
}

static double undamped_baseline_reduction(double with, double without) {
    return without > 0 ? 1 - with / without : (double)NAN;
}

// The canonical form of a scene, as the key of its baseline.
typedef struct BaselineKey {
    char *at;
    size_t size, room;
    bool is_incomplete; // without memory, or too long
} BaselineKey;

static void baseline_key_append(void *context, const void *bytes, size_t size) {
    enum { KEY_MAX = 1 << 20 };
    BaselineKey *key = context;
    if (size > KEY_MAX - key->size)
        key->is_incomplete = true;
    if (key->is_incomplete)
        return;
    if (key->size + size > key->room) {
        const size_t room = 2 * (key->size + size);
        char *at = realloc(key->at, room);
        key->is_incomplete = at == NULL;
        if (at == NULL)
            return;
        key->at = at;
        key->room = room;
    }
    memcpy(key->at + key->size, bytes, size);
    key->size += size;
}

static const Baseline *baseline_find(const Workspace *workspace, const BaselineKey *key) {
    for (size_t i = 0; i < BASELINES && !key->is_incomplete; i++) {
        const Baseline *baseline = &workspace->baselines[i];
        if (baseline->key != NULL && baseline->key_size == key->size &&
            memcmp(baseline->key, key->at, key->size) == 0)
            return baseline;
    }
    return NULL;
}

static Status baseline_compute(const Simulation *view, const SimulationLimits *limits,
                               const Progress *progress, Workspace *workspace, RunInputs *inputs,
                               Baseline *baseline, Problem *problem) {
    Outcome *outcome;
    plan_free(inputs->plan);
    inputs->plan = NULL;
    TRY(run_scene(view, limits, progress, workspace, inputs, &outcome, problem));
    *baseline = (Baseline){.peak_displacement = outcome->summary.peak_displacement,
                           .rms_displacement = outcome->summary.rms_displacement,
                           .peak_acceleration = outcome->summary.peak_acceleration,
                           .rms_acceleration = outcome->summary.rms_acceleration,
                           .peak_storey_drift = outcome->summary.peak_storey_drift,
                           .peak_base_shear = outcome->summary.peak_base_shear,
                           .steps = outcome->steps,
                           .work = outcome->work};
    baseline->work.base_samples = 0; // the motion is that of the scene with dampers
    outcome_unref(outcome);
    return STATUS_OK;
}

// A key takes about 10 us to write and compare: cheaper baselines are computed again.
#define BASELINE_CPU_SECONDS 1e-4

// The baseline of the undamped scene `view`, from the workspace if it has it. `inputs` are those of
// the scene with dampers.
static Status baseline_get(const Simulation *view, const SimulationLimits *limits,
                           const Progress *progress, Workspace *workspace, RunInputs *inputs,
                           Baseline *baseline, Problem *problem) {
    BaselineKey key = {0};
    if (workspace == NULL || cost_scene(view).cpu_seconds < BASELINE_CPU_SECONDS)
        return baseline_compute(view, limits, progress, workspace, inputs, baseline, problem);
    canonical_write(simulation_fields, view, baseline_key_append, &key);
    const Baseline *found = baseline_find(workspace, &key);
    Status status = STATUS_OK;
    if (found != NULL)
        *baseline = *found;
    else
        status = baseline_compute(view, limits, progress, workspace, inputs, baseline, problem);
    if (found == NULL && status == STATUS_OK && !key.is_incomplete) {
        Baseline *target = &workspace->baselines[workspace->next_baseline++ % BASELINES];
        free(target->key);
        *target = *baseline;
        target->key = key.at;
        target->key_size = key.size;
        return STATUS_OK;
    }
    free(key.at);
    return status;
}

// Compares the outcome's summary with that of the scene without its dampers and adds the work of
// that run. If that run fails, the reductions are unknown, and a warning gives the reason.
static Status outcome_add_reduction(const Simulation *simulation, const SimulationLimits *limits,
                                    const Progress *progress, Workspace *workspace,
                                    RunInputs *inputs, Outcome *outcome, Problem *problem) {
    UndampedBaseline undamped;
    Baseline without;
    Problem own = {0};
    undamped_baseline_set(simulation, &undamped);
    outcome->has_reduction = true;
    outcome->reduction = (Reduction){NAN, NAN, NAN, NAN, NAN, NAN};
    const Status status =
        baseline_get(&undamped.view, limits, progress, workspace, inputs, &without, &own);
    if (status == STATUS_OK) {
        const Summary *with = &outcome->summary;
        outcome->reduction = (Reduction){
            undamped_baseline_reduction(with->peak_displacement, without.peak_displacement),
            undamped_baseline_reduction(with->rms_displacement, without.rms_displacement),
            undamped_baseline_reduction(with->peak_acceleration, without.peak_acceleration),
            undamped_baseline_reduction(with->rms_acceleration, without.rms_acceleration),
            undamped_baseline_reduction(with->peak_storey_drift, without.peak_storey_drift),
            undamped_baseline_reduction(with->peak_base_shear, without.peak_base_shear),
        };
        outcome->steps += without.steps;
        work_counters_add(&outcome->work, &without.work);
        return STATUS_OK;
    }
    if (status == STATUS_CANCELLED || status == STATUS_NO_MEMORY)
        return problem_set(problem, status, "%s", own.detail);
    return warnings_add(&outcome->warnings, "/output/reduction",
                        "is unknown: the scene without dampers could not be run: %s",
                        own.detail) == STATUS_OK
               ? STATUS_OK
               : problem_set(problem, STATUS_NO_MEMORY, "no memory for a warning");
}

static Status simulation_refuse_time(const Simulation *simulation, const Cost *cost,
                                     const SimulationLimits *limits, Problem *problem) {
    const Solver *solver = (const Solver *)(const void *)simulation->accuracy->kind;
    const double most = limits->steps * SOLVER_STEP;
    static const char format[] =
        "would take about %.2g s of CPU%s%s, at most %.4g s are allowed: %s";
    if (2 * cost->spectra > cost->steps)
        return problem_add(problem, STATUS_INVALID, "/output/psd", format, cost->cpu_seconds,
                           ", most of it for spectra", "", most,
                           "ask for fewer channels, less overlap, or a segment without large "
                           "prime factors");
    if (2 * cost->base > cost->steps)
        return problem_add(problem, STATUS_INVALID, "/excitation", format, cost->cpu_seconds,
                           ", most of it to make the base's motion", "", most,
                           "take fewer samples of it, or a shorter duration");
    if (solver->cost != NULL)
        return problem_add(problem, STATUS_INVALID, "/accuracy", format, cost->cpu_seconds, " by ",
                           solver->kind.name, most,
                           "take longer steps or a larger tolerance, or the solver exact");
    return problem_add_real(problem, STATUS_INVALID, "/duration", simulation->scene.duration, "s",
                            format, cost->cpu_seconds, "", "", most,
                            cost->is_fast ? "take a shorter one; the structure or the base moves "
                                            "many times within a sample interval"
                                          : "take a shorter one, or fewer samples");
}

static Status simulation_refuse_bytes(const Simulation *simulation, const Cost *cost,
                                      const SimulationLimits *limits, Problem *problem) {
    static const char format[] =
        "would take about %.3g MB of memory, at most %.4g MB are allowed: %s";
    if (2 * cost->spectra_bytes > cost->bytes)
        return problem_add(problem, STATUS_INVALID, "/output/psd", format, 1e-6 * cost->bytes,
                           1e-6 * limits->bytes, "ask for shorter segments or fewer channels");
    return problem_add_real(problem, STATUS_INVALID, "/output/channels",
                            (double)simulation->output.channels.count, NULL, format,
                            1e-6 * cost->bytes, 1e-6 * limits->bytes,
                            "ask for fewer channels or samples");
}

// Refuses a scene that is predicted to exceed the limits.
static Status simulation_check_cost(const Simulation *simulation, const SimulationLimits *limits,
                                    Problem *problem) {
    if (limits == NULL)
        return STATUS_OK;
    const Cost cost = simulation_cost(simulation);
    if (limits->steps > 0 && !(cost.steps <= limits->steps))
        return simulation_refuse_time(simulation, &cost, limits, problem);
    if (limits->document_bytes > 0 && !(cost.document_bytes <= limits->document_bytes))
        return problem_add(problem, STATUS_INVALID, "/output/psd",
                           "would be about %.3g MB, at most %.4g MB can be stored: "
                           "ask for shorter segments or fewer channels",
                           1e-6 * cost.document_bytes, 1e-6 * limits->document_bytes);
    if (limits->bytes > 0 && !(cost.bytes <= limits->bytes))
        return simulation_refuse_bytes(simulation, &cost, limits, problem);
    return STATUS_OK;
}

Status simulation_complete(Simulation *simulation, const SimulationLimits *limits,
                           Warnings *warnings, Problem *problem) {
    TRY(simulation_validate(simulation, limits, warnings, problem));
    TRY(simulation_check_cost(simulation, limits, problem));
    return warnings == NULL || scene_warnings_of_input(simulation, warnings) == STATUS_OK
               ? STATUS_OK
               : problem_set(problem, STATUS_NO_MEMORY, "no memory for warnings");
}

Status simulation_plan(const Simulation *simulation, PlanReport *report, Problem *problem) {
    *report = (PlanReport){0};
    return simulation_has_target(simulation) ? accuracy_target_plan(simulation, report, problem)
                                             : plan_scene(simulation, report, problem);
}

Cost simulation_cost(const Simulation *simulation) {
    Cost cost = simulation_has_target(simulation) ? accuracy_target_cost(simulation)
                                                  : cost_scene(simulation);
    if (!simulation->output.reduction)
        return cost;
    UndampedBaseline undamped;
    undamped_baseline_set(simulation, &undamped);
    const Cost other = cost_scene(&undamped.view);
    // The second run needs no more memory than the first; the motion of the base is made once.
    cost.steps += other.steps - (simulation_has_target(simulation) ? 0 : other.base);
    cost.cpu_seconds = cost.steps * SOLVER_STEP;
    return cost;
}

Status simulation_run(const Simulation *simulation, const SimulationLimits *limits,
                      const Progress *progress, Workspace *workspace, Outcome **outcome,
                      Problem *problem) {
    const bool has_reduction = simulation->output.reduction;
    const double share = has_reduction ? 0.8 : 1; // of the progress, if another run follows
    const Progress own = progress_range_view(&(ProgressRange){progress, 0, share, 0});
    const Progress other = progress_range_view(&(ProgressRange){progress, share, 1 - share, 0});
    RunInputs inputs = {0};
    *outcome = NULL;
    Status status =
        simulation_has_target(simulation)
            ? accuracy_target_run(simulation, limits, &own, workspace, NULL, outcome, problem)
            : run_scene(simulation, limits, &own, workspace, &inputs, outcome, problem);
    if (status == STATUS_OK && has_reduction)
        status = outcome_add_reduction(simulation, limits, &other, workspace, &inputs, *outcome,
                                       problem);
    run_inputs_clear(&inputs);
    if (status != STATUS_OK) {
        outcome_unref(*outcome);
        *outcome = NULL;
    }
    return status;
}
