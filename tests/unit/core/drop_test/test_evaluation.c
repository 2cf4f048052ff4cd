// Drop tests whose truth is known: impacts that the core simulates, and the same blurred by noise.
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "core/drop_test/evaluation.h"
#include "core/drop_test/pulse_model.h"
#include "server/util/bytes.h"
#include "tests/support/drops.h"
#include "tests/support/test.h"

static Problem problem;
static Evaluation evaluation;

static void assert_near(double is, double should, double within) {
    if (!(fabs(is - should) <= within))
        fail_msg("%.17g should be %.17g within %g", is, should, within);
}

static void evaluate(const DropTest *test, Separation separation) {
    const Measurement one = {COUNT_ABSENT, test};
    problem_clear(&problem);
    const Status status = evaluation_run(&one, 1, separation, NULL, &evaluation, &problem);
    if (status != STATUS_OK)
        fail_msg("%s", problem.detail);
}

static bool is_warned(const char *pointer, const char *says) {
    for (size_t i = 0; i < evaluation.warnings.count; i++)
        if (strcmp(evaluation.warnings.at[i].pointer, pointer) == 0 &&
            strstr(evaluation.warnings.at[i].detail, says) != NULL)
            return true;
    return false;
}

static void read(const char *text, DropTest *test) {
    if (drops_read(text, test, &problem) != STATUS_OK)
        fail_msg("%s: %s", text, problem.detail);
}

static double height_of(double speed) {
    return speed * speed / (2 * STANDARD_GRAVITY);
}

enum { SPEEDS = 3 };
static const double restitutions[] = {0.1, 0.3, 0.5, 0.7, 0.95};
static const double times[] = {1e-4, 1e-3, 1e-2, 3e-2};
static const double speeds[SPEEDS] = {0.2, 0.5, 1.5};

TEST(simulated_drops_give_back_e_and_contact_time) {
    for (int rule = 0; rule < 2; rule++)
        for (size_t i = 0; i < COUNT(restitutions); i++)
            for (size_t k = 0; k < COUNT(times); k++) {
                DropTest test;
                drops_make(&test, 2 * SPEEDS);
                test.gravity = 0;
                for (size_t n = 0; n < 2 * SPEEDS; n++) {
                    const DropMade made = drops_simulate(restitutions[i], times[k],
                                                         (Separation)rule, speeds[n / 2], 0);
                    Drop *drop = &test.drops.at[n];
                    drop->contact_time = made.duration;
                    if (n % 2 == 0) {
                        drop->drop_height = height_of(made.approach);
                        drop->rebound_height = height_of(made.separation);
                    } else {
                        drop->approach_speed = made.approach;
                        drop->rebound_speed = made.separation;
                    }
                }
                assert_int_equal(drop_test_validate(&test, "", &problem), STATUS_OK);
                evaluate(&test, (Separation)rule);
                assert_near(evaluation.restitution.mean / restitutions[i], 1, 1e-6);
                assert_near(evaluation.contact_time.mean / times[k], 1, 1e-6);
                assert_int_equal(evaluation.restitution.count, 2 * SPEEDS);
                assert_int_equal(evaluation.restitution.trend.verdict, TREND_CONSTANT);
                assert_int_equal(evaluation.warnings.count, 0);
                evaluation_clear(&evaluation);
                fields_clear(drop_test_fields, &test);
            }
}

TEST(gravity_is_taken_out_of_drops_that_say_it) {
    for (int rule = 0; rule < 2; rule++) {
        DropTest test;
        drops_make(&test, 2 * SPEEDS);
        test.gravity = 9.80665;
        for (size_t n = 0; n < 2 * SPEEDS; n++) {
            const DropMade made =
                drops_simulate(0.61, 0.015, (Separation)rule, 0.3 + speeds[n / 2], 9.80665);
            Drop *drop = &test.drops.at[n];
            drop->approach_speed = made.approach;
            if (n % 2 == 0 || n == 1)
                drop->rebound_speed = made.separation;
            if (n % 2 == 0 || n > 1)
                drop->contact_time = made.duration;
        }
        evaluate(&test, (Separation)rule);
        // Five tell each, some by both and some with the help of the others.
        assert_int_equal(evaluation.restitution.count, 4);
        assert_int_equal(evaluation.contact_time.count, 5);
        assert_near(evaluation.restitution.mean / 0.61, 1, 1e-6);
        assert_near(evaluation.contact_time.mean / 0.015, 1, 1e-6);
        for (size_t i = 0; i < evaluation.rows.count; i++) {
            const EvaluationRow *row = &evaluation.rows.at[i];
            assert_true(isnan(row->read_restitution) || row->read_restitution < row->restitution);
            assert_true(isnan(row->read_contact_time) ||
                        row->read_contact_time > row->contact_time);
        }
        assert_int_equal(evaluation.warnings.count, 0);
        evaluation_clear(&evaluation);
        // Left alone, it is told how much that is.
        test.gravity = (double)NAN;
        evaluate(&test, (Separation)rule);
        assert_true(is_warned("/gravity", "lengthens a contact with this e and T_c by"));
        evaluation_clear(&evaluation);
        fields_clear(drop_test_fields, &test);
    }
}

