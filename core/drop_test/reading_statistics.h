// Statistics of the readings of one quantity: mean, interval, outliers, trend over speed.
#ifndef CORE_DROP_TEST_READING_STATISTICS_H
#define CORE_DROP_TEST_READING_STATISTICS_H

#include "core/base/field.h"

#define EVALUATION_CONFIDENCE 0.95

// One reading that counts. Unknown values are NAN.
typedef struct Reading {
    double value, uncertainty, speed;
    size_t row; // for the caller
    double weight, score;
    bool is_outlier;
} Reading;

// Constant: no slope is significant, and a change of more than TREND_CHANGE_MAX of the mean would
// have been.
typedef enum TrendVerdict { TREND_CONSTANT, TREND_NOT_CONSTANT, TREND_UNDECIDED } TrendVerdict;
#define TREND_CHANGE_MAX 0.2

// A straight line over approach speed by least squares: whether a quantity is constant over speed.
typedef struct Trend {
    uint64_t count;                          // of readings with a speed
    double least_speed, most_speed;          // [m/s]
    double mean_speed, mean_value;           // a point of the line
    double slope, standard_error, low, high; // per m/s; 95 %
    double t, p;                             // of no slope
    double change;                           // of the line from the slowest to the fastest
    double missed_change; // the largest one within the 95 % interval of the slope
    int verdict;          // TrendVerdict; CHOICE_ABSENT: no test is possible
    char *detail;         // the verdict in words
} Trend;

// e or T_c over all readings that count.
typedef struct Statistic {
    uint64_t count;
    double mean;            // weighted where the readings state their uncertainties
    double unweighted_mean; // of the readings as they are
    double deviation;       // standard deviation of the readings
    double scatter;         // beyond the stated uncertainties; NAN: not weighted
    double standard_error;  // of the mean
    double spread;    // standard deviation for a revision: scatter where the mean is weighted,
                      // else deviation; at least standard_error
    double low, high; // 95 % interval of the mean
    double minimum, median, maximum;
    uint64_t outliers;
    double mean_without_outliers; // NAN: there are none
    char *why;                    // how the interval was made, or why there is none
    Trend trend;
} Statistic;
extern const Field reading_statistic_fields[];

// Fills `statistic`, which may be uninitialised; weights, scores and marks the readings. `name` and
// `unit` are words of its sentences ("contact time", " s"). STATUS_NO_MEMORY. Released by
// fields_clear.
Status reading_statistics_run(Reading *readings, size_t count, const char *name, const char *unit,
                              Statistic *statistic);

#endif
