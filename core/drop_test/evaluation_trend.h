// Readings over approach speed as a straight line by least squares, and whether it says that they
// are constant. Not their mean and outliers (evaluation_statistics.h). Used by
// evaluation_statistics.c.
#ifndef CORE_DROP_TEST_EVALUATION_TREND_H
#define CORE_DROP_TEST_EVALUATION_TREND_H

#include "core/drop_test/reading_statistics.h"

#define EVALUATION_RESOLVED 1e-6 // of a value: less is no outlier and no trend

// Slope and intercept of those readings that have a speed.
typedef struct Line {
    size_t count;
    double speed, value; // means
    double squares;      // of speeds about their mean
    double slope, left;  // what remains of the squares of the values
    double least, most;
} Line;
Line line_fit(const Reading *readings, size_t count);

// Fills the trend of a quantity whose mean is known, of readings that have their weights. False
// without memory.
bool trend_make(const Reading *readings, size_t count, const char *name, const char *unit,
                Statistic *quantity);

#endif
