#include "core/solve/exact_record.h"

#include <string.h>

void exact_record_start(ExactRecord *recorder, const Run *run, Response *response) {
    memset(recorder, 0, sizeof *recorder);
    for (size_t i = 0; i < run->column_count; i++)
        recorder->columns[run->columns[i].channel] = run->columns[i].values;
    recorder->sample_rate = run->plan->sample_rate;
    recorder->statistics_start =
        (size_t)ceil(run->statistics_from * run->plan->sample_rate * (1 - 1e-12));
    response->sample_rate = run->plan->sample_rate;
    response->count = run->plan->count;
}

static inline void put(double *column, size_t sample, double value) {
    if (column != NULL)
        column[sample] = value;
}

void exact_record_take(ExactRecord *recorder, size_t sample, const Instant *at,
                       double base_acceleration) {
    double *const *columns = recorder->columns;
    put(columns[CHANNEL_DISPLACEMENT], sample, at->x);
    put(columns[CHANNEL_VELOCITY], sample, at->v);
    put(columns[CHANNEL_ACCELERATION], sample, at->acceleration);
    // What a filtered accelerometer keeps: the velocity gained over the interval, impulses
    // included.
    put(columns[CHANNEL_MEAN_ACCELERATION], sample,
        sample == 0
            ? at->acceleration
            : (at->v - recorder->last_velocity + recorder->base_speed) * recorder->sample_rate);
    put(columns[CHANNEL_DAMPER_DISPLACEMENT], sample, at->damper_x);
    put(columns[CHANNEL_DAMPER_VELOCITY], sample, at->damper_v);
    put(columns[CHANNEL_PENETRATION], sample, at->penetration);
    put(columns[CHANNEL_CONTACT_FORCE], sample, at->force);
    put(columns[CHANNEL_BASE_ACCELERATION], sample, base_acceleration);
    recorder->last_velocity = at->v;
    recorder->base_speed = 0;
    if (sample >= recorder->statistics_start) {
        recorder->sum_displacement += at->x * at->x;
        recorder->sum_acceleration += at->acceleration * at->acceleration;
        recorder->count++;
    }
}

void exact_record_sums(ExactRecord *recorder, size_t count, double displacement,
                       double acceleration) {
    recorder->sum_displacement += displacement;
    recorder->sum_acceleration += acceleration;
    recorder->count += count;
}

void exact_record_finish(const ExactRecord *recorder, Response *response) {
    response->sum_squares_displacement = recorder->sum_displacement;
    response->sum_squares_acceleration = recorder->sum_acceleration;
    response->statistics_count = recorder->count;
}
