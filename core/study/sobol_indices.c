// With f_A, f_B the results of two independent rows and f_i that of row A with input i from row B:
//
//   first = <f_B (f_i - f_A)> / V        Saltelli et al., Comput. Phys. Commun. 181, 259 (2010)
//   total = <(f_A - f_i)^2> / (2 V)      Jansen, Comput. Phys. Commun. 117, 35 (1999)
//   V     = <(f_A - m)^2 + (f_B - m)^2> / 2,  m the mean of f_A and f_B
//
// m is subtracted from f_B first, which leaves the expectation as it is and makes the variance of
// the estimate smaller. Each index is a ratio of two means U / V over the base samples. To first
// order its error is the mean of (u_j - S v_j) / V, whose variance gives the interval by Student's
// t. Under a Latin hypercube or a Sobol sequence the errors are smaller, and the interval is wide.
#include "core/study/sobol_indices.h"

#include <math.h>
#include <stdbool.h>

#include "core/math/student_t.h"

#define CONFIDENCE 0.95

// Results of one base sample for one input.
typedef struct SobolSample {
    double a, b, mixed;
} SobolSample;

static bool sobol_sample_get(const SobolRuns *runs, size_t number, size_t input,
                             SobolSample *sample) {
    const double *at = runs->values + number * (runs->inputs + 2) * runs->stride;
    *sample = (SobolSample){at[0], at[runs->stride], at[(2 + input) * runs->stride]};
    return isfinite(sample->a) && isfinite(sample->b) && isfinite(sample->mixed);
}

// Terms of the means: first, total and V.
typedef struct SobolTerms {
    double first, total, variance;
} SobolTerms;

static SobolTerms sobol_terms(const SobolSample *sample, double mean) {
    const double a = sample->a - mean, b = sample->b - mean, change = sample->mixed - sample->a;
    return (SobolTerms){b * change, change * change / 2, (a * a + b * b) / 2};
}

void sobol_index_estimate(const SobolRuns *runs, size_t input, SobolIndex *index) {
    const double unknown = (double)NAN;
    SobolSample sample;
    SobolTerms means = {0, 0, 0};
    double mean = 0, first_squares = 0, total_squares = 0;
    size_t count = 0;
    *index = (SobolIndex){.first = unknown,
                          .first_interval = {unknown, unknown},
                          .total = unknown,
                          .total_interval = {unknown, unknown}};
    for (size_t j = 0; j < runs->samples; j++)
        if (sobol_sample_get(runs, j, input, &sample)) {
            count++;
            mean += ((sample.a + sample.b) / 2 - mean) / (double)count;
        }
    index->count = count;
    for (size_t j = 0; j < runs->samples; j++)
        if (sobol_sample_get(runs, j, input, &sample)) {
            const SobolTerms terms = sobol_terms(&sample, mean);
            means.first += terms.first / (double)count;
            means.total += terms.total / (double)count;
            means.variance += terms.variance / (double)count;
        }
    if (count < 2 || !(means.variance > 0) || !isfinite(means.variance))
        return;
    index->first = means.first / means.variance;
    index->total = means.total / means.variance;
    for (size_t j = 0; j < runs->samples; j++)
        if (sobol_sample_get(runs, j, input, &sample)) {
            const SobolTerms terms = sobol_terms(&sample, mean);
            const double first = (terms.first - index->first * terms.variance) / means.variance,
                         total = (terms.total - index->total * terms.variance) / means.variance;
            first_squares += first * first;
            total_squares += total * total;
        }
    const double n = (double)count,
                 t = student_t_quantile(CONFIDENCE, count - 1) / sqrt(n * (n - 1));
    for (int side = 0; side < 2; side++) {
        const double width = side == 0 ? -t : t;
        index->first_interval[side] = index->first + width * sqrt(first_squares);
        index->total_interval[side] = index->total + width * sqrt(total_squares);
    }
}
