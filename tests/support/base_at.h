// What a base is at any instant, said as plainly as it can be: the measure of cursors, refined
// bases and excitations. Not how a solver meets it (core/solve/base_motion_cursor.h). Used by
// tests.
#ifndef TESTS_SUPPORT_BASE_AT_H
#define TESTS_SUPPORT_BASE_AT_H

#include "core/excitation/base_motion.h"

// a_g at time t >= 0 [m/s^2]; right-continuous at the end of the samples.
double base_at(const Base *base, double time);

#endif
