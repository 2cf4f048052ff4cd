// Points in the unit cube from which uncertain inputs are drawn: independent, a Latin hypercube or
// a Sobol sequence. Each coordinate is a function of its row and dimension: any thread can make any
// point.
#ifndef CORE_STUDY_SAMPLING_H
#define CORE_STUDY_SAMPLING_H

#include <stddef.h>
#include <stdint.h>

#include "core/base/status.h"

enum {
    SAMPLING_DIMENSIONS = 64,
    SAMPLING_SOBOL_DIMENSIONS = 32,
};

typedef enum SamplingMethod {
    SAMPLING_RANDOM,
    SAMPLING_LATIN_HYPERCUBE,
    SAMPLING_SOBOL
} SamplingMethod;
extern const char *const sampling_names[]; // NULL-terminated

// Points of one seed. Immutable, shared by threads.
typedef struct Sampling {
    int method; // SamplingMethod
    uint64_t seed;
    size_t rows, dimensions;
    uint32_t *strata; // of a Latin hypercube, dimension by dimension a permutation of the rows
} Sampling;

// Rows up to 2^32, dimensions up to SAMPLING_DIMENSIONS, of a Sobol sequence up to
// SAMPLING_SOBOL_DIMENSIONS. Cleared by sampling_clear. STATUS_NO_MEMORY.
Status sampling_make(int method, uint64_t seed, size_t rows, size_t dimensions, Sampling *sampling);
void sampling_clear(Sampling *sampling);

// A coordinate, within 0 and 1, never one of them and never 1/2.
double sampling_coordinate(const Sampling *sampling, size_t row, size_t dimension);

// Another one, independent of all; `again` from 0 to 2^20 - 1.
double sampling_draw_again(const Sampling *sampling, size_t row, size_t dimension, uint64_t again);

#endif
