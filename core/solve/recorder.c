// The summary has one value for a structure: the largest over its storeys. Most samples hold no new
// peak, and the bound "sum over modes of |q_i| times the largest |shape| of any storey" shows it
// without the storeys. Sums of squares are taken over pairs of modes, several samples at a time,
// and converted to the storeys at the end.
#include "core/solve/engine.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

// Displacement of the free mass relative to its storey at r = 0 [m].
static double recorder_middle(const DamperState *damper) {
    const double stop = damper->plan->clearance / 2;
    const double origin =
        damper->origin == FROM_MIDDLE ? 0 : modal_state_sign((Side)damper->origin) * stop;
    return damper->plan->offset + origin;
}

Status recorder_start(Recorder *record, const ModalState *state, Response *response,
                      Problem *problem) {
    const size_t n = state->mode_count, columns = state->run->column_count, padded = state->padded;
    const size_t m = state->dampers, rows = FLIGHT_BUFFER_ROWS;
    FlightBuffer *buffer = &record->buffer;
    memset(record, 0, sizeof *record);
    const SimdArray arrays[] = {
        {&buffer->q, rows * padded},
        {&buffer->p, rows * padded},
        {&buffer->moved, rows * padded},
        {&buffer->sped, rows * padded},
        {&buffer->elastic, rows * padded},
        {&buffer->r, rows * m},
        {&buffer->z, rows * m},
        {&buffer->a, rows},
        {&buffer->b, rows},
        {&buffer->ground, rows},
        {&record->squares[0], padded * padded},
        {&record->squares[1], padded * padded},
        {&record->batch[0], FLIGHT_BUFFER_MAX * padded},
        {&record->batch[1], FLIGHT_BUFFER_MAX * padded},
        {&record->shapes, columns * padded},
        {&record->last_velocity, columns},
    };
    record->block = simd_kernels_allocate(arrays, COUNT(arrays));
    if (record->block == NULL)
        return problem_set(problem, STATUS_NO_MEMORY, "no memory for a run of %zu modes", n);
    for (size_t i = 0; i < columns; i++) {
        const RunColumn *column = &state->run->columns[i];
        const ChannelOwner owner = channels[column->channel].owner;
        const size_t storey = owner == CHANNEL_OF_STOREY ? column->number
                              : owner == CHANNEL_OF_DAMPER
                                  ? state->plan->dampers[column->number].storey
                                  : 0;
        double *shape = record->shapes + i * padded;
        memcpy(shape, state->modes->shapes + storey * n, n * sizeof *shape);
        for (size_t k = 0; k < n && column->channel == CHANNEL_STOREY_DRIFT && storey > 0; k++)
            shape[k] -= state->modes->shapes[(storey - 1) * n + k];
        if (column->channel == CHANNEL_BASE_SHEAR)
            memcpy(shape, state->base_shear, padded * sizeof *shape);
        // Row p has 0 in the slot of a_g.
        if (state->residual_influence != NULL && (column->channel == CHANNEL_ACCELERATION ||
                                                  column->channel == CHANNEL_MEAN_ACCELERATION))
            shape[n] = -state->residual_influence[column->number];
    }
    record->statistics_start =
        (size_t)ceil(state->run->statistics_from * state->plan->sample_rate * (1 - 1e-12));
    response->sample_rate = state->plan->sample_rate;
    response->count = state->plan->count;
    return STATUS_OK;
}

void recorder_clear(Recorder *record) {
    free(record->block);
}

// Replaces velocities by mean accelerations over the intervals before.
static void recorder_write_means(Recorder *record, const ModalState *state, size_t column,
                                 double *values, size_t count) {
    const double share = state->plan->influence[state->run->columns[column].number];
    for (size_t k = 0; k < count; k++) {
        const double velocity = values[k];
        values[k] = (velocity - record->last_velocity[column] + share * record->buffer.ground[k]) *
                    state->plan->sample_rate;
        record->last_velocity[column] = velocity;
    }
}

// A sum over modes.
static void recorder_write_storey(Recorder *record, const ModalState *state, size_t column,
                                  double *values, size_t count) {
    const FlightBuffer *buffer = &record->buffer;
    const ChannelId channel = state->run->columns[column].channel;
    const size_t padded = state->padded, storey = state->run->columns[column].number;
    const double *rows =
        channel == CHANNEL_ACCELERATION || channel == CHANNEL_BASE_SHEAR     ? buffer->elastic
        : channel == CHANNEL_DISPLACEMENT || channel == CHANNEL_STOREY_DRIFT ? buffer->q
                                                                             : buffer->p;
    const double *shape = record->shapes + column * padded;
    state->lanes->dot(padded, count, shape, rows + padded, values);
    if (channel == CHANNEL_MEAN_ACCELERATION)
        recorder_write_means(record, state, column, values, count);
    if (channel == CHANNEL_MEAN_ACCELERATION && state->sample == 0)
        state->lanes->dot(padded, 1, shape, buffer->elastic + padded, values);
    else if (channel != CHANNEL_ACCELERATION)
        return;
    double push = 0;
    for (size_t d = 0; d < state->dampers; d++)
        push += state->mobility[d * state->storey_count + storey] * state->damper[d].force;
    for (size_t k = 0; k < count; k++)
        values[k] = push - values[k];
}

