// The lognormal distribution of numbers that are known to lie within intervals, by maximum
// likelihood, with confidence intervals.
#ifndef CORE_MATH_LOGNORMAL_FIT_H
#define CORE_MATH_LOGNORMAL_FIT_H

#include <stdbool.h>
#include <stddef.h>

// The number is above `low`, 0 if that is not known, and at most `high`, INFINITY likewise.
typedef struct CensoredNumber {
    double low, high;
} CensoredNumber;

typedef struct LognormalFit {
    double median, dispersion; // exp(mu), and the standard deviation of the logarithm
    double median_interval[2], dispersion_interval[2];
} LognormalFit;

// Intervals have this confidence. False where the likelihood has no maximum: without a number that
// is surely above another one the dispersion may be 0, and without one that ends and one that
// begins at a bound nothing is known of the median.
bool lognormal_fit(const CensoredNumber *numbers, size_t count, double confidence,
                   LognormalFit *fit);

#endif
