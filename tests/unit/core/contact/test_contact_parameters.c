// Tables over approach speed, other pairs of masses, and what stays the same for all impacts.
#include <math.h>

#include "core/contact/contact_parameters.h"
#include "core/contact/identification.h"
#include "core/contact/power_law.h"
#include "tests/support/test.h"

static ContactRow rows[] = {{0.1, 0.8, 0.03}, {0.5, 0.6, 0.02}, {2, 0.5, 0.01}};
static const ContactNumbers table = {NAN, NAN, NAN, NAN, 1.5, {rows, 3}};
static const ContactNumbers measured = {0.6, 0.02, NAN, NAN, 1.5, {NULL, 0}};

static void assert_near(double is, double should) {
    if (!(fabs(is - should) <= 1e-14 * fabs(should)))
        fail_msg("%.17g should be %.17g", is, should);
}

TEST(a_table_is_linear_between_its_rows_and_constant_beyond) {
    const ContactRows *at = &table.rows;
    assert_true(contact_rows_interpolate(at, 0).restitution == 0.8);
    assert_true(contact_rows_interpolate(at, 0.1).contact_time == 0.03);
    assert_near(contact_rows_interpolate(at, 0.3).restitution, 0.7);
    assert_near(contact_rows_interpolate(at, 0.3).contact_time, 0.025);
    assert_true(contact_rows_interpolate(at, 0.5).restitution == 0.6);
    assert_near(contact_rows_interpolate(at, 1.25).contact_time, 0.015);
    assert_true(contact_rows_interpolate(at, 2).restitution == 0.5);
    assert_true(contact_rows_interpolate(at, 1e9).contact_time == 0.01);
    assert_true(contact_rows_interpolate(at, (double)NAN).restitution == 0.8);
}

TEST(a_linear_impact_takes_the_tables_values_at_its_speed) {
    for (int rule = 0; rule < 2; rule++) {
        const ContactStop stop =
            contact_stop_prepare(&contact_spring_damper, rule, 0.1, 0.1, &table);
        for (double speed = 0; speed < 3; speed += 0.1) {
            const ContactRow row = contact_rows_interpolate(&table.rows, speed);
            const Identification found = identification_from_restitution(
                0.1, row.restitution, row.contact_time, (Separation)rule);
            const ContactParameters frozen = contact_parameters_at(&stop, speed);
            assert_true(frozen.stiffness == found.stiffness && frozen.damping == found.damping);
        }
    }
    const ContactStop stop = contact_stop_prepare(&contact_impulse, 0, 0.1, 0.1, &table);
    assert_near(contact_parameters_at(&stop, 0.3).restitution, 0.7);
}

TEST(without_a_table_all_impacts_are_alike) {
    const ContactStop stop = contact_stop_prepare(&contact_spring_damper, 0, 0.1, 0.1, &measured);
    const ContactParameters slow = contact_parameters_at(&stop, 1e-9),
                            fast = contact_parameters_at(&stop, 10);
    assert_true(slow.stiffness == fast.stiffness && slow.damping == fast.damping);
}

// T_c = h (m / k)^(1/(n+1)) v0^(2/(n+1) - 1)
TEST(a_power_law_is_as_stiff_as_its_contact_time_asks_at_each_speed) {
    const ContactStop stop = contact_stop_prepare(&contact_hunt_crossley, 0, 0.1, 0.1, &measured);
    const double h = power_law_duration(power_law_factor(0.6), 1.5);
    for (double speed = 1e-6; speed < 100; speed *= 10) {
        const ContactParameters frozen = contact_parameters_at(&stop, speed);
        assert_near(h * pow(0.1 / frozen.stiffness, 0.4) * pow(speed, -0.2), 0.02);
        assert_true(frozen.speed == speed);
    }
    assert_true(contact_parameters_at(&stop, 0).speed == CONTACT_SPEED_MIN);
    ContactNumbers known = measured;
    known.contact_time = NAN;
    known.stiffness = 1e5;
    const ContactStop given = contact_stop_prepare(&contact_flores, 0, 0.1, 0.1, &known);
    assert_true(contact_parameters_at(&given, 0.1).stiffness == 1e5);
    assert_true(contact_parameters_at(&given, 3).stiffness == 1e5);
}

TEST(a_rigs_parameters_are_carried_over_to_other_masses) {
    const ContactStop stop = contact_stop_prepare(&contact_spring_damper, 0, 0.5, 0.1, &measured);
    const Identification there =
        identification_from_restitution(0.5, 0.6, 0.02, SEPARATION_ZERO_PENETRATION);
    const ContactParameters frozen = contact_parameters_at(&stop, 0.3);
    assert_true(frozen.stiffness == there.stiffness && frozen.damping == there.damping);
    const ContactStop hertz = contact_stop_prepare(&contact_hertz, 0, 0.5, 0.1, &measured);
    const ContactParameters power = contact_parameters_at(&hertz, 0.3);
    assert_near(power_law_duration(0, 1.5) * pow(0.5 / power.stiffness, 0.4) * pow(0.3, -0.2),
                0.02);
    assert_true(power.mass == 0.1);
}
