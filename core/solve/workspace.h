// Memory of a run that the next run can use again. It never changes a result. One per worker, used
// by one run at a time.
#ifndef CORE_SOLVE_WORKSPACE_H
#define CORE_SOLVE_WORKSPACE_H

#include "core/math/fft.h"

// All zero is empty.
typedef struct Workspace {
    FftCache transforms;
    struct SingleMass *single; // tables of the last system of one mass
    double *values;            // scratch
    size_t room;
} Workspace;

// Room for `count` values, until the next call; NULL: no memory.
double *workspace_values(Workspace *workspace, size_t count);
// Frees what is too large to keep.
void workspace_tidy(Workspace *workspace);

void workspace_clear(Workspace *workspace);

#endif
