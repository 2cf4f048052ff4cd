// Table I of Li and Darby 2009, and the way back.
#include <math.h>

#include "core/base/status.h"
#include "core/contact/identification.h"
#include "tests/support/test.h"

static void assert_near(double is, double should, double relative) {
    if (!(fabs(is - should) <= relative * fabs(should)))
        fail_msg("%.17g should be %.17g within %g", is, should, relative);
}

TEST(table_one_of_the_paper_is_met_within_half_a_percent) {
    static const struct {
        double e, T_c, k_b, c_b;
    } table[] = {
        {0.61, 0.025, 1.65e3, 4.05},  {0.44, 0.019, 2.99e3, 8.80},  {0.53, 0.004, 65.7e3, 32.5},
        {0.49, 0.003, 118.0e3, 48.7}, {0.46, 0.0003, 11900e3, 530},
    };
    const double m_e = contact_effective_mass(1.35, 0.1107);
    for (size_t i = 0; i < COUNT(table); i++) {
        const Identification found = identification_from_restitution(m_e, table[i].e, table[i].T_c,
                                                                     SEPARATION_ZERO_PENETRATION);
        assert_near(found.stiffness, table[i].k_b, 0.005);
        assert_near(found.damping, table[i].c_b, 0.005);
    }
}

TEST(the_sponge_comes_to_these_numbers) {
    const Identification sponge = identification_from_restitution(
        contact_effective_mass(1.35, 0.1107), 0.61, 0.025, SEPARATION_ZERO_PENETRATION);
    assert_near(sponge.effective_mass, 0.10231054, 5e-8);
    assert_near(sponge.stiffness, 1655.6191, 5e-8);
    assert_near(sponge.damping, 4.0457377, 5e-8);
    assert_near(sponge.damping_ratio, 0.15542731, 5e-8);
    assert_true(sponge.restitution == 0.61 && sponge.contact_time == 0.025);
}

TEST(what_was_measured_comes_back_from_stiffness_and_damping) {
    static const double restitutions[] = {1e-6, 0.01, 0.1, 0.5, 0.9, 0.999999, 1};
    static const double times[] = {1e-6, 0.0003, 0.025, 10};
    for (size_t i = 0; i < COUNT(restitutions); i++)
        for (size_t j = 0; j < COUNT(times); j++) {
            const Identification there = identification_from_restitution(
                0.1, restitutions[i], times[j], SEPARATION_ZERO_PENETRATION);
            const Identification back = identification_from_stiffness(
                0.1, there.stiffness, there.damping, SEPARATION_ZERO_PENETRATION);
            assert_near(back.restitution, restitutions[i], 1e-13);
            assert_near(back.contact_time, times[j], 1e-13);
            assert_near(back.damping_ratio, there.damping_ratio, 1e-14);
        }
}

TEST(an_elastic_buffer_has_no_damping) {
    const Identification elastic =
        identification_from_restitution(1, 1, 0.5, SEPARATION_ZERO_PENETRATION);
    assert_true(elastic.damping == 0 && !signbit(elastic.damping));
    assert_true(elastic.damping_ratio == 0);
    const Identification back =
        identification_from_stiffness(1, elastic.stiffness, 0, SEPARATION_ZERO_PENETRATION);
    assert_true(back.restitution == 1);
}

TEST(an_overdamped_buffer_never_lets_go) {
    const Identification critical =
                             identification_from_stiffness(1, 1, 2, SEPARATION_ZERO_PENETRATION),
                         over = identification_from_stiffness(1, 1, 5, SEPARATION_ZERO_PENETRATION);
    assert_true(critical.restitution == 0 && isinf(critical.contact_time));
    assert_true(over.restitution == 0 && isinf(over.contact_time));
    assert_near(over.damping_ratio, 2.5, 1e-15);
}

TEST(the_effective_mass_neither_overflows_nor_underflows) {
    assert_near(contact_effective_mass(1e308, 1e308), 0.5e308, 1e-15);
    assert_near(contact_effective_mass(1e-300, 1e300), 1e-300, 1e-15);
    assert_near(contact_effective_mass(1e-300, 1e-300), 0.5e-300, 1e-15);
    assert_true(contact_effective_mass(2, 3) == contact_effective_mass(3, 2));
    assert_near(contact_effective_mass(2, 3), 1.2, 1e-15);
}

TEST(zero_force_gives_back_what_was_measured) {
    static const double times[] = {1e-9, 0.0003, 0.025, 10};
    // Through Z = 1, where e = exp(-2), in steps down to the last bits.
    for (int i = 0; i < 2000; i++) {
        const double e =
            i < 1000 ? exp(-20.7 * i / 999)
                     : exp(-2) * (1 + (i % 2 ? 1 : -1) * pow(10, -1 - 15.0 * (i - 1000) / 1000));
        for (size_t j = 0; j < COUNT(times); j++) {
            const Identification there =
                identification_from_restitution(0.1, e, times[j], SEPARATION_ZERO_FORCE);
            const Identification back = identification_from_stiffness(
                0.1, there.stiffness, there.damping, SEPARATION_ZERO_FORCE);
            assert_near(back.restitution, e, 1e-14);
            assert_near(back.contact_time, times[j], 1e-14);
            assert_near(back.damping_ratio, there.damping_ratio, 1e-14);
            assert_near(there.damping, -2 * 0.1 * log(e) / times[j], 1e-14);
        }
    }
}

