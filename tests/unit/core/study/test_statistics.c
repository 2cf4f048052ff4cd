

#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "core/study/statistics.h"
#include "tests/support/test.h"

static void assert_near(double is, double should) {
    if (!(fabs(is / should - 1) <= 1e-10))
        fail_msg("is %.17g, should be %.17g", is, should);
}

static RunStatistic blank(void) {
    return (RunStatistic){.mean = (double)NAN,
                          .standard_deviation = (double)NAN,
                          .standard_error = (double)NAN,
                          .low = (double)NAN,
                          .high = (double)NAN};
}

enum { RUNS = 9 };
static RunRecord runs[RUNS];
static char unstable[] = "the numbers grew", limit[] = "too many impacts";

// Seven runs that ended, seeds 10 to 18 but 12 and 15.
static RunTable seven(void) {
    static const double values[RUNS] = {3.1, 2.7, NAN, 8.9, 1.0, NAN, 4.4, 2.7, 5.2};
    for (size_t i = 0; i < RUNS; i++) {
        runs[i] = (RunRecord){.number = 10 + i, .why = i == 2 || i == 5 ? unstable : NULL};
        runs[i].summary = (Summary){.rms_displacement = values[i],
                                    .impacts = COUNT_ABSENT,
                                    .error_estimate = i == 8 ? (double)NAN : 1e-9 * values[i],
                                    .trust_horizon = i == 3 || i == 4 ? values[i] : (double)NAN,
                                    .energy_residual = 1e-14};
    }
    return (RunTable){runs, RUNS};
}

TEST(statistics_are_numpys_over_the_runs_that_ended) {
    const RunTable table = seven();
    RunStatistic of = blank();
    assert_int_equal(statistics_fill(&table, STATISTICS_RMS_DISPLACEMENT, &of), STATUS_OK);
    assert_int_equal(of.count, 7);
    assert_string_equal(of.unit, "m");
    assert_near(of.mean, 4);
    assert_near(of.standard_deviation, 2.54296414970142);
    assert_near(of.standard_error, 0.9611501047232548);
    assert_near(of.low, 1.6481504180234396);
    assert_near(of.high, 6.351849581976561);
    assert_true(of.minimum == 1 && of.minimum_seed == 14);
    assert_true(of.maximum == 8.9 && of.maximum_seed == 13);
    assert_near(of.q05, 1.51);
    assert_near(of.q25, 2.7);
    assert_near(of.median, 3.1);
    assert_near(of.q75, 4.8);
    assert_near(of.q95, 7.79);
    free(of.unit);
}

TEST(a_mean_far_from_its_spread_loses_no_digits) {
    for (size_t i = 0; i < RUNS; i++)
        runs[i] = (RunRecord){.number = i, .summary = {.rms_displacement = 1e9 + (double)i}};
    const RunTable table = {runs, RUNS};
    RunStatistic of = blank();
    assert_int_equal(statistics_fill(&table, STATISTICS_RMS_DISPLACEMENT, &of), STATUS_OK);
    assert_true(of.mean == 1e9 + 4);
    assert_near(of.standard_deviation, sqrt(60 / 8.0));
    free(of.unit);
}

TEST(numbers_of_any_size_have_statistics) {
    static const double scales[] = {1e-300, 1e-160, 1e160, 1e307};
    for (size_t k = 0; k < COUNT(scales); k++) {
        for (size_t i = 0; i < RUNS; i++)
            runs[i] = (RunRecord){
                .number = i, .summary = {.rms_displacement = scales[k] * (double)(1 + i * i % 5)}};
        const RunTable table = {runs, RUNS};
        RunStatistic of = blank();
        RunSpread spread;
        assert_int_equal(statistics_fill(&table, STATISTICS_RMS_DISPLACEMENT, &of), STATUS_OK);
        assert_int_equal(statistics_spread(&table, STATISTICS_RMS_DISPLACEMENT, &spread),
                         STATUS_OK);
        // 1, 2, 5, 5, 2, 1, 2, 5, 5
        assert_near(of.mean, scales[k] * (28 / 9.0));
        assert_near(of.standard_deviation, scales[k] * sqrt((114 - 28 * 28 / 9.0) / 8));
        assert_near(spread.relative, of.standard_deviation / of.mean);
        assert_true(fabs(spread.skewness) < 1);
        free(of.unit);
    }
}

