// The closed forms against differences of the identification itself.
#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>

#include <cmocka.h>

#include "core/base/status.h"
#include "core/contact/identification.h"
#include "core/contact/identification_sensitivity.h"

static void assert_near(double is, double should, double within) {
    if (!(fabs(is - should) <= within))
        fail_msg("%.17g should be %.17g within %g", is, should, within);
}

static const double restitutions[] = {0.02, 0.1353352832366127, 0.3, 0.46, 0.61, 0.9, 0.999};

static void slopes_are_those_of_the_identification(void **state) {
    (void)state;
    for (int separation = 0; separation < 2; separation++)
        for (size_t i = 0; i < COUNT(restitutions); i++) {
            const double e = restitutions[i], T = 0.025, h = 1e-5;
            const Propagation by = propagate(e, (Separation)separation);
            const Identified more = identify_measured(0.1, e * exp(h), T, (Separation)separation);
            const Identified less = identify_measured(0.1, e * exp(-h), T, (Separation)separation);
            const Identified late = identify_measured(0.1, e, T * exp(h), (Separation)separation);
            const Identified soon = identify_measured(0.1, e, T * exp(-h), (Separation)separation);
            assert_near(log(more.stiffness / less.stiffness) / (2 * h), by.stiffness_by_restitution,
                        1e-7);
            assert_near(log(late.stiffness / soon.stiffness) / (2 * h),
                        by.stiffness_by_contact_time, 1e-7);
            assert_near(log(more.damping / less.damping) / (2 * h) / by.damping_by_restitution, 1,
                        1e-4);
            assert_near(log(late.damping / soon.damping) / (2 * h), by.damping_by_contact_time,
                        1e-7);
        }
}

static void the_papers_formulas_are_met(void **state) {
    (void)state;
    const double L = log(0.61), pi = acos(-1);
    const Propagation by = propagate(0.61, SEPARATION_ZERO_PENETRATION);
    assert_near(by.stiffness_by_restitution, 2 * L / (pi * pi + L * L), 1e-15);
    assert_near(by.damping_by_restitution, 1 / L, 1e-14);
    assert_true(by.stiffness_by_contact_time == -2 && by.damping_by_contact_time == -1);
}

static void what_gives_all_back_has_no_damping_to_change(void **state) {
    (void)state;
    assert_true(isnan(propagate(1, SEPARATION_ZERO_PENETRATION).damping_by_restitution));
    assert_true(propagate(1, SEPARATION_ZERO_PENETRATION).stiffness_by_restitution == 0);
    const double pi = acos(-1);
    assert_near(propagate(1, SEPARATION_ZERO_FORCE).stiffness_by_restitution, 4 / (pi * pi), 1e-12);
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(slopes_are_those_of_the_identification),
        cmocka_unit_test(the_papers_formulas_are_met),
        cmocka_unit_test(what_gives_all_back_has_no_damping_to_change),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
