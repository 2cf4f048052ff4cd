// Uncertainty of a fitted pulse: distribution of T_c and L over all gaps between samples in which
// the contact may start and end.
#ifndef CORE_DROP_TEST_FIT_CONFIDENCE_H
#define CORE_DROP_TEST_FIT_CONFIDENCE_H

#include "core/drop_test/pulse_fit.h"

typedef struct Posterior {
    double mean, deviation;
} Posterior;
typedef struct FitConfidence {
    Posterior contact_time, decay; // [sample intervals], [-]
    double least, most;            // 95 % interval of contact_time
} FitConfidence;

// Of the fits that pulse_fit_run found; is_form_sure: the best one leaves only noise.
// STATUS_NO_MEMORY.
Status fit_confidence_run(const FitWindow *window, const PulseFit *fits, size_t count,
                          bool is_form_sure, FitConfidence *confidence);

#endif
