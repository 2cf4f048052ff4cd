// Evaluation of the drop tests of one material: all readings as rows, mean and interval of e and
// T_c, their trend over speed, warnings.
#ifndef CORE_DROP_TEST_EVALUATION_H
#define CORE_DROP_TEST_EVALUATION_H

#include "core/base/report.h"
#include "core/contact/contact.h"
#include "core/drop_test/readings.h"

enum { EVALUATION_SAMPLES_MAX = 4 * TRACE_SAMPLES_MAX };

// Conditions of the rows that count; NAN: unknown.
typedef struct Ranges {
    double least_speed, most_speed;             // [m/s]
    double least_temperature, most_temperature; // of the rows' tests [degC]
} Ranges;

typedef struct Evaluation {
    int separation; // Separation: the rule by which traces were evaluated
    double confidence;
    Statistic restitution, contact_time;
    EvaluationRows rows;
    Ranges ranges;     // of all rows that count
    Warnings warnings; // pointers lead into the tests: "/drops/2"
} Evaluation;

extern const Field evaluation_fields[]; // without the warnings

// Number of samples in all traces of all tests.
size_t evaluation_sample_count(const Measurement *tests, size_t count);

// `tests` have passed drop_test_validate. `progress` (may be NULL) is called before each contact
// and each correction of gravity. STATUS_INVALID: a trace cannot be read at all; STATUS_LIMIT: too
// many rows or samples; STATUS_CANCELLED; STATUS_NO_MEMORY. Released by evaluation_clear in any
// case.
Status evaluation_run(const Measurement *tests, size_t count, Separation separation,
                      const Progress *progress, Evaluation *evaluation, Problem *problem);
void evaluation_clear(Evaluation *evaluation);

// All NAN, and extended by a row.
extern const Ranges ranges_unknown;
void ranges_extend(Ranges *ranges, const EvaluationRow *row, const Measurement *tests);

#endif
