// The statistics of readings of one quantity: mean, interval, outliers, trend over speed. Not where
// the readings come from (evaluation_rows.h). Used by evaluation.c and the tests.
#ifndef CORE_DROP_TEST_READING_STATISTICS_H
#define CORE_DROP_TEST_READING_STATISTICS_H

#include "core/drop_test/evaluation.h"

// One reading that counts. What is not known is NAN.
typedef struct Reading {
    double value, uncertainty, speed;
    size_t row; // of the evaluation
    double weight, score;
    bool is_outlier;
} Reading;

// Fills `quantity`, which may be uninitialised, and weighs, scores and marks the readings. `name`
// and `unit` stand in sentences ("contact time", " s"). STATUS_NO_MEMORY.
Status statistic_make(Reading *readings, size_t count, const char *name, const char *unit,
                      Statistic *quantity, Problem *problem);

void statistic_clear(Statistic *quantity);

#endif
