// What revision is proposed of which readings, and when none is.
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "core/drop_test/evaluation.h"
#include "tests/support/drops.h"
#include "tests/support/test.h"

static Problem problem;
static Evaluation evaluation;
static MaterialProposal proposal;
static DropTest tests_read[2];
static Material before;

static void assert_near(double is, double should, double within) {
    if (!(fabs(is - should) <= within))
        fail_msg("%.17g should be %.17g within %g", is, should, within);
}

static int set_up(void **state) {
    (void)state;
    assert_int_equal(fields_default(material_fields, &before), STATUS_OK);
    before.name = strdup("Sponge");
    before.kind = strdup("foam");
    before.source = strdup("an old book");
    before.restitution = 0.1;
    before.contact_time = 7;
    before.impactor_mass = 3;
    before.separation = SEPARATION_ZERO_FORCE;
    return 0;
}

static int tear_down(void **state) {
    (void)state;
    fields_clear(material_fields, &before);
    fields_clear(drop_test_fields, &tests_read[0]);
    fields_clear(drop_test_fields, &tests_read[1]);
    material_proposal_clear(&proposal);
    evaluation_clear(&evaluation);
    return 0;
}

static void propose(const char *const *texts, size_t count, ProposalForm form) {
    Measurement tests[2];
    for (size_t i = 0; i < count; i++) {
        if (drops_read(texts[i], &tests_read[i], &problem) != STATUS_OK)
            fail_msg("%s", problem.detail);
        tests[i] = (Measurement){10 + i, &tests_read[i]};
    }
    assert_int_equal(
        evaluation_run(tests, count, SEPARATION_ZERO_PENETRATION, NULL, &evaluation, &problem),
        STATUS_OK);
    assert_int_equal(
        material_proposal_run(&evaluation, tests, count, &before, form, &proposal, &problem),
        STATUS_OK);
    // What is proposed would be taken.
    if (proposal.why == NULL && material_validate(&proposal.material, "", &problem) != STATUS_OK)
        fail_msg("%s", problem.detail);
}

static bool is_warned(const char *pointer) {
    for (size_t i = 0; i < evaluation.warnings.count; i++)
        if (strcmp(evaluation.warnings.at[i].pointer, pointer) == 0)
            return true;
    return false;
}

TEST_IN(means_and_ranges_are_taken_and_nothing_old, set_up, tear_down) {
    const char *const text[] = {
        "{\"gravity\": 0, \"impactor\": \"ball\", \"impactor_mass\": 0.11, \"base\": \"fixed\", "
        "\"temperature\": 20, \"source\": \"doi:10/x\", \"drops\": ["
        "{\"approach_speed\": 1, \"rebound_speed\": 0.6, \"contact_time\": 0.02}, "
        "{\"approach_speed\": 2, \"rebound_speed\": 1.24, \"contact_time\": 0.021}, "
        "{\"approach_speed\": 3, \"rebound_speed\": 1.83, \"contact_time\": 0.022}]}"};
    propose(text, 1, PROPOSAL_CONSTANT);
    const Material *material = &proposal.material;
    assert_null(proposal.why);
    assert_string_equal(material->name, "Sponge");
    assert_string_equal(material->kind, "foam");
    assert_string_equal(material->source, "doi:10/x");
    assert_string_equal(material->impactor, "ball");
    assert_near(material->restitution, 0.61, 1e-12);
    assert_near(material->restitution_deviation, 0.01, 1e-12);
    assert_near(material->contact_time, 0.021, 1e-12);
    assert_near(material->contact_time_deviation, 0.001, 1e-12);
    assert_near(material->least_speed, 1, 0);
    assert_near(material->most_speed, 3, 0);
    assert_near(material->most_temperature, 20, 0);
    assert_near(material->impactor_mass, 0.11, 0);
    assert_int_equal(material->base, MATERIAL_BASE_FIXED);
    // Durations that were read belong to no rule.
    assert_int_equal(material->separation, CHOICE_ABSENT);
    assert_int_equal(material->measurements.count, 1);
    assert_near(material->measurements.at[0], 10, 0);
    assert_int_equal(material->table.count, 0);
}

