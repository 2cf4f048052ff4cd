// One storey and one free mass under a power law, once more: everything, flight too, in plain time
// by math/ode.h (SUNDIALS) with what it finds as roots. Shares with the product its contact laws
// and their frozen parameters alone; not as exact (about 1e-12 a contact) and slow. Used by
// test_power.c.
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
