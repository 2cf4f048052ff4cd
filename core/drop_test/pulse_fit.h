// Least-squares fit of the model's pulse to one window of a force trace: start, end, decay,
// amplitude and baseline, and the uncertainty of the fit.
#ifndef CORE_DROP_TEST_PULSE_FIT_H
#define CORE_DROP_TEST_PULSE_FIT_H

#include "core/drop_test/pulse_model.h"

#include <stddef.h>

enum { FIT_BLOCKS_MAX = 512, FIT_PARTS = 3, FITS_MAX = 6 };
enum { FIT_START, FIT_END, FIT_DECAY }; // of FIT_PARTS

// The window, as means of per_block samples each. Samples count from its beginning; forces are in
// units of the peak.
typedef struct FitWindow {
    double mean[FIT_BLOCKS_MAX];
    size_t blocks, per_block;
    double sum; // of the means
    // Noise of the rest of the trace: sum of squares and degrees of freedom.
    double noise_square, noise_freedom;
    int separation;
    double pull_rate;           // g / v0 [1/sample interval]; 0: no gravity
    long first, last;           // samples that are certainly above the threshold
    long least_start, most_end; // samples beyond which the contact does not extend
} FitWindow;

// Start, end [samples] and L. Samples ceil(start) to floor(end) are in contact.
typedef struct FitPoint {
    double part[FIT_PARTS];
} FitPoint;

typedef struct FitResidual {
    double sum;       // of squared residuals, scaled to single samples; INFINITY: no such contact
    double amplitude; // m_e v0 / T_c
    double baseline;
    double model_square; // of the model about its mean, at unit amplitude
} FitResidual;

typedef struct PulseFit {
    FitPoint at;
    long first, last; // samples in contact
    FitResidual residual;
    double slope[FIT_PARTS];                // of half the sum of squares
    double curvature[FIT_PARTS][FIT_PARTS]; // Gauss-Newton
} PulseFit;

// The pulse at a point and its T_c [sample intervals]; false: no such contact exists.
bool pulse_fit_model(const FitWindow *window, const FitPoint *point, PulseModel *model,
                     double *contact_time);

// Local minima from pulses of six decays, the best first. Returns their number.
size_t pulse_fit_run(const FitWindow *window, PulseFit fits[FITS_MAX]);

// Improves a fit that was made with another pull_rate.
void pulse_fit_continue(const FitWindow *window, PulseFit *fit);

// Distribution of T_c and L over all gaps between samples in which the contact may start and end.
typedef struct Posterior {
    double mean, deviation;
} Posterior;
typedef struct FitConfidence {
    Posterior contact_time, decay; // [sample intervals], [-]
    double least, most;            // 95 % interval of contact_time
} FitConfidence;

// Of the fits that pulse_fit_run found; is_form_sure: the best one leaves only noise.
// STATUS_NO_MEMORY.
Status pulse_fit_confidence(const FitWindow *window, const PulseFit *fits, size_t count,
                            bool is_form_sure, FitConfidence *confidence);

#endif
