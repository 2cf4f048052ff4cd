// What an answer to a scene misses of the true one, sample by sample and impact by impact, each as
// an error relative to the run's own scale. Not a verdict. Used by test_reference.c.
#ifndef TESTS_TRUTH_REFERENCE_COMPARE_H
#define TESTS_TRUTH_REFERENCE_COMPARE_H

#include "tests/truth/reference.h"

typedef enum ReferenceMetric {
    MISS_DISPLACEMENT,
    MISS_START, // times approach speed, over the clearance or the largest displacement
    MISS_VELOCITY,
    MISS_DAMPER_DISPLACEMENT,
    MISS_DAMPER_VELOCITY,
    MISS_MEAN_ACCELERATION,
    MISS_FORCE,
    MISS_APPROACH,
    MISS_SEPARATION,
    MISS_PEAK,
    MISS_IMPULSE,
    MISS_LOST,
    MISS_REST_START, // [s]
    MISS_REST_END,   // [s]
    MISS_REST_PEAK,
    MISS_COUNT
} ReferenceMetric;
extern const char *const reference_metric_names[MISS_COUNT];

typedef struct ReferenceMisses {
    double of[MISS_COUNT];
    bool is_same; // the same impacts
    char why[200];
} ReferenceMisses;

// Impacts below 1e-9 of the largest approach speed, or 1e-13 of the free mass's largest speed, are
// not compared.
void reference_compare(const ReferenceScene *scene, const ReferenceAnswer *answer,
                       const ReferenceAnswer *truth, ReferenceMisses *misses);

#endif
