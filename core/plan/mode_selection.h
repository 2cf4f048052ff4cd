// Leaves modes out of a plan, modes above the number asked for and modes that nothing sets in
// motion, and predicts the error of a run that keeps only the lowest.
#ifndef CORE_PLAN_MODE_SELECTION_H
#define CORE_PLAN_MODE_SELECTION_H

#include "core/plan/plan.h"

// Selects the modes of a plan of plan_new, once; `modes` is the number asked for, 0: all. Adds its
// decisions and the predicted error to the plan. Does nothing where plan_is_single.
Status plan_keep(Plan *plan, const Scene *scene, size_t modes, Problem *problem);

// Relative to the same run with all modes; at most 1. Exceeded in about 1 % of scenes without
// dampers and 3 % of scenes with dampers.
typedef struct TruncationError {
    double displacement;      // largest difference over the largest displacement, any storey
    double mean_acceleration; // rms of the difference over rms, of all storeys together
    double rms_displacement;  // difference of the largest storey's rms over that rms
} TruncationError;

// Writes to errors[k] the error of a run with the k + 1 lowest modes, for all plan->modes.count of
// them; it never rises with k and ends with 0. The plan has all modes of its structure (plan_new,
// before plan_keep). Nothing is written where plan_is_single. Makes the base's motion.
Status truncation_predict(const Plan *plan, const Scene *scene, TruncationError *errors);

// The share of the lowest `kept` modes in the mass that the base moves, r' M r; 1 where it moves
// none.
double truncation_moved_mass(const Plan *plan, size_t kept);

#endif
