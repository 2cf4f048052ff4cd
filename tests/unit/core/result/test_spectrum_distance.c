#include <math.h>

#include "core/result/spectrum_distance.h"
#include "tests/support/test.h"

enum { ROWS = 101 };
static double frequency[ROWS], wanted[ROWS], other[ROWS], half_frequency[ROWS];

static Spectrum spectrum_of(double *f) {
    return (Spectrum){.frequency = f, .densities = {.rows = ROWS}};
}

static void assert_near(double is, double should) {
    if (!(fabs(is - should) <= 1e-12 * fmax(1, fabs(should))))
        fail_msg("%.17g should be %.17g", is, should);
}

static void fill(void) {
    for (size_t k = 0; k < ROWS; k++) {
        frequency[k] = (double)k;
        half_frequency[k] = 0.5 * (double)k;
        wanted[k] = 1;
        other[k] = 2;
    }
}

TEST(twice_the_density_is_three_decibels_off) {
    fill();
    const Spectrum a = spectrum_of(frequency);
    const SpectrumDistance told = spectrum_distance_measure(&a, wanted, &a, other, 10, 20);
    assert_true(told.from == 10 && told.to == 20);
    assert_near(told.level, 10 * log10(2));
    assert_near(told.difference, 1);
    assert_near(told.power, 1);
    const SpectrumDistance back = spectrum_distance_measure(&a, other, &a, wanted, 10, 20);
    assert_near(back.power, -0.5);
    assert_near(back.level, told.level);
}

TEST(without_a_band_it_is_where_the_power_is) {
    fill();
    for (size_t k = 31; k < ROWS; k++)
        wanted[k] = 1e-9;
    wanted[0] = 1e9; // the mean does not count
    const Spectrum a = spectrum_of(frequency);
    const SpectrumDistance told =
        spectrum_distance_measure(&a, wanted, &a, other, (double)NAN, (double)NAN);
    assert_true(told.from == 1 && told.to == 30);
    assert_true(spectrum_distance_band_end(wanted, ROWS) == 31);
}

TEST(a_band_ends_where_the_other_has_no_bins) {
    fill();
    const Spectrum a = spectrum_of(frequency), b = spectrum_of(half_frequency);
    const SpectrumDistance told = spectrum_distance_measure(&a, wanted, &b, other, 40, 90);
    assert_true(told.from == 40 && told.to == 50);
    assert_near(told.level, 10 * log10(2));
    assert_true(isnan(spectrum_distance_measure(&a, wanted, &b, other, 60, 90).level));
    assert_true(isnan(spectrum_distance_level(&a, wanted, &b, other, 1, ROWS)));
}

TEST(what_has_no_power_has_no_distance) {
    fill();
    for (size_t k = 0; k < ROWS; k++)
        wanted[k] = 0;
    const Spectrum a = spectrum_of(frequency);
    assert_true(
        isnan(spectrum_distance_measure(&a, wanted, &a, other, (double)NAN, (double)NAN).level));
    const SpectrumDistance told = spectrum_distance_measure(&a, wanted, &a, other, 1, 5);
    assert_true(isnan(told.level) && isnan(told.power) && told.to == 5);
    const Spectrum empty = {0};
    assert_true(isnan(spectrum_distance_measure(&empty, wanted, &a, other, 1, 5).from));
}