TEST_IN(what_was_not_measured_is_not_said, set_up, tear_down) {
    const char *const text[] = {"{\"drops\": [{\"drop_height\": 0.1, \"rebound_height\": 0.04}]}"};
    propose(text, 1, PROPOSAL_CONSTANT);
    const Material *material = &proposal.material;
    assert_near(material->restitution, sqrt(0.4), 1e-12);
    assert_true(isnan(material->restitution_deviation));
    assert_true(isnan(material->contact_time) && isnan(material->contact_time_deviation));
    assert_true(isnan(material->impactor_mass) && isnan(material->least_temperature));
    assert_string_equal(material->source, "measurements of this material: 10");
    assert_true(is_warned("/revision/contact_time"));
}

TEST_IN(without_a_restitution_there_is_no_proposal, set_up, tear_down) {
    const char *const text[] = {"{\"drops\": [{\"contact_time\": 0.1}]}"};
    propose(text, 1, PROPOSAL_CONSTANT);
    assert_non_null(strstr(proposal.why, "a revision needs"));
    assert_null(proposal.material.name);
}

TEST_IN(two_tests_add_up_and_their_pairs_must_agree, set_up, tear_down) {
    const char *const texts[] = {
        "{\"impactor_mass\": 0.11, \"base\": \"fixed\", \"source\": \"a\", \"temperature\": 10, "
        "\"drops\": [{\"drop_height\": 0.1, \"rebound_height\": 0.04}]}",
        "{\"impactor_mass\": 0.2, \"base\": \"fixed\", \"source\": \"b\", \"temperature\": 30, "
        "\"drops\": [{\"contact_time\": 0.004}]}"};
    propose(texts, 2, PROPOSAL_CONSTANT);
    const Material *material = &proposal.material;
    assert_near(material->restitution, sqrt(0.4), 1e-12);
    assert_near(material->contact_time, 0.004, 0);
    assert_near(material->least_temperature, 10, 0);
    assert_near(material->most_temperature, 30, 0);
    assert_string_equal(material->source, "a, b");
    assert_true(isnan(material->impactor_mass));
    assert_int_equal(material->base, CHOICE_ABSENT);
    assert_true(is_warned("/revision/impactor_mass"));
    assert_int_equal(material->measurements.count, 2);
}

TEST_IN(a_table_has_a_row_for_each_speed, set_up, tear_down) {
    const char *const text[] = {
        "{\"gravity\": 0, \"drops\": ["
        "{\"approach_speed\": 1.02, \"rebound_speed\": 0.612, \"contact_time\": 0.02}, "
        "{\"approach_speed\": 0.98, \"rebound_speed\": 0.588, \"contact_time\": 0.022}, "
        "{\"approach_speed\": 2, \"rebound_speed\": 1, \"contact_time\": 0.03}, "
        "{\"approach_speed\": 3, \"rebound_speed\": 1.2}]}"};
    propose(text, 1, PROPOSAL_TABLE);
    const MaterialRows *table = &proposal.material.table;
    assert_null(proposal.why);
    assert_int_equal(table->count, 2); // at 3 m/s there is no contact time
    assert_true(is_warned("/revision/table"));
    assert_near(table->at[0].approach_speed, 1, 1e-12);
    assert_near(table->at[0].restitution, 0.6, 1e-12);
    assert_near(table->at[0].contact_time, 0.021, 1e-12);
    assert_near(table->at[0].contact_time_deviation, sqrt(2) * 0.001, 1e-12);
    assert_near(table->at[1].restitution, 0.5, 1e-12);
    assert_true(isnan(table->at[1].restitution_deviation));
    assert_true(isnan(proposal.material.restitution));
}

