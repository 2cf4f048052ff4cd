// Numbers as they lie in memory, in at standard input and out at standard output: how the Python
// tests hand data to a tool and take it back without a digit lost. Used by tests/contract/*_tool.c.
#ifndef TESTS_SUPPORT_DOUBLES_H
#define TESTS_SUPPORT_DOUBLES_H

#include <stdbool.h>
#include <stddef.h>

// All of standard input; freed by the caller. NULL without memory.
double *doubles_read(size_t *count);
bool doubles_write(const double *values, size_t count);

#endif
