// One mode as truncation_levels.c and truncation_record.c see it, and what both ask of it. Not how
// far it moves: that is what these find. Used by those.
#ifndef CORE_PLAN_TRUNCATION_MODE_H
#define CORE_PLAN_TRUNCATION_MODE_H

#include <math.h>

#include "core/excitation/recorded_motion.h"
#include "core/plan/truncation_levels.h"

// One mode, and the run it is in.
typedef struct Mode {
    double omega, slack, share; // w, s, participation
    double time, interval;      // of the run; between samples
} Mode;

static inline double square(double x) {
    return x * x;
}

// What a mean over a sample interval leaves of a wave, which is never quite nothing: waves begin,
// and die away.
static inline double mean_of(double omega, double interval) {
    const double half = omega * interval / 2;
    return half > 1e-6 ? fmin(fmax(fabs(sin(half)), 0.5) / half, 1) : 1;
}

// Mean of exp(-2 s t) over a time.
static inline double kept(double slack, double time) {
    const double decay = 2 * slack * time;
    return decay > 1e-9 ? -expm1(-decay) / decay : 1;
}

// No frequency is lower than what the run can tell from a drift.
static inline double omega_of(const Mode *mode, double time) {
    return fmax(mode->omega, 1 / time);
}

static inline Mode mode_of(const Plan *plan, size_t k) {
    const Modes *modes = &plan->modes;
    return (Mode){modes->omega[k], fmax(modes->damping[k * modes->count + k] / 2, 0),
                  modes->participation[k], plan->duration, 1 / plan->sample_rate};
}

// A record's part in all modes' levels.
void levels_of_record(const Plan *plan, const ExcitationRecord *base, Level *levels, Wave *wave);

#endif
