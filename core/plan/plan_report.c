// The field tables of a plan's report.
#include "core/base/side.h"
#include "core/plan/plan.h"
#include "core/result/metric.h"

// clang-format off
const Field derived_fields[] = {
    FIELD_COUNT(Derived, damper, NULL, AT_MIN(1), OPTIONAL, "number of the damper"),
    FIELD_CHOICE(Derived, side, side_names, OPTIONAL, "side of the damper"),
    FIELD_TEXT(Derived, material, 0, PRESENCE_OPTIONAL, 0, "where the numbers come from"),
    FIELD_REAL(Derived, restitution, NULL, ANY, OPTIONAL, "coefficient of restitution e"),
    FIELD_REAL(Derived, contact_time, "s", ANY, OPTIONAL, "contact time T_c of an isolated impact"),
    FIELD_REAL(Derived, effective_mass, "kg", ANY, OPTIONAL, "effective mass m_e of the pair"),
    FIELD_REAL(Derived, stiffness, "N/m", ANY, OPTIONAL, "contact stiffness k_b"),
    FIELD_REAL(Derived, damping, "N s/m", ANY, OPTIONAL, "contact damping c_b"),
    FIELD_REAL(Derived, damping_ratio, NULL, ANY, OPTIONAL, "damping ratio Z of the contact"),
    FIELD_REAL(Derived, reached_restitution, NULL, ANY, OPTIONAL, "restitution that an isolated contact really reaches under a power law, or with what was carried over from a rig"),
    FIELD_REAL(Derived, reached_contact_time, "s", ANY, OPTIONAL, "contact time that it really has"),
    FIELD_REAL(Derived, identified_mass, "kg", ANY, OPTIONAL, "effective mass of the rig"),
    FIELD_REAL(Derived, exponent, NULL, ANY, OPTIONAL, "exponent n of a power law"),
    FIELD_REAL(Derived, factor, NULL, ANY, OPTIONAL, "a power law's dissipation factor: D, or xi"),
    FIELD_END
};

const Field mode_fields[] = {
    FIELD_REAL(PlanMode, frequency, "Hz", ANY, OPTIONAL, "natural frequency without damping"),
    FIELD_REAL(PlanMode, damping_ratio, NULL, ANY, OPTIONAL, "damping ratio xi of the mode by itself; unknown where it does not swing"),
    FIELD_END
};

static const Field attempt_fields[] = {
    FIELD_TEXT(PlanAttempt, way, 0, PRESENCE_OPTIONAL, 0, "what was run"),
    FIELD_REAL(PlanAttempt, predicted_error, NULL, ANY, OPTIONAL, "relative error foretold"),
    FIELD_REAL(PlanAttempt, estimated_error, NULL, ANY, OPTIONAL, "relative error estimated of the run"),
    FIELD_REAL(PlanAttempt, steps, NULL, ANY, OPTIONAL, "solver steps, counted"),
    FIELD_END
};

static const char *const verdict_names[] = {"kept", "missed", "unknown", NULL};

const Field target_fields[] = {
    FIELD_REAL(PlanTarget, error, NULL, ANY, OPTIONAL, "relative error wanted"),
    FIELD_CHOICE(PlanTarget, metric, metric_names, OPTIONAL, "what it is of"),
    FIELD_TEXT(PlanTarget, way, 0, PRESENCE_OPTIONAL, 0, "the way chosen; after a run the one that this answer came by"),
    FIELD_REAL(PlanTarget, predicted_error, NULL, ANY, OPTIONAL, "relative error foretold for that way"),
    FIELD_REAL(PlanTarget, estimated_error, NULL, ANY, OPTIONAL, "relative error estimated of the run"),
    FIELD_CHOICE(PlanTarget, verdict, verdict_names, OPTIONAL, "whether the estimated error keeps the one wanted; unknown where it could not be estimated"),
    FIELD_LIST(PlanTarget, attempts, attempt_fields, 0, PRESENCE_OPTIONAL, "all runs that were needed"),
    FIELD_END
};

const Field plan_report_fields[] = {
    FIELD_TEXT(PlanReport, contact_model, 0, PRESENCE_OPTIONAL, 0, "the contact model that is run"),
    FIELD_TEXT(PlanReport, solver, 0, PRESENCE_OPTIONAL, 0, "the solver that is run"),
    FIELD_ITEM(PlanReport, target, target_fields, NULL, PRESENCE_OPTIONAL, "what accuracy.target came to; null without one"),
    FIELD_LIST(PlanReport, decisions, decision_fields, 0, PRESENCE_DEFAULT, "choices with their reasons"),
    FIELD_LIST(PlanReport, derived, derived_fields, 0, PRESENCE_DEFAULT, "contact parameters for this pair of masses"),
    FIELD_LIST(PlanReport, modes, mode_fields, 0, PRESENCE_DEFAULT, "natural modes of the structure, the slowest first"),
    FIELD_END
};
// clang-format on