static void recorder_write_damper(Recorder *record, const ModalState *state, size_t column,
                                  double *values, size_t count) {
    const FlightBuffer *buffer = &record->buffer;
    const RunColumn *wanted = &state->run->columns[column];
    const DamperState *damper = &state->damper[wanted->number];
    const double *r = buffer->r + wanted->number * FLIGHT_BUFFER_ROWS + 1;
    const double *z = buffer->z + wanted->number * FLIGHT_BUFFER_ROWS + 1;
    if (wanted->channel == CHANNEL_DAMPER_DISPLACEMENT) {
        const double middle = recorder_middle(damper);
        state->lanes->dot(state->padded, count, record->shapes + column * state->padded,
                          buffer->q + state->padded, values);
        for (size_t k = 0; k < count; k++)
            values[k] += middle + r[k];
        return;
    }
    const bool is_inside = damper->phase == PHASE_CONTACT || damper->phase == PHASE_INSIDE;
    for (size_t k = 0; k < count; k++)
        values[k] = wanted->channel == CHANNEL_DAMPER_VELOCITY ? z[k]
                    : wanted->channel == CHANNEL_CONTACT_FORCE ? damper->force
                    : is_inside ? fmax(modal_state_sign(damper->side) * r[k], 0)
                                : 0;
}

// Writes rows 1 to `count` of the buffer with the present forces.
static void recorder_write_column(Recorder *record, const ModalState *state, size_t column,
                                  size_t count) {
    const size_t first = state->sample + 1 - count;
    double *values = state->run->columns[column].values + first;
    const ChannelId channel = state->run->columns[column].channel;
    const ChannelOwner owner = channels[channel].owner;
    if (owner == CHANNEL_OF_STOREY || channel == CHANNEL_BASE_SHEAR)
        recorder_write_storey(record, state, column, values, count);
    else if (owner == CHANNEL_OF_DAMPER)
        recorder_write_damper(record, state, column, values, count);
    for (size_t k = 0; k < count && channel == CHANNEL_BASE_ACCELERATION; k++)
        values[k] = base_cursor_at(&state->base, first + k);
}

static void recorder_add_batch(Recorder *record, const ModalState *state, size_t count) {
    for (size_t k = 0; k < 2; k++)
        state->lanes->square(state->slot_count, state->padded, count, record->batch[k],
                             record->squares[k]);
}

// The sign of the accelerations does not matter.
static void recorder_add_squares(Recorder *record, const ModalState *state, size_t row) {
    const size_t padded = state->padded, at = record->count++ % FLIGHT_BUFFER_MAX;
    double *restrict pull = record->batch[1] + at * padded;
    memcpy(record->batch[0] + at * padded, record->buffer.q + row * padded, padded * sizeof *pull);
    memcpy(pull, record->buffer.elastic + row * padded, padded * sizeof *pull);
    for (size_t d = 0; d < state->dampers; d++) {
        const double force = state->damper[d].force, *shape = state->damper[d].shape;
        for (size_t i = 0; i < state->mode_count && force != 0; i++)
            pull[i] -= shape[i] * force;
    }
    if (at + 1 == FLIGHT_BUFFER_MAX)
        recorder_add_batch(record, state, FLIGHT_BUFFER_MAX);
}

static void recorder_write(Recorder *record, const ModalState *state, size_t count) {
    for (size_t i = 0; i < state->run->column_count; i++)
        recorder_write_column(record, state, i, count);
    if (state->sample >= record->statistics_start)
        for (size_t k = 1; k <= count; k++)
            recorder_add_squares(record, state, k);
    record->base_speed = 0;
}

// The largest shape' squares shape of any storey.
static double recorder_largest_sum(const ModalState *state, const double *squares) {
    const size_t n = state->mode_count, padded = state->padded;
    double most = 0;
    for (size_t j = 0; j < state->storey_count; j++) {
        const double *shape = state->modes->shapes + j * n;
        double sum = 0;
        for (size_t i = 0; i < n; i++) {
            const double *row = squares + i * padded;
            sum += shape[i] * (2 * modal_state_dot(row, shape, i) + row[i] * shape[i]);
        }
        if (state->residual_influence != NULL) {
            const double *row = squares + n * padded, own = -state->residual_influence[j];
            sum += own * (2 * modal_state_dot(row, shape, n) + row[n] * own);
        }
        most = fmax(most, sum);
    }
    return most;
}

