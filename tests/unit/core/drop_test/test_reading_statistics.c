// Means, intervals, outliers and trends of readings made here; figures to compare with are from
// SciPy (ttest_1samp, linregress).
#include <math.h>
#include <string.h>

#include "core/drop_test/reading_statistics.h"
#include "tests/support/drops.h"
#include "tests/support/test.h"

enum { MOST = 200 };

static Reading readings[MOST];
static Statistic quantity;

static void assert_near(double is, double should, double within) {
    if (!(fabs(is - should) <= within))
        fail_msg("%.17g should be %.17g within %g", is, should, within);
}

static void make(const double *values, const double *speeds, size_t count) {
    const double none = (double)NAN;
    for (size_t i = 0; i < count; i++)
        readings[i] = (Reading){
            .value = values[i], .uncertainty = none, .speed = speeds != NULL ? speeds[i] : none};
    assert_int_equal(reading_statistics_run(readings, count, "restitution", "", &quantity),
                     STATUS_OK);
}

TEST(mean_and_interval_are_those_of_the_t_test) {
    const double values[] = {0.61, 0.63, 0.58, 0.60, 0.65};
    make(values, NULL, COUNT(values));
    assert_int_equal(quantity.count, 5);
    assert_near(quantity.mean, 0.614, 1e-15);
    assert_near(quantity.deviation, 0.027018512172212617, 1e-15);
    assert_near(quantity.low, 0.5804520861507333, 1e-12);
    assert_near(quantity.high, 0.6475479138492667, 1e-12);
    assert_near(quantity.median, 0.61, 0);
    assert_near(quantity.minimum, 0.58, 0);
    assert_near(quantity.maximum, 0.65, 0);
    assert_int_equal(quantity.outliers, 0);
    assert_true(isnan(quantity.mean_without_outliers));
    fields_clear(reading_statistic_fields, &quantity);
}

TEST(the_line_is_that_of_least_squares) {
    const double speeds[] = {0.2, 0.4, 0.6, 0.8, 1.0, 1.2};
    const double falls[] = {0.66, 0.64, 0.61, 0.60, 0.57, 0.55};
    const double stays[] = {0.61, 0.62, 0.60, 0.61, 0.60, 0.62};
    make(falls, speeds, COUNT(falls));
    const Trend *trend = &quantity.trend;
    assert_near(trend->slope, -0.11, 1e-12);
    assert_near(trend->standard_error, 0.00534522483824838, 1e-12);
    assert_near(trend->p, 3.293355253640748e-05, 1e-11);
    assert_int_equal(trend->verdict, TREND_NOT_CONSTANT);
    assert_non_null(strstr(trend->detail, "falls"));
    assert_non_null(strstr(trend->detail, "not constant"));
    fields_clear(reading_statistic_fields, &quantity);
    make(stays, speeds, COUNT(stays));
    assert_int_equal(trend->verdict, TREND_CONSTANT);
    assert_non_null(strstr(trend->detail, "may be taken as constant"));
    assert_near(trend->missed_change, fmax(fabs(trend->low), fabs(trend->high)), 1e-15);
    fields_clear(reading_statistic_fields, &quantity);
}

TEST(what_speeds_cannot_tell_is_said) {
    const double values[] = {0.61, 0.62, 0.60, 0.61}, alike[] = {0.5, 0.51, 0.5, 0.52};
    make(values, alike, 4);
    assert_int_equal(quantity.trend.verdict, CHOICE_ABSENT);
    assert_non_null(strstr(quantity.trend.detail, "all readings were made at about"));
    fields_clear(reading_statistic_fields, &quantity);
    make(values, NULL, 4);
    assert_non_null(strstr(quantity.trend.detail, "0 readings with a speed"));
    fields_clear(reading_statistic_fields, &quantity);
    make(values, NULL, 0);
    assert_true(isnan(quantity.mean) && quantity.count == 0);
    assert_non_null(strstr(quantity.why, "no reading"));
    fields_clear(reading_statistic_fields, &quantity);
}

