// The summary names one number for a whole structure: the largest over its storeys. Most samples
// hold no new peak, and the sum over modes of |q_i| times the mode's widest shape tells so without
// a look at any storey. Sums of squares are taken over pairs of modes, several samples at a time,
// and become the storeys' in the end.
#include "core/solve/frame_record.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

Status frame_record_start(FrameRecord *record, const Frame *frame, Response *response,
                          Problem *problem) {
    const size_t n = frame->storeys, columns = frame->run->column_count;
    memset(record, 0, sizeof *record);
    record->block = calloc(2 * n * (n + RECORD_BATCH) + columns, sizeof *record->block);
    if (record->block == NULL)
        return problem_set(problem, STATUS_NO_MEMORY, "no memory for a run of %zu storeys", n);
    for (size_t k = 0; k < 2; k++) {
        record->squares[k] = record->block + k * n * n;
        record->batch[k] = record->block + 2 * n * n + k * RECORD_BATCH * n;
    }
    record->last_velocity = record->block + 2 * n * (n + RECORD_BATCH);
    record->statistics_start =
        (size_t)ceil(frame->run->statistics_from * frame->plan->sample_rate * (1 - 1e-12));
    response->sample_rate = frame->plan->sample_rate;
    response->count = frame->plan->count;
    return STATUS_OK;
}

void frame_record_clear(FrameRecord *record) {
    free(record->block);
}

static double mean_acceleration(FrameRecord *record, const Frame *frame, size_t column) {
    const size_t storey = frame->run->columns[column].number;
    const double velocity = frame_velocity(frame, storey), last = record->last_velocity[column];
    record->last_velocity[column] = velocity;
    if (frame->sample == 0)
        return frame_storey_acceleration(frame, storey);
    return (velocity - last + frame->plan->influence[storey] * record->base_speed) *
           frame->plan->sample_rate;
}

static double value(FrameRecord *record, const Frame *frame, size_t column) {
    const ChannelId channel = frame->run->columns[column].channel;
    const size_t i = frame->run->columns[column].number;
    switch (channel) {
    case CHANNEL_DISPLACEMENT:
        return frame_displacement(frame, i);
    case CHANNEL_VELOCITY:
        return frame_velocity(frame, i);
    case CHANNEL_ACCELERATION:
        return frame_storey_acceleration(frame, i);
    case CHANNEL_MEAN_ACCELERATION:
        return mean_acceleration(record, frame, column);
    case CHANNEL_BASE_ACCELERATION:
        return frame->ground;
    default:
        break;
    }
    const FrameDamper *damper = &frame->damper[i];
    const size_t storey = damper->plan->storey;
    const bool is_inside = damper->phase == FRAME_CONTACT || damper->phase == FRAME_INSIDE;
    switch (channel) {
    case CHANNEL_DAMPER_DISPLACEMENT:
        return frame_displacement(frame, storey) + frame_relative(damper);
    case CHANNEL_DAMPER_VELOCITY:
        return frame_velocity(frame, storey) + damper->w;
    case CHANNEL_PENETRATION:
        return is_inside ? fmax(frame_sign(damper->side) * damper->r, 0) : 0;
    case CHANNEL_CONTACT_FORCE:
        return damper->force;
    default:
        return 0;
    }
}

// squares += the batch's products; rows left over are 0. Eight samples at once spare the sums'
// ways to memory and back.
static void add_batch(double *restrict squares, double *restrict batch, size_t n) {
    for (size_t i = 0; i < n; i++) {
        double *restrict row = squares + i * n, own[RECORD_BATCH];
        for (size_t k = 0; k < RECORD_BATCH; k++)
            own[k] = batch[k * n + i];
        for (size_t j = 0; j <= i; j++) {
            double sum = 0;
            for (size_t k = 0; k < RECORD_BATCH; k++)
                sum += own[k] * batch[k * n + j];
            row[j] += sum;
        }
    }
    memset(batch, 0, RECORD_BATCH * n * sizeof *batch);
}

