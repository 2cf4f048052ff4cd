// Table I of Li and Darby 2009, and the way back.
#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>

#include <cmocka.h>

#include "core/base/status.h"
#include "core/contact/identify.h"

static void assert_near(double is, double should, double relative) {
    if (!(fabs(is - should) <= relative * fabs(should)))
        fail_msg("%.17g should be %.17g within %g", is, should, relative);
}

static void table_one_of_the_paper_is_met_within_half_a_percent(void **state) {
    (void)state;
    static const struct {
        double e, T_c, k_b, c_b;
    } table[] = {
        {0.61, 0.025, 1.65e3, 4.05},  {0.44, 0.019, 2.99e3, 8.80},  {0.53, 0.004, 65.7e3, 32.5},
        {0.49, 0.003, 118.0e3, 48.7}, {0.46, 0.0003, 11900e3, 530},
    };
    const double m_e = effective_mass(1.35, 0.1107);
    for (size_t i = 0; i < COUNT(table); i++) {
        const Identified found =
            identify_measured(m_e, table[i].e, table[i].T_c, SEPARATION_ZERO_PENETRATION);
        assert_near(found.stiffness, table[i].k_b, 0.005);
        assert_near(found.damping, table[i].c_b, 0.005);
    }
}

static void the_sponge_comes_to_these_numbers(void **state) {
    (void)state;
    const Identified sponge =
        identify_measured(effective_mass(1.35, 0.1107), 0.61, 0.025, SEPARATION_ZERO_PENETRATION);
    assert_near(sponge.effective_mass, 0.10231054, 5e-8);
    assert_near(sponge.stiffness, 1655.6191, 5e-8);
    assert_near(sponge.damping, 4.0457377, 5e-8);
    assert_near(sponge.damping_ratio, 0.15542731, 5e-8);
    assert_true(sponge.restitution == 0.61 && sponge.contact_time == 0.025);
}

static void what_was_measured_comes_back_from_stiffness_and_damping(void **state) {
    (void)state;
    static const double restitutions[] = {1e-6, 0.01, 0.1, 0.5, 0.9, 0.999999, 1};
    static const double times[] = {1e-6, 0.0003, 0.025, 10};
    for (size_t i = 0; i < COUNT(restitutions); i++)
        for (size_t j = 0; j < COUNT(times); j++) {
            const Identified there =
                identify_measured(0.1, restitutions[i], times[j], SEPARATION_ZERO_PENETRATION);
            const Identified back =
                identify_given(0.1, there.stiffness, there.damping, SEPARATION_ZERO_PENETRATION);
            assert_near(back.restitution, restitutions[i], 1e-13);
            assert_near(back.contact_time, times[j], 1e-13);
            assert_near(back.damping_ratio, there.damping_ratio, 1e-14);
        }
}

static void an_elastic_buffer_has_no_damping(void **state) {
    (void)state;
    const Identified elastic = identify_measured(1, 1, 0.5, SEPARATION_ZERO_PENETRATION);
    assert_true(elastic.damping == 0 && !signbit(elastic.damping));
    assert_true(elastic.damping_ratio == 0);
    const Identified back = identify_given(1, elastic.stiffness, 0, SEPARATION_ZERO_PENETRATION);
    assert_true(back.restitution == 1);
}

static void an_overdamped_buffer_never_lets_go(void **state) {
    (void)state;
    const Identified critical = identify_given(1, 1, 2, SEPARATION_ZERO_PENETRATION),
                     over = identify_given(1, 1, 5, SEPARATION_ZERO_PENETRATION);
    assert_true(critical.restitution == 0 && isinf(critical.contact_time));
    assert_true(over.restitution == 0 && isinf(over.contact_time));
    assert_near(over.damping_ratio, 2.5, 1e-15);
}

static void the_effective_mass_neither_overflows_nor_underflows(void **state) {
    (void)state;
    assert_near(effective_mass(1e308, 1e308), 0.5e308, 1e-15);
    assert_near(effective_mass(1e-300, 1e300), 1e-300, 1e-15);
    assert_near(effective_mass(1e-300, 1e-300), 0.5e-300, 1e-15);
    assert_true(effective_mass(2, 3) == effective_mass(3, 2));
    assert_near(effective_mass(2, 3), 1.2, 1e-15);
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(table_one_of_the_paper_is_met_within_half_a_percent),
        cmocka_unit_test(the_sponge_comes_to_these_numbers),
        cmocka_unit_test(what_was_measured_comes_back_from_stiffness_and_damping),
        cmocka_unit_test(an_elastic_buffer_has_no_damping),
        cmocka_unit_test(an_overdamped_buffer_never_lets_go),
        cmocka_unit_test(the_effective_mass_neither_overflows_nor_underflows),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
