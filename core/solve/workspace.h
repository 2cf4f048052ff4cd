// What a run needs and the next one can use again. Nothing of a result: the bytes of a run do not
// depend on what its workspace served before. One per worker, used by one run at a time.
#ifndef CORE_SOLVE_WORKSPACE_H
#define CORE_SOLVE_WORKSPACE_H

#include "core/math/fft.h"

// All zero is empty.
typedef struct Workspace {
    FftCache transforms;
    struct SingleMass *single; // one block, with the tables of the last system of one mass
    double *values;            // scratch
    size_t room;
} Workspace;

// Room for `count` values, until the next call; NULL: no memory.
double *workspace_values(Workspace *workspace, size_t count);
// Gives back what is too large to be kept for the next run.
void workspace_tidy(Workspace *workspace);

void workspace_clear(Workspace *workspace);

#endif
