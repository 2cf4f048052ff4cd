// How alike two motions are in time: rms and peak of both and of their difference, correlation, the
// time at which they part, and the shift at which they fit best. Not of spectra: distance.h. Used
// by the study compare and the comparison of results.
#ifndef CORE_RESULT_SIGNAL_COMPARISON_H
#define CORE_RESULT_SIGNAL_COMPARISON_H

#include "core/base/columns.h"
#include "core/base/field.h"
#include "core/base/progress.h"

// Evenly sampled; value i stands at start + i / rate.
typedef struct Signal {
    const double *values;
    size_t count;
    double rate, start; // [Hz], [s]
} Signal;

// Over the common span, at the samples of the coarser one; the finer is linear between its own.
// NAN where nothing tells it.
typedef struct Likeness {
    double from, to; // the span [s]
    uint64_t samples;
    double rms, other_rms, peak, other_peak;
    double difference_rms, difference_peak;
    double relative;    // rms of the difference over the reference's rms
    double correlation; // Pearson's
    double parting;     // the difference passes a part of the reference's peak first here [s]
} Likeness;
extern const Field likeness_fields[];

// `part` is of the reference's peak within the span. Where the progress stops it, its numbers are
// NAN.
Likeness likeness_measure(const Signal *reference, const Signal *other, double part,
                          const Progress *progress);

// Both on one grid as two columns of `rate`. STATUS_LIMIT where fewer than `least` samples are
// common.
Status likeness_pair(const Signal *reference, const Signal *other, size_t least, Columns *pair,
                     double *rate, Problem *problem);

enum { LIKENESS_SHIFT_MAX = 1 << 22 }; // samples of both, at the coarser one's rate

// The shift [s] within [-most, most] that `other` must be moved by to correlate best with the
// reference, by cross-correlation with at least half of the shorter one in common.
// STATUS_LIMIT: there is none, or too much to look at.
Status likeness_shift(const Signal *reference, const Signal *other, double most, double *shift,
                      Problem *problem);

#endif
