// How sure the figures of a fitted pulse are: by the form, over all gaps between samples that the
// trace leaves open for its start and end. Not the fit (trace_fit.h).
// Used by trace.c.
#ifndef CORE_DROP_TEST_FIT_CONFIDENCE_H
#define CORE_DROP_TEST_FIT_CONFIDENCE_H

#include "core/drop_test/pulse_fit.h"

// In sample intervals; mean and standard deviation, and within which it lies in 95 of 100 cases.
typedef struct TraceBelief {
    double mean, deviation;
} TraceBelief;
typedef struct TraceInterval {
    TraceBelief contact_time, decay;
    double least, most; // of contact_time
} TraceInterval;

// From what trace_fit found; is_form_sure: it leaves no more than noise. STATUS_NO_MEMORY.
Status trace_interval(const TraceWindow *window, const TraceFit *fits, size_t count,
                      bool is_form_sure, TraceInterval *interval);

#endif
