// Reference for one storey and one free mass under a power law: flight and contact are integrated
// in plain time by GSL. It shares with the product only the contact laws and their frozen
// parameters. Its error is about 1e-12 a contact, and it is slow.
#ifndef TESTS_TRUTH_POWER_REFERENCE_H
#define TESTS_TRUTH_POWER_REFERENCE_H

#include "core/excitation/base_motion.h"
#include "core/plan/plan.h"

typedef struct PowerImpact {
    int side;
    double start, end, approach, separation, peak, impulse; // what is open has NAN
} PowerImpact;

typedef struct PowerTruth {
    double *x; // plan->count samples of the displacement
    PowerImpact *impacts;
    size_t count;
    bool is_whole;
} PowerTruth;

// At most `most` impacts. Cleared by power_truth_clear.
void power_truth(const Plan *plan, const Base *base, size_t most, PowerTruth *truth);
void power_truth_clear(PowerTruth *truth);

#endif
