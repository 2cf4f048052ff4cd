// Sobol indices of functions whose indices are known.
#include "tests/support/ishigami.h"

// Of a sum the variances add up: indices are theirs over the total, first and total the same.
static double sum(const double u[INPUTS]) {
    return 3 * u[0] + 2 * u[1] + u[2];
}

TEST(intervals_contain_the_indices_of_the_ishigami_function) {
    enum { TRIALS = 200, SAMPLES = 500 };
    double first[INPUTS], total[INPUTS];
    size_t inside[INPUTS][2] = {{0}};
    ishigami_indices(first, total);
    for (uint64_t seed = 1; seed <= TRIALS; seed++) {
        SobolIndex indices[INPUTS];
        indices_estimate(ishigami, SAMPLING_RANDOM, seed, SAMPLES, indices);
        for (size_t i = 0; i < INPUTS; i++) {
            bool contains[2];
            (void)index_contains(&indices[i], first[i], total[i], contains);
            inside[i][0] += contains[0];
            inside[i][1] += contains[1];
        }
        indices_clear(indices);
    }
    for (size_t k = 0; k < 2 * INPUTS; k++) // 95 % of 200, three standard deviations either way
        if (inside[k / 2][k % 2] < 181 || inside[k / 2][k % 2] > 199)
            fail_msg("input %zu: %zu of %d", k / 2, inside[k / 2][k % 2], TRIALS);
}

TEST(even_points_give_indices_within_narrower_errors) {
    double first[INPUTS], total[INPUTS];
    SobolIndex indices[INPUTS];
    ishigami_indices(first, total);
    indices_estimate(ishigami, SAMPLING_SOBOL, 1, 4096, indices);
    for (size_t i = 0; i < INPUTS; i++) {
        bool contains[2];
        assert_true(fabs(indices[i].first - first[i]) < 0.01 &&
                    fabs(indices[i].total - total[i]) < 0.01);
        assert_true(index_contains(&indices[i], first[i], total[i], contains));
    }
    indices_clear(indices);
}

TEST(first_and_total_indices_of_a_sum_are_its_variances) {
    SobolIndex indices[INPUTS];
    indices_estimate(sum, SAMPLING_SOBOL, 2, 1024, indices);
    for (size_t i = 0; i < INPUTS; i++) {
        const double share = pow(3 - (double)i, 2) / 14;
        assert_true(fabs(indices[i].first - share) < 0.005 &&
                    fabs(indices[i].total - share) < 0.005);
    }
    indices_clear(indices);
}

static SobolIndex estimate(const double *values, size_t samples) {
    SobolIndex index;
    assert_int_equal(sobol_index_estimate(&(SobolRuns){values, 1, samples, 1}, 0, &index),
                     STATUS_OK);
    assert_true(isnan(index.first) == (index.total_interval_95.count == 0));
    fields_clear(sobol_index_fields, &(SobolIndex){.first_interval_95 = index.first_interval_95,
                                                   .total_interval_95 = index.total_interval_95});
    return index;
}

TEST(unknown_runs_are_left_out_and_constant_results_have_no_indices) {
    double values[4 * 3] = {1, 2, 1.5, NAN, 2, 3, 2, 4, 3, 5, 1, 2};
    SobolIndex index = estimate(values, 4);
    assert_int_equal(index.samples, 3);
    values[3] = values[0], values[4] = values[1], values[5] = values[2];
    const SobolIndex rest = estimate(values + 3, 3);
    assert_true(fabs(index.first - rest.first) < 1e-15 && fabs(index.total - rest.total) < 1e-15);
    for (size_t i = 0; i < COUNT(values); i++)
        values[i] = 7;
    index = estimate(values, 4);
    assert_true(isnan(index.first) && isnan(index.total));
    index = estimate(values, 1);
    assert_true(index.samples == 1 && isnan(index.first));
}
