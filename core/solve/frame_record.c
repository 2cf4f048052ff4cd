// The summary names one number for a whole structure: the largest over its storeys.
#include "core/solve/frame_record.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

Status frame_record_start(FrameRecord *record, const Frame *frame, Response *response,
                          Problem *problem) {
    const size_t n = frame->storeys;
    memset(record, 0, sizeof *record);
    record->block = calloc(n, 3 * sizeof *record->block);
    if (record->block == NULL)
        return problem_set(problem, STATUS_NO_MEMORY, "no memory for a run of %zu storeys", n);
    record->last_velocity = record->block;
    record->sum_displacement = record->block + n;
    record->sum_acceleration = record->block + 2 * n;
    record->statistics_start =
        (size_t)ceil(frame->run->statistics_from * frame->plan->sample_rate * (1 - 1e-12));
    response->sample_rate = frame->plan->sample_rate;
    response->count = frame->plan->count;
    return STATUS_OK;
}

void frame_record_clear(FrameRecord *record) {
    free(record->block);
}

static double value(const FrameRecord *record, const Frame *frame, const RunColumn *column) {
    const size_t i = column->number;
    switch (column->channel) {
    case CHANNEL_DISPLACEMENT:
        return frame->x[i];
    case CHANNEL_VELOCITY:
        return frame->v[i];
    case CHANNEL_ACCELERATION:
        return frame->a[i];
    case CHANNEL_MEAN_ACCELERATION:
        return frame->sample == 0 ? frame->a[i]
                                  : (frame->v[i] - record->last_velocity[i] +
                                     frame->plan->influence[i] * record->base_speed) *
                                        frame->plan->sample_rate;
    case CHANNEL_BASE_ACCELERATION:
        return frame->ground;
    default:
        break;
    }
    const FrameDamper *damper = &frame->damper[i];
    const size_t storey = damper->plan->storey;
    const bool is_inside = damper->phase == FRAME_CONTACT || damper->phase == FRAME_INSIDE;
    switch (column->channel) {
    case CHANNEL_DAMPER_DISPLACEMENT:
        return frame->x[storey] + frame_relative(damper);
    case CHANNEL_DAMPER_VELOCITY:
        return frame->v[storey] + damper->w;
    case CHANNEL_PENETRATION:
        return is_inside ? fmax(frame_sign(damper->side) * damper->r, 0) : 0;
    case CHANNEL_CONTACT_FORCE:
        return damper->force;
    default:
        return 0;
    }
}

void frame_record_take(FrameRecord *record, Frame *frame) {
    const size_t n = frame->storeys;
    for (size_t i = 0; i < frame->run->column_count; i++)
        frame->run->columns[i].values[frame->sample] =
            value(record, frame, &frame->run->columns[i]);
    memcpy(record->last_velocity, frame->v, n * sizeof *frame->v);
    record->base_speed = 0;
    if (frame->sample < record->statistics_start)
        return;
    record->count++;
    for (size_t i = 0; i < n; i++) {
        record->sum_displacement[i] += frame->x[i] * frame->x[i];
        record->sum_acceleration[i] += frame->a[i] * frame->a[i];
    }
}

static double largest(const double *values, size_t count) {
    double most = 0;
    for (size_t i = 0; i < count; i++) {
        const double magnitude = fabs(values[i]);
        most = magnitude > most ? magnitude : most;
    }
    return most;
}

void frame_record_finish(const FrameRecord *record, const Frame *frame, Response *response) {
    response->sum_squares_displacement = largest(record->sum_displacement, frame->storeys);
    response->sum_squares_acceleration = largest(record->sum_acceleration, frame->storeys);
    response->statistics_count = record->count;
}

static Moment moment(const Frame *frame) {
    Moment at = {.x = largest(frame->x, frame->storeys),
                 .v = largest(frame->v, frame->storeys),
                 .acceleration = largest(frame->a, frame->storeys)};
    for (size_t d = 0; d < frame->dampers; d++) {
        const FrameDamper *damper = &frame->damper[d];
        at.damper_x =
            fmax(at.damper_x, fabs(frame->x[damper->plan->storey] + frame_relative(damper)));
        at.force = fmax(at.force, fabs(damper->force));
    }
    return at;
}

void frame_record_peaks(Frame *frame) {
    const Moment at = moment(frame);
    ledger_peaks(&frame->ledger, &at);
}

void frame_record_forget(Frame *frame) {
    const Moment at = moment(frame);
    ledger_forget_peaks(&frame->ledger, &at);
}

void frame_record_note(Frame *frame) {
    frame_look(frame);
    frame_record_peaks(frame);
    const EnergyState energy = frame_energy(frame);
    ledger_balance(&frame->ledger, &energy);
}
