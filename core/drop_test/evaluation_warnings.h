// What an evaluation is to be read with. Not its numbers (evaluation.c). Used by evaluation.c.
#ifndef CORE_DROP_TEST_EVALUATION_WARNINGS_H
#define CORE_DROP_TEST_EVALUATION_WARNINGS_H

#include "core/drop_test/evaluation.h"

// Adds to the warnings of an evaluation whose rows and quantities are done. STATUS_OK or
// STATUS_NO_MEMORY.
Status evaluation_warn(const Measurement *tests, size_t count, Evaluation *evaluation);

#endif
