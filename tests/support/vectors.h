// Restricts the core to narrower vectors than the processor has, for tests and benchmarks.
#ifndef TESTS_SUPPORT_VECTORS_H
#define TESTS_SUPPORT_VECTORS_H

#include <stdbool.h>

typedef enum Vectors { VECTORS_AVX512, VECTORS_AVX2, VECTORS_PLAIN, VECTORS_COUNT } Vectors;
extern const char *const vectors_names[VECTORS_COUNT];

// From here on the core uses vectors of this width; false if the processor has none. Must be called
// from the widest to the narrowest, while no run is in progress and without workspaces of earlier
// runs.
bool vectors_set(Vectors vectors);

#endif
