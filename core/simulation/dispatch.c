// Entry points: each decides between a plain scene, an accuracy target and a comparison with the
// scene without dampers.
#include <math.h>

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

// Runs the scene without its dampers, compares the outcome's summary with it and adds its work.
static Status undamped_baseline_run(const Simulation *simulation, const SimulationLimits *limits,
                                    const Progress *progress, Workspace *workspace,
                                    Outcome *outcome, Problem *problem) {
    UndampedBaseline undamped;
    Outcome *other;
    undamped_baseline_set(simulation, &undamped);
    TRY(run_scene(&undamped.view, limits, progress, workspace, NULL, &other, problem));
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
    outcome_unref(other);
    return STATUS_OK;
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
    cost.steps += other.steps;
    cost.cpu_seconds += other.cpu_seconds;
    cost.base += other.base;
    cost.bytes += other.bytes; // the first outcome is still in memory
    return cost;
}

Status simulation_run(const Simulation *simulation, const SimulationLimits *limits,
                      const Progress *progress, Workspace *workspace, Outcome **outcome,
                      Problem *problem) {
    const bool has_reduction = simulation->output.reduction;
    const double share = has_reduction ? 0.8 : 1; // of the progress, if another run follows
    const Progress own = progress_range_view(&(ProgressRange){progress, 0, share, 0});
    const Progress other = progress_range_view(&(ProgressRange){progress, share, 1 - share, 0});
    *outcome = NULL;
    TRY(simulation_has_target(simulation)
            ? accuracy_target_run(simulation, limits, &own, workspace, NULL, outcome, problem)
            : run_scene(simulation, limits, &own, workspace, NULL, outcome, problem));
    const Status status = has_reduction ? undamped_baseline_run(simulation, limits, &other,
                                                                workspace, *outcome, problem)
                                        : STATUS_OK;
    if (status != STATUS_OK) {
        outcome_unref(*outcome);
        *outcome = NULL;
    }
    return status;
}
