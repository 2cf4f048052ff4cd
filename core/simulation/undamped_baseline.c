// The scene without its dampers, run for comparison. It samples no channels, because only its
// summary is used. An accuracy target is about the dampers, so without them the exact solver runs.
#include <math.h>
#include <string.h>

#include "core/simulation/internal.h"

// Borrows its members from `simulation`.
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

Status undamped_baseline_run(const Simulation *simulation, const SimulationLimits *limits,
                             const Progress *progress, Workspace *workspace, Outcome *outcome,
                             Problem *problem) {
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

Cost undamped_baseline_cost(const Simulation *simulation) {
    const Simulation view = undamped_baseline_view(simulation);
    return cost_scene(&view);
}