TEST(zero_force_meets_its_branches) {
    static const double ratios[] = {0.1, 0.5, 0.9};
    for (size_t i = 0; i < COUNT(ratios); i++) {
        const double Z = ratios[i], root = sqrt(1 - Z * Z), w = 3;
        const Identification found =
            identification_from_stiffness(2, 2 * w * w, 2 * Z * w * 2, SEPARATION_ZERO_FORCE);
        assert_near(found.restitution, exp(-2 * Z / root * acos(Z)), 1e-14);
        assert_near(found.contact_time, 2 * acos(Z) / (w * root), 1e-14);
    }
    static const double over[] = {1.2, 3, 100};
    for (size_t i = 0; i < COUNT(over); i++) {
        const double Z = over[i], root = sqrt(Z * Z - 1), w = 3;
        const Identification found =
            identification_from_stiffness(2, 2 * w * w, 2 * Z * w * 2, SEPARATION_ZERO_FORCE);
        assert_near(found.restitution, exp(-2 * Z / root * acosh(Z)), 1e-13);
        assert_near(found.contact_time, 2 * acosh(Z) / (w * root), 1e-13);
    }
    const Identification critical = identification_from_stiffness(1, 1, 2, SEPARATION_ZERO_FORCE);
    assert_near(critical.restitution, exp(-2), 1e-15);
    assert_near(critical.contact_time, 2, 1e-15);
    const Identification elastic =
        identification_from_restitution(1, 1, 0.5, SEPARATION_ZERO_FORCE);
    assert_near(elastic.stiffness, 4 * acos(-1) * acos(-1), 1e-15);
    assert_true(elastic.damping == 0 && !signbit(elastic.damping));
    // The smallest restitution there is still has numbers.
    assert_true(
        isfinite(identification_from_restitution(1, 5e-324, 1, SEPARATION_ZERO_FORCE).damping));
}

TEST(zero_force_needs_a_softer_buffer) {
    static const double table[][2] = {
        {0.61, 0.025}, {0.44, 0.019}, {0.53, 0.004}, {0.49, 0.003}, {0.46, 0.0003}};
    for (size_t i = 0; i < COUNT(table); i++) {
        const Identification force = identification_from_restitution(0.1, table[i][0], table[i][1],
                                                                     SEPARATION_ZERO_FORCE),
                             way = identification_from_restitution(0.1, table[i][0], table[i][1],
                                                                   SEPARATION_ZERO_PENETRATION);
        const double lower = 1 - force.stiffness / way.stiffness;
        assert_true(lower > 0.20 && lower < 0.345);
        assert_near(force.damping, way.damping, 1e-15);
    }
}

static void assert_within(double is, double should, double within) {
    if (!(fabs(is - should) <= within))
        fail_msg("%.17g should be %.17g within %g", is, should, within);
}

// The closed forms against differences of the identification itself.
static const double restitutions[] = {0.02, 0.1353352832366127, 0.3, 0.46, 0.61, 0.9, 0.999};

TEST(slopes_are_those_of_the_identification) {
    for (int separation = 0; separation < 2; separation++)
        for (size_t i = 0; i < COUNT(restitutions); i++) {
            const double e = restitutions[i], T = 0.025, h = 1e-5;
            const IdentificationSensitivity by =
                identification_sensitivity(e, (Separation)separation);
            const Identification more =
                identification_from_restitution(0.1, e * exp(h), T, (Separation)separation);
            const Identification less =
                identification_from_restitution(0.1, e * exp(-h), T, (Separation)separation);
            const Identification late =
                identification_from_restitution(0.1, e, T * exp(h), (Separation)separation);
            const Identification soon =
                identification_from_restitution(0.1, e, T * exp(-h), (Separation)separation);
            assert_within(log(more.stiffness / less.stiffness) / (2 * h),
                          by.stiffness_by_restitution, 1e-7);
            assert_within(log(late.stiffness / soon.stiffness) / (2 * h),
                          by.stiffness_by_contact_time, 1e-7);
            assert_within(log(more.damping / less.damping) / (2 * h) / by.damping_by_restitution, 1,
                          1e-4);
            assert_within(log(late.damping / soon.damping) / (2 * h), by.damping_by_contact_time,
                          1e-7);
        }
}

TEST(the_papers_formulas_are_met) {
    const double L = log(0.61), pi = acos(-1);
    const IdentificationSensitivity by =
        identification_sensitivity(0.61, SEPARATION_ZERO_PENETRATION);
    assert_within(by.stiffness_by_restitution, 2 * L / (pi * pi + L * L), 1e-15);
    assert_within(by.damping_by_restitution, 1 / L, 1e-14);
    assert_true(by.stiffness_by_contact_time == -2 && by.damping_by_contact_time == -1);
}

TEST(what_gives_all_back_has_no_damping_to_change) {
    assert_true(
        isnan(identification_sensitivity(1, SEPARATION_ZERO_PENETRATION).damping_by_restitution));
    assert_true(
        identification_sensitivity(1, SEPARATION_ZERO_PENETRATION).stiffness_by_restitution == 0);
    const double pi = acos(-1);
    assert_within(identification_sensitivity(1, SEPARATION_ZERO_FORCE).stiffness_by_restitution,
                  4 / (pi * pi), 1e-12);
}
