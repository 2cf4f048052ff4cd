// Quantities written for people, "10 mm", as numbers in the unit of a Field row.
#ifndef SERVER_UTIL_UNITS_H
#define SERVER_UTIL_UNITS_H

#include <stdbool.h>
#include <stddef.h>

enum { QUANTITY_REASON = 300 };

// Reads a number with or without a unit into *value, in `unit` (NULL: none); without one it is in
// `unit`. The digits are scaled as decimals: "35 mm" is the same double as 0.035. False with what
// is wrong, to follow a place: "is a length in m, 10kg is a mass; write 10mm".
bool quantity_read(const char *text, const char *unit, double *value, char reason[QUANTITY_REASON]);

#endif
