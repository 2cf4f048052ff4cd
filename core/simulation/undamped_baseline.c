// Nothing of the bare run is kept but its summary, so it samples no channels. A target is the
// dampers' accuracy: without them the scene is solved exactly.
#include "core/simulation/undamped_baseline.h"

#include <math.h>
#include <string.h>

#include "core/simulation/accuracy_target.h"
#include "core/solve/solvers.h"

// Only its summary, borrowed from the whole.
static Simulation strip(const Simulation *simulation) {
    Simulation bare = *simulation;
    bare.scene.dampers = (Dampers){NULL, 0};
    bare.output = (Output){.statistics_from = simulation->output.statistics_from,
                           .psd = {.window = simulation->output.psd.window,
                                   .detrend = simulation->output.psd.detrend}};
    bare.output.psd.segment = bare.output.psd.overlap = COUNT_ABSENT;
    bare.title = NULL;
    bare.labels = (Texts){NULL, 0};
    return bare;
}

// A simulation of its own, whose contact is that of a scene without dampers.
static Status make(const Simulation *simulation, Simulation *bare, Problem *problem) {
    const Simulation view = strip(simulation);
    if (fields_copy(simulation_fields, &view, bare) != STATUS_OK)
        return problem_set(problem, STATUS_NO_MEMORY, "no memory for the scene without dampers");
    if (aim_is_asked(simulation)) {
        Variant *accuracy = variant_new(&solver_exact.kind);
        if (accuracy == NULL)
            return problem_set(problem, STATUS_NO_MEMORY, "no memory for a solver's settings");
        variant_free(bare->accuracy);
        bare->accuracy = accuracy;
    }
    return simulation_complete(bare, NULL, NULL, problem);
}

static double saved(double with, double without) {
    return without > 0 ? 1 - with / without : (double)NAN;
}

Status bare_compare(const Simulation *simulation, const SimulationLimits *limits,
                    const Progress *progress, Workspace *workspace, Outcome *outcome,
                    Problem *problem) {
    Simulation bare;
    Outcome *other = NULL;
    memset(&bare, 0, sizeof bare);
    Status status = make(simulation, &bare, problem);
    if (status == STATUS_OK)
        status = simulation_run(&bare, limits, progress, workspace, &other, problem);
    if (status == STATUS_OK) {
        const Summary *with = &outcome->summary, *without = &other->summary;
        outcome->has_reduction = true;
        outcome->reduction = (Reduction){
            saved(with->peak_displacement, without->peak_displacement),
            saved(with->rms_displacement, without->rms_displacement),
            saved(with->peak_acceleration, without->peak_acceleration),
            saved(with->rms_acceleration, without->rms_acceleration),
        };
        outcome->steps += other->steps;
        work_add(&outcome->work, &other->work);
    }
    outcome_unref(other);
    simulation_clear(&bare);
    return status;
}

Cost bare_cost(const Simulation *simulation) {
    Simulation bare;
    Cost cost = {0};
    memset(&bare, 0, sizeof bare);
    if (make(simulation, &bare, NULL) == STATUS_OK)
        cost = simulation_cost(&bare);
    simulation_clear(&bare);
    return cost;
}
