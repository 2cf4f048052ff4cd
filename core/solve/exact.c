// The exact solver: between events the scene is a linear system, which is propagated exactly;
// events are located to rounding. One storey with one mass goes by single_mass.h, everything else
// by event_engine.h.
#include "core/solve/event_engine.h"
#include "core/solve/exact_accuracy.h"
#include "core/solve/refine.h"
#include "core/solve/single_mass.h"
#include "core/solve/solver.h"

static Status exact_run(Run *run, Response *response, Problem *problem) {
    if (!single_mass_serves(run->plan, run->is_clear))
        return event_engine_run(run, response, problem);
    // A base whose samples are further apart than the output's goes by strides once it has them.
    const size_t fine = refine_count(run->base, run->plan->sample_rate, run->plan->count);
    Workspace none = {0}, *workspace = run->workspace == NULL ? &none : run->workspace;
    double *const values = fine == 0 ? NULL : workspace_values(workspace, fine);
    if (values == NULL)
        return single_mass_run(run, response, problem);
    Base refined;
    Run own = *run;
    own.base = &refined;
    Status status = refine_base(run->base, run->plan->sample_rate, fine, values, run->progress,
                                &refined, problem);
    if (status == STATUS_OK)
        status = single_mass_run(&own, response, problem);
    run->steps = own.steps;
    run->work = own.work;
    workspace_tidy(workspace);
    workspace_clear(&none);
    return status;
}

const Solver solver_exact = {
    .kind = {"exact", "each contact state propagated exactly, events located to rounding",
             accuracy_exact_fields, sizeof(AccuracyExact)},
    .run = exact_run,
    .decide = exact_decide,
    .forget_unused = exact_forget_unused,
};
