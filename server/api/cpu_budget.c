#include "server/api/cpu_budget.h"

#include "server/util/clock.h"

enum { LONG_MAX = 4 };
static const double quick = 0.5, most = 30; // [s]

void patience_begin(App *app, Patience *patience) {
    *patience = (Patience){.app = app, .from_ns = clock_thread_cpu_ns()};
}

bool patience_lasts(void *context, double fraction) {
    Patience *patience = context;
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

Status patience_tell(const Patience *patience, Problem *problem) {
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

void patience_end(Patience *patience) {
    if (patience->has_place)
        atomic_fetch_sub(&patience->app->evaluations, 1);
    patience->has_place = false;
}
