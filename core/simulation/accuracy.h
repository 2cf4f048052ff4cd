// The kinds of "accuracy" a user may ask for, named by their solver. Not the solvers: a row only says what is accepted.
// Used by request.c and by whoever chooses a solver.
#ifndef CORE_SIMULATION_ACCURACY_H
#define CORE_SIMULATION_ACCURACY_H

#include "core/base/field.h"

extern const KindTable accuracy_kinds;
extern const Kind accuracy_auto, accuracy_exact;

#endif
