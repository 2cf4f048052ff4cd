// Detection of contacts in a force trace: baseline, noise, and the runs of samples above a
// threshold.
#ifndef CORE_DROP_TEST_CONTACT_DETECTION_H
#define CORE_DROP_TEST_CONTACT_DETECTION_H

#include "core/base/field.h"

enum { TRACE_CONTACTS_MAX = 200 };

// Samples above the threshold.
typedef struct DetectedContact {
    size_t first, last; // with the tensile part
    size_t pressed;     // last one before the tensile part
    double peak;        // signed, above the baseline [N]
} DetectedContact;

typedef struct ContactDetection {
    double *force;   // without baseline, one for each sample [N]
    double baseline; // in the middle of the trace [N]
    double bend[2];  // the baseline adds these times u and u^2, u from -1 to 1 over the trace [N]
    size_t samples;
    double noise;       // standard deviation [N]
    double noise_count; // samples outside contacts, from which it is estimated
    double threshold;   // [N]
    DetectedContact runs[TRACE_CONTACTS_MAX];
    size_t count;
    bool is_full; // more than TRACE_CONTACTS_MAX were found; the others are left out
} ContactDetection;

// `threshold` [N]; NAN: from the noise. STATUS_NO_MEMORY. Released by contact_detection_clear in
// any case.
Status contact_detection_run(const Reals *force, double threshold, ContactDetection *detection);
void contact_detection_clear(ContactDetection *detection);

// The baseline at a sample or between samples [N].
double contact_detection_baseline(const ContactDetection *detection, double sample);

#endif