void recorder_finish(Recorder *record, const ModalState *state, Response *response) {
    recorder_add_batch(record, state, record->count % FLIGHT_BUFFER_MAX);
    response->sum_squares_displacement = recorder_largest_sum(state, record->squares[0]);
    response->sum_squares_acceleration = recorder_largest_sum(state, record->squares[1]);
    response->statistics_count = record->count;
}

// Eight at a time: zeros follow `count` values up to whole vectors.
static double recorder_largest_value(const double *values, size_t count) {
    double most[SIMD_WIDTH] = {0};
    for (size_t j = 0; j < count; j += SIMD_WIDTH)
        for (size_t i = 0; i < SIMD_WIDTH; i++)
            most[i] = impact_log_larger(most[i], fabs(values[j + i]));
    for (size_t i = 1; i < SIMD_WIDTH; i++)
        most[0] = impact_log_larger(most[0], most[i]);
    return most[0];
}

void recorder_acceleration(ModalState *state) {
    double most, at = 0; // an upper bound first
    state->lanes->weighted_abs(state->padded, 1, state->max_shape, state->elastic, &most);
    for (size_t d = 0; d < state->dampers; d++)
        most += state->damper[d].max_mobility * fabs(state->damper[d].force);
    if (!(most > state->impacts.response->peaks.acceleration))
        return;
    const double *pull = modal_state_expand(state, state->elastic, 1);
    for (size_t j = 0; j < state->storey_count; j++) {
        double sum = -pull[j];
        for (size_t d = 0; d < state->dampers; d++)
            sum += state->mobility[d * state->storey_count + j] * state->damper[d].force;
        at = impact_log_larger(at, fabs(sum));
    }
    impact_log_acceleration(&state->impacts, at);
}

// The largest value of any storey in `count` rows, or `least` if that is larger; `is_drift`: of its
// difference from the storey below. `largest` has the largest size of each mode in these rows.
static double recorder_find_peak(const ModalState *state, const double *rows, size_t count,
                                 bool is_drift, const double *largest, double least) {
    const double *weights = is_drift ? state->max_drift : state->max_shape;
    const size_t padded = state->padded;
    double bounds[FLIGHT_BUFFER_MAX];
    state->lanes->dot(padded, 1, weights, largest, bounds);
    if (!(bounds[0] > least))
        return least;
    state->lanes->weighted_abs(padded, count, weights, rows, bounds);
    for (size_t k = 0; k < count; k += FLIGHT_ROWS) {
        bool may_rise = false;
        for (size_t j = k; j < k + FLIGHT_ROWS && j < count; j++)
            may_rise = may_rise || bounds[j] > least;
        if (!may_rise)
            continue;
        double *values = modal_state_expand(state, rows + k * padded, count == 1 ? 1 : FLIGHT_ROWS);
        for (size_t j = k; j < k + FLIGHT_ROWS && j < count; j++, values += state->tall) {
            for (size_t i = state->storey_count - 1; i > 0 && is_drift; i--)
                values[i] -= values[i - 1];
            least = impact_log_larger(least, recorder_largest_value(values, state->storey_count));
        }
    }
    return least;
}

// Likewise of the force on the base.
static double recorder_find_shear(const ModalState *state, const double *elastic, size_t count,
                                  const double *largest, double least) {
    double values[FLIGHT_BUFFER_MAX];
    state->lanes->dot(state->padded, 1, state->max_base_shear, largest, values);
    if (!(values[0] > least))
        return least;
    state->lanes->dot(state->padded, count, state->base_shear, elastic, values);
    for (size_t k = 0; k < count; k++)
        least = impact_log_larger(least, fabs(values[k]));
    return least;
}

