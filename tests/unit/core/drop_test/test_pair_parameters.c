// What a material comes to for a pair, against the identification itself and against drawn
// readings.
#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "core/contact/identification.h"
#include "core/drop_test/pair_parameters.h"
#include "tests/support/drops.h"
#include "tests/support/fields.h"
#include "tests/support/test.h"

static Problem problem;
static PairParameters pair;
static Material material;

static void assert_near(double is, double should, double within) {
    if (!(fabs(is - should) <= within))
        fail_msg("%.17g should be %.17g within %g", is, should, within);
}

static int set_up(void **state) {
    (void)state;
    problem_clear(&problem);
    assert_int_equal(fields_default(material_fields, &material), STATUS_OK);
    material.restitution = 0.61;
    material.contact_time = 0.025;
    material.restitution_deviation = 0.02;
    material.contact_time_deviation = 0.001;
    material.impactor_mass = 0.11;
    material.base = MATERIAL_BASE_FIXED;
    material.least_speed = 0.15;
    material.most_speed = 1;
    return 0;
}

static int tear_down(void **state) {
    (void)state;
    fields_clear(material_fields, &material);
    pair_parameters_clear(&pair);
    return 0;
}

static void derive(double damper, double structure, int identified_for, int separation) {
    assert_int_equal(pair_parameters_run(&material, damper, structure, identified_for, separation,
                                         &pair, &problem),
                     STATUS_OK);
}

static bool is_warned(const char *pointer, const char *says) {
    for (size_t i = 0; i < pair.warnings.count; i++)
        if (strcmp(pair.warnings.at[i].pointer, pointer) == 0 &&
            strstr(pair.warnings.at[i].detail, says) != NULL)
            return true;
    return false;
}

TEST_IN(both_rules_are_told_for_the_pair, set_up, tear_down) {
    derive(0.1107, 1.35, IDENTIFIED_FOR_SCENE, CHOICE_ABSENT);
    assert_int_equal(pair.contacts.count, 2);
    for (int rule = 0; rule < 2; rule++) {
        const Identification it = identification_from_restitution(
            contact_effective_mass(0.1107, 1.35), 0.61, 0.025, (Separation)rule);
        const PairContact *contact = &pair.contacts.at[rule];
        assert_int_equal(contact->separation, rule);
        assert_near(contact->stiffness.value, it.stiffness, 0);
        assert_near(contact->damping.value, it.damping, 0);
        assert_near(contact->damping_ratio.value, it.damping_ratio, 0);
        assert_near(contact->restitution.value, 0.61, 0);
    }
    assert_near(pair.contacts.at[0].stiffness.value, 1655.6191, 1e-4);
    assert_near(pair.effective_mass, 0.10231054, 1e-8);
}

// Readings are drawn with the stated deviations: k_b and c_b spread as was told.
TEST_IN(uncertainties_are_those_of_drawn_readings, set_up, tear_down) {
    enum { DRAWN = 20000 };
    for (int for_rig = 0; for_rig < 2; for_rig++)
        for (int rule = 0; rule < 2; rule++) {
            derive(0.3, 2, for_rig, rule);
            const PairContact *contact = &pair.contacts.at[0];
            const PairFigure *figures[] = {&contact->stiffness, &contact->damping,
                                           &contact->damping_ratio, &contact->restitution,
                                           &contact->contact_time};
            double sums[5] = {0}, squares[5] = {0};
            int inside[5] = {0};
            uint64_t next = 0;
            for (int i = 0; i < DRAWN; i++) {
                const double e = 0.61 + 0.02 * drops_noise(5, &next);
                const double T = 0.025 + 0.001 * drops_noise(5, &next);
                Identification it = identification_from_restitution(
                    for_rig ? 0.11 : pair.effective_mass, e, T, (Separation)rule);
                if (for_rig)
                    it = identification_from_stiffness(pair.effective_mass, it.stiffness,
                                                       it.damping, (Separation)rule);
                const double values[] = {it.stiffness, it.damping, it.damping_ratio, it.restitution,
                                         it.contact_time};
                for (int k = 0; k < 5; k++) {
                    const double off = values[k] - figures[k]->value;
                    sums[k] += off;
                    squares[k] += off * off;
                    inside[k] +=
                        figures[k]->low <= values[k] && values[k] <= figures[k]->high ? 1 : 0;
                }
            }
            for (int k = 0; k < 5; k++) {
                const double mean = sums[k] / DRAWN;
                const double deviation = sqrt(squares[k] / DRAWN - mean * mean);
                assert_near(figures[k]->uncertainty / deviation, 1, 0.03);
                assert_in_range(inside[k], 0.94 * DRAWN, 0.96 * DRAWN);
            }
            pair_parameters_clear(&pair);
        }
}

