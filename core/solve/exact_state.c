#include "core/solve/exact_state.h"

#include <stdlib.h>

void exact_forget(Exact *exact) {
    exact->has_lanes = exact->has_flight = false;
    for (int side = 0; side < 2; side++) {
        exact->has_pulse[side] = false;
        free(exact->holds[side]);
        exact->holds[side] = NULL;
    }
}
