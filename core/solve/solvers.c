#include "core/solve/solvers.h"

// clang-format off
const Field accuracy_fields[] = {
    FIELD_COUNT(Accuracy, modes, NULL, AT_LEAST(1), OPTIONAL, "natural modes of a structure with several storeys that move, the slowest; all if absent"),
    FIELD_END
};
// clang-format on

static const Solver solver_auto = {
    .kind = {"auto", "the solver that the plan finds best", accuracy_fields, sizeof(Accuracy)},
};

const Solver *const solvers[] = {
    &solver_auto,     &solver_exact, &solver_precise, &solver_rk4, &solver_newmark,
    &solver_adaptive, NULL,
};

static const Kind *solver_at(size_t index) {
    return index + 1 < COUNT(solvers) ? &solvers[index]->kind : NULL;
}

const KindTable solver_kinds = {"solver", solver_at};