TEST(the_effect_of_gravity_is_told_where_it_is_left_in) {
    DropTest test;
    read("{\"drops\": [{\"approach_speed\": 0.3, \"rebound_speed\": 0.183, \"contact_time\": "
         "0.025}, {\"approach_speed\": 1, \"rebound_speed\": 0.61, \"contact_time\": 0.025}]}",
         &test);
    evaluate(&test, SEPARATION_ZERO_PENETRATION);
    assert_true(is_warned("/gravity", "at the slowest 0.3 m/s"));
    assert_true(is_warned("/gravity", "by 24 % and lowers e by 29 %"));
    evaluation_clear(&evaluation);
    test.gravity = 0;
    evaluate(&test, SEPARATION_ZERO_PENETRATION);
    assert_int_equal(evaluation.warnings.count, 0);
    evaluation_clear(&evaluation);
    fields_clear(drop_test_fields, &test);
}

TEST(every_reading_is_a_row_with_its_uncertainty) {
    DropTest test;
    read("{\"gravity\": 0, \"height_uncertainty\": 0.001, \"speed_uncertainty\": 0.01, "
         "\"time_uncertainty\": 1e-5, \"temperature\": 21, \"drops\": ["
         "{\"drop_height\": 0.1, \"rebound_height\": 0.04}, "
         "{\"approach_speed\": 2, \"rebound_speed\": 1.3, \"contact_time\": 1e-3, \"note\": \"n\"},"
         "{\"drop_height\": 0.1, \"rebound_height\": 0.09, \"excluded\": \"struck the edge\"}]}",
         &test);
    evaluate(&test, SEPARATION_ZERO_PENETRATION);
    assert_int_equal(evaluation.rows.count, 3);
    const EvaluationRow *row = evaluation.rows.at;
    assert_string_equal(row[0].from, "drop 1");
    assert_near(row[0].restitution, sqrt(0.4), 1e-15);
    assert_near(row[0].restitution_uncertainty, sqrt(0.4) / 2 * hypot(0.001 / 0.1, 0.001 / 0.04),
                1e-15);
    assert_near(row[0].approach_speed_uncertainty, 9.80665 * 0.001 / row[0].approach_speed, 1e-15);
    assert_int_equal(row[0].restitution_by, RESTITUTION_BY_HEIGHTS);
    assert_near(row[1].restitution_uncertainty, 0.65 * hypot(0.01 / 2, 0.01 / 1.3), 1e-15);
    assert_near(row[1].contact_time_uncertainty, 1e-5, 0);
    assert_string_equal(row[1].note, "n");
    assert_string_equal(row[2].excluded, "struck the edge");
    assert_true(!row[2].restitution_counts && row[2].restitution > 0.9);
    assert_int_equal(evaluation.restitution.count, 2);
    assert_int_equal(evaluation.contact_time.count, 1);
    assert_near(evaluation.ranges.most_speed, 2, 0);
    assert_near(evaluation.ranges.least_temperature, 21, 0);
    evaluation_clear(&evaluation);
    fields_clear(drop_test_fields, &test);
}

