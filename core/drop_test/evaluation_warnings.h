// Warnings about the tests and results of an evaluation.
#ifndef CORE_DROP_TEST_EVALUATION_WARNINGS_H
#define CORE_DROP_TEST_EVALUATION_WARNINGS_H

#include "core/base/report.h"
#include "core/drop_test/readings.h"

// What an evaluation found.
typedef struct EvaluationResult {
    int separation; // Separation
    const EvaluationRows *rows;
    const Statistic *restitution, *contact_time;
} EvaluationResult;

// Appends to `warnings`; pointers lead into the tests: "/drops/2". STATUS_OK or STATUS_NO_MEMORY.
Status evaluation_warnings_add(const Measurement *tests, size_t count,
                               const EvaluationResult *result, Warnings *warnings);

#endif
