#include "core/solve/solver.h"

#include "core/result/response.h"

// clang-format off
static const Field auto_fields[] = {
    FIELD_BASE(AccuracyAuto, accuracy, accuracy_fields),
    FIELD_REAL(AccuracyAuto, target, NULL, WITHIN(1e-15, 1), OPTIONAL, "relative error requested: the cheapest settings that are predicted to keep it are run, and the result states the estimated error; if absent the accuracy of double precision"),
    FIELD_CHOICE(AccuracyAuto, metric, metric_names, OPTIONAL, "what the target is of; displacement if absent"),
    FIELD_END
};
// clang-format on

static const Solver solver_auto = {
    .kind = {"auto", "the best solver for the scene, or the cheapest settings for a target",
             auto_fields, sizeof(AccuracyAuto)},
};

const Solver *const solvers[] = {
    &solver_auto,     &solver_exact, &solver_precise, &solver_rk4, &solver_newmark,
    &solver_adaptive, NULL,
};

static const Kind *solver_at(size_t index) {
    return index + 1 < COUNT(solvers) ? &solvers[index]->kind : NULL;
}

const KindTable solver_kinds = {"solver", solver_at, false};
