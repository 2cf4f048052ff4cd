#include <math.h>
#include <stdlib.h>

#include "core/base/philox.h"
#include "core/result/signal_comparison.h"
#include "tests/support/test.h"

static void assert_near(double is, double should, double within) {
    if (!(fabs(is - should) <= within))
        fail_msg("%.17g should be %.17g within %g", is, should, within);
}

// A smooth motion that is nowhere alike.
static double motion(double t) {
    return exp(-0.3 * t) * sin(9 * t + 0.4 * t * t) + 0.2 * cos(3.1 * t);
}

static double *sampled(double rate, size_t count, double start) {
    double *values = calloc(count, sizeof *values);
    assert_non_null(values);
    for (size_t i = 0; i < count; i++)
        values[i] = motion(start + (double)i / rate);
    return values;
}

TEST(a_motion_is_like_itself) {
    double *x = sampled(100, 501, 0);
    const Signal signal = {x, 501, 100, 0};
    const SignalComparison own = signal_comparison_measure(&signal, &signal, 0.01, NULL);
    assert_true(own.samples == 501 && own.from == 0 && own.to == 5);
    assert_true(own.relative == 0 && own.difference_peak == 0 && isnan(own.parting));
    assert_near(own.correlation, 1, 1e-12);
    free(x);
}

TEST(the_coarser_ones_samples_are_compared_within_the_common_span) {
    double *x = sampled(100, 501, 0), *y = sampled(1000, 3001, 1.005);
    const Signal coarse = {x, 501, 100, 0}, fine = {y, 3001, 1000, 1.005};
    const SignalComparison told = signal_comparison_measure(&coarse, &fine, 0.01, NULL);
    assert_near(told.from, 1.01, 1e-12);
    assert_near(told.to, 4.0, 1e-12);
    assert_true(told.samples == 300);
    assert_true(told.relative < 1e-12 && told.difference_peak < 1e-12);
    const SignalComparison other = signal_comparison_measure(&fine, &coarse, 0.01, NULL);
    assert_true(other.samples == 300 && other.relative < 1e-12);
    free(x);
    free(y);
}

TEST(numbers_are_those_of_the_definitions) {
    const double x[] = {1, -2, 3, 0}, y[] = {1, -2, 4, -1};
    const Signal a = {x, 4, 2, 0}, b = {y, 4, 2, 0};
    const SignalComparison told = signal_comparison_measure(&a, &b, 0.25, NULL);
    assert_near(told.rms, sqrt(14.0 / 4), 1e-15);
    assert_near(told.other_rms, sqrt(22.0 / 4), 1e-15);
    assert_near(told.difference_rms, sqrt(0.5), 1e-15);
    assert_near(told.relative, sqrt(2.0 / 14), 1e-15);
    assert_true(told.peak == 3 && told.other_peak == 4 && told.difference_peak == 1);
    assert_near(told.correlation, 16 / sqrt(13.0 * 21), 1e-14);
    assert_true(told.parting == 1); // 1 is more than a quarter of 3
    assert_true(isnan(signal_comparison_measure(&a, &b, 0.5, NULL).parting));
}

TEST(what_does_not_overlap_has_nothing_in_common) {
    const double x[] = {1, 2};
    const Signal a = {x, 2, 1, 0}, b = {x, 2, 1, 5}, none = {NULL, 0, 1, 0};
    assert_true(signal_comparison_measure(&a, &b, 0.1, NULL).samples == 0);
    assert_true(isnan(signal_comparison_measure(&a, &b, 0.1, NULL).rms));
    assert_true(signal_comparison_measure(&a, &none, 0.1, NULL).samples == 0);
    Columns pair = {0};
    double rate;
    assert_int_equal(signal_comparison_align(&a, &b, 1, &pair, &rate, NULL), STATUS_LIMIT);
}

TEST(a_shift_is_found_to_a_part_of_a_sample) {
    double *x = sampled(200, 2001, 0);
    const Signal a = {x, 2001, 200, 0};
    static const double shifts[] = {0, 0.25, 1.2345, -0.7};
    for (size_t i = 0; i < COUNT(shifts); i++) {
        // What happened at t is written down at t - shift.
        double *y = sampled(500, 2001, 1.5);
        const Signal b = {y, 2001, 500, 1.5 - shifts[i]};
        double shift;
        assert_int_equal(signal_comparison_shift(&a, &b, 3, &shift, NULL), STATUS_OK);
        assert_near(shift, shifts[i], 1e-3);
        free(y);
    }
    free(x);
}

TEST(a_copy_behind_silence_is_found_at_its_sample) {
    enum { SILENCE = 37, COUNT_X = 2001 };
    double *x = calloc(COUNT_X, sizeof *x), *y = calloc(COUNT_X + SILENCE, sizeof *y), shift;
    assert_true(x != NULL && y != NULL);
    for (size_t i = 0; i < COUNT_X; i++) // begins with its largest value
        y[i + SILENCE] = x[i] = exp(-0.002 * (double)i) * cos(0.025 * (double)i);
    const Signal a = {x, COUNT_X, 1000, 0}, b = {y, COUNT_X + SILENCE, 1000, 0};
    assert_int_equal(signal_comparison_shift(&a, &b, 1, &shift, NULL), STATUS_OK);
    assert_near(shift, -0.037, 1e-12);
    free(x);
    free(y);
}

TEST(nothing_is_more_alike_than_alike) {
    for (size_t count = 2; count < 2000; count++) {
        double *x = sampled(100, count, 0);
        const Signal signal = {x, count, 100, 0};
        assert_true(signal_comparison_measure(&signal, &signal, 0.01, NULL).correlation <= 1);
        free(x);
    }
}

TEST(a_shift_stays_within_what_is_allowed) {
    double *x = sampled(200, 2001, 0), *y = sampled(200, 1001, 1), shift;
    const Signal a = {x, 2001, 200, 0}, b = {y, 1001, 200, 0}; // 1 s would be right
    assert_int_equal(signal_comparison_shift(&a, &b, 0.3, &shift, NULL), STATUS_OK);
    assert_true(fabs(shift) <= 0.3 + 1.0 / 200);
    const Signal late = {y, 1001, 200, 100};
    assert_int_equal(signal_comparison_shift(&a, &late, 1, &shift, NULL), STATUS_LIMIT);
    const Signal lone = {y, 1, 200, 0};
    assert_int_equal(signal_comparison_shift(&a, &lone, 1, &shift, NULL), STATUS_LIMIT);
    free(x);
    free(y);
}

static bool stop_at_third(void *context, double fraction) {
    (void)fraction;
    return ++*(int *)context < 3;
}

TEST(a_long_measurement_stops_soon_when_it_is_told_to) {
    enum { MANY = 1 << 20 };
    double *values = test_calloc(MANY, sizeof *values);
    const Signal signal = {.values = values, .count = MANY, .rate = 1000};
    int looks = 0;
    const Progress progress = {&looks, stop_at_third};
    assert_true(isnan(signal_comparison_measure(&signal, &signal, 0.5, &progress).rms));
    assert_int_equal(looks, 3);
    assert_true(signal_comparison_measure(&signal, &signal, 0.5, NULL).rms == 0);
    test_free(values);
}
