// The Ishigami function, whose Sobol indices are known, and estimates of indices of any function.
#ifndef TESTS_SUPPORT_ISHIGAMI_H
#define TESTS_SUPPORT_ISHIGAMI_H

#include <math.h>
#include <stdlib.h>

#include "core/study/inputs.h"
#include "core/study/statistics.h"
#include "tests/support/test.h"

#define PI 3.14159265358979323846

enum { INPUTS = 3, RUNS = INPUTS + 2 };

// Ishigami and Homma 1990: sin x1 + a sin^2 x2 + b x3^4 sin x1, x within -pi and pi, a = 7, b =
// 0.1; of u within 0 and 1.
static inline double ishigami(const double u[INPUTS]) {
    double x[INPUTS];
    for (size_t i = 0; i < INPUTS; i++)
        x[i] = PI * (2 * u[i] - 1);
    return sin(x[0]) + 7 * pow(sin(x[1]), 2) + 0.1 * pow(x[2], 4) * sin(x[0]);
}

// V1 = (1 + b pi^4 / 5)^2 / 2, V2 = a^2 / 8, V13 = 8 b^2 pi^8 / 225.
static inline void ishigami_indices(double first[INPUTS], double total[INPUTS]) {
    const double v1 = pow(1 + 0.1 * pow(PI, 4) / 5, 2) / 2, v2 = 49.0 / 8,
                 v13 = 8 * 0.01 * pow(PI, 8) / 225, v = v1 + v2 + v13;
    first[0] = v1 / v;
    first[1] = total[1] = v2 / v;
    first[2] = 0;
    total[0] = (v1 + v13) / v;
    total[2] = v13 / v;
}

// Whether the intervals of an index contain both.
static inline bool index_contains(const SobolIndex *index, double first, double total, bool of[2]) {
    const double *low = index->first_interval_95.at, *high = index->total_interval_95.at;
    of[0] = low != NULL && low[0] <= first && first <= low[1];
    of[1] = high != NULL && high[0] <= total && total <= high[1];
    return of[0] && of[1];
}

// The indices of all inputs of `f`; cleared by indices_clear.
static inline void indices_estimate(double (*f)(const double *), int method, uint64_t seed,
                                    size_t samples, SobolIndex indices[INPUTS]) {
    const Sampling sampling = {method, seed, samples};
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
    for (size_t i = 0; i < INPUTS; i++) {
        const SobolRuns runs = {values, 1, samples, INPUTS};
        assert_int_equal(sobol_index_estimate(&runs, i, &indices[i]), STATUS_OK);
        assert_int_equal(indices[i].samples, samples);
    }
    free(values);
}

static inline void indices_clear(SobolIndex indices[INPUTS]) {
    for (size_t i = 0; i < INPUTS; i++)
        fields_clear(sobol_index_fields, &indices[i]);
}

#endif
