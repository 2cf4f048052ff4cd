// A run in which nothing moves: the answer without any solver. Not a mass at rest at its stop: that
// is the solvers'.
#ifndef CORE_SOLVE_REST_H
#define CORE_SOLVE_REST_H

#include "core/solve/solver.h"

// For a plan whose structure and masses start without motion, off their stops, over a still base.
// Fills all of `response` but its series. STATUS_CANCELLED where the progress says so.
Status rest_run(Run *run, Response *response, Problem *problem);

#endif
