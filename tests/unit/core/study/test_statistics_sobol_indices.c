

#include <math.h>
#include <stdlib.h>

#include "core/study/inputs.h"
#include "core/study/statistics.h"
#include "tests/support/test.h"

#define PI 3.14159265358979323846

enum { INPUTS = 3, RUNS = INPUTS + 2 };

// Ishigami and Homma 1990: sin x1 + a sin^2 x2 + b x3^4 sin x1, x within -pi and pi, a = 7, b =
// 0.1.
static double ishigami(const double u[INPUTS]) {
    double x[INPUTS];
    for (size_t i = 0; i < INPUTS; i++)
        x[i] = PI * (2 * u[i] - 1);
    return sin(x[0]) + 7 * pow(sin(x[1]), 2) + 0.1 * pow(x[2], 4) * sin(x[0]);
}

// Of a sum the variances add up: indices are theirs over the total, first and total the same.
static double sum(const double u[INPUTS]) {
    return 3 * u[0] + 2 * u[1] + u[2];
}

static SobolIndex estimate(double (*f)(const double *), int method, uint64_t seed, size_t samples,
                           size_t input) {
    Sampling sampling;
    assert_int_equal(sampling_make(method, seed, samples, 2 * INPUTS, &sampling), STATUS_OK);
    double *values = calloc(samples * RUNS, sizeof *values);
    assert_non_null(values);
    for (size_t j = 0; j < samples; j++)
        for (size_t run = 0; run < RUNS; run++) {
            double u[INPUTS];
            for (size_t i = 0; i < INPUTS; i++) {
                const bool is_b = run == 1 || run == 2 + i;
                u[i] = sampling_coordinate(&sampling, j, i + (is_b ? INPUTS : 0));
            }
            values[j * RUNS + run] = f(u);
        }
    const SobolRuns runs = {values, 1, samples, INPUTS};
    SobolIndex index;
    sobol_index_estimate(&runs, input, &index);
    assert_int_equal(index.count, samples);
    free(values);
    sampling_clear(&sampling);
    return index;
}

// V1 = (1 + b pi^4 / 5)^2 / 2, V2 = a^2 / 8, V13 = 8 b^2 pi^8 / 225.
static void ishigami_indices(double first[INPUTS], double total[INPUTS]) {
    const double v1 = pow(1 + 0.1 * pow(PI, 4) / 5, 2) / 2, v2 = 49.0 / 8,
                 v13 = 8 * 0.01 * pow(PI, 8) / 225, v = v1 + v2 + v13;
    first[0] = v1 / v;
    first[1] = total[1] = v2 / v;
    first[2] = 0;
    total[0] = (v1 + v13) / v;
    total[2] = v13 / v;
}

TEST(intervals_contain_the_indices_of_the_ishigami_function) {
    enum { TRIALS = 200, SAMPLES = 500 };
    double first[INPUTS], total[INPUTS];
    ishigami_indices(first, total);
    for (size_t i = 0; i < INPUTS; i++) {
        size_t inside[2] = {0, 0};
        for (uint64_t seed = 1; seed <= TRIALS; seed++) {
            const SobolIndex index = estimate(ishigami, SAMPLING_RANDOM, seed, SAMPLES, i);
            inside[0] += index.first_interval[0] <= first[i] && first[i] <= index.first_interval[1];
            inside[1] += index.total_interval[0] <= total[i] && total[i] <= index.total_interval[1];
        }
        for (size_t k = 0; k < 2; k++) // 95 % of 200, three standard deviations either way
            if (inside[k] < 181 || inside[k] > 199)
                fail_msg("input %zu: %zu of %d", i, inside[k], TRIALS);
    }
}

TEST(even_points_give_indices_within_narrower_errors) {
    double first[INPUTS], total[INPUTS];
    ishigami_indices(first, total);
    for (size_t i = 0; i < INPUTS; i++) {
        const SobolIndex index = estimate(ishigami, SAMPLING_SOBOL, 1, 4096, i);
        assert_true(fabs(index.first - first[i]) < 0.01 && fabs(index.total - total[i]) < 0.01);
        assert_true(index.first_interval[0] <= first[i] && first[i] <= index.first_interval[1]);
        assert_true(index.total_interval[0] <= total[i] && total[i] <= index.total_interval[1]);
    }
}

TEST(first_and_total_indices_of_a_sum_are_its_variances) {
    for (size_t i = 0; i < INPUTS; i++) {
        const double share = pow(3 - (double)i, 2) / 14;
        const SobolIndex index = estimate(sum, SAMPLING_SOBOL, 2, 1024, i);
        assert_true(fabs(index.first - share) < 0.005 && fabs(index.total - share) < 0.005);
    }
}

TEST(unknown_runs_are_left_out_and_constant_results_have_no_indices) {
    double values[4 * 3] = {1, 2, 1.5, NAN, 2, 3, 2, 4, 3, 5, 1, 2};
    const SobolRuns runs = {values, 1, 4, 1};
    SobolIndex index, rest;
    sobol_index_estimate(&runs, 0, &index);
    assert_int_equal(index.count, 3);
    values[3] = values[0], values[4] = values[1], values[5] = values[2];
    sobol_index_estimate(&(SobolRuns){values + 3, 1, 3, 1}, 0, &rest);
    assert_true(fabs(index.first - rest.first) < 1e-15 && fabs(index.total - rest.total) < 1e-15);
    for (size_t i = 0; i < COUNT(values); i++)
        values[i] = 7;
    sobol_index_estimate(&runs, 0, &index);
    assert_true(isnan(index.first) && isnan(index.total) && isnan(index.total_interval[0]));
    sobol_index_estimate(&(SobolRuns){values, 1, 1, 1}, 0, &index);
    assert_true(index.count == 1 && isnan(index.first));
}