TEST(only_what_counts_widens_the_ranges) {
    DropTest cold, hot;
    read("{\"gravity\": 0, \"temperature\": 20, \"drops\": [{\"approach_speed\": 1, "
         "\"rebound_speed\": 0.6}]}",
         &cold);
    read("{\"gravity\": 0, \"temperature\": 80, \"drops\": [{\"approach_speed\": 2, "
         "\"rebound_speed\": 1.9, \"excluded\": \"slipped\"}]}",
         &hot);
    const Measurement tests[] = {{1, &cold}, {2, &hot}};
    assert_int_equal(evaluation_run(tests, 2, SEPARATION_ZERO_FORCE, NULL, &evaluation, &problem),
                     STATUS_OK);
    assert_near(evaluation.ranges.most_speed, 1, 0);
    assert_near(evaluation.ranges.least_temperature, 20, 0);
    assert_near(evaluation.ranges.most_temperature, 20, 0);
    evaluation_clear(&evaluation);
    fields_clear(drop_test_fields, &cold);
    fields_clear(drop_test_fields, &hot);
}

TEST(heights_go_by_the_earth_and_say_so_where_another_gravity_pulls) {
    DropTest test;
    read("{\"gravity\": 1000, \"drops\": [{\"drop_height\": 0.1, \"rebound_height\": 0.04, "
         "\"contact_time\": 1e-4}, {\"approach_speed\": 2, \"rebound_speed\": 1, "
         "\"contact_time\": 1e-4}]}",
         &test);
    evaluate(&test, SEPARATION_ZERO_FORCE);
    assert_near(evaluation.rows.at[0].approach_speed, sqrt(2 * 9.80665 * 0.1), 1e-15);
    assert_true(is_warned("/gravity", "follow from heights by 9.80665"));
    evaluation_clear(&evaluation);
    free(test.drops.at[0].excluded);
    test.drops.at[0].excluded = strdup("slipped");
    evaluate(&test, SEPARATION_ZERO_FORCE);
    assert_int_equal(evaluation.warnings.count, 0);
    evaluation_clear(&evaluation);
    fields_clear(drop_test_fields, &test);
}

TEST(a_trace_s_contact_is_shown_as_it_was_detected) {
    DropTest test;
    drops_make(&test, 0);
    test.gravity = 0;
    test.traces.at = calloc(1, sizeof *test.traces.at);
    test.traces.count = 1;
    Trace *trace = test.traces.at;
    *trace = (Trace){.interval = 1e-4};
    assert_true(reals_allocate(&trace->force, 300));
    for (size_t i = 0; i < 300; i++) {
        const double s = ((double)i - 100.3) / 50;
        trace->force.at[i] = 5 + (s >= 0 && s <= 1 ? 8 * sin(3.14159265358979 * s) : 0);
    }
    evaluate(&test, SEPARATION_ZERO_FORCE);
    assert_int_equal(evaluation.rows.count, 1);
    const EvaluationRow *row = evaluation.rows.at;
    assert_int_equal(row->trace, 1);
    assert_near(row->contact.baseline, 5, 1e-3);
    assert_near(row->contact.peak, 8, 0.05);
    assert_near(row->contact.start, 0.01003, 1e-5);
    assert_near(row->contact.end, 0.01503, 1e-5);
    assert_true(row->contact.threshold > 0 && row->contact.misfit_share < 0.01);
    assert_true(row->contact.crossing_time < 0.00503 && row->contact.crossing_shortfall > 0);
    assert_int_equal(row->contact.samples, 50);
    assert_int_equal(row->contact.pulse.count, TRACE_PULSE);
    assert_near(row->contact.pulse.at[TRACE_PULSE / 2], 13, 0.05);
    evaluation_clear(&evaluation);
    fields_clear(drop_test_fields, &test);
}

TEST(a_free_base_is_reckoned_with) {
    // e = 0.5 of 0.1 kg on 0.3 kg: the ball rises with (e M - m) / (m + M) of its speed.
    const double v = sqrt(2 * 9.80665 * 0.2), u = v * (0.5 * 0.3 - 0.1) / 0.4;
    char text[400];
    snprintf(text, sizeof text,
             "{\"impactor_mass\": 0.1, \"base\": \"free\", \"base_mass\": 0.3, \"gravity\": 0, "
             "\"height_uncertainty\": 1e-6, "
             "\"drops\": [{\"drop_height\": 0.2, \"rebound_height\": %.17g}]}",
             height_of(u));
    DropTest test;
    read(text, &test);
    evaluate(&test, SEPARATION_ZERO_PENETRATION);
    assert_near(evaluation.restitution.mean, 0.5, 1e-12);
    // By difference: the rebound's height moved by its uncertainty, for the drop's adds little.
    const double moved = (0.1 * v + 0.4 * sqrt(2 * 9.80665 * (height_of(u) + 1e-6))) / 0.3 / v;
    assert_near(evaluation.rows.at[0].restitution_uncertainty / (moved - 0.5), 1, 0.01);
    evaluation_clear(&evaluation);
    fields_clear(drop_test_fields, &test);
}

