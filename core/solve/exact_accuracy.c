#include "core/solve/exact_accuracy.h"

#include <math.h>

#include "core/solve/power_contact.h"

double exact_tolerance(const Accuracy *accuracy) {
    const double asked =
        accuracy == NULL ? (double)NAN : ((const AccuracyExact *)(const void *)accuracy)->tolerance;
    return asked > POWER_CONTACT_TOLERANCE ? asked : POWER_CONTACT_TOLERANCE;
}

// Linear contacts and impulses have closed forms.
void exact_forget_unused(Accuracy *accuracy, bool has_power_law) {
    if (!has_power_law)
        ((AccuracyExact *)(void *)accuracy)->tolerance = (double)NAN;
}

Status exact_decide(const Accuracy *accuracy, double base_interval, Plan *plan, Problem *problem) {
    (void)base_interval;
    (void)problem;
    if (plan->form != CONTACT_POWER || plan->damper_count == 0)
        return STATUS_OK;
    const double tolerance = exact_tolerance(accuracy);
    const bool is_asked = tolerance > POWER_CONTACT_TOLERANCE;
    return decisions_add(&plan->report.decisions, "tolerance", is_asked ? "asked" : "rounding",
                         tolerance, NULL,
                         is_asked ? "relative error that a contact may end with; flight between "
                                    "contacts is exact, and instants are found as well as these "
                                    "contacts are known"
                                  : "each contact as exact as rounding lets it be, for none asked "
                                    "for less");
}

// clang-format off
const Field accuracy_exact_fields[] = {
    FIELD_BASE(AccuracyExact, accuracy, accuracy_fields),
    FIELD_REAL(AccuracyExact, tolerance, NULL, WITHIN(1e-15, 1e-1), OPTIONAL, "relative error that a contact under a power law may end with; if absent none but rounding's; of no use to other laws, whose contacts have closed forms"),
    FIELD_END
};
// clang-format on
