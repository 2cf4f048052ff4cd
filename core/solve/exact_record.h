// Writes samples into the wanted columns and sums what statistics need, sample by sample.
// Used by the solvers.
#ifndef CORE_SOLVE_EXACT_RECORD_H
#define CORE_SOLVE_EXACT_RECORD_H

#include "core/solve/impact_log.h"
#include "core/solve/solver.h"

typedef struct ExactRecord {
    double *columns[CHANNEL_COUNT];
    double sample_rate;
    size_t statistics_start; // the first sample that counts
    double base_speed;       // integral of a_g since the last sample [m/s]
    double last_velocity;
    double sum_displacement, sum_acceleration; // of squares
    size_t count;
} ExactRecord;

void exact_record_start(ExactRecord *recorder, const Run *run, Response *response);
void exact_record_take(ExactRecord *recorder, size_t sample, const Instant *at,
                       double base_acceleration);
// The sums over `count` more samples, all of them where statistics count.
void exact_record_sums(ExactRecord *recorder, size_t count, double displacement,
                       double acceleration);
void exact_record_finish(const ExactRecord *recorder, Response *response);

// The base's velocity gained over a stretch [m/s].
static inline void exact_record_base(ExactRecord *recorder, double speed) {
    recorder->base_speed += speed;
}

#endif
