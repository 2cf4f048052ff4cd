// The model's pulse fitted to one stretch of a force trace: least squares over its start, its end
// and e, with size and baseline. Not finding the stretch (contact_detection_run.h) and not how sure
// the figures are (fit_confidence_run.h). Used by trace.c and fit_confidence_run.c.
#ifndef CORE_DROP_TEST_PULSE_FIT_H
#define CORE_DROP_TEST_PULSE_FIT_H

#include "core/drop_test/pulse_model.h"

#include <stddef.h>

enum { FIT_BLOCKS_MAX = 512, FIT_PARTS = 3, FITS_MAX = 6 };

// The stretch, in means of so many samples each; samples count from its beginning.
typedef struct FitWindow {
    double mean[FIT_BLOCKS_MAX]; // [peak]
    size_t blocks, per_block;
    double sum, square; // of the means, and of their squares
    // What the rest of the trace says of the noise: sum of squares and degrees of freedom.
    double noise_square, noise_freedom;
    int separation;
    double pull_rate;           // g / v0 [1/sample interval]; 0: none
    long first, last;           // samples that are surely above the threshold
    long least_start, most_end; // samples beyond which the contact does not reach
} FitWindow;

// What is fitted, in samples; the samples in contact are those from ceil(start) to floor(end).
typedef struct FitPoint {
    double part[FIT_PARTS]; // start, end, L
} FitPoint;

typedef struct FitResidual {
    double sum;       // of squares that the fit leaves, of as many samples as there are means
    double amplitude; // m_e v0 / T_c
    double baseline;
    double model_square; // of the model about its mean, for unit amplitude
} FitResidual;

// Where start and end may lie, in gaps between samples.
typedef struct FitBox {
    double least[FIT_PARTS], most[FIT_PARTS];
    long first, last; // first sample in contact at least, last one at most
} FitBox;

typedef struct PulseFit {
    FitPoint at;
    long first, last; // samples in contact
    FitResidual residue;
    double slope[FIT_PARTS];                // of half the sum of squares
    double curvature[FIT_PARTS][FIT_PARTS]; // Gauss-Newton
} PulseFit;

// `start` in (first - gaps, first], `end` in [last, last + gaps).
FitBox fit_box_make(long first, long last, long gaps);

// T_c [sample intervals] and shape at a point; false where there is no such contact.
bool pulse_fit_model(const FitWindow *window, const FitPoint *point, PulseModel *shape,
                     double *contact_time);

// The least within a box from `fit->at` on.
void pulse_fit_in_box(const FitWindow *window, const FitBox *box, PulseFit *fit);

// From pulses of every form, the best first; how many there are.
size_t pulse_fit_run(const FitWindow *window, PulseFit fits[FITS_MAX]);

// From a fit on that was made under another pull.
void pulse_fit_continue(const FitWindow *window, PulseFit *fit);

// log of the likelihood under noise of unknown size, but for a constant.
double pulse_fit_log_likelihood(const FitWindow *window, double sum);
// sigma^2 of the noise.
double pulse_fit_variance(const FitWindow *window, double sum);

#endif
