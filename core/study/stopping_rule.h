// When an ensemble under a target has enough runs: how far the mean of the runs made may be from
// the mean of all runs requested.
#ifndef CORE_STUDY_STOPPING_RULE_H
#define CORE_STUDY_STOPPING_RULE_H

#include <stddef.h>

// Differences among the runs made so far.
typedef struct RunSpread {
    size_t count;    // runs
    double relative; // standard deviation of one run over the mean; INFINITY: unknown, or no mean
    double skewness;
    double freedom; // independent numbers that share the spread: 1 of a statistic, more of spectra
} RunSpread;

#define STOPPING_RULE_CONFIDENCE 0.99
enum { STOPPING_RULE_PILOT = 8 }; // runs before the first check

// Relative error of the mean of `count` of `all` runs against the mean of all, which is exceeded
// with a probability of 1 - STOPPING_RULE_CONFIDENCE; 0 if count >= all.
double stopping_rule_error(const RunSpread *spread, size_t count, size_t all);

// Smallest number of runs, at least those made, whose estimated error is within `target`.
size_t stopping_rule_predict(const RunSpread *spread, size_t all, double target);

// Number of runs at the check that follows the one at `count`.
size_t stopping_rule_next_check(size_t count);

#endif
