// A linear contact by its closed form (pulse.h), from touch to release. Not for contacts that
// pulse.h does not take. Used by exact_stride.c.
#ifndef CORE_SOLVE_EXACT_PRESS_H
#define CORE_SOLVE_EXACT_PRESS_H

#include "core/solve/exact_state.h"

// From where the present contact began to its release, or until the arcs must go on; past at most
// `most` samples. Returns how many.
size_t exact_press(Exact *exact, size_t most);

#endif
