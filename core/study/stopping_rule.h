// When an ensemble under a target has enough runs: how far the mean of those made may be from the
// mean of all that were asked for. Not what the mean is of: that is ensemble_statistics.h and
// ensemble_spectra.h, which tell the spread. Used by ensemble_run.c and the tests.
#ifndef CORE_STUDY_STOPPING_RULE_H
#define CORE_STUDY_STOPPING_RULE_H

#include <stddef.h>

// What the runs made so far tell of one another.
typedef struct Spread {
    size_t count;    // runs
    double relative; // standard deviation of one run over the mean; INFINITY: not known, or no mean
    double skewness;
    // How many independent numbers share the spread: 1 for a statistic, more for spectra.
    double freedom;
} Spread;

#define ENSEMBLE_CONFIDENCE 0.99 // of the rule
enum { ENSEMBLE_PILOT = 8 };

// The error of the mean of `count` of `all` runs against the mean of all, relative to it, that is
// not passed with ENSEMBLE_CONFIDENCE; 0 where none is left.
double stopping_rule_error(const Spread *spread, size_t count, size_t all);

// The fewest runs, from those made on, by which the error is foretold to be within `target`.
size_t stopping_rule_predict(const Spread *spread, size_t all, double target);

// The number of runs at which the error is looked at after it was at `count`.
size_t stopping_rule_next_check(size_t count);

#endif