// What is left out of a table, and what does not count, is not said to be measured.
TEST_IN(only_what_stands_behind_a_revision_is_named, set_up, tear_down) {
    const char *const texts[] = {
        "{\"gravity\": 0, \"impactor_mass\": 0.11, \"base\": \"fixed\", \"temperature\": 20, "
        "\"source\": \"a\", \"drops\": ["
        "{\"approach_speed\": 1, \"rebound_speed\": 0.6, \"contact_time\": 0.02}, "
        "{\"approach_speed\": 2, \"rebound_speed\": 1.2, \"contact_time\": 0.02}]}",
        "{\"gravity\": 0, \"impactor_mass\": 0.2, \"base\": \"fixed\", \"temperature\": 80, "
        "\"source\": \"b\", \"drops\": ["
        "{\"approach_speed\": 9, \"rebound_speed\": 5.4}]}"};
    propose(texts, 2, PROPOSAL_TABLE);
    const Material *material = &proposal.material;
    assert_int_equal(material->table.count, 2);
    assert_near(material->most_speed, 2, 0);
    assert_near(material->most_temperature, 20, 0);
    assert_string_equal(material->source, "a");
    assert_int_equal(material->measurements.count, 1);
    assert_near(material->measurements.at[0], 10, 0);
    assert_near(material->impactor_mass, 0.11, 0);
    assert_false(is_warned("/revision/impactor_mass"));
}

// Mean and deviation are of one kind, in a constant as in a table's row.
TEST_IN(readings_weigh_in_a_table_as_in_a_constant, set_up, tear_down) {
    static const char one[] = "{\"gravity\": 0, \"height_uncertainty\": 0.002, \"drops\": ["
                              "{\"drop_height\": 0.02, \"rebound_height\": 0.0110}, "
                              "{\"drop_height\": 0.0201, \"rebound_height\": 0.0030}, "
                              "{\"drop_height\": 0.0202, \"rebound_height\": 0.0075}, "
                              "{\"drop_height\": 0.0203, \"rebound_height\": 0.0072}";
    char constant[800], table[800];
    snprintf(constant, sizeof constant, "%s]}", one);
    snprintf(table, sizeof table, "%s, {\"drop_height\": 1, \"rebound_height\": 0.36}]}", one);
    propose((const char *const[]){constant}, 1, PROPOSAL_CONSTANT);
    const double mean = proposal.material.restitution;
    const double deviation = proposal.material.restitution_deviation;
    const Statistic *e = &evaluation.restitution;
    assert_true(fabs(e->mean / e->unweighted_mean - 1) > 1e-3);
    assert_near(deviation, fmax(e->scatter, e->standard_error), 0);
    assert_true(deviation < e->deviation);
    material_proposal_clear(&proposal);
    evaluation_clear(&evaluation);
    fields_clear(drop_test_fields, &tests_read[0]);
    propose((const char *const[]){table}, 1, PROPOSAL_TABLE);
    assert_int_equal(proposal.material.table.count, 2);
    assert_near(proposal.material.table.at[0].restitution, mean, 1e-15);
    assert_near(proposal.material.table.at[0].restitution_deviation, deviation, 1e-15);
    // Of a single reading nothing but its own uncertainty is known.
    assert_near(proposal.material.table.at[1].restitution_deviation,
                evaluation.rows.at[4].restitution_uncertainty, 1e-15);
}

TEST_IN(a_table_of_one_speed_is_refused, set_up, tear_down) {
    const char *const text[] = {"{\"drops\": [{\"approach_speed\": 1, \"rebound_speed\": 0.6}, "
                                "{\"approach_speed\": 1.05, \"rebound_speed\": 0.6}]}"};
    propose(text, 1, PROPOSAL_TABLE);
    assert_non_null(strstr(proposal.why, "at two approach speeds at least"));
    assert_int_equal(proposal.material.table.count, 0);
}

TEST_IN(what_changes_with_speed_is_told_of_a_constant, set_up, tear_down) {
    const char *const text[] = {
        "{\"gravity\": 0, \"drops\": [{\"approach_speed\": 1, \"rebound_speed\": 0.7}, "
        "{\"approach_speed\": 2, \"rebound_speed\": 1.3}, "
        "{\"approach_speed\": 3, \"rebound_speed\": 1.801}, "
        "{\"approach_speed\": 4, \"rebound_speed\": 2.2}]}"};
    propose(text, 1, PROPOSAL_CONSTANT);
    assert_true(is_warned("/revision/restitution"));
}