TEST(one_reading_has_its_instruments_interval_or_none) {
    readings[0] = (Reading){.value = 0.6, .uncertainty = 0.01, .speed = (double)NAN};
    assert_int_equal(reading_statistics_run(readings, 1, "e", "", &quantity), STATUS_OK);
    assert_true(isnan(quantity.deviation));
    assert_near(quantity.high - quantity.low, 2 * 1.959963984540054 * 0.01, 1e-12);
    fields_clear(reading_statistic_fields, &quantity);
    readings[0].uncertainty = (double)NAN;
    assert_int_equal(reading_statistics_run(readings, 1, "e", "", &quantity), STATUS_OK);
    assert_true(isnan(quantity.low) && isnan(quantity.high));
    assert_non_null(strstr(quantity.why, "no interval"));
    fields_clear(reading_statistic_fields, &quantity);
}

TEST(equal_readings_are_not_taken_for_certainty) {
    const double values[] = {0.6, 0.6, 0.6, 0.6};
    make(values, NULL, 4);
    assert_true(isnan(quantity.low) && quantity.deviation == 0 && quantity.outliers == 0);
    assert_non_null(strstr(quantity.why, "are equal"));
    fields_clear(reading_statistic_fields, &quantity);
    for (size_t i = 0; i < 4; i++)
        readings[i].uncertainty = 0.02;
    assert_int_equal(reading_statistics_run(readings, 4, "e", "", &quantity), STATUS_OK);
    assert_near(quantity.standard_error, 0.01, 1e-15);
    fields_clear(reading_statistic_fields, &quantity);
}

TEST(an_outlier_is_shown_and_counts) {
    const double values[] = {0.61, 0.63, 0.60, 0.62, 0.61, 0.62, 0.20};
    make(values, NULL, COUNT(values));
    assert_int_equal(quantity.outliers, 1);
    assert_true(readings[6].is_outlier && readings[6].score < -10);
    assert_near(quantity.mean, 3.89 / 7, 1e-12);
    assert_near(quantity.mean_without_outliers, 3.69 / 6, 1e-12);
    fields_clear(reading_statistic_fields, &quantity);
    // Most of them the same: the rest need not be far off.
    const double coarse[] = {0.61, 0.61, 0.61, 0.61, 0.61, 0.62};
    make(coarse, NULL, COUNT(coarse));
    assert_int_equal(quantity.outliers, 0);
    fields_clear(reading_statistic_fields, &quantity);
}

// Far from the middle, but where the line leads.
TEST(a_trend_makes_no_outliers) {
    double values[9], speeds[9];
    for (size_t i = 0; i < 9; i++) {
        speeds[i] = i < 8 ? 0.2 + 0.01 * (double)i : 2;
        values[i] = 0.7 - 0.1 * speeds[i] + (i % 2 == 0 ? 0.002 : -0.002);
    }
    make(values, speeds, 9);
    assert_int_equal(quantity.trend.verdict, TREND_NOT_CONSTANT);
    assert_int_equal(quantity.outliers, 0);
    fields_clear(reading_statistic_fields, &quantity);
}

TEST(good_samples_seldom_have_outliers) {
    static const size_t counts[] = {3, 5, 10, 30, 100};
    uint64_t next = 0;
    for (size_t c = 0; c < COUNT(counts); c++) {
        int marked = 0;
        for (int trial = 0; trial < 1000; trial++) {
            double values[MOST];
            for (size_t i = 0; i < counts[c]; i++)
                values[i] = 0.6 + 0.02 * drops_noise(11, &next);
            make(values, NULL, counts[c]);
            marked += quantity.outliers > 0 ? 1 : 0;
            fields_clear(reading_statistic_fields, &quantity);
        }
        print_message("%zu readings: %d of 1000 samples have an outlier\n", counts[c], marked);
        assert_in_range(marked, 25, 75);
    }
}

