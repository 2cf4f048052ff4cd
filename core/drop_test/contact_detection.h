// Where in a force trace contacts are: its baseline, its noise, and the stretches above a
// threshold. Not what the contacts are (trace_fit.h). Used by trace.c.
#ifndef CORE_DROP_TEST_CONTACT_DETECTION_H
#define CORE_DROP_TEST_CONTACT_DETECTION_H

#include "core/base/field.h"

// Samples above the threshold.
typedef struct TraceRun {
    size_t first, last; // a tensile end included
    size_t pressed;     // the last one before that end
    double peak;        // signed, above the baseline [N]
} TraceRun;

typedef struct TraceFound {
    double *force;      // without baseline
    double baseline;    // in the middle
    double bend[2];     // times u and u^2 it is added elsewhere, u from -1 to 1 over the trace [N]
    size_t samples;
    double noise;       // standard deviation
    double noise_count; // samples outside contacts, which it is from
    double threshold;
    TraceRun *runs;
    size_t count;
    bool is_full; // there are more runs than may be kept
} TraceFound;

// `threshold` NAN: from the noise. STATUS_NO_MEMORY. Cleared by trace_found_clear in any case.
Status trace_find(const Reals *force, double threshold, TraceFound *found);
void trace_found_clear(TraceFound *found);

// The baseline there, also between samples [N].
double trace_found_baseline(const TraceFound *found, double sample);

#endif
