// What drop tests of one material come to: e and T_c with their spread, whether they hold over
// speed, and the revision that would say so. Not the tests themselves (drop_test.h) and not their
// storage. Used by whoever shows or proposes it.
#ifndef CORE_MEASURE_EVALUATION_H
#define CORE_MEASURE_EVALUATION_H

#include "core/measure/drop_test.h"
#include "core/measure/trace.h"
#include "core/scene/material.h"

// The owner of this file completes it: see drop_test.h and trace.h for what goes in, material.h for
// what is proposed.

#endif
