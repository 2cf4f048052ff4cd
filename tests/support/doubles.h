// Plain arrays of numbers: in at standard input and out at standard output as they lie in memory,
// which is how the Python tests hand data to a tool and take it back without a digit lost, and what
// tests ask of them. Not columns with names. Used by tests/contract/*_tool.c and the truth tests.
#ifndef TESTS_SUPPORT_DOUBLES_H
#define TESTS_SUPPORT_DOUBLES_H

#include <stdbool.h>
#include <stddef.h>

// All of standard input; freed by the caller. NULL without memory.
double *doubles_read(size_t *count);
bool doubles_write(const double *values, size_t count);

// The largest magnitude, 0 of none.
double doubles_largest(const double *values, size_t count);

#endif
