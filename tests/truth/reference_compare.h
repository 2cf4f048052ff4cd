// What an answer to a scene misses of the true one, sample by sample and impact by impact, each as
// an error relative to the run's own scale. Not a verdict. Used by test_reference.c.
#ifndef TESTS_TRUTH_REFERENCE_COMPARE_H
#define TESTS_TRUTH_REFERENCE_COMPARE_H

#include "tests/truth/reference.h"

typedef enum ReferenceMetric {
    METRIC_DISPLACEMENT,
    METRIC_START, // times approach speed, over the clearance or the largest displacement
    METRIC_VELOCITY,
    METRIC_DAMPER_DISPLACEMENT,
    METRIC_DAMPER_VELOCITY,
    METRIC_MEAN_ACCELERATION,
    METRIC_FORCE,
    METRIC_APPROACH,
    METRIC_SEPARATION,
    METRIC_PEAK,
    METRIC_IMPULSE,
    METRIC_LOST,
    METRIC_REST_START, // [s]
    METRIC_REST_END,   // [s]
    METRIC_REST_PEAK,
    METRIC_COUNT
} ReferenceMetric;
extern const char *const reference_metric_names[METRIC_COUNT];

typedef struct ReferenceMisses {
    double of[METRIC_COUNT];
    bool is_same; // the same impacts
    char why[200];
} ReferenceMisses;

// Impacts below 1e-9 of the largest approach speed, or 1e-13 of the free mass's largest speed, are
// not compared.
void reference_compare(const ReferenceScene *scene, const ReferenceAnswer *answer,
                       const ReferenceAnswer *truth, ReferenceMisses *misses);

#endif
