#include "core/solve/solvers.h"

const Field accuracy_fields[] = {FIELD_END};

static const Solver solver_auto = {
    {"auto", "the solver that the plan finds best", accuracy_fields, sizeof(Accuracy)},
    NULL,
};

const Solver *const solvers[] = {
    &solver_auto,
    &solver_exact,
    NULL,
};

static const Kind *solver_at(size_t index) {
    return index + 1 < COUNT(solvers) ? &solvers[index]->kind : NULL;
}

const KindTable solver_kinds = {"solver", solver_at};
