// Welch's densities against the sums they stand for, in long double; tests/contract/test_welch.py
// compares them with scipy's.
#include "core/result/welch.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "core/base/philox.h"
#include "tests/support/test.h"

static const char *const unit[] = {"m^2/Hz", "(m/s)^2/Hz"};

// Two columns of noise, the second one's upon a steep line.
static Columns columns_of(size_t rows) {
    Columns columns;
    assert_int_equal(columns_allocate(&columns, 2, rows, 0, NULL), STATUS_OK);
    columns_name(&columns, 0, "displacement", "m");
    columns_name(&columns, 1, "velocity", "m/s");
    for (size_t i = 0; i < rows; i++) {
        double pair[2];
        philox_normal_pair(1, 1, i, pair);
        columns.at[0].values[i] = pair[0];
        columns.at[1].values[i] = pair[1] + 3 + 0.1 * (double)i;
    }
    return columns;
}

static Spectrum welch(const Columns *columns, WelchSettings settings, double rate) {
    Spectrum spectrum;
    assert_int_equal(welch_spectrum(columns, unit, rate, &settings, NULL, NULL, &spectrum, NULL),
                     STATUS_OK);
    return spectrum;
}

static long double slow_window(int window, size_t n, size_t length) {
    const long double angle = 2 * acosl(-1) * (long double)n / (long double)length;
    if (length == 1)
        return 1;
    switch (window) {
    case WELCH_HANN:
        return 0.5L - 0.5L * cosl(angle);
    case WELCH_HAMMING:
        return 0.54L - 0.46L * cosl(angle);
    case WELCH_BLACKMAN:
        return 0.42L - 0.5L * cosl(angle) + 0.08L * cosl(2 * angle);
    default:
        return 1;
    }
}

// By the normal equations, unlike the code under test.
static void slow_trend(int detrend, const double *x, size_t length, long double *level,
                       long double *slope) {
    long double n = (long double)length, t = 0, tt = 0, y = 0, ty = 0;
    for (size_t i = 0; i < length; i++) {
        t += (long double)i;
        tt += (long double)i * (long double)i;
        y += x[i];
        ty += (long double)i * x[i];
    }
    *slope =
        detrend == WELCH_DETREND_LINEAR && length > 1 ? (n * ty - t * y) / (n * tt - t * t) : 0;
    *level = detrend == WELCH_DETREND_NONE ? 0 : (y - *slope * t) / n;
}

static long double slow_density(const double *x, size_t rows, const WelchSettings *settings,
                                double rate, size_t k) {
    const size_t length = settings->segment;
    long double squares = 0, power = 0, segments = 0;
    for (size_t n = 0; n < length; n++)
        squares += powl(slow_window(settings->window, n, length), 2);
    for (size_t start = 0; start + length <= rows; start += length - settings->overlap) {
        long double level, slope, re = 0, im = 0;
        slow_trend(settings->detrend, x + start, length, &level, &slope);
        for (size_t n = 0; n < length; n++) {
            const long double angle =
                2 * acosl(-1) * (long double)(n * k % length) / (long double)length;
            const long double v = slow_window(settings->window, n, length) *
                                  (x[start + n] - level - slope * (long double)n);
            re += v * cosl(angle);
            im -= v * sinl(angle);
        }
        power += re * re + im * im;
        segments++;
    }
    const bool has_mirror = k > 0 && 2 * k != length;
    return (has_mirror ? 2 : 1) * power / segments / (rate * squares);
}

TEST(densities_equal_a_slow_sum_for_every_window_and_trend) {
    static const struct {
        size_t rows, segment, overlap;
    } shapes[] = {
        {64, 16, 8}, {61, 15, 4}, {50, 7, 6}, {33, 33, 0},  {9, 2, 1},
        {5, 1, 0},   {3, 3, 2},   {1, 1, 0},  {40, 39, 38},
    };
    for (size_t s = 0; s < COUNT(shapes); s++)
        for (int window = WELCH_HANN; window <= WELCH_BLACKMAN; window++)
            for (int detrend = WELCH_DETREND_CONSTANT; detrend <= WELCH_DETREND_NONE; detrend++) {
                const WelchSettings settings = {shapes[s].segment, shapes[s].overlap, window,
                                                detrend};
                Columns columns = columns_of(shapes[s].rows);
                Spectrum spectrum = welch(&columns, settings, 8);
                for (size_t c = 0; c < 2; c++) {
                    const double *density = spectrum.densities.at[c].values;
                    double most = 0;
                    for (size_t k = 0; k < spectrum.densities.rows; k++)
                        most = fmax(most, density[k]);
                    for (size_t k = 0; k < spectrum.densities.rows; k++)
                        assert_true(fabsl(density[k] - slow_density(columns.at[c].values,
                                                                    shapes[s].rows, &settings, 8,
                                                                    k)) <= 1e-14L * most + 1e-28L);
                }
                spectrum_clear(&spectrum);
                columns_clear(&columns);
            }
}

