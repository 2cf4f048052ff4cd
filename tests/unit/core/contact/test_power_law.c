// Power laws in isolated contact: factors, what they reach, how long they last.
#include <math.h>

#include "core/base/status.h"
#include "core/contact/power_law.h"
#include "tests/support/test.h"

static void assert_near(double is, double should, double relative) {
    if (!(fabs(is - should) <= relative * fabs(should)))
        fail_msg("%.17g should be %.17g within %g, is off by %.2g", is, should, relative,
                 is / should - 1);
}

TEST(the_exact_factor_is_right_to_rounding) {
    // By bisection in 60 decimal digits.
    static const double known[][2] = {
        {0.02, 49.999999999999998958984},  {0.1, 9.9981593974956672619221},
        {0.3, 3.0870819811296243805085},   {0.5, 1.4327505332713750280527},
        {0.51, 1.3799669824537123063615},  {0.7, 0.6348282812664168741606},
        {0.9, 0.1664819506853080638992},   {0.99, 0.0151513621094410187232},
        {0.999, 0.0015015013512010866244}, {0.999999, 0.0000015000015000444835},
    };
    for (size_t i = 0; i < COUNT(known); i++)
        assert_near(power_law_factor(known[i][0]), known[i][1],
                    i == COUNT(known) - 1 ? 1e-14 : 1e-15);
    assert_near(power_law_factor(1e-3), 1e3, 1e-15);
    assert_true(power_law_factor(1) == 0);
}

TEST(the_reached_restitution_undoes_the_exact_factor) {
    for (double e = 1e-3; e <= 1; e += 1e-3)
        assert_near(power_law_restitution(power_law_factor(e), 1.5), e, 1e-14);
    for (double off = 0.1; off > 1e-16; off /= 7)
        assert_near(1 - power_law_restitution(power_law_factor(1 - off), 1.5), 1 - (1 - off),
                    1e-7 + 3e-16 / off);
}

static double reached(const ContactLaw *law, double e) {
    return law->restitution(law->factor(e), POWER_LAW_EXPONENT);
}

TEST(textbook_factors_reach_what_they_reach) {
    assert_true(fabs(reached(&contact_hunt_crossley, 0.5) - 0.5) < 1e-15);
    assert_true(fabs(reached(&contact_hunt_crossley_textbook, 0.5) - 0.663) < 5e-4);
    assert_true(fabs(reached(&contact_lankarani_nikravesh, 0.5) - 0.725) < 5e-4);
    assert_true(fabs(reached(&contact_flores, 0.5) - 0.470) < 5e-4);
    assert_true(fabs(reached(&contact_jankowski, 0.5) - 0.4946) < 5e-5);
}

TEST(hertz_lasts_as_in_the_books) {
    // In an isolated contact's own units the greatest penetration is 1.25^(2/5).
    assert_near(power_law_duration(0, 1.5), 2.9432752 * pow(1.25, 0.4), 1e-7);
    // sqrt(pi) G(7/5) / G(9/10) is half of it.
    assert_near(power_law_duration(0, 1.5),
                2 * sqrt(acos(-1)) * tgamma(1.4) / tgamma(0.9) * pow(1.25, 0.4), 1e-13);
    assert_near(power_law_duration(0, 1), acos(-1), 1e-14);
    assert_near(power_law_duration(1e-9, 1.5), power_law_duration(0, 1.5), 1e-8);
    assert_near(contact_jankowski.duration(0, 1.5), power_law_duration(0, 1.5), 1e-12);
}

// Jankowski's law with n = 1 is a damped oscillator, then a free one.
TEST(a_linear_approach_has_closed_forms) {
    static const double factors[] = {0.1, 0.5, 0.9};
    for (size_t i = 0; i < COUNT(factors); i++) {
        const double z = factors[i], root = sqrt(1 - z * z);
        assert_near(contact_jankowski.restitution(z, 1), exp(-z / root * acos(z)), 1e-14);
        assert_near(contact_jankowski.duration(z, 1), acos(z) / root + acos(0), 1e-13);
    }
}

static ContactParameters contact(const ContactLaw *law, double e) {
    return (ContactParameters){.stiffness = 1e5,
                               .exponent = 1.5,
                               .factor = law->factor != NULL ? law->factor(e) : 0,
                               .speed = 0.3,
                               .mass = 0.1};
}

TEST(forces_never_pull_and_know_their_slopes) {
    for (size_t i = 0; contacts[i] != NULL; i++) {
        if (contacts[i]->form != CONTACT_POWER)
            continue;
        const ContactParameters at = contact(contacts[i], 0.5);
        for (double p = -1e-3; p < 1e-2; p += 1.1e-3)
            for (double speed = -3; speed < 3; speed += 0.17) {
                const ContactForce force = contacts[i]->force(&at, p, speed);
                assert_true(force.value >= 0 && force.strain >= 0);
                if (!(p > 0)) {
                    assert_true(force.value == 0 && force.strain == 0);
                    continue;
                }
                const double h = 1e-6, there = contacts[i]->force(&at, p * (1 + h), speed).value,
                             faster = contacts[i]->force(&at, p, speed + h).value;
                assert_true(fabs((there - force.value) / (p * h) - force.by_penetration) <=
                            1e-4 * fabs(force.by_penetration) + 1e-3);
                assert_true(fabs((faster - force.value) / h - force.by_speed) <=
                            1e-4 * fabs(force.by_speed) + 1e-3);
            }
    }
}