TEST(too_few_runs_leave_numbers_unknown) {
    RunTable table = seven();
    RunStatistic of = blank();
    assert_int_equal(statistics_fill(&table, STATISTICS_IMPACTS, &of), STATUS_OK);
    assert_true(of.count == 0 && isnan(of.mean) && isnan(of.low));
    free(of.unit);
    of = blank();
    table.count = 1;
    assert_int_equal(statistics_fill(&table, STATISTICS_RMS_DISPLACEMENT, &of), STATUS_OK);
    assert_true(of.count == 1 && of.mean == 3.1 && of.median == 3.1 && isnan(of.high));
    free(of.unit);
}

TEST(the_spread_tells_what_the_rule_needs) {
    const RunTable table = seven();
    RunSpread spread;
    assert_int_equal(statistics_spread(&table, STATISTICS_RMS_DISPLACEMENT, &spread), STATUS_OK);
    assert_int_equal(spread.count, 7);
    assert_near(spread.relative, 0.635741037425355);
    assert_near(spread.skewness, 0.9558840420092773);
    // Alike, or without a mean: nothing is known of the rest.
    assert_int_equal(statistics_spread(&table, STATISTICS_PEAK_DISPLACEMENT, &spread), STATUS_OK);
    assert_true(isinf(spread.relative));
}

TEST(trust_and_failures_are_counted) {
    RunTable table = seven();
    RunTrust trust = {.shortest_horizon = (double)NAN,
                      .largest_error_estimate = (double)NAN,
                      .largest_energy_residual = (double)NAN};
    statistics_trust(&table, &trust);
    assert_true(trust.whole == 4 && trust.beyond == 2 && trust.unknown == 1);
    assert_true(trust.shortest_horizon == 1 && trust.largest_error_estimate == 1e-9 * 8.9);
    assert_true(trust.largest_energy_residual == 1e-14);
    runs[7].why = limit;
    runs[2].status = runs[5].status = STATUS_UNSTABLE;
    runs[7].status = STATUS_LIMIT;
    StudyFailures failures = {NULL, 0};
    for (size_t i = 0; i < table.count; i++)
        if (runs[i].why != NULL)
            assert_int_equal(study_failures_add(&failures, (int)runs[i].status,
                                                status_slug(runs[i].status), runs[i].number,
                                                runs[i].why),
                             STATUS_OK);
    assert_int_equal(failures.count, 2);
    assert_string_equal(failures.at[0].reason, "unstable");
    assert_true(failures.at[0].count == 2 && failures.at[0].first == 12);
    assert_string_equal(failures.at[1].detail, limit);
    for (size_t i = 0; i < failures.count; i++) {
        free(failures.at[i].reason);
        free(failures.at[i].detail);
    }
    free(failures.at);
}

TEST(a_statistic_of_runs_has_the_interval_of_its_kind) {
    double values[60], interval[2];
    for (size_t i = 0; i < 60; i++)
        values[i] = (double)((i * 37) % 60) + 1;
    const RunAggregate mean = {false, (double)NAN}, max = {true, (double)NAN},
                       median = {false, 0.5}, high = {false, 0.99};
    assert_true(fabs(run_aggregate(&mean, values, 60) - 30.5) < 1e-12);
    assert_true(run_aggregate(&max, values, 60) == 60);
    assert_true(fabs(run_aggregate(&median, values, 60) - 30.5) < 1e-12);
    run_aggregate_interval(&mean, values, 60, interval);
    // t of 59 degrees of freedom times sqrt(60 * 61 / 12) / sqrt(60)
    assert_true(fabs(interval[1] - 30.5 - 2.0010 * 17.4642 / sqrt(60)) < 1e-3);
    // Of 60 coins, 21 and 39 are the ends of the tails of 2.5 %.
    run_aggregate_interval(&median, values, 60, interval);
    assert_true(interval[0] == 22 && interval[1] == 39);
    run_aggregate_interval(&high, values, 60, interval);
    assert_true(isnan(interval[0]) && isnan(interval[1]));
    run_aggregate_interval(&max, values, 60, interval);
    assert_true(isnan(interval[0]) && isnan(interval[1]));
    values[3] = (double)NAN;
    assert_true(isnan(run_aggregate(&max, values, 60)));
}