TEST(a_boxcar_density_integrates_to_the_mean_square) {
    static const size_t counts[] = {1, 2, 3, 10, 10001, 65536, 1000000, 999983};
    for (size_t i = 0; i < COUNT(counts); i++) {
        const size_t rows = counts[i];
        const double rate = 977;
        Columns columns = columns_of(rows);
        Spectrum spectrum =
            welch(&columns, (WelchSettings){rows, 0, WELCH_BOXCAR, WELCH_DETREND_NONE}, rate);
        assert_int_equal(spectrum.segments, 1);
        for (size_t c = 0; c < 2; c++) {
            long double square = 0, integral = 0;
            for (size_t n = 0; n < rows; n++)
                square += (long double)columns.at[c].values[n] * columns.at[c].values[n] /
                          (long double)rows;
            for (size_t k = 0; k < spectrum.densities.rows; k++)
                integral +=
                    (long double)spectrum.densities.at[c].values[k] * rate / (long double)rows;
            assert_true(fabsl(integral / square - 1) < 1e-13L);
        }
        spectrum_clear(&spectrum);
        columns_clear(&columns);
    }
}

TEST(many_short_segments_lose_no_digits) {
    Columns columns = columns_of(1000000);
    Spectrum spectrum = welch(&columns, (WelchSettings){1, 0, WELCH_HANN, WELCH_DETREND_NONE}, 4);
    long double square = 0;
    for (size_t n = 0; n < columns.rows; n++)
        square += (long double)columns.at[0].values[n] * columns.at[0].values[n] /
                  (long double)columns.rows;
    assert_int_equal(spectrum.segments, 1000000);
    assert_true(fabsl(spectrum.densities.at[0].values[0] * 4 / square - 1) < 1e-15L);
    spectrum_clear(&spectrum);
    columns_clear(&columns);
}

TEST(frequencies_names_and_units_stand_beside_the_densities) {
    Columns columns = columns_of(1000);
    Spectrum spectrum =
        welch(&columns, (WelchSettings){100, 50, WELCH_HANN, WELCH_DETREND_CONSTANT}, 250);
    assert_int_equal(spectrum.densities.rows, 51);
    assert_int_equal(spectrum.segments, 19);
    assert_true(spectrum.frequency[0] == 0 && spectrum.frequency[1] == 2.5 &&
                spectrum.frequency[50] == 125);
    assert_string_equal(spectrum.densities.at[0].name, "displacement");
    assert_string_equal(spectrum.densities.at[0].unit, "m^2/Hz");
    assert_string_equal(spectrum.densities.at[1].name, "velocity");
    assert_string_equal(spectrum.densities.at[1].unit, "(m/s)^2/Hz");
    assert_int_equal(spectrum.settings.segment, 100);
    spectrum_clear(&spectrum);
    columns_clear(&columns);
}

TEST(settings_that_make_no_sense_are_refused) {
    static const WelchSettings bad[] = {
        {0, 0, 0, 0}, {11, 0, 0, 0}, {5, 5, 0, 0}, {5, SIZE_MAX, 0, 0},
        {5, 0, 4, 0}, {5, 0, -1, 0}, {5, 0, 0, 3}, {5, 0, 0, -1},
    };
    Columns columns = columns_of(10);
    for (size_t i = 0; i < COUNT(bad); i++) {
        Spectrum spectrum;
        assert_int_equal(welch_spectrum(&columns, unit, 1, &bad[i], NULL, NULL, &spectrum, NULL),
                         STATUS_INVALID);
        assert_null(spectrum.frequency);
        assert_int_equal(spectrum.densities.count, 0);
    }
    columns_clear(&columns);
}

typedef struct Looks {
    double last;
    int count, most;
} Looks;

static bool look(void *context, double fraction) {
    Looks *looks = context;
    assert_true(fraction >= looks->last && fraction <= 1);
    looks->last = fraction;
    return ++looks->count < looks->most;
}

TEST(the_watch_sees_progress_and_can_stop) {
    static Problem problem;
    Columns columns = columns_of(300000);
    const WelchSettings settings = {4096, 2048, WELCH_HANN, WELCH_DETREND_CONSTANT};
    Spectrum spectrum;
    Looks looks = {.most = 1000};
    const Progress progress = {&looks, look};
    assert_int_equal(welch_spectrum(&columns, unit, 1, &settings, &progress, NULL, &spectrum, NULL),
                     STATUS_OK);
    assert_true(looks.count > 10 && looks.last > 0.9);
    spectrum_clear(&spectrum);
    looks = (Looks){.most = 3};
    assert_int_equal(
        welch_spectrum(&columns, unit, 1, &settings, &progress, NULL, &spectrum, &problem),
        STATUS_CANCELLED);
    assert_int_equal(looks.count, 3);
    assert_null(spectrum.frequency);
    columns_clear(&columns);
}
