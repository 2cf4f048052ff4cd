

#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "core/study/ensemble.h"
#include "core/study/statistics.h"
#include "tests/support/test.h"

static Problem problem;

enum { RUNS = 4, ROWS = 4 };
static const double densities[RUNS][ROWS] = {
    {1, 2, 4, 0}, {2, 2, 1, 0}, {1.5, 5, 1, 0}, {3, 3, 3, 0}};
static double frequency[ROWS] = {0, 1, 2, 3};

static void assert_near(double is, double should) {
    if (!(fabs(is - should) <= 1e-10 * fabs(should)))
        fail_msg("is %.17g, should be %.17g", is, should);
}

// Two channels: the densities, and twice the mean of the four without any spread.
static void add_run(SpectrumAccumulator *fold, size_t run, size_t channel_count) {
    Spectrum spectrum = {.frequency = calloc(ROWS, sizeof(double))};
    assert_non_null(spectrum.frequency);
    memcpy(spectrum.frequency, frequency, sizeof frequency);
    assert_int_equal(columns_allocate(&spectrum.densities, channel_count, ROWS, 0, &problem),
                     STATUS_OK);
    for (size_t c = 0; c < channel_count; c++) {
        columns_name(&spectrum.densities, c, c == 0 ? "displacement" : "velocity",
                     c == 0 ? "m^2/Hz" : "(m/s)^2/Hz");
        for (size_t k = 0; k < ROWS; k++)
            spectrum.densities.at[c].values[k] = c == 0 ? densities[run][k] : 7;
    }
    assert_int_equal(spectrum_accumulator_add(fold, &spectrum, SPECTRUM_ACCUMULATOR_FIRST),
                     STATUS_OK);
    spectrum_clear(&spectrum);
}

static SpectrumAccumulator fold_of(size_t runs) {
    SpectrumAccumulator fold = {0};
    for (size_t run = 0; run < runs; run++)
        add_run(&fold, run, 2);
    return fold;
}

static Ensemble *tell(const SpectrumAccumulator *fold) {
    Ensemble *answer = (Ensemble *)(void *)variant_new(study_ensemble.answer);
    assert_non_null(answer);
    assert_int_equal(spectrum_accumulator_report(fold, NULL, SPECTRUM_INTERVALS, NULL,
                                                 &answer->frequency, &answer->spectra, &problem),
                     STATUS_OK);
    return answer;
}

TEST(means_and_bands_are_numpys) {
    static const double mean[] = {1.875, 3, 2.25, 0},
                        deviation[] = {0.8539125638299665, 1.4142135623730951, 1.5, 0},
                        low[] = {0.9084038387497005, 1.4169440865902474, 0.7788901798292007, 0},
                        high[] = {3.8701124434247216, 6.3516973500752, 6.499632594045714, 0};
    SpectrumAccumulator fold = fold_of(RUNS);
    Ensemble *answer = tell(&fold);
    assert_int_equal(answer->spectra.count, 2);
    const RunSpectrum *spectrum = &answer->spectra.at[0];
    assert_string_equal(spectrum->channel, "displacement");
    assert_string_equal(spectrum->unit, "m^2/Hz");
    for (size_t k = 0; k < ROWS; k++) {
        assert_true(answer->frequency.at[k] == frequency[k]);
        assert_near(spectrum->mean.at[k], mean[k]);
        assert_near(spectrum->standard_deviation.at[k], deviation[k]);
        assert_near(spectrum->low.at[k], low[k]);
        assert_near(spectrum->high.at[k], high[k]);
        assert_true(answer->spectra.at[1].mean.at[k] == 7 && answer->spectra.at[1].low.at[k] == 7);
    }
    variant_free(&answer->variant);
    spectrum_accumulator_clear(&fold);
}

TEST(one_run_has_a_mean_and_no_band_and_none_has_nothing) {
    SpectrumAccumulator fold = fold_of(1);
    Ensemble *answer = tell(&fold);
    assert_int_equal(answer->spectra.at[0].mean.count, ROWS);
    assert_int_equal(answer->spectra.at[0].low.count, 0);
    variant_free(&answer->variant);
    spectrum_accumulator_clear(&fold);
    answer = tell(&fold);
    assert_int_equal(answer->spectra.count, 0);
    assert_int_equal(answer->frequency.count, 0);
    variant_free(&answer->variant);
}

TEST(the_spread_is_that_of_the_channel_farthest_off) {
    SpectrumAccumulator fold = fold_of(RUNS);
    // The second channel does not differ at all: of it nothing is known, which is the farthest.
    assert_true(isinf(spectrum_accumulator_spread(&fold, 100).relative));
    SpectrumAccumulator alone = {0};
    for (size_t run = 0; run < RUNS; run++)
        add_run(&alone, run, 1);
    const RunSpread spread = spectrum_accumulator_spread(&alone, 100);
    assert_int_equal(spread.count, RUNS);
    assert_near(spread.relative, 0.5322210623972516);
    assert_near(spread.freedom, 2.1325742019787195);
    spectrum_accumulator_clear(&alone);
    spectrum_accumulator_clear(&fold);
}
