// The model's pulse fitted to one stretch of a force trace: least squares over its start, its end
// and e, with size and baseline. Not finding the stretch (trace_find.h) and not how sure the
// figures are (trace_interval.h). Used by trace.c and trace_interval.c.
#ifndef CORE_DROP_TEST_PULSE_FIT_H
#define CORE_DROP_TEST_PULSE_FIT_H

#include "core/drop_test/pulse_model.h"

#include <stddef.h>

enum { TRACE_BLOCKS_MAX = 512, TRACE_PARTS = 3, TRACE_FITS_MAX = 6 };

// The stretch, in means of so many samples each; samples count from its beginning.
typedef struct TraceWindow {
    double mean[TRACE_BLOCKS_MAX]; // [peak]
    size_t blocks, per_block;
    double sum, square; // of the means, and of their squares
    // What the rest of the trace says of the noise: sum of squares and degrees of freedom.
    double noise_square, noise_freedom;
    int separation;
    double pull_rate;           // g / v0 [1/sample interval]; 0: none
    long first, last;           // samples that are surely above the threshold
    long least_start, most_end; // samples beyond which the contact does not reach
} TraceWindow;

// What is fitted, in samples; the samples in contact are those from ceil(start) to floor(end).
typedef struct TracePoint {
    double part[TRACE_PARTS]; // start, end, L
} TracePoint;

typedef struct TraceResidue {
    double sum;       // of squares that the fit leaves, of as many samples as there are means
    double amplitude; // m_e v0 / T_c
    double baseline;
    double model_square; // of the model about its mean, for unit amplitude
} TraceResidue;

// Where start and end may lie, in gaps between samples.
typedef struct TraceBox {
    double least[TRACE_PARTS], most[TRACE_PARTS];
    long first, last; // first sample in contact at least, last one at most
} TraceBox;

typedef struct TraceFit {
    TracePoint at;
    long first, last; // samples in contact
    TraceResidue residue;
    double slope[TRACE_PARTS];                  // of half the sum of squares
    double curvature[TRACE_PARTS][TRACE_PARTS]; // Gauss-Newton
} TraceFit;

// `start` in (first - gaps, first], `end` in [last, last + gaps).
TraceBox trace_box(long first, long last, long gaps);

// T_c [sample intervals] and shape at a point; false where there is no such contact.
bool trace_point_shape(const TraceWindow *window, const TracePoint *point, TraceShape *shape,
                       double *contact_time);

// The least within a box from `fit->at` on.
void trace_fit_box(const TraceWindow *window, const TraceBox *box, TraceFit *fit);

// From pulses of every form, the best first; how many there are.
size_t trace_fit(const TraceWindow *window, TraceFit fits[TRACE_FITS_MAX]);

// From a fit on that was made under another pull.
void trace_refit(const TraceWindow *window, TraceFit *fit);

// log of the likelihood under noise of unknown size, but for a constant.
double trace_likelihood(const TraceWindow *window, double sum);
// sigma^2 of the noise.
double trace_variance(const TraceWindow *window, double sum);

#endif
