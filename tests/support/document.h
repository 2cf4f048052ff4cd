// A scene from its JSON text, read and completed, for tests of what only a document says shortly.
// Not a file's. Used by unit tests.
#ifndef TESTS_SUPPORT_DOCUMENT_H
#define TESTS_SUPPORT_DOCUMENT_H

#include "core/simulation/simulation.h"

// Reads and completes {"duration": 1, "sample_rate": 100, `members`}; `simulation` may be
// uninitialised and is the caller's to clear. Faults are in `problem`, which is cleared before.
Status document_complete(Simulation *simulation, const char *members, Problem *problem);

// The same; the test fails if it has one fault, and prints it.
void document_pass(Simulation *simulation, const char *members);

// The test fails unless the document has exactly this fault.
void document_refuse(const char *members, const char *pointer, const char *detail);

#endif
