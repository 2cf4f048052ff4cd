#include "server/api/cpu_budget.h"

#include "server/util/clock.h"

enum { LONG_MAX = 4 };
static const double quick = 0.5, most = 30; // [s]

void cpu_budget_begin(App *app, CpuBudget *budget) {
    *budget = (CpuBudget){.app = app, .from_ns = clock_thread_cpu_ns()};
}

bool cpu_budget_lasts(void *context, double fraction) {
    CpuBudget *budget = context;
    App *app = budget->app;
    const double spent = 1e-9 * (double)(clock_thread_cpu_ns() - budget->from_ns);
    (void)fraction;
    if (spent > quick && !budget->has_place) {
        budget->has_place = atomic_fetch_add(&app->evaluations, 1) < LONG_MAX;
        budget->is_crowded = !budget->has_place;
        if (budget->is_crowded)
            atomic_fetch_sub(&app->evaluations, 1);
    }
    return !budget->is_crowded && spent < most && !atomic_load(&app->is_stopping);
}

Status cpu_budget_report(const CpuBudget *budget, Problem *problem) {
    if (atomic_load(&budget->app->is_stopping))
        return problem_set(problem, STATUS_BUSY, "the daemon is stopping");
    if (budget->is_crowded)
        return problem_set(problem, STATUS_BUSY,
                           "other long measurements are being evaluated: ask again");
    return problem_set(problem, STATUS_LIMIT,
                       "to evaluate this takes more than %g s: cut the traces, or take in fewer "
                       "measurements at a time",
                       most);
}

void cpu_budget_end(CpuBudget *budget) {
    if (budget->has_place)
        atomic_fetch_sub(&budget->app->evaluations, 1);
    budget->has_place = false;
}
