// Of N possible runs n were made, in the order of their seeds, which is random. The mean of the n
// differs from that of the N by a number of variance s^2 (1/n - 1/N), s the standard deviation of
// one run; it vanishes at n = N. Student's t gives its quantile. In a skewed distribution the mean
// and s depend on each other: to first order this adds |g| (2 q^2 + 1) / (6 sqrt(n)) to the
// quantile q (Johnson 1978).
//
// To stop as soon as an estimate is small enough prefers estimates that are too small. Checks are
// therefore few: at 8 runs and then after every quarter more. Over 1,500 to 6,000 ensembles each of
// normal, gamma and log-normal numbers, N 64 to 1000, targets 0.2 to 0.01, the error then exceeded
// the target in 0 to 1.0 %, mostly in 0.3 to 0.5 %, where 1 % is allowed. A pilot of 4 saves almost
// nothing.
//
// Spectra differ in many numbers at once: the sum of the squares of their differences is about
// chi-square distributed with d degrees of freedom, and its quantile per degree falls with d
// (Wilson and Hilferty).
#include "core/study/stopping_rule.h"

#include <math.h>

#include "core/math/student_t.h"

// sqrt(quantile / d) of a chi-square, relative to d = 1.
static double stopping_rule_narrowing(double d) {
    const double z = student_t_quantile(2 * STOPPING_RULE_CONFIDENCE - 1, 0);
    const double of_one = pow(1 - 2 / 9.0 + z * sqrt(2 / 9.0), 1.5);
    const double part = 2 / (9 * fmax(d, 1));
    return pow(1 - part + z * sqrt(part), 1.5) / of_one;
}

double stopping_rule_error(const RunSpread *spread, size_t count, size_t all) {
    if (count >= all)
        return 0;
    if (count < 2)
        return INFINITY;
    const double n = (double)count;
    const double t = student_t_quantile(STOPPING_RULE_CONFIDENCE, count - 1);
    const double q = t * stopping_rule_narrowing(spread->freedom) +
                     fabs(spread->skewness) * (2 * t * t + 1) / (6 * sqrt(n));
    return q * spread->relative * sqrt(1 / n - 1 / (double)all);
}

size_t stopping_rule_predict(const RunSpread *spread, size_t all, double target) {
    size_t min = spread->count, max = all;
    while (min < max) {
        const size_t middle = min + (max - min) / 2;
        if (stopping_rule_error(spread, middle, all) <= target)
            max = middle;
        else
            min = middle + 1;
    }
    return min;
}

size_t stopping_rule_next_check(size_t count) {
    return count < STOPPING_RULE_PILOT ? STOPPING_RULE_PILOT : count + (count + 3) / 4;
}
