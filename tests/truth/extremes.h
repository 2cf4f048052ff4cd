// Scenes from the edges of what is sensible, as JSON texts, so that each can be run again by the
// program: corners of a grid, and random draws. Not a judge. Used by test_extremes.c.
#ifndef TESTS_TRUTH_EXTREMES_H
#define TESTS_TRUTH_EXTREMES_H

#include <stddef.h>
#include <stdint.h>

enum { EXTREMES_TEXT = 1 << 16 };

// A scene of its own for each seed and number; every second one is a corner of the grid, which has
// EXTREMES_CORNERS of them in an order of its own.
enum { EXTREMES_CORNERS = 5120 };
void extremes_scene(uint64_t seed, uint64_t number, char text[EXTREMES_TEXT]);

#endif
