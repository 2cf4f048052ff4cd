#include <stdlib.h>
#include <string.h>

#include "core/plan/plan.h"
#include "tests/support/test.h"

TEST(a_report_is_cleared_by_its_rows) {
    PlanReport report, copy;
    assert_int_equal(fields_default(plan_report_fields, &report), STATUS_OK);
    report.contact_model = strdup("spring_damper");
    assert_int_equal(decisions_add(&report.decisions, "contact_model", "spring_damper", 0.025, "s",
                                   "a contact time is %s", "known"),
                     STATUS_OK);
    assert_int_equal(
        decisions_add(&report.decisions, "solver", "exact", (double)NAN, NULL, "it is linear"),
        STATUS_OK);
    assert_int_equal(decisions_add(&report.decisions, "psd", "left_out", 0, NULL, "%s asked for",
                                   "no spectrum is"),
                     STATUS_OK);
    report.derived.at = calloc(1, sizeof(Derived));
    report.derived.count = 1;
    assert_int_equal(fields_default(derived_fields, &report.derived.at[0]), STATUS_OK);
    report.derived.at[0].material = strdup("sponge@1");
    assert_int_equal(fields_copy(plan_report_fields, &report, &copy), STATUS_OK);
    fields_clear(plan_report_fields, &report);
    assert_int_equal(copy.decisions.count, 3);
    assert_string_equal(copy.decisions.at[0].why, "a contact time is known");
    assert_string_equal(copy.decisions.at[0].unit, "s");
    assert_null(copy.decisions.at[1].unit);
    assert_true(isnan(copy.decisions.at[1].value));
    assert_string_equal(copy.decisions.at[2].chose, "left_out");
    assert_true(copy.decisions.at[2].value == 0);
    assert_string_equal(copy.derived.at[0].material, "sponge@1");
    assert_int_equal(copy.derived.at[0].side, CHOICE_ABSENT);
    fields_clear(plan_report_fields, &copy);
}