TEST(an_outlier_is_told_and_counts) {
    DropTest test;
    read("{\"gravity\": 0, \"drops\": [{\"approach_speed\": 1, \"rebound_speed\": 0.61}, "
         "{\"approach_speed\": 1, \"rebound_speed\": 0.62}, "
         "{\"approach_speed\": 1, \"rebound_speed\": 0.60}, "
         "{\"approach_speed\": 1, \"rebound_speed\": 0.615}, "
         "{\"approach_speed\": 1, \"rebound_speed\": 0.2}]}",
         &test);
    evaluate(&test, SEPARATION_ZERO_PENETRATION);
    assert_int_equal(evaluation.restitution.outliers, 1);
    assert_true(evaluation.rows.at[4].restitution_is_outlier);
    assert_true(evaluation.rows.at[4].restitution_counts);
    assert_near(evaluation.restitution.mean, 2.645 / 5, 1e-12);
    assert_true(is_warned("/drops/4", "It counts"));
    evaluation_clear(&evaluation);
    fields_clear(drop_test_fields, &test);
}

// The way a test was read: what is blurred.
typedef enum Blur { BLUR_HEIGHTS, BLUR_SPEEDS, BLUR_TIMES } Blur;
static const char *const blur_names[] = {"heights", "speeds", "times"};

// Of 1000 tests of so many drops each: how many times the interval held the truth. Drops are from
// rising heights where the instrument's uncertainty is stated, else from one.
static int covered(Blur blur, size_t count, double noise, bool is_stated) {
    const double e = 0.61, T = 0.0042;
    uint64_t next = 0;
    int hits = 0;
    for (int trial = 0; trial < 1000; trial++) {
        DropTest test;
        drops_make(&test, count);
        test.gravity = 0;
        for (size_t i = 0; i < count; i++) {
            Drop *drop = &test.drops.at[i];
            const double speed = is_stated ? 0.4 + 1.2 * (double)i / (double)count : 1;
            const double one = noise * drops_noise(21, &next), two = noise * drops_noise(21, &next);
            if (blur == BLUR_HEIGHTS) { // a ruler's error is the same at every height
                const double ruler = is_stated ? height_of(0.4) : height_of(1) / 4;
                drop->drop_height = height_of(speed) + one * ruler;
                drop->rebound_height = height_of(e * speed) + two * ruler;
                test.height_uncertainty = is_stated ? noise * ruler : (double)NAN;
            } else if (blur == BLUR_SPEEDS) {
                drop->approach_speed = speed + 0.4 * one;
                drop->rebound_speed = e * speed + 0.4 * two;
                test.speed_uncertainty = is_stated ? 0.4 * noise : (double)NAN;
            } else {
                drop->contact_time = T * (1 + one);
                test.time_uncertainty = is_stated ? T * noise : (double)NAN;
            }
        }
        evaluate(&test, SEPARATION_ZERO_PENETRATION);
        const Statistic *told =
            blur == BLUR_TIMES ? &evaluation.contact_time : &evaluation.restitution;
        const double truth = blur == BLUR_TIMES ? T : e;
        assert_int_equal(told->count, count);
        hits += told->low <= truth && truth <= told->high ? 1 : 0;
        evaluation_clear(&evaluation);
        fields_clear(drop_test_fields, &test);
    }
    print_message("%zu drops, %s with noise of %g %%%s: the interval holds the truth in %d of "
                  "1000\n",
                  count, blur_names[blur], 100 * noise, is_stated ? ", stated" : "", hits);
    return hits;
}

TEST(the_stated_confidence_is_kept) {
    static const size_t counts[] = {3, 5, 10, 30};
    static const double noises[] = {0.01, 0.05};
    for (int blur = 0; blur < 3; blur++)
        for (size_t c = 0; c < COUNT(counts); c++)
            for (size_t n = 0; n < COUNT(noises); n++)
                for (int stated = 0; stated < 2; stated++)
                    assert_in_range(covered((Blur)blur, counts[c], noises[n], stated == 1), 920,
                                    980);
}

