// Whether a test is taken in twice. Not the other warnings (evaluation_warn.h). Used by those.
#ifndef CORE_DROP_TEST_EVALUATION_SAME_H
#define CORE_DROP_TEST_EVALUATION_SAME_H

#include "core/drop_test/evaluation.h"

// Warns of tests of which readings count that say in every member what one before them says.
// STATUS_NO_MEMORY.
Status evaluation_warn_same(const Measurement *tests, size_t count, Evaluation *evaluation);

#endif
