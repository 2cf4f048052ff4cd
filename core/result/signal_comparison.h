// Comparison of two motions in time: rms and peak of both and of their difference, correlation,
// time of divergence, and the shift of best correlation.
#ifndef CORE_RESULT_SIGNAL_COMPARISON_H
#define CORE_RESULT_SIGNAL_COMPARISON_H

#include "core/base/columns.h"
#include "core/base/field.h"
#include "core/base/progress.h"

// Evenly sampled: value i is at time start + i / rate.
typedef struct Signal {
    const double *values;
    size_t count;
    double rate, start; // [Hz], [s]
} Signal;

// Over the common time span, at the samples of the coarser signal; the finer one is interpolated
// linearly. NAN if undefined.
typedef struct SignalComparison {
    double from, to; // the common span [s]
    uint64_t samples;
    double rms, other_rms, peak, other_peak;
    double difference_rms, difference_peak;
    double relative;    // rms of the difference over the rms of the reference
    double correlation; // Pearson's
    double parting;     // first time at which the difference exceeds a part of the peak [s]
} SignalComparison;
extern const Field signal_comparison_fields[];

// `part` is relative to the peak of the reference within the span. All NAN if stopped by
// `progress`.
SignalComparison signal_comparison_measure(const Signal *reference, const Signal *other,
                                           double part, const Progress *progress);

// Resamples both at `rate` as two columns over the common span. STATUS_LIMIT if they have fewer
// than `min` samples in common.
Status signal_comparison_align(const Signal *reference, const Signal *other, size_t min,
                               Columns *pair, double *rate, Problem *problem);

enum { SIGNAL_COMPARISON_SHIFT_MAX = 1 << 22 }; // samples of both at the lower rate

// The shift of `other` within [-max, max] that correlates best with the reference [s], with at
// least half of the shorter one in common. STATUS_LIMIT if there is none, or too many samples.
Status signal_comparison_shift(const Signal *reference, const Signal *other, double max,
                               double *shift, Problem *problem);

#endif
