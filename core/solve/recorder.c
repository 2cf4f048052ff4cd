// The summary names one number for a whole structure: the largest over its storeys. Most samples
// hold no new peak, and the sum over modes of |q_i| times the mode's widest shape tells so without
// a look at any storey. Sums of squares are taken over pairs of modes, several samples at a time,
// and become the storeys' in the end.
#include "core/solve/recorder.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

// Of the storey that a column is of, or its damper's.
static const double *shape_of(const Frame *frame, const RunColumn *column) {
    switch (column->channel) {
    case CHANNEL_DISPLACEMENT:
    case CHANNEL_VELOCITY:
    case CHANNEL_ACCELERATION:
    case CHANNEL_MEAN_ACCELERATION:
        return frame->modes->shapes + column->number * frame->mode_count;
    case CHANNEL_BASE_ACCELERATION:
        return frame->modes->shapes; // of no use
    default:
        return frame->damper[column->number].shape;
    }
}

Status frame_record_start(FrameRecord *record, const FrameTrail *trail, const Frame *frame,
                          Response *response, Problem *problem) {
    const size_t n = frame->mode_count, columns = frame->run->column_count, padded = trail->padded;
    const size_t square = padded * padded;
    memset(record, 0, sizeof *record);
    record->block =
        calloc(2 * (square + TRAIL_MAX * padded) + columns * (1 + padded), sizeof *record->block);
    if (record->block == NULL)
        return problem_set(problem, STATUS_NO_MEMORY, "no memory for a run of %zu modes", n);
    record->trail = trail;
    for (size_t k = 0; k < 2; k++) {
        record->squares[k] = record->block + k * square;
        record->batch[k] = record->block + 2 * square + k * TRAIL_MAX * padded;
    }
    record->shapes = record->batch[1] + TRAIL_MAX * padded;
    record->last_velocity = record->shapes + columns * padded;
    for (size_t i = 0; i < columns; i++) {
        const RunColumn *column = &frame->run->columns[i];
        memcpy(record->shapes + i * padded, shape_of(frame, column), n * sizeof *record->shapes);
        if (frame->unmoved != NULL && column->channel == CHANNEL_ACCELERATION)
            record->shapes[i * padded + n] = -frame->unmoved[column->number];
    }
    record->statistics_start =
        (size_t)ceil(frame->run->statistics_from * frame->plan->sample_rate * (1 - 1e-12));
    response->sample_rate = frame->plan->sample_rate;
    response->count = frame->plan->count;
    return STATUS_OK;
}

void frame_record_clear(FrameRecord *record) {
    free(record->block);
}

// Speeds to means over the intervals before.
static void take_means(FrameRecord *record, const Frame *frame, size_t column, double *values,
                       size_t count) {
    const double share = frame->plan->influence[frame->run->columns[column].number];
    for (size_t k = 0; k < count; k++) {
        const double velocity = values[k];
        values[k] = (velocity - record->last_velocity[column] + share * record->trail->ground[k]) *
                    frame->plan->sample_rate;
        record->last_velocity[column] = velocity;
    }
}

static void take_storey(FrameRecord *record, const Frame *frame, size_t column, double *values,
                        size_t count) {
    const FrameTrail *trail = record->trail;
    const ChannelId channel = frame->run->columns[column].channel;
    const size_t padded = trail->padded, storey = frame->run->columns[column].number;
    const double *rows = channel == CHANNEL_ACCELERATION   ? trail->elastic
                         : channel == CHANNEL_DISPLACEMENT ? trail->q
                                                           : trail->p;
    const double *shape = record->shapes + column * padded;
    frame->lanes->dot(padded, count, shape, rows + padded, values);
    if (channel == CHANNEL_MEAN_ACCELERATION) {
        take_means(record, frame, column, values, count);
        if (frame->sample == 0)
            values[0] = frame_storey_acceleration(frame, storey);
    }
    if (channel != CHANNEL_ACCELERATION)
        return;
    double push = 0;
    for (size_t d = 0; d < frame->dampers; d++)
        push += frame->mobility[d * frame->storey_count + storey] * frame->damper[d].force;
    for (size_t k = 0; k < count; k++)
        values[k] = push - values[k];
}

