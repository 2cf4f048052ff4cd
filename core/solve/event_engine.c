// A run of the general engine from its first sample to its end, with a neighbour beside it.
#include "core/solve/event_engine.h"

#include <stdlib.h>
#include <string.h>

#include "core/solve/exact_accuracy.h"
#include "core/solve/companion_run.h"
#include "core/solve/recorder.h"

static Status solve(FrameEngine *engine, FrameNeighbour *neighbour) {
    Frame *frame = &engine->frame;
    const Plan *plan = frame->plan;
    TRY(frame_engine_settle(engine));
    frame_engine_take_sample(engine);
    frame_neighbour_start(neighbour, engine);
    while (frame->sample + 1 < plan->count) {
        const size_t next = (frame->sample / NEIGHBOUR_SAMPLES + 1) * NEIGHBOUR_SAMPLES;
        const size_t until = next < plan->count - 1 ? next : plan->count - 1;
        while (frame->sample < until)
            TRY(frame_engine_step(engine, until));
        if (!frame_neighbour_step(neighbour, frame))
            TRY(frame_engine_check(engine)); // it may have been told to stop
    }
    frame_neighbour_tell(neighbour, frame, frame->ledger.response);
    // The duration may end between samples.
    TRY(frame_engine_cross(engine, plan->duration - (double)frame->sample / plan->sample_rate));
    frame_record_note(frame);
    TRY(frame_engine_check(engine));
    return frame_record_ledger(frame);
}

Status frame_run(Run *run, Response *response, Problem *problem) {
    FrameEngine engine;
    FrameNeighbour *neighbour = calloc(1, sizeof *neighbour);
    if (neighbour == NULL)
        return problem_set(problem, STATUS_NO_MEMORY, "no memory for a run");
    memset(&engine, 0, sizeof engine);
    Status status =
        frame_engine_make(&engine, run, exact_tolerance(run->accuracy), response, problem);
    if (status == STATUS_OK)
        status = solve(&engine, neighbour);
    if (engine.record.block != NULL)
        frame_record_finish(&engine.record, &engine.frame, response);
    frame_engine_clear(&engine);
    frame_neighbour_clear(neighbour);
    free(neighbour);
    return status;
}