static void add_squares(FrameRecord *record, const Frame *frame) {
    const size_t n = frame->storeys, at = record->count++ % RECORD_BATCH;
    double *restrict pull = record->batch[1] + at * n;
    memcpy(record->batch[0] + at * n, frame->q, n * sizeof *frame->q);
    for (size_t i = 0; i < n; i++)
        pull[i] = -frame->elastic[i];
    for (size_t d = 0; d < frame->dampers; d++) {
        const double force = frame->damper[d].force, *shape = frame->damper[d].shape;
        for (size_t i = 0; i < n && force != 0; i++)
            pull[i] += shape[i] * force;
    }
    if (at + 1 == RECORD_BATCH)
        for (size_t k = 0; k < 2; k++)
            add_batch(record->squares[k], record->batch[k], n);
}

void frame_record_take(FrameRecord *record, Frame *frame) {
    for (size_t i = 0; i < frame->run->column_count; i++)
        frame->run->columns[i].values[frame->sample] = value(record, frame, i);
    record->base_speed = 0;
    if (frame->sample >= record->statistics_start)
        add_squares(record, frame);
}

// The largest shape' squares shape of any storey.
static double largest_sum(const double *squares, const Frame *frame) {
    const size_t n = frame->storeys;
    double most = 0;
    for (size_t j = 0; j < n; j++) {
        const double *shape = frame->modes->shapes + j * n;
        double sum = 0;
        for (size_t i = 0; i < n; i++)
            sum += shape[i] *
                   (2 * frame_dot(squares + i * n, shape, i) + squares[i * n + i] * shape[i]);
        most = fmax(most, sum);
    }
    return most;
}

void frame_record_finish(FrameRecord *record, const Frame *frame, Response *response) {
    for (size_t k = 0; k < 2; k++)
        add_batch(record->squares[k], record->batch[k], frame->storeys);
    response->sum_squares_displacement = largest_sum(record->squares[0], frame);
    response->sum_squares_acceleration = largest_sum(record->squares[1], frame);
    response->statistics_count = record->count;
}

typedef double Look(const Frame *frame, size_t storey);

static double largest(const Frame *frame, Look *look) {
    double most = 0;
    for (size_t j = 0; j < frame->storeys; j++)
        most = fmax(most, fabs(look(frame, j)));
    return most;
}

// No storey's value can be larger where its modes' are these.
static double bound(const Frame *frame, const double *modal) {
    double sum[2] = {0, 0};
    size_t i = 0;
    for (; i + 2 <= frame->storeys; i += 2)
        for (size_t k = 0; k < 2; k++)
            sum[k] += frame->widest[i + k] * fabs(modal[i + k]);
    if (i < frame->storeys)
        sum[0] += frame->widest[i] * fabs(modal[i]);
    return sum[0] + sum[1];
}

void frame_record_acceleration(Frame *frame) {
    double most = bound(frame, frame->elastic);
    for (size_t d = 0; d < frame->dampers; d++)
        most += frame->damper[d].thrust * fabs(frame->damper[d].force);
    if (most > frame->ledger.response->peaks.acceleration)
        ledger_acceleration(&frame->ledger, largest(frame, frame_storey_acceleration));
}

void frame_record_peaks(Frame *frame) {
    const Peaks *peaks = &frame->ledger.response->peaks;
    Moment at = {0};
    const double far = bound(frame, frame->q);
    if (far > peaks->displacement)
        at.x = largest(frame, frame_displacement);
    if (bound(frame, frame->p) > peaks->velocity)
        at.v = largest(frame, frame_velocity);
    for (size_t d = 0; d < frame->dampers; d++) {
        const FrameDamper *damper = &frame->damper[d];
        const double relative = frame_relative(damper);
        if (far + fabs(relative) > peaks->damper_displacement)
            at.damper_x =
                fmax(at.damper_x, fabs(frame_displacement(frame, damper->plan->storey) + relative));
    }
    ledger_peaks(&frame->ledger, &at);
    frame_record_acceleration(frame);
}

void frame_record_forget(Frame *frame) {
    Moment at = {0};
    for (size_t d = 0; d < frame->dampers; d++)
        at.force = fmax(at.force, fabs(frame->damper[d].force));
    ledger_forget_peaks(&frame->ledger, &at);
}

void frame_record_note(Frame *frame) {
    if (frame->is_shadow)
        return;
    frame_feel(frame);
    frame_record_peaks(frame);
    const EnergyState energy = frame_energy(frame);
    ledger_balance(&frame->ledger, &energy);
}
