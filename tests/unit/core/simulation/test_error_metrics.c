

#include <stdlib.h>
#include <string.h>

#include "core/simulation/error_metrics.h"
#include "tests/support/test.h"

// An outcome of one storey made up by hand: samples at `rate`, a spectrum of `bins` up to half of
// it.
static char law[] = "spring_damper", impulse[] = "impulse";

static Outcome outcome_make(size_t count, double rate, size_t bins) {
    Outcome outcome = {.plan.contact_model = law,
                       .response = {.sample_rate = rate, .count = count}};
    outcome.summary.error_estimate = 1e-14;
    outcome.summary.trust_horizon = (double)NAN;
    outcome.summary.rms_displacement = 1;
    assert_int_equal(columns_allocate(&outcome.response.series, 2, count, 0, NULL), STATUS_OK);
    assert_int_equal(columns_allocate(&outcome.spectrum.densities, 1, bins, 0, NULL), STATUS_OK);
    outcome.spectrum.frequency = calloc(bins, sizeof(double));
    assert_non_null(outcome.spectrum.frequency);
    for (size_t i = 0; i < count; i++) {
        outcome.response.series.at[0].values[i] = sin(0.1 * (double)i * 100 / rate);
        outcome.response.series.at[1].values[i] = i % 2 == 0 ? 3 : -3;
    }
    for (size_t k = 0; k < bins; k++) {
        outcome.spectrum.frequency[k] = (double)k * rate / 2 / (double)(bins - 1);
        outcome.spectrum.densities.at[0].values[k] = k < 10 ? 2 : 1e-9;
    }
    return outcome;
}

static void outcome_free(Outcome *outcome) {
    response_clear(&outcome->response);
    spectrum_clear(&outcome->spectrum);
}

static Errors measure(const Outcome *reference, const Outcome *point) {
    return error_metrics_measure(reference, point, true);
}

TEST(the_same_outcome_has_no_error_but_the_references_own) {
    Outcome a = outcome_make(101, 100, 51), b = outcome_make(101, 100, 51);
    const Errors errors = measure(&a, &b);
    assert_true(errors.displacement == 1e-14);
    assert_true(errors.mean_acceleration == 0 && errors.impacts == 0 && errors.psd == 0 &&
                errors.rms_displacement == 0);
    assert_true(isnan(errors.peak_force)); // nobody has a force
    outcome_free(&a);
    outcome_free(&b);
}

TEST(samples_are_compared_within_the_horizon_only) {
    Outcome a = outcome_make(101, 100, 51), b = outcome_make(101, 100, 51);
    double largest = 0;
    for (size_t i = 0; i < 101; i++)
        largest = fmax(largest, fabs(a.response.series.at[0].values[i]));
    b.response.series.at[0].values[20] += 0.25;
    b.response.series.at[0].values[60] += 0.5;
    b.response.series.at[1].values[60] += 30;
    assert_true(fabs(measure(&a, &b).displacement - 0.5 / largest) < 1e-15);
    // 30 off in one of 101 samples of 3
    assert_true(fabs(measure(&a, &b).mean_acceleration - 10 / sqrt(101)) < 1e-12);
    a.summary.trust_horizon = 0.599;
    assert_true(fabs(measure(&a, &b).displacement - 0.25 / largest) < 1e-15);
    assert_true(measure(&a, &b).mean_acceleration == 0);
    a.summary.trust_horizon = 0.6; // the sample at the horizon still counts
    assert_true(fabs(measure(&a, &b).displacement - 0.5 / largest) < 1e-15);
    a.summary.trust_horizon = 0.005; // before the first sample after 0: nothing to compare
    assert_true(isnan(measure(&a, &b).displacement));
    // What the reference is off by behind the horizon says nothing of what is before it.
    a.summary.trust_horizon = 0.3;
    a.summary.error_estimate = 1;
    b.response.series.at[0].values[20] -= 0.25;
    assert_true(measure(&a, &b).displacement == RESPONSE_DIVERGENCE);
    b.summary.rms_displacement = 1.5; // of the whole run, whatever the horizon
    assert_true(measure(&a, &b).rms_displacement == 0.5);
    outcome_free(&a);
    outcome_free(&b);
}