TEST(a_thousand_drops_are_evaluated) {
    DropTest test;
    drops_make(&test, DROPS_MAX);
    test.gravity = 9.80665;
    uint64_t next = 0;
    for (size_t i = 0; i < DROPS_MAX; i++) {
        const double speed = 0.5 + (double)i / DROPS_MAX;
        const GravityLoad pull = {9.80665, speed, SEPARATION_ZERO_FORCE, false};
        const GravityContact pulled = gravity_apply(&pull, 0.7, 0.01);
        test.drops.at[i].approach_speed = speed;
        test.drops.at[i].rebound_speed =
            speed * pulled.restitution * (1 + 0.01 * drops_noise(3, &next));
        test.drops.at[i].contact_time = pulled.contact_time;
    }
    evaluate(&test, SEPARATION_ZERO_FORCE);
    assert_int_equal(evaluation.restitution.count, DROPS_MAX);
    assert_near(evaluation.restitution.mean, 0.7, 0.002);
    assert_near(evaluation.contact_time.mean / 0.01, 1, 0.001);
    evaluation_clear(&evaluation);
    fields_clear(drop_test_fields, &test);
}

TEST(other_pairs_and_too_many_readings_are_told) {
    DropTest one, other;
    read("{\"impactor_mass\": 0.1, \"base\": \"fixed\", \"gravity\": 0, \"drops\": "
         "[{\"contact_time\": 0.001}]}",
         &one);
    read("{\"impactor_mass\": 0.2, \"base\": \"fixed\", \"gravity\": 0, \"drops\": "
         "[{\"contact_time\": 0.002}]}",
         &other);
    const Measurement tests[] = {{4, &one}, {7, &other}};
    assert_int_equal(evaluation_run(tests, 2, SEPARATION_ZERO_FORCE, NULL, &evaluation, &problem),
                     STATUS_OK);
    assert_true(is_warned("/measurements/7", "another pair of masses"));
    assert_int_equal(evaluation.rows.at[1].measurement, 7);
    evaluation_clear(&evaluation);
    DropTest many;
    drops_make(&many, DROPS_MAX);
    for (size_t i = 0; i < DROPS_MAX; i++)
        many.drops.at[i].contact_time = 1;
    Measurement all[21];
    for (size_t i = 0; i < COUNT(all); i++)
        all[i] = (Measurement){i + 1, &many};
    problem_clear(&problem);
    assert_int_equal(
        evaluation_run(all, COUNT(all), SEPARATION_ZERO_FORCE, NULL, &evaluation, &problem),
        STATUS_LIMIT);
    evaluation_clear(&evaluation);
    // Two tests of the most samples go together, many do not; what is there is not looked at.
    double nothing[8] = {0};
    Trace trace = {.interval = 1e-3, .force = {nothing, TRACE_SAMPLES_MAX}};
    const DropTest large = {.traces = {&trace, 1}};
    assert_int_equal(drop_test_sample_count(&large), TRACE_SAMPLES_MAX);
    for (size_t i = 0; i < COUNT(all); i++)
        all[i].test = &large;
    assert_true(evaluation_sample_count(all, 2) <= EVALUATION_SAMPLES_MAX);
    problem_clear(&problem);
    assert_int_equal(
        evaluation_run(all, COUNT(all), SEPARATION_ZERO_FORCE, NULL, &evaluation, &problem),
        STATUS_LIMIT);
    evaluation_clear(&evaluation);
    fields_clear(drop_test_fields, &one);
    fields_clear(drop_test_fields, &other);
    fields_clear(drop_test_fields, &many);
}

static bool refuse_third(void *context, double fraction) {
    (void)fraction;
    return ++*(int *)context < 3;
}

TEST(gravity_is_taken_out_only_while_somebody_waits) {
    DropTest test;
    read("{\"gravity\": 9.81, \"drops\": [{\"approach_speed\": 1, \"rebound_speed\": 0.5, "
         "\"contact_time\": 0.01}, {\"approach_speed\": 1, \"rebound_speed\": 0.5, "
         "\"contact_time\": "
         "0.01}, {\"approach_speed\": 1, \"rebound_speed\": 0.5}]}",
         &test);
    int asked = 0;
    const Progress progress = {&asked, refuse_third};
    const Measurement one = {COUNT_ABSENT, &test};
    assert_int_equal(
        evaluation_run(&one, 1, SEPARATION_ZERO_PENETRATION, &progress, &evaluation, &problem),
        STATUS_CANCELLED);
    assert_int_equal(asked, 3);
    evaluation_clear(&evaluation);
    fields_clear(drop_test_fields, &test);
}
