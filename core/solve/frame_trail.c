#include "core/solve/frame_trail.h"

#include <stdlib.h>
#include <string.h>

Status frame_trail_make(FrameTrail *trail, const Frame *frame, Problem *problem) {
    const size_t m = frame->dampers, padded = frame->padded;
    trail->padded = padded;
    trail->block =
        calloc(frame_lanes_room((5 * padded + 2 * m + 3) * TRAIL_ROWS), sizeof *trail->block);
    if (trail->block == NULL)
        return problem_set(problem, STATUS_NO_MEMORY, "no memory for a run of %zu modes",
                           frame->mode_count);
    double *at = frame_lanes_start(trail->block);
    double **const stretches[] = {&trail->q, &trail->p, &trail->moved, &trail->sped,
                                  &trail->elastic};
    for (size_t i = 0; i < COUNT(stretches); i++, at += TRAIL_ROWS * padded)
        *stretches[i] = at;
    trail->r = at;
    trail->z = trail->r + m * TRAIL_ROWS;
    trail->a = trail->z + m * TRAIL_ROWS;
    trail->b = trail->a + TRAIL_ROWS;
    trail->ground = trail->b + TRAIL_ROWS;
    return STATUS_OK;
}

void frame_trail_clear(FrameTrail *trail) {
    free(trail->block);
}

void frame_trail_feel(FrameTrail *trail, const Frame *frame, size_t count) {
    const size_t padded = trail->padded;
    const double *q = trail->q + padded, *p = trail->p + padded;
    if (frame->diagonal != NULL)
        frame->lanes->mix(padded, count, frame->diagonal, p, frame->omega2, q,
                          trail->elastic + padded);
    for (size_t at = padded; at <= count * padded && frame->diagonal == NULL; at += padded)
        frame_elastic(frame, trail->q + at, trail->p + at, trail->elastic + at);
    for (size_t k = 1; k <= count && frame->unmoved != NULL; k++)
        trail->elastic[k * padded + frame->mode_count] =
            base_cursor_at(&frame->base, frame->sample - count + k);
}

void frame_trail_take(FrameTrail *trail, const Frame *frame, double ground) {
    const size_t at = trail->padded;
    memcpy(trail->q + at, frame->q, at * sizeof *frame->q);
    memcpy(trail->p + at, frame->p, at * sizeof *frame->p);
    memcpy(trail->elastic + at, frame->elastic, at * sizeof *frame->elastic);
    trail->ground[0] = ground;
    for (size_t d = 0; d < frame->dampers; d++) {
        const FrameDamper *damper = &frame->damper[d];
        trail->r[d * TRAIL_ROWS + 1] = damper->r;
        trail->z[d * TRAIL_ROWS + 1] =
            frame_dot(damper->shape, frame->p, frame->mode_count) + damper->w;
    }
}
