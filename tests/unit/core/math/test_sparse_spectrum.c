// Parts of long periods against the slow sum of their bins.
#include "core/math/sparse_spectrum.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "core/base/philox.h"
#include "tests/support/test.h"

typedef struct Case {
    size_t length, bins;
} Case;

// By one transform; by a short one and sums over 8, 16, 64 and 1024 phases; and at the edges of
// each.
static const Case cases[] = {
    {1 << 12, 1 << 11}, {1 << 12, 65},  {1 << 12, 64}, {1 << 15, 492},     {1 << 15, 512},
    {1 << 15, 513},     {1 << 16, 500}, {1 << 18, 17}, {1 << 22, 40},      {1 << 22, 1},
    {1 << 15, 256},     {1 << 15, 257}, {1 << 13, 2},  {1 << 22, 1 << 19},
};

// Of an rms of 1; the first `empty` bins are 0.
static double *bins_of(const Case *of, size_t empty) {
    double *bins = calloc(2 * of->bins, sizeof *bins);
    assert_non_null(bins);
    for (size_t k = empty; k < of->bins; k++) {
        double normal[2];
        philox_normal_pair(5, of->length, k, normal);
        bins[2 * k] = normal[0] / (2 * sqrt((double)of->bins));
        bins[2 * k + 1] = normal[1] / (2 * sqrt((double)of->bins));
    }
    return bins;
}

static SparseSpectrum *synthesis_of(const Case *of, const double *bins, FftCache *stock) {
    SparseSpectrum *synthesis = sparse_spectrum_new(of->length, of->bins, stock);
    assert_non_null(synthesis);
    memcpy(sparse_spectrum_bins(synthesis), bins, 2 * of->bins * sizeof *bins);
    sparse_spectrum_run(synthesis);
    return synthesis;
}

static double slow(const Case *of, const double *bins, size_t i) {
    long double sum = 0;
    const long double turn = 2 * acosl(-1) / (long double)of->length;
    for (size_t k = 0; k < of->bins; k++) {
        const long double angle = turn * (long double)(k * i % of->length);
        sum += bins[2 * k] * cosl(angle) - bins[2 * k + 1] * sinl(angle);
    }
    return (double)(2 * sum);
}

TEST(samples_are_the_sum_of_their_bins) {
    double *values = malloc((1 << 22) * sizeof *values);
    assert_non_null(values);
    for (size_t c = 0; c < sizeof cases / sizeof *cases; c++) {
        const Case *of = &cases[c];
        double *bins = bins_of(of, of->bins / 3 + (of->bins > 1));
        if (of->bins == 1)
            bins[0] = 0.4;
        SparseSpectrum *synthesis = synthesis_of(of, bins, NULL);
        sparse_spectrum_samples(synthesis, 0, of->length, values);
        const size_t looks = of->bins > 10000 ? 5 : 60;
        for (size_t i = 0; i < looks; i++) {
            // From both ends on, and all over.
            const size_t at = i < 4 ? i : i < 8 ? of->length - (i - 3) : i * 7919 % of->length;
            // k = 0 has no mirror.
            const double wanted = slow(of, bins, at) - bins[0];
            if (!(fabs(values[at] - wanted) < 1e-14))
                fail_msg("%zu of %zu, %zu bins: %.17g, not %.17g", at, of->length, of->bins,
                         values[at], wanted);
        }
        sparse_spectrum_free(synthesis, NULL);
        free(bins);
    }
    free(values);
}

TEST(a_part_has_the_bits_of_the_whole) {
    for (size_t c = 0; c < sizeof cases / sizeof *cases; c++) {
        const Case *of = &cases[c];
        double *bins = bins_of(of, 0), *values = malloc(of->length * sizeof *values);
        double part[SPARSE_SPECTRUM_BLOCK];
        assert_non_null(values);
        SparseSpectrum *synthesis = synthesis_of(of, bins, NULL);
        sparse_spectrum_samples(synthesis, 0, of->length, values);
        for (size_t from = 0; from < of->length; from += 3 * SPARSE_SPECTRUM_BLOCK) {
            sparse_spectrum_samples(synthesis, from, SPARSE_SPECTRUM_BLOCK, part);
            assert_memory_equal(part, values + from, sizeof part);
        }
        sparse_spectrum_free(synthesis, NULL);
        free(values);
        free(bins);
    }
}

TEST(a_stock_and_what_was_there_before_leave_no_trace) {
    FftCache stock = {0};
    double first[SPARSE_SPECTRUM_BLOCK], again[SPARSE_SPECTRUM_BLOCK];
    const Case *of = &cases[3];
    double *bins = bins_of(of, 1);
    for (int i = 0; i < 3; i++) {
        SparseSpectrum *synthesis = synthesis_of(of, bins, &stock);
        sparse_spectrum_samples(synthesis, 2 * SPARSE_SPECTRUM_BLOCK, SPARSE_SPECTRUM_BLOCK,
                                i == 0 ? first : again);
        if (i > 0)
            assert_memory_equal(first, again, sizeof first);
        // The bins are spoilt now; what is above them must not matter either.
        double *spoilt = sparse_spectrum_bins(synthesis);
        for (size_t k = 0; k < 2 * of->bins; k++)
            spoilt[k] = 1e300;
        sparse_spectrum_free(synthesis, &stock);
    }
    assert_non_null(stock.at[0]);
    fft_cache_clear(&stock);
    free(bins);
}
