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

void workspace_clear(Workspace *workspace) {
    fft_cache_clear(&workspace->transforms);
    free(workspace->single);
    workspace->single = NULL;
}
