// The tables of lanes.h. Not the flying. Used by lanes.c.
#ifndef CORE_SOLVE_LANES_MAKE_H
#define CORE_SOLVE_LANES_MAKE_H

#include "core/solve/lanes.h"

// All of `lanes` but how it runs; interval, omega2, damping and base_omega are set.
void lanes_make_tables(Lanes *lanes);

#endif
