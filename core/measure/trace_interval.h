// How sure the figures of a fitted pulse are: the likelihood over all starts, ends and e that the
// trace leaves open, which gaps between samples they lie in included. Not the fit (trace_fit.h).
// Used by trace.c.
#ifndef CORE_MEASURE_TRACE_INTERVAL_H
#define CORE_MEASURE_TRACE_INTERVAL_H

#include "core/measure/trace_fit.h"

// In sample intervals; mean and standard deviation, and within which it lies in 95 of 100 cases.
typedef struct TraceBelief {
    double mean, deviation;
} TraceBelief;
typedef struct TraceInterval {
    TraceBelief contact_time, decay, start, end;
    double least, most; // of contact_time
} TraceInterval;

// From what trace_fit found. STATUS_NO_MEMORY.
Status trace_interval(const TraceWindow *window, const TraceFit *fits, size_t count,
                      TraceInterval *interval);

#endif
