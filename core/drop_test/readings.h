// Readings of drop tests as rows: speeds, e and T_c with the uncertainty that the instrument leaves
// them, gravity taken out where a test says what pulls. Not statistics over them
// (evaluation_statistics.h). Used by evaluation.c.
#ifndef CORE_DROP_TEST_READINGS_H
#define CORE_DROP_TEST_READINGS_H

#include "core/drop_test/evaluation.h"

// Appends the rows of test `index` of those given. Ends as evaluation_run does.
Status rows_add(const Measurement *of, size_t index, const Progress *progress,
                Evaluation *evaluation, Problem *problem);

// Takes gravity out of all drops whose test says what pulls; traces have had it taken out by their
// fit. A drop that tells only one of e and T_c borrows the mean of the other from the readings of
// its test that are free of gravity.
Status rows_unpull(const Measurement *tests, size_t count, const Progress *progress,
                   Evaluation *evaluation, Problem *problem);

// The place of a row in what was given: "/drops/2", or "/measurements/3/traces/0".
void row_pointer(const EvaluationRow *row, char *pointer, size_t size);

#endif
