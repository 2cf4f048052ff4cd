

#include <math.h>
#include <string.h>

#include "core/study/inputs.h"
#include "tests/support/test.h"

enum { ROWS = 64, DIMENSIONS = 32, MANY = 64 };

TEST(every_stratum_of_a_latin_hypercube_has_one_point) {
    static const size_t counts[] = {2, 7, ROWS};
    for (size_t n = 0; n < COUNT(counts); n++) {
        Sampling sampling = {SAMPLING_LATIN_HYPERCUBE, 3, counts[n]};
        for (size_t d = 0; d < MANY; d++) {
            bool is_taken[ROWS] = {false};
            for (size_t i = 0; i < counts[n]; i++) {
                const double place = sampling_coordinate(&sampling, i, d);
                assert_true(place > 0 && place < 1);
                const size_t stratum = (size_t)(place * (double)counts[n]);
                assert_true(!is_taken[stratum]);
                is_taken[stratum] = true;
            }
        }
    }
}

// Of the points without a shift, scipy.stats.qmc.Sobol(32, scramble=False): a shift is undone by
// that of row 0. scipy's are in the order of Gray codes: its row 13 is this row 11.
TEST(sobol_points_are_those_of_joe_and_kuo) {
    static const double row11[DIMENSIONS] = {
        0.8125, 0.6875, 0.8125, 0.0625, 0.4375, 0.9375, 0.5625, 0.5625, 0.5625, 0.4375, 0.8125,
        0.9375, 0.0625, 0.8125, 0.1875, 0.5625, 0.1875, 0.6875, 0.5625, 0.9375, 0.5625, 0.0625,
        0.8125, 0.5625, 0.0625, 0.4375, 0.4375, 0.0625, 0.0625, 0.3125, 0.5625, 0.4375};
    Sampling sampling = {SAMPLING_SOBOL, 9, 1 << 20};
    for (size_t d = 0; d < DIMENSIONS; d++) {
        const uint32_t shift = (uint32_t)(sampling_coordinate(&sampling, 0, d) * 0x1p32);
        const uint32_t word = (uint32_t)(sampling_coordinate(&sampling, 11, d) * 0x1p32);
        assert_true((double)(word ^ shift) * 0x1p-32 == row11[d]);
    }
}

// Each dimension of 2^k points has one in each of 2^k parts, also the 30th: the recurrence of the
// direction numbers is used beyond the given ones.
TEST(sobol_points_are_one_in_each_part_of_every_dimension) {
    enum { POINTS = 1 << 12 };
    static bool is_taken[POINTS];
    Sampling sampling = {SAMPLING_SOBOL, 1, POINTS};
    for (size_t d = 0; d < DIMENSIONS; d++) {
        memset(is_taken, 0, sizeof is_taken);
        for (size_t i = 0; i < POINTS; i++) {
            const size_t part = (size_t)(sampling_coordinate(&sampling, i, d) * POINTS);
            assert_true(part < POINTS && !is_taken[part]);
            is_taken[part] = true;
        }
    }
}

// A smooth function's mean: sobol and latin_hypercube are nearer to it than independent points.
TEST(means_over_even_points_have_smaller_errors) {
    double error[3] = {0};
    for (int method = SAMPLING_RANDOM; method <= SAMPLING_SOBOL; method++)
        for (uint64_t seed = 1; seed <= 20; seed++) {
            Sampling sampling = {method, seed, 256};
            double mean = 0;
            for (size_t i = 0; i < 256; i++) {
                double value = 0;
                for (size_t d = 0; d < 4; d++)
                    value += sampling_coordinate(&sampling, i, d);
                mean += value * value / 256;
            }
            error[method] += pow(mean - (4 + 1 / 3.0), 2);
        }
    assert_true(error[SAMPLING_LATIN_HYPERCUBE] < error[SAMPLING_RANDOM] / 5);
    assert_true(error[SAMPLING_SOBOL] < error[SAMPLING_RANDOM] / 50);
}

TEST(points_depend_on_seed_row_and_dimension_alone) {
    for (int method = SAMPLING_RANDOM; method <= SAMPLING_SOBOL; method++) {
        Sampling one = {method, 5, ROWS}, same = {method, 5, ROWS}, other = {method, 6, ROWS};
        size_t equal = 0;
        for (size_t i = ROWS; i-- > 0;)
            for (size_t d = 8; d-- > 0;) {
                const double place = sampling_coordinate(&one, i, d);
                assert_true(place == sampling_coordinate(&same, i, d));
                equal += place == sampling_coordinate(&other, i, d);
                assert_true(sampling_draw_again(&one, i, d, 0) !=
                            sampling_draw_again(&one, i, d, 1));
            }
        assert_int_equal(equal, 0);
    }
}
