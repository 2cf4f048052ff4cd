// What a run gives up that keeps only the lowest modes of a structure: foretold from plan and scene
// before anything runs. Not the leaving out (keep.h), not an error measured. Used by keep.c and by
// whoever chooses how many modes to keep.
#ifndef CORE_PLAN_MODAL_TRUNCATION_H
#define CORE_PLAN_MODAL_TRUNCATION_H

#include "core/plan/plan.h"

// Against the same run with all modes; at most 1. Meant to be seldom exceeded: in some 3 % of
// scenes without dampers, 10 % of those with.
typedef struct TruncationError {
    double displacement;      // largest difference over the largest displacement, any storey
    double mean_acceleration; // rms of the difference over rms, of all storeys together
    double rms_displacement;  // difference of rms over rms, of the storey where that is largest
} TruncationError;

// errors[k] becomes that of the k + 1 lowest modes, for all plan->modes.count of them: no less than
// with more modes, and 0 in the end. The plan has all modes of its structure (plan_new, before
// keep.h): none, and nothing to tell, where plan_is_single.
Status truncation_predict(const Plan *plan, const Scene *scene, TruncationError *errors);

// The part that the lowest `kept` of the plan's modes have of the mass that the base moves, r' M r;
// 1 where it moves none.
double truncation_moved_mass(const Plan *plan, size_t kept);

#endif
