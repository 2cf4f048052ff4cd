// How sure the figures of a fitted pulse are: by the form, over all gaps between samples that the
// trace leaves open for its start and end. Not the fit (pulse_fit_run.h).
// Used by trace.c.
#ifndef CORE_DROP_TEST_FIT_CONFIDENCE_H
#define CORE_DROP_TEST_FIT_CONFIDENCE_H

#include "core/drop_test/pulse_fit.h"

// In sample intervals; mean and standard deviation, and within which it lies in 95 of 100 cases.
typedef struct Posterior {
    double mean, deviation;
} Posterior;
typedef struct FitConfidence {
    Posterior contact_time, decay;
    double least, most; // of contact_time
} FitConfidence;

// From what pulse_fit_run found; is_form_sure: it leaves no more than noise. STATUS_NO_MEMORY.
Status fit_confidence_run(const FitWindow *window, const PulseFit *fits, size_t count,
                          bool is_form_sure, FitConfidence *interval);

#endif