TEST(fewer_samples_are_joined_by_lines_and_means_hold_for_their_interval) {
    Outcome a = outcome_make(9, 8, 5), b = outcome_make(3, 2, 5);
    static const double x[] = {0, 1, 2, 3, 4, 3, 2, 1, 2}, y[] = {0, 4, 1};
    memcpy(a.response.series.at[0].values, x, sizeof x);
    memcpy(b.response.series.at[0].values, y, sizeof y);
    // From 4 to 1 the line passes 3.25, 2.5, 1.75 and 1: off by 1 at the end.
    assert_true(fabs(measure(&a, &b).displacement - 0.25) < 1e-15);
    static const double mean[] = {5, 1, 1, 1, 1, 2, 2, 2, 2}, coarse[] = {5, 1, 2};
    memcpy(a.response.series.at[1].values, mean, sizeof mean);
    memcpy(b.response.series.at[1].values, coarse, sizeof coarse);
    assert_true(measure(&a, &b).mean_acceleration == 0);
    outcome_free(&a);
    outcome_free(&b);
}

TEST(impacts_and_forces_are_those_within_the_horizon) {
    Outcome a = outcome_make(101, 100, 51), b = outcome_make(101, 100, 51);
    Impact own[] = {{.kind = IMPACT_IMPACT, .start = 0.1, .peak_force = 4},
                    {.kind = IMPACT_RESTING, .start = 0.2, .peak_force = 2},
                    {.kind = IMPACT_IMPACT, .start = 0.5, .peak_force = 9}};
    Impact other[] = {{.kind = IMPACT_IMPACT, .start = 0.1, .peak_force = 5},
                      {.kind = IMPACT_IMPACT, .start = 0.15, .peak_force = 1},
                      {.kind = IMPACT_IMPACT, .start = 0.3, .peak_force = (double)NAN}};
    a.response.impacts = (Impacts){own, 3};
    b.response.impacts = (Impacts){other, 3};
    assert_true(measure(&a, &b).impacts == 1);
    assert_true(fabs(measure(&a, &b).peak_force - 4.0 / 9) < 1e-15);
    a.summary.trust_horizon = 0.45;
    assert_true(measure(&a, &b).impacts == 2);
    assert_true(fabs(measure(&a, &b).peak_force - 0.25) < 1e-15);
    const ReferenceSummary told = error_metrics_reference(&a);
    assert_int_equal(told.impacts, 1);
    assert_true(told.peak_force == 4 && told.trust_horizon == 0.45);
    b.plan.contact_model = impulse;
    assert_true(isnan(measure(&a, &b).peak_force));
    const Errors errors = error_metrics_measure(&a, &b, false);
    assert_true(isnan(errors.displacement) && isnan(errors.mean_acceleration) &&
                isnan(errors.impacts) && isnan(errors.peak_force) &&
                isnan(errors.rms_displacement) && errors.psd == 0);
    a.response.impacts = b.response.impacts = (Impacts){NULL, 0};
    outcome_free(&a);
    outcome_free(&b);
}

TEST(spectra_are_compared_over_the_band_that_holds_the_power) {
    Outcome a = outcome_make(101, 100, 51), b = outcome_make(101, 100, 51);
    double *density = b.spectrum.densities.at[0].values;
    const ReferenceSummary told = error_metrics_reference(&a);
    assert_true(told.psd_from == 1 && told.psd_to == 9);
    density[0] = 1e6;   // the mean is taken off
    density[40] = 1000; // out of the band
    assert_true(measure(&a, &b).psd == 0);
    for (size_t k = 1; k < 10; k++)
        density[k] = 20;
    assert_true(fabs(measure(&a, &b).psd - 10) < 1e-12);
    for (size_t k = 1; k < 10; k++)
        density[k] = k == 4 ? 200 : 2; // 20 dB in one bin of nine
    assert_true(fabs(measure(&a, &b).psd - 20.0 / 3) < 1e-12);
    density[4] = 0; // no finite distance
    assert_true(isnan(measure(&a, &b).psd));
    outcome_free(&b);
    b = outcome_make(26, 25, 6); // up to 12.5 Hz, a bin every 2.5
    for (size_t k = 0; k < 6; k++)
        b.spectrum.densities.at[0].values[k] = 2;
    assert_true(measure(&a, &b).psd == 0);
    outcome_free(&b);
    b = outcome_make(17, 16, 9); // up to 8 Hz: the band is not covered
    assert_true(isnan(measure(&a, &b).psd));
    outcome_free(&a);
    outcome_free(&b);
}
