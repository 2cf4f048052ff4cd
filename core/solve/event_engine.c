// A run of the general engine from its first sample to its end, with a neighbour beside it.
#include "core/solve/event_engine.h"

#include <stdlib.h>
#include <string.h>

#include "core/solve/companion_run.h"
#include "core/solve/exact_accuracy.h"
#include "core/solve/recorder.h"

static Status solve(EventEngine *engine, CompanionRun *neighbour) {
    ModalState *state = &engine->state;
    const Plan *plan = state->plan;
    TRY(event_engine_settle(engine));
    event_engine_take_sample(engine);
    companion_run_start(neighbour, engine);
    while (state->sample + 1 < plan->count) {
        const size_t next = (state->sample / COMPANION_SAMPLES + 1) * COMPANION_SAMPLES;
        const size_t until = next < plan->count - 1 ? next : plan->count - 1;
        while (state->sample < until)
            TRY(event_engine_step(engine, until));
        if (!companion_run_step(neighbour, state))
            TRY(event_engine_check(engine)); // it may have been told to stop
    }
    companion_run_tell(neighbour, state, state->impacts.response);
    // The duration may end between samples.
    TRY(event_engine_cross(engine, plan->duration - (double)state->sample / plan->sample_rate));
    recorder_note(state);
    TRY(event_engine_check(engine));
    return recorder_ledger(state);
}

Status event_engine_run(Run *run, Response *response, Problem *problem) {
    EventEngine engine;
    CompanionRun *neighbour = calloc(1, sizeof *neighbour);
    if (neighbour == NULL)
        return problem_set(problem, STATUS_NO_MEMORY, "no memory for a run");
    memset(&engine, 0, sizeof engine);
    Status status =
        event_engine_make(&engine, run, exact_tolerance(run->accuracy), response, problem);
    if (status == STATUS_OK)
        status = solve(&engine, neighbour);
    if (engine.record.block != NULL)
        recorder_finish(&engine.record, &engine.state, response);
    event_engine_clear(&engine);
    companion_run_clear(neighbour);
    free(neighbour);
    return status;
}