TEST_IN(a_rigs_stiffness_and_damping_are_carried_over, set_up, tear_down) {
    derive(0.5, (double)NAN, IDENTIFIED_FOR_RIG, SEPARATION_ZERO_PENETRATION);
    const Identification rig =
        identification_from_restitution(0.11, 0.61, 0.025, SEPARATION_ZERO_PENETRATION);
    const Identification it =
        identification_from_stiffness(0.5, rig.stiffness, rig.damping, SEPARATION_ZERO_PENETRATION);
    assert_near(pair.contacts.at[0].stiffness.value, rig.stiffness, 0);
    assert_near(pair.contacts.at[0].restitution.value, it.restitution, 0);
    assert_near(pair.contacts.at[0].contact_time.value, it.contact_time, 0);
    assert_true(is_warned("/effective_mass", "355 % above the test's 0.11 kg"));
    assert_true(is_warned("/effective_mass", "are those of the test"));
    pair_parameters_clear(&pair);
    // Of the test's own pair it is the same thing.
    derive(0.11, (double)NAN, IDENTIFIED_FOR_RIG, SEPARATION_ZERO_FORCE);
    assert_near(pair.contacts.at[0].restitution.value, 0.61, 1e-12);
    assert_int_equal(pair.warnings.count, 0);
    pair_parameters_clear(&pair);
    material.base = CHOICE_ABSENT;
    assert_int_equal(pair_parameters_run(&material, 0.5, (double)NAN, IDENTIFIED_FOR_RIG,
                                         CHOICE_ABSENT, &pair, &problem),
                     STATUS_INVALID);
    assert_non_null(
        strstr(detail_at(&problem, "/identified_for"), "does not state the masses of the test"));
}

TEST_IN(another_pair_is_warned_of, set_up, tear_down) {
    derive(0.11, (double)NAN, IDENTIFIED_FOR_SCENE, CHOICE_ABSENT);
    assert_int_equal(pair.warnings.count, 0);
    pair_parameters_clear(&pair);
    derive(0.22, (double)NAN, IDENTIFIED_FOR_SCENE, CHOICE_ABSENT);
    assert_true(is_warned("/effective_mass", "100 % above"));
    assert_true(is_warned("/effective_mass", "e would be 0.707 in place of 0.61"));
    pair_parameters_clear(&pair);
    material.base = CHOICE_ABSENT;
    material.least_speed = (double)NAN;
    material.separation = SEPARATION_ZERO_FORCE;
    derive(0.22, (double)NAN, IDENTIFIED_FOR_SCENE, SEPARATION_ZERO_PENETRATION);
    assert_true(is_warned("/test_mass", "are unknown"));
    assert_true(is_warned("/least_speed", "range of approach speeds"));
    assert_true(is_warned("/contacts", "determined under zero_force"));
}

TEST_IN(without_a_contact_time_only_the_ratio_is_known, set_up, tear_down) {
    material.contact_time = material.contact_time_deviation = (double)NAN;
    derive(0.11, (double)NAN, IDENTIFIED_FOR_SCENE, CHOICE_ABSENT);
    assert_true(isnan(pair.contacts.at[0].stiffness.value));
    assert_true(isnan(pair.contacts.at[0].damping.value));
    const Identification it = identification_from_restitution(0.11, 0.61, 1, SEPARATION_ZERO_FORCE);
    assert_near(pair.contacts.at[1].damping_ratio.value, it.damping_ratio, 1e-15);
    assert_true(pair.contacts.at[1].damping_ratio.uncertainty > 0);
    assert_true(is_warned("/contacts", "no contact time"));
}

TEST_IN(what_is_not_stated_has_no_uncertainty, set_up, tear_down) {
    material.contact_time_deviation = (double)NAN;
    derive(0.11, (double)NAN, IDENTIFIED_FOR_SCENE, SEPARATION_ZERO_FORCE);
    const PairContact *contact = &pair.contacts.at[0];
    assert_true(isnan(contact->stiffness.uncertainty) && isnan(contact->stiffness.low));
    assert_true(contact->damping_ratio.uncertainty > 0);
    assert_true(is_warned("/contacts", "no standard deviation of T_c"));
}

TEST_IN(e_of_one_and_of_none_are_borders, set_up, tear_down) {
    material.restitution = 1;
    derive(0.11, (double)NAN, IDENTIFIED_FOR_SCENE, CHOICE_ABSENT);
    for (int rule = 0; rule < 2; rule++) {
        assert_near(pair.contacts.at[rule].damping.value, 0, 0);
        assert_true(pair.contacts.at[rule].stiffness.value > 0);
        assert_near(pair.contacts.at[rule].restitution.high, 1, 0);
    }
    pair_parameters_clear(&pair);
    material.restitution = 0;
    derive(0.11, (double)NAN, IDENTIFIED_FOR_SCENE, CHOICE_ABSENT);
    assert_true(isnan(pair.contacts.at[0].stiffness.value));
    assert_true(is_warned("/contacts", "without a rebound"));
}

TEST_IN(an_overdamped_pair_never_parts, set_up, tear_down) {
    material.restitution = 0.05;
    derive(1e-4, (double)NAN, IDENTIFIED_FOR_RIG, SEPARATION_ZERO_PENETRATION);
    assert_true(isnan(pair.contacts.at[0].contact_time.value));
    assert_true(is_warned("/contacts", "never ends"));
}

TEST_IN(a_table_has_figures_for_each_row, set_up, tear_down) {
    material.table.at = calloc(2, sizeof *material.table.at);
    assert_non_null(material.table.at);
    material.table.count = 2;
    material.table.at[0] = (MaterialRow){0.2, 0.7, 0.02, 0.01, (double)NAN};
    material.table.at[1] = (MaterialRow){0.9, 0.5, 0.03, 0.01, 0.001};
    derive(0.11, (double)NAN, IDENTIFIED_FOR_SCENE, CHOICE_ABSENT);
    assert_int_equal(pair.contacts.count, 4);
    assert_near(pair.contacts.at[2].approach_speed, 0.9, 0);
    assert_near(pair.contacts.at[3].stiffness.value,
                identification_from_restitution(0.11, 0.5, 0.03, SEPARATION_ZERO_FORCE).stiffness,
                1e-12);
    assert_true(isnan(pair.contacts.at[0].stiffness.uncertainty));
    assert_true(pair.contacts.at[2].stiffness.uncertainty > 0);
}