// Updates all peaks by `count` rows of q, p and elastic, and of the dampers' r, each damper's
// `stride` values apart; that of the acceleration in flight only, where it has no contact forces.
static void recorder_find_peaks(ModalState *state, const double *q, const double *p,
                                const double *elastic, const double *r, size_t stride, size_t count,
                                bool is_flight) {
    const Peaks *peaks = &state->impacts.response->peaks;
    const SimdKernels *lanes = state->lanes;
    double *largest = state->largest, far;
    Instant at = {.damper_x = peaks->damper_displacement};
    lanes->largest(state->padded, count, p, largest);
    at.v = recorder_find_peak(state, p, count, false, largest, peaks->velocity);
    lanes->largest(state->padded, count, elastic, largest);
    at.shear = recorder_find_shear(state, elastic, count, largest, peaks->base_shear);
    if (is_flight)
        at.acceleration =
            recorder_find_peak(state, elastic, count, false, largest, peaks->acceleration);
    lanes->largest(state->padded, count, q, largest);
    at.x = recorder_find_peak(state, q, count, false, largest, peaks->displacement);
    if (state->plan->has_drifts && state->storey_count > 1)
        at.drift = recorder_find_peak(state, q, count, true, largest, peaks->storey_drift);
    lanes->dot(state->padded, 1, state->max_shape, largest, &far);
    for (size_t d = 0; d < state->dampers; d++) {
        const DamperState *damper = &state->damper[d];
        const double middle = recorder_middle(damper);
        for (size_t k = 0; k < count; k++) {
            const double relative = middle + r[d * stride + k];
            if (far + fabs(relative) > at.damper_x)
                at.damper_x = fmax(
                    at.damper_x,
                    fabs(modal_state_dot(damper->shape, q + k * state->padded, state->mode_count) +
                         relative));
        }
    }
    impact_log_peaks(&state->impacts, &at);
}

void recorder_peaks(ModalState *state) {
    double r[SCENE_DAMPERS];
    for (size_t d = 0; d < state->dampers; d++)
        r[d] = state->damper[d].r;
    recorder_find_peaks(state, state->q, state->p, state->elastic, r, 1, 1, false);
    recorder_acceleration(state);
}

static void recorder_restart_peaks(ModalState *state) {
    double force = 0;
    for (size_t d = 0; d < state->dampers; d++)
        force = fmax(force, fabs(state->damper[d].force));
    impact_log_restart_peaks(&state->impacts, force);
}

void recorder_flight(Recorder *record, ModalState *state, size_t count) {
    const FlightBuffer *buffer = &record->buffer;
    const size_t padded = state->padded;
    const double *q = buffer->q + padded, *p = buffer->p + padded;
    double *elastic = buffer->elastic + padded;
    state->base_acceleration = base_cursor_at(&state->base, state->sample);
    if (state->diagonal != NULL)
        state->lanes->mix(padded, count, state->diagonal, p, state->omega2, q, elastic);
    for (size_t k = 0; k < count; k++) {
        if (state->diagonal == NULL)
            modal_state_elastic(state, q + k * padded, p + k * padded, elastic + k * padded);
        if (state->residual_influence != NULL)
            elastic[k * padded + state->mode_count] =
                base_cursor_at(&state->base, state->sample + 1 - count + k);
    }
    if (state->sample + 1 - count == record->statistics_start)
        recorder_restart_peaks(state);
    recorder_write(record, state, count);
    recorder_find_peaks(state, q, p, elastic, buffer->r + 1, FLIGHT_BUFFER_ROWS, count, true);
}

void recorder_sample(Recorder *record, ModalState *state) {
    const FlightBuffer *buffer = &record->buffer;
    const size_t at = state->padded;
    if (state->is_shadow)
        return;
    state->base_acceleration = base_cursor_at(&state->base, state->sample);
    modal_state_forces(state);
    if (state->sample == record->statistics_start && state->sample > 0)
        recorder_restart_peaks(state);
    memcpy(buffer->q + at, state->q, at * sizeof *state->q);
    memcpy(buffer->p + at, state->p, at * sizeof *state->p);
    memcpy(buffer->elastic + at, state->elastic, at * sizeof *state->elastic);
    buffer->ground[0] = record->base_speed;
    for (size_t d = 0; d < state->dampers; d++) {
        const DamperState *damper = &state->damper[d];
        buffer->r[d * FLIGHT_BUFFER_ROWS + 1] = damper->r;
        buffer->z[d * FLIGHT_BUFFER_ROWS + 1] =
            modal_state_dot(damper->shape, state->p, state->mode_count) + damper->w;
    }
    recorder_write(record, state, 1);
    recorder_peaks(state);
}

void recorder_update(ModalState *state) {
    if (state->is_shadow)
        return;
    modal_state_forces(state);
    recorder_peaks(state);
    const EnergyState energy = modal_state_energy(state);
    impact_log_balance(&state->impacts, &energy);
}

Status recorder_finish_log(ModalState *state) {
    for (size_t d = 0; d < state->dampers; d++)
        impact_log_end(&state->impacts, &state->damper[d].row);
    const EnergyState energy = modal_state_energy(state);
    return impact_log_finish(&state->impacts, state->dampers, &energy, &state->run->work,
                             state->problem);
}
