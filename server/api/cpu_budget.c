#include "server/api/cpu_budget.h"

#include "server/util/clock.h"

enum { LONG_MAX = 4 };
static const double quick = 0.5, most = 30; // [s]

void cpu_budget_begin(App *app, CpuBudget *patience) {
    *patience = (CpuBudget){.app = app, .from_ns = clock_thread_cpu_ns()};
}

bool cpu_budget_lasts(void *context, double fraction) {
    CpuBudget *patience = context;
    App *app = patience->app;
    const double spent = 1e-9 * (double)(clock_thread_cpu_ns() - patience->from_ns);
    (void)fraction;
    if (spent > quick && !patience->has_place) {
        patience->has_place = atomic_fetch_add(&app->evaluations, 1) < LONG_MAX;
        patience->is_crowded = !patience->has_place;
        if (patience->is_crowded)
            atomic_fetch_sub(&app->evaluations, 1);
    }
    return !patience->is_crowded && spent < most && !atomic_load(&app->is_stopping);
}

Status cpu_budget_report(const CpuBudget *patience, Problem *problem) {
    if (atomic_load(&patience->app->is_stopping))
        return problem_set(problem, STATUS_BUSY, "the daemon is stopping");
    if (patience->is_crowded)
        return problem_set(problem, STATUS_BUSY,
                           "other long measurements are being evaluated: ask again");
    return problem_set(problem, STATUS_LIMIT,
                       "to evaluate this takes more than %g s: cut the traces, or take in fewer "
                       "measurements at a time",
                       most);
}

void cpu_budget_end(CpuBudget *patience) {
    if (patience->has_place)
        atomic_fetch_sub(&patience->app->evaluations, 1);
    patience->has_place = false;
}
