// All solvers, in the order they are offered. "auto" is first and has no run of its own: the
// planner chooses.
#ifndef CORE_SOLVE_SOLVERS_H
#define CORE_SOLVE_SOLVERS_H

#include "core/solve/solver.h"

extern const Solver *const solvers[]; // NULL-terminated
extern const KindTable solver_kinds;

#endif
