// Where in a force trace contacts are: its baseline, its noise, and the stretches above a
// threshold. Not what the contacts are (pulse_fit_run.h). Used by trace.c.
#ifndef CORE_DROP_TEST_CONTACT_DETECTION_H
#define CORE_DROP_TEST_CONTACT_DETECTION_H

#include "core/base/field.h"

// Samples above the threshold.
typedef struct DetectedContact {
    size_t first, last; // a tensile end included
    size_t pressed;     // the last one before that end
    double peak;        // signed, above the baseline [N]
} DetectedContact;

typedef struct ContactDetection {
    double *force;   // without baseline
    double baseline; // in the middle
    double bend[2];  // times u and u^2 it is added elsewhere, u from -1 to 1 over the trace [N]
    size_t samples;
    double noise;       // standard deviation
    double noise_count; // samples outside contacts, which it is from
    double threshold;
    DetectedContact *runs;
    size_t count;
    bool is_full; // there are more runs than may be kept
} ContactDetection;

// `threshold` NAN: from the noise. STATUS_NO_MEMORY. Cleared by contact_detection_clear in any
// case.
Status contact_detection_run(const Reals *force, double threshold, ContactDetection *found);
void contact_detection_clear(ContactDetection *found);

// The baseline there, also between samples [N].
double contact_detection_baseline(const ContactDetection *found, double sample);

#endif