static void take_damper(FrameRecord *record, const Frame *frame, size_t column, double *values,
                        size_t count) {
    const FrameTrail *trail = record->trail;
    const RunColumn *wanted = &frame->run->columns[column];
    const FrameDamper *damper = &frame->damper[wanted->number];
    const double *r = trail->r + wanted->number * TRAIL_ROWS + 1;
    const double *z = trail->z + wanted->number * TRAIL_ROWS + 1;
    if (wanted->channel == CHANNEL_DAMPER_DISPLACEMENT) {
        const double middle = frame_middle(damper);
        frame->lanes->dot(trail->padded, count, record->shapes + column * trail->padded,
                          trail->q + trail->padded, values);
        for (size_t k = 0; k < count; k++)
            values[k] += middle + r[k];
        return;
    }
    const bool is_inside = damper->phase == FRAME_CONTACT || damper->phase == FRAME_INSIDE;
    for (size_t k = 0; k < count; k++)
        values[k] = wanted->channel == CHANNEL_DAMPER_VELOCITY ? z[k]
                    : wanted->channel == CHANNEL_CONTACT_FORCE ? damper->force
                    : is_inside ? fmax(frame_sign(damper->side) * r[k], 0)
                                : 0;
}

static void take_column(FrameRecord *record, const Frame *frame, size_t column, size_t count) {
    const size_t first = frame->sample + 1 - count;
    double *values = frame->run->columns[column].values + first;
    switch (frame->run->columns[column].channel) {
    case CHANNEL_DISPLACEMENT:
    case CHANNEL_VELOCITY:
    case CHANNEL_ACCELERATION:
    case CHANNEL_MEAN_ACCELERATION:
        take_storey(record, frame, column, values, count);
        return;
    case CHANNEL_BASE_ACCELERATION:
        for (size_t k = 0; k < count; k++)
            values[k] = base_cursor_at(&frame->base, first + k);
        return;
    default:
        take_damper(record, frame, column, values, count);
    }
}

static void add_batch(FrameRecord *record, const Frame *frame, size_t count) {
    const FrameTrail *trail = record->trail;
    for (size_t k = 0; k < 2; k++)
        frame->lanes->square(frame->slot_count, trail->padded, count, record->batch[k],
                             record->squares[k]);
}

// Of accelerations the sign does not matter.
static void add_squares(FrameRecord *record, const Frame *frame, size_t row) {
    const size_t padded = record->trail->padded, at = record->count++ % TRAIL_MAX;
    double *restrict pull = record->batch[1] + at * padded;
    memcpy(record->batch[0] + at * padded, record->trail->q + row * padded, padded * sizeof *pull);
    memcpy(pull, record->trail->elastic + row * padded, padded * sizeof *pull);
    for (size_t d = 0; d < frame->dampers; d++) {
        const double force = frame->damper[d].force, *shape = frame->damper[d].shape;
        for (size_t i = 0; i < frame->mode_count && force != 0; i++)
            pull[i] -= shape[i] * force;
    }
    if (at + 1 == TRAIL_MAX)
        add_batch(record, frame, TRAIL_MAX);
}

void frame_record_take(FrameRecord *record, Frame *frame, size_t count) {
    for (size_t i = 0; i < frame->run->column_count; i++)
        take_column(record, frame, i, count);
    if (frame->sample >= record->statistics_start)
        for (size_t k = 1; k <= count; k++)
            add_squares(record, frame, k);
    record->base_speed = 0;
}

// The largest shape' squares shape of any storey, over all slots.
static double largest_sum(const FrameRecord *record, const double *squares, const Frame *frame) {
    const size_t n = frame->mode_count, padded = record->trail->padded;
    double most = 0;
    for (size_t j = 0; j < frame->storey_count; j++) {
        const double *shape = frame->modes->shapes + j * n;
        double sum = 0;
        for (size_t i = 0; i < n; i++) {
            const double *row = squares + i * padded;
            sum += shape[i] * (2 * frame_dot(row, shape, i) + row[i] * shape[i]);
        }
        if (frame->unmoved != NULL) {
            const double *row = squares + n * padded, own = -frame->unmoved[j];
            sum += own * (2 * frame_dot(row, shape, n) + row[n] * own);
        }
        most = fmax(most, sum);
    }
    return most;
}

void frame_record_finish(FrameRecord *record, const Frame *frame, Response *response) {
    add_batch(record, frame, record->count % TRAIL_MAX);
    response->sum_squares_displacement = largest_sum(record, record->squares[0], frame);
    response->sum_squares_acceleration = largest_sum(record, record->squares[1], frame);
    response->statistics_count = record->count;
}

// No storey's value can be larger where its modes' are these.
static double bound(const Frame *frame, const double *modal) {
    double most;
    frame->lanes->reach(frame->padded, 1, frame->widest, modal, &most);
    return most;
}

// Eight at a time: behind `count` values come zeros to whole vectors.
static double largest_of(const double *values, size_t count) {
    double most[FRAME_LANES] = {0};
    for (size_t j = 0; j < count; j += FRAME_LANES)
        for (size_t i = 0; i < FRAME_LANES; i++)
            most[i] = ledger_larger(most[i], fabs(values[j + i]));
    for (size_t i = 1; i < FRAME_LANES; i++)
        most[0] = ledger_larger(most[0], most[i]);
    return most[0];
}

