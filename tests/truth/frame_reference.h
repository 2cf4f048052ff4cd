// A second opinion on frames: the same scene in __float128, in physical coordinates, by a method
// that shares nothing with core/solve. Not a solver of the product and not fast. Used by
// test_frames.c.
#ifndef TESTS_TRUTH_FRAME_REFERENCE_H
#define TESTS_TRUTH_FRAME_REFERENCE_H

#include <stdbool.h>
#include <stddef.h>

#include "core/excitation/base_motion.h"
#include "core/plan/plan.h"

enum { TRUTH_STOREYS = 12, TRUTH_DAMPERS = 3 };

// What is not known is NAN.
typedef struct TruthImpact {
    bool is_resting;
    size_t damper; // from 0
    int side;
    double start, end, approach, separation, peak, impulse, lost;
} TruthImpact;

typedef struct FrameTruth {
    size_t count;          // samples
    double *x, *v, *a;     // storey after storey, `count` each; a absolute
    double *z, *y, *force; // damper after damper; z and y relative to the base
    TruthImpact *impacts;
    size_t impact_count;
    bool is_whole; // false: too many steps or impacts
} FrameTruth;

// Cleared by frame_truth_clear. More than `most` steps end it unfinished.
void frame_truth(const Plan *plan, const Base *base, double most, FrameTruth *truth);
void frame_truth_clear(FrameTruth *truth);

#endif
