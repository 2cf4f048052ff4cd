// What is said of a scene when it is judged: its faults and its warnings.
// Not of one read from a document (document.h). Used by the tests of core/simulation.
#ifndef TESTS_SUPPORT_VERDICT_H
#define TESTS_SUPPORT_VERDICT_H

#include "core/simulation/simulation.h"

// All zero is none.
typedef struct Verdict {
    Problem problem;
    Warnings warnings;
} Verdict;

// simulation_complete, with 2^25 samples at most. The first forgets what was said before, the
// second adds to it.
Status verdict_complete(Verdict *verdict, Simulation *simulation);
Status verdict_more(Verdict *verdict, Simulation *simulation);
void verdict_clear(Verdict *verdict);

// What is warned of at `pointer`; "(no warning there)" if nothing.
const char *verdict_warning(const Verdict *verdict, const char *pointer);

// The test fails unless the text does.
void verdict_begins(const char *text, const char *beginning);

#endif