TEST(no_trend_is_shown_in_one_of_twenty_without_one) {
    uint64_t next = 0;
    static const size_t counts[] = {3, 6, 20};
    for (size_t c = 0; c < COUNT(counts); c++) {
        int shown = 0, covered = 0;
        for (int trial = 0; trial < 1000; trial++) {
            double values[MOST], speeds[MOST];
            for (size_t i = 0; i < counts[c]; i++) {
                speeds[i] = 0.2 + (double)i / (double)counts[c];
                values[i] = 0.6 + 0.02 * drops_noise(12, &next);
            }
            make(values, speeds, counts[c]);
            shown += quantity.trend.verdict == TREND_NOT_CONSTANT ? 1 : 0;
            covered += quantity.trend.low <= 0 && quantity.trend.high >= 0 ? 1 : 0;
            fields_clear(reading_statistic_fields, &quantity);
        }
        print_message("%zu readings: a trend in %d of 1000\n", counts[c], shown);
        assert_in_range(shown, 30, 70);
        assert_int_equal(shown + covered, 1000);
    }
}

TEST(sure_readings_weigh_more) {
    const double values[] = {0.60, 0.62, 0.70, 0.59, 0.66}, u[] = {0.01, 0.02, 0.1, 0.02, 0.08};
    double weights = 0, sum = 0;
    for (size_t i = 0; i < 5; i++) {
        readings[i] = (Reading){.value = values[i], .uncertainty = u[i], .speed = (double)NAN};
        weights += 1 / (u[i] * u[i]);
        sum += values[i] / (u[i] * u[i]);
    }
    assert_int_equal(reading_statistics_run(readings, 5, "e", "", &quantity), STATUS_OK);
    assert_near(quantity.scatter, 0, 0);
    assert_near(quantity.mean, sum / weights, 1e-15);
    assert_near(quantity.unweighted_mean, 3.17 / 5, 1e-15);
    fields_clear(reading_statistic_fields, &quantity);
    // Readings that differ by far more than they state: the scatter is their own, all weigh alike.
    for (size_t i = 0; i < 5; i++)
        readings[i].uncertainty = 1e-4 * (double)(1 + i);
    assert_int_equal(reading_statistics_run(readings, 5, "e", "", &quantity), STATUS_OK);
    assert_near(quantity.mean, quantity.unweighted_mean, 1e-5);
    assert_near(quantity.scatter, quantity.deviation, 1e-4);
    fields_clear(reading_statistic_fields, &quantity);
    // Below four there is too little to tell scatter by.
    assert_int_equal(reading_statistics_run(readings, 3, "e", "", &quantity), STATUS_OK);
    assert_near(quantity.mean, 1.92 / 3, 1e-15);
    assert_true(isnan(quantity.scatter));
    fields_clear(reading_statistic_fields, &quantity);
}

// Noise that is ten times larger for the slow ones, as a ruler has it, and stated.
TEST(uneven_noise_makes_no_trends) {
    static const size_t counts[] = {6, 20};
    uint64_t next = 0;
    for (size_t c = 0; c < COUNT(counts); c++) {
        int shown = 0, held = 0;
        for (int trial = 0; trial < 1000; trial++) {
            for (size_t i = 0; i < counts[c]; i++) {
                const double speed = 0.3 + 0.7 * (double)i / (double)counts[c];
                const double noise = 0.005 / (speed * speed);
                readings[i] = (Reading){.value = 0.6 + noise * drops_noise(13, &next),
                                        .uncertainty = noise,
                                        .speed = speed};
            }
            assert_int_equal(reading_statistics_run(readings, counts[c], "e", "", &quantity),
                             STATUS_OK);
            shown += quantity.trend.verdict == TREND_NOT_CONSTANT ? 1 : 0;
            held += quantity.low <= 0.6 && 0.6 <= quantity.high ? 1 : 0;
            fields_clear(reading_statistic_fields, &quantity);
        }
        print_message("%zu uneven readings: a trend in %d, the mean held in %d of 1000\n",
                      counts[c], shown, held);
        assert_in_range(shown, 25, 80);
        assert_in_range(held, 920, 980);
    }
}
