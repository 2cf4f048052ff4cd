// Table I of Li and Darby 2009, and the way back.
#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>

#include <cmocka.h>

#include "core/base/status.h"
#include "core/contact/identification.h"

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

static void zero_force_gives_back_what_was_measured(void **state) {
    (void)state;
    static const double times[] = {1e-9, 0.0003, 0.025, 10};
    // Through Z = 1, where e = exp(-2), in steps down to the last bits.
    for (int i = 0; i < 2000; i++) {
        const double e =
            i < 1000 ? exp(-20.7 * i / 999)
                     : exp(-2) * (1 + (i % 2 ? 1 : -1) * pow(10, -1 - 15.0 * (i - 1000) / 1000));
        for (size_t j = 0; j < COUNT(times); j++) {
            const Identified there = identify_measured(0.1, e, times[j], SEPARATION_ZERO_FORCE);
            const Identified back =
                identify_given(0.1, there.stiffness, there.damping, SEPARATION_ZERO_FORCE);
            assert_near(back.restitution, e, 1e-14);
            assert_near(back.contact_time, times[j], 1e-14);
            assert_near(back.damping_ratio, there.damping_ratio, 1e-14);
            assert_near(there.damping, -2 * 0.1 * log(e) / times[j], 1e-14);
        }
    }
}

static void zero_force_meets_its_branches(void **state) {
    (void)state;
    static const double ratios[] = {0.1, 0.5, 0.9};
    for (size_t i = 0; i < COUNT(ratios); i++) {
        const double Z = ratios[i], root = sqrt(1 - Z * Z), w = 3;
        const Identified found = identify_given(2, 2 * w * w, 2 * Z * w * 2, SEPARATION_ZERO_FORCE);
        assert_near(found.restitution, exp(-2 * Z / root * acos(Z)), 1e-14);
        assert_near(found.contact_time, 2 * acos(Z) / (w * root), 1e-14);
    }
    static const double over[] = {1.2, 3, 100};
    for (size_t i = 0; i < COUNT(over); i++) {
        const double Z = over[i], root = sqrt(Z * Z - 1), w = 3;
        const Identified found = identify_given(2, 2 * w * w, 2 * Z * w * 2, SEPARATION_ZERO_FORCE);
        assert_near(found.restitution, exp(-2 * Z / root * acosh(Z)), 1e-13);
        assert_near(found.contact_time, 2 * acosh(Z) / (w * root), 1e-13);
    }
    const Identified critical = identify_given(1, 1, 2, SEPARATION_ZERO_FORCE);
    assert_near(critical.restitution, exp(-2), 1e-15);
    assert_near(critical.contact_time, 2, 1e-15);
    const Identified elastic = identify_measured(1, 1, 0.5, SEPARATION_ZERO_FORCE);
    assert_near(elastic.stiffness, 4 * acos(-1) * acos(-1), 1e-15);
    assert_true(elastic.damping == 0 && !signbit(elastic.damping));
    // The smallest restitution there is still has numbers.
    assert_true(isfinite(identify_measured(1, 5e-324, 1, SEPARATION_ZERO_FORCE).damping));
}

static void zero_force_needs_a_softer_buffer(void **state) {
    (void)state;
    static const double table[][2] = {
        {0.61, 0.025}, {0.44, 0.019}, {0.53, 0.004}, {0.49, 0.003}, {0.46, 0.0003}};
    for (size_t i = 0; i < COUNT(table); i++) {
        const Identified force = identify_measured(0.1, table[i][0], table[i][1],
                                                   SEPARATION_ZERO_FORCE),
                         way = identify_measured(0.1, table[i][0], table[i][1],
                                                 SEPARATION_ZERO_PENETRATION);
        const double lower = 1 - force.stiffness / way.stiffness;
        assert_true(lower > 0.20 && lower < 0.345);
        assert_near(force.damping, way.damping, 1e-15);
    }
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(table_one_of_the_paper_is_met_within_half_a_percent),
        cmocka_unit_test(the_sponge_comes_to_these_numbers),
        cmocka_unit_test(what_was_measured_comes_back_from_stiffness_and_damping),
        cmocka_unit_test(an_elastic_buffer_has_no_damping),
        cmocka_unit_test(an_overdamped_buffer_never_lets_go),
        cmocka_unit_test(zero_force_gives_back_what_was_measured),
        cmocka_unit_test(zero_force_meets_its_branches),
        cmocka_unit_test(zero_force_needs_a_softer_buffer),
        cmocka_unit_test(the_effective_mass_neither_overflows_nor_underflows),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
