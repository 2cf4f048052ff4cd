// Entry points: each decides between a plain scene, an accuracy target and a comparison with the
// scene without dampers.
#include <math.h>
#include <string.h>

#include "core/simulation/internal.h"

// The scene without its dampers, run for comparison. It samples no channels, because only its
// summary is used. An accuracy target is about the dampers, so without them the exact solver runs.
// The view borrows its members from `simulation`.
static Simulation undamped_baseline_view(const Simulation *simulation) {
    Simulation view = *simulation;
    view.scene.dampers = (Dampers){NULL, 0};
    view.output = (Output){.statistics_from = simulation->output.statistics_from,
                           .psd = {.window = simulation->output.psd.window,
                                   .detrend = simulation->output.psd.detrend}};
    view.output.psd.segment = view.output.psd.overlap = COUNT_ABSENT;
    view.title = NULL;
    view.labels = (Texts){NULL, 0};
    return view;
}

// A completed copy, whose contact is that of a scene without dampers.
static Status undamped_baseline_make(const Simulation *simulation, Simulation *undamped,
                                     Problem *problem) {
    const Simulation view = undamped_baseline_view(simulation);
    if (fields_copy(simulation_fields, &view, undamped) != STATUS_OK)
        return problem_set(problem, STATUS_NO_MEMORY, "no memory for the scene without dampers");
    if (simulation_has_target(simulation)) {
        Variant *accuracy = variant_new(&solver_exact.kind);
        if (accuracy == NULL)
            return problem_set(problem, STATUS_NO_MEMORY, "no memory for a solver's settings");
        variant_free(undamped->accuracy);
        undamped->accuracy = accuracy;
    }
    return simulation_validate(undamped, NULL, NULL, problem);
}

static double undamped_baseline_reduction(double with, double without) {
    return without > 0 ? 1 - with / without : (double)NAN;
}

// Runs the scene without its dampers, compares the outcome's summary with it and adds its work.
static Status undamped_baseline_run(const Simulation *simulation, const SimulationLimits *limits,
                                    const Progress *progress, Workspace *workspace,
                                    Outcome *outcome, Problem *problem) {
    Simulation undamped;
    Outcome *other = NULL;
    memset(&undamped, 0, sizeof undamped);
    Status status = undamped_baseline_make(simulation, &undamped, problem);
    if (status == STATUS_OK)
        status = run_scene(&undamped, limits, progress, workspace, NULL, &other, problem);
    if (status == STATUS_OK) {
        const Summary *with = &outcome->summary, *without = &other->summary;
        outcome->has_reduction = true;
        outcome->reduction = (Reduction){
            undamped_baseline_reduction(with->peak_displacement, without->peak_displacement),
            undamped_baseline_reduction(with->rms_displacement, without->rms_displacement),
            undamped_baseline_reduction(with->peak_acceleration, without->peak_acceleration),
            undamped_baseline_reduction(with->rms_acceleration, without->rms_acceleration),
        };
        outcome->steps += other->steps;
        work_counters_add(&outcome->work, &other->work);
    }
    outcome_unref(other);
    simulation_clear(&undamped);
    return status;
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
                           "would make a document of about %.3g MB, at most %.4g MB can be kept: "
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
    const Simulation view = undamped_baseline_view(simulation);
    const Cost undamped = cost_scene(&view);
    cost.steps += undamped.steps;
    cost.cpu_seconds += undamped.cpu_seconds;
    cost.base += undamped.base;
    cost.bytes += undamped.bytes; // the first outcome is still in memory
    return cost;
}

static Status simulation_run_damped(const Simulation *simulation, const SimulationLimits *limits,
                                    const Progress *progress, Workspace *workspace,
                                    Outcome **outcome, Problem *problem) {
    return simulation_has_target(simulation)
               ? accuracy_target_run(simulation, limits, progress, workspace, NULL, outcome,
                                     problem)
               : run_scene(simulation, limits, progress, workspace, NULL, outcome, problem);
}

Status simulation_run(const Simulation *simulation, const SimulationLimits *limits,
                      const Progress *progress, Workspace *workspace, Outcome **outcome,
                      Problem *problem) {
    static const double share = 0.8; // of the progress, if the undamped scene follows
    *outcome = NULL;
    if (!simulation->output.reduction)
        return simulation_run_damped(simulation, limits, progress, workspace, outcome, problem);
    ProgressRange first = progress_range(progress, 0, share),
                  second = progress_range(progress, share, 1 - share);
    const Progress damped = progress_range_view(&first), undamped = progress_range_view(&second);
    TRY(simulation_run_damped(simulation, limits, &damped, workspace, outcome, problem));
    const Status status =
        undamped_baseline_run(simulation, limits, &undamped, workspace, *outcome, problem);
    if (status != STATUS_OK) {
        outcome_unref(*outcome);
        *outcome = NULL;
    }
    return status;
}
