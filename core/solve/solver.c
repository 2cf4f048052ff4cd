#include "core/solve/solver.h"

#include <math.h>
#include <stdlib.h>

// clang-format off
const Field accuracy_fields[] = {
    FIELD_COUNT(Accuracy, modes, NULL, AT_MIN(1), OPTIONAL, "natural modes of a structure with several storeys that move, the slowest; all if absent"),
    FIELD_END
};
// clang-format on

double step_work_steps(StepWorkKind kind, size_t storeys, size_t dampers, bool is_coupled) {
    const double n = (double)storeys, m = (double)dampers, pairs = is_coupled ? n * n : 0;
    switch (kind) {
    case STEP_WORK_FLIGHT:
        return 1.2 + (0.05 + 0.0008 * n) * n * (1 + m) + (0.02 + 1.9e-6 * n * n) * pairs;
    case STEP_WORK_SUSTAINED:
        return 6 + 0.3 * n * (1 + m) + 0.1 * n * n;
    case STEP_WORK_ARC:
        return 20 + 5 * m + (1.2 + 0.06 * m) * n + 0.15 * pairs;
    case STEP_WORK_EVENT:
        return 10 * (1 + m);
    case STEP_WORK_POWER:
        return 300 + 1000 * ceil(n / 8) + 20 * pairs + fmax(m - 1, 0) * (200 + 3 * n);
    }
    return 0;
}

Status run_check(const Run *run, double time, double step, bool is_finite, Problem *problem) {
    const double duration = run->plan->duration, max = run->steps_max;
    if (!is_finite)
        return problem_set(problem, STATUS_UNSTABLE,
                           "the motion left what double precision can hold at t = %.6g s", time);
    if (max > 0 && run->steps > max)
        return step > 0 ? problem_set(problem, STATUS_LIMIT,
                                      SOLVER_STOPPED "t = %.6g s of %.6g s, by steps of %.4g s",
                                      max, max * SOLVER_STEP, time, duration, step)
                        : problem_set(problem, STATUS_LIMIT, SOLVER_STOPPED "t = %.6g s of %.6g s",
                                      max, max * SOLVER_STEP, time, duration);
    if (!progress_advance(run->progress, time / duration))
        return problem_set(problem, STATUS_CANCELLED, "cancelled at t = %.6g s", time);
    return STATUS_OK;
}

void workspace_clear(Workspace *workspace) {
    fft_cache_clear(&workspace->transforms);
    free(workspace->single);
    for (size_t i = 0; i < BASELINES; i++)
        free(workspace->baselines[i].key);
    *workspace = (Workspace){0};
}