// The largest of all storeys.
static double largest(const Frame *frame, const double *modal) {
    return largest_of(frame_spread(frame, modal), frame->storey_count);
}

void frame_record_acceleration(Frame *frame) {
    double most = bound(frame, frame->elastic), at = 0;
    for (size_t d = 0; d < frame->dampers; d++)
        most += frame->damper[d].thrust * fabs(frame->damper[d].force);
    if (!(most > frame->ledger.response->peaks.acceleration))
        return;
    const double *pull = frame_spread(frame, frame->elastic);
    for (size_t j = 0; j < frame->storey_count; j++) {
        double sum = -pull[j];
        for (size_t d = 0; d < frame->dampers; d++)
            sum += frame->mobility[d * frame->storey_count + j] * frame->damper[d].force;
        at = ledger_larger(at, fabs(sum));
    }
    ledger_acceleration(&frame->ledger, at);
}

void frame_record_peaks(Frame *frame) {
    const Peaks *peaks = &frame->ledger.response->peaks;
    const double far = bound(frame, frame->q);
    Moment at = {0};
    if (far > peaks->displacement)
        at.x = largest(frame, frame->q);
    if (bound(frame, frame->p) > peaks->velocity)
        at.v = largest(frame, frame->p);
    for (size_t d = 0; d < frame->dampers; d++) {
        const FrameDamper *damper = &frame->damper[d];
        const double relative = frame_middle(damper) + damper->r;
        if (far + fabs(relative) > peaks->damper_displacement)
            at.damper_x =
                fmax(at.damper_x, fabs(frame_displacement(frame, damper->plan->storey) + relative));
    }
    ledger_peaks(&frame->ledger, &at);
    frame_record_acceleration(frame);
}

// The largest of all storeys in rows 1 to `count`, where that is more than `least`; `most` gets
// what no row can be beyond.
static double rise(const Frame *frame, const double *rows, size_t count, double least,
                   double *most) {
    const size_t padded = frame->padded;
    frame->lanes->reach(padded, count, frame->widest, rows + padded, most);
    for (size_t k = 0; k < count; k += FRAME_FOUR) {
        bool may_rise = false;
        for (size_t j = k; j < k + FRAME_FOUR && j < count; j++)
            may_rise = may_rise || most[j] > least;
        if (!may_rise)
            continue;
        // Of rows behind the last one no use is made.
        const double *values = frame_spread_four(frame, rows + (k + 1) * padded);
        for (size_t j = k; j < k + FRAME_FOUR && j < count; j++)
            least = ledger_larger(least,
                                  largest_of(values + (j - k) * frame->tall, frame->storey_count));
    }
    return least;
}

void frame_record_flight_peaks(FrameRecord *record, Frame *frame, size_t count) {
    const FrameTrail *trail = record->trail;
    const Peaks *peaks = &frame->ledger.response->peaks;
    double far[TRAIL_MAX], most[TRAIL_MAX];
    Moment at = {
        .v = rise(frame, trail->p, count, peaks->velocity, most),
        .acceleration = rise(frame, trail->elastic, count, peaks->acceleration, most),
        .x = rise(frame, trail->q, count, peaks->displacement, far),
        .damper_x = peaks->damper_displacement,
    };
    for (size_t d = 0; d < frame->dampers; d++) {
        const FrameDamper *damper = &frame->damper[d];
        const double *r = trail->r + d * TRAIL_ROWS + 1, middle = frame_middle(damper);
        for (size_t k = 0; k < count; k++)
            if (far[k] + fabs(middle + r[k]) > at.damper_x)
                at.damper_x = fmax(at.damper_x,
                                   fabs(frame_dot(damper->shape, trail->q + (k + 1) * trail->padded,
                                                  frame->mode_count) +
                                        (middle + r[k])));
    }
    ledger_peaks(&frame->ledger, &at);
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

Status frame_record_ledger(Frame *frame) {
    LedgerRow *rows = calloc(frame->dampers + 1, sizeof *rows);
    if (rows == NULL)
        return problem_set(frame->problem, STATUS_NO_MEMORY, "no memory for the list of impacts");
    for (size_t d = 0; d < frame->dampers; d++)
        rows[d] = frame->damper[d].row;
    const EnergyState energy = frame_energy(frame);
    const Status status =
        ledger_finish(&frame->ledger, rows, frame->dampers, &energy, frame->problem);
    ledger_count(&frame->ledger, &frame->run->work);
    free(rows);
    return status;
}
