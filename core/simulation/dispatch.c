// Entry points: each decides between a plain scene, an accuracy target and a comparison with the
// undamped baseline.
#include <stddef.h>

#include "core/simulation/internal.h"

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
    const Cost undamped = undamped_baseline_cost(simulation);
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
