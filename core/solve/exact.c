// The exact solver: between events the scene is a linear system, which is propagated exactly;
// events are located to rounding. One storey with one mass goes by single_mass.h. Everything else
// goes by the event engine, with a companion run beside it that shows how far the run can be
// trusted.
#include "core/solve/exact.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "core/solve/companion_run.h"
#include "core/solve/engine.h"
#include "core/solve/single_mass.h"

double exact_tolerance(const Accuracy *accuracy) {
    const double asked =
        accuracy == NULL ? (double)NAN : ((const AccuracyExact *)(const void *)accuracy)->tolerance;
    return asked > POWER_CONTACT_TOLERANCE ? asked : POWER_CONTACT_TOLERANCE;
}

// Linear contacts and impulses have closed forms.
static void exact_forget_unused(Accuracy *accuracy, bool has_power_law) {
    if (!has_power_law)
        ((AccuracyExact *)(void *)accuracy)->tolerance = (double)NAN;
}

static Status exact_decide(const Solver *solver, const Accuracy *accuracy, double base_interval,
                           Plan *plan, Problem *problem) {
    (void)solver, (void)base_interval, (void)problem;
    if (plan->form != CONTACT_POWER || plan->damper_count == 0)
        return STATUS_OK;
    const double tolerance = exact_tolerance(accuracy);
    const bool is_asked = tolerance > POWER_CONTACT_TOLERANCE;
    return decisions_add(&plan->report.decisions, "tolerance", is_asked ? "asked" : "rounding",
                         tolerance, NULL,
                         is_asked ? "relative error of a contact at its end; flight is exact, and "
                                    "events are located as accurately as the contacts"
                                  : "contacts are exact to rounding, since no tolerance is "
                                    "requested");
}

// clang-format off
const Field accuracy_exact_fields[] = {
    FIELD_BASE(AccuracyExact, accuracy, accuracy_fields),
    FIELD_REAL(AccuracyExact, tolerance, NULL, WITHIN(1e-15, 1e-1), OPTIONAL, "relative error of a contact under a power law at its end; if absent that of rounding; without effect on other laws, whose contacts have closed forms"),
    FIELD_END
};
// clang-format on

static Status exact_solve(EventEngine *engine, CompanionRun *companion) {
    ModalState *state = &engine->state;
    const Plan *plan = state->plan;
    TRY(event_engine_settle(engine));
    recorder_sample(&engine->record, state);
    companion_run_start(companion, engine);
    while (state->sample + 1 < plan->count) {
        const size_t next = (state->sample / COMPANION_SAMPLES + 1) * COMPANION_SAMPLES;
        const size_t until = next < plan->count - 1 ? next : plan->count - 1;
        while (state->sample < until)
            TRY(event_engine_step(engine, until));
        if (!companion_run_step(companion, state))
            TRY(event_engine_check(engine)); // the cause may be the run's own limit
    }
    companion_run_report(companion, state, state->impacts.response);
    // The duration may end between samples.
    TRY(event_engine_cross(engine, plan->duration - (double)state->sample / plan->sample_rate));
    recorder_update(state);
    TRY(event_engine_check(engine));
    return recorder_finish_log(state);
}

Status exact_run_engine(Run *run, Response *response, Problem *problem) {
    EventEngine engine;
    CompanionRun *companion = calloc(1, sizeof *companion);
    if (companion == NULL)
        return problem_set(problem, STATUS_NO_MEMORY, "no memory for a run");
    memset(&engine, 0, sizeof engine);
    Status status =
        event_engine_make(&engine, run, exact_tolerance(run->accuracy), response, problem);
    if (status == STATUS_OK)
        status = exact_solve(&engine, companion);
    if (engine.record.block != NULL)
        recorder_finish(&engine.record, &engine.state, response);
    event_engine_clear(&engine);
    companion_run_clear(companion);
    free(companion);
    return status;
}

static Status exact_advance(EventEngine *engine, double time) {
    const ModalState *state = &engine->state;
    const double rate = state->plan->sample_rate;
    const size_t sample = (size_t)floor(time * rate);
    if (state->offset > 0 && state->sample < sample)
        TRY(event_engine_finish_interval(engine));
    while (state->sample < sample)
        TRY(event_engine_step(engine, sample));
    return event_engine_cross(engine, time - (double)sample / rate);
}

static ContactPoint exact_point(ModalState *state, size_t index, Side side, double time) {
    const DamperState *damper = &state->damper[index];
    const double sign = modal_state_sign(side);
    const bool is_inside = damper->phase == PHASE_CONTACT || damper->phase == PHASE_INSIDE;
    Slice slice;
    (void)base_cursor_slice(&state->base, state->sample, state->offset, &slice);
    state->base_acceleration = slice.value;
    modal_state_forces(state);
    return (ContactPoint){time, sign * damper->force, is_inside ? fmax(sign * damper->r, 0) : 0,
                          sign * damper->w};
}

static Status exact_sample(EventEngine *engine, const OutputWindow *window) {
    engine->state.sample = window->first;
    if (window->first == 0)
        TRY(event_engine_settle(engine));
    for (size_t k = 0; k < window->count; k++) {
        const double time = window->start + (double)(k + 1) * window->interval;
        TRY(exact_advance(engine, time));
        window->points[k] = exact_point(&engine->state, window->damper, window->side, time);
    }
    TRY(exact_advance(engine, window->end));
    TRY(event_engine_check(engine));
    return recorder_finish_log(&engine->state);
}

Status exact_run_window(Run *run, const OutputWindow *window, Response *response,
                        Problem *problem) {
    EventEngine engine;
    memset(&engine, 0, sizeof engine);
    Status status =
        event_engine_make(&engine, run, exact_tolerance(run->accuracy), response, problem);
    if (status == STATUS_OK)
        status = exact_sample(&engine, window);
    event_engine_clear(&engine);
    return status;
}

static Status exact_run(const Solver *solver, Run *run, Response *response, Problem *problem) {
    (void)solver;
    if (!single_mass_serves(run->plan, run->is_clear))
        return exact_run_engine(run, response, problem);
    // With values at all output samples single_mass.h moves over many of them at once.
    const size_t fine =
        base_cursor_refined_count(run->base, run->plan->sample_rate, run->plan->count);
    Workspace none = {0}, *workspace = run->workspace == NULL ? &none : run->workspace;
    double *const values = fine == 0 ? NULL : workspace_values(workspace, fine);
    if (values == NULL)
        return single_mass_run(run, response, problem);
    Base refined;
    Run own = *run;
    own.base = &refined;
    Status status = base_cursor_refine(run->base, run->plan->sample_rate, fine, values,
                                       run->progress, &refined, problem);
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
