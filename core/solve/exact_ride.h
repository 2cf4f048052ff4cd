// A contact that lasts for many samples, eight of them at once. Not its beginning and not its end.
// Used by exact_press.c.
#ifndef CORE_SOLVE_EXACT_RIDE_H
#define CORE_SOLVE_EXACT_RIDE_H

#include "core/solve/press.h"

// The largest force within a stretch in which its slope turns from rising to falling; false if it
// cannot be told.
bool press_find_peak(Press *press, double guess, double length);

// From the present sample on over as many intervals as surely belong to the contact, `most` at
// most, in eights; returns how many.
size_t press_ride(Press *press, size_t most);

#endif
