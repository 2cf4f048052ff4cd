// A point is judged by making its scene. Its faults are told where their cause stands: at a value
// of an axis, not in a scene that nobody wrote.
#include "core/study/sweep_validation.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

enum { PLACE = sizeof((Fault){0}.pointer), RANGE_SAMPLES = 512 };

static bool is_range(const SweepAxis *axis) {
    return axis->values.count == 0;
}

static Status no_memory(Problem *problem) {
    return problem_set(problem, STATUS_NO_MEMORY, "no memory for the sweep's points");
}

// Where the value stands that the point has on an axis.
static void place_value(const SweepPlan *plan, size_t axis, size_t index, char place[PLACE]) {
    if (is_range(&plan->study->axes.at[axis]))
        snprintf(place, PLACE, "/study/axes/%zu", axis);
    else
        snprintf(place, PLACE, "/study/axes/%zu/values/%zu", axis, index);
}

// Whether `pointer` is `above` or lies below it.
static bool lies_below(const char *pointer, const char *above) {
    const size_t length = strlen(above);
    return strncmp(pointer, above, length) == 0 &&
           (pointer[length] == '\0' || pointer[length] == '/');
}

// A fault of a point's scene, told where its cause is: the last axis that leads there, else the
// only one, else all of them.
static void tell_fault(const SweepPlan *plan, size_t point, const Fault *fault, Problem *problem) {
    Fault told = *fault;
    size_t cause = plan->axis_count > 1 ? plan->axis_count : 0;
    for (size_t i = 0; i < plan->axis_count; i++)
        if (lies_below(fault->pointer, plan->axes[i].pointer) ||
            lies_below(plan->axes[i].pointer, fault->pointer))
            cause = i;
    if (cause < plan->axis_count)
        place_value(plan, cause, sweep_plan_index(plan, cause, point), told.pointer);
    else
        snprintf(told.pointer, sizeof told.pointer, "/study/axes");
    char detail[sizeof told.detail + PLACE + 64];
    snprintf(detail, sizeof detail, "point %zu, %s: %s", point, fault->pointer, fault->detail);
    text_fit(told.detail, sizeof told.detail, detail);
    problem_put(problem, STATUS_INVALID, &told);
}

static Status check_point(const SweepPlan *plan, size_t point, const SimulationLimits *limits,
                          Problem *fault, Problem *problem) {
    Simulation target;
    problem_clear(fault);
    const Status status = sweep_scene(plan, point, true, limits, &target, fault);
    simulation_clear(&target);
    if (status == STATUS_OK)
        return STATUS_OK;
    if (status != STATUS_INVALID)
        return problem_set(problem, status, "%s", fault->detail);
    for (size_t i = 0; i < fault->count && i < PROBLEM_FAULTS; i++)
        tell_fault(plan, point, &fault->faults[i], problem);
    return status;
}

typedef struct Check {
    const SweepPlan *plan;
    const SimulationLimits *limits;
    const Progress *progress;
    Problem *fault, *problem;
    bool is_faulty;
} Check;

static Status check_next(Check *check, size_t point) {
    if (!progress_advance(check->progress, (double)point / (double)check->plan->points))
        return problem_set(check->problem, STATUS_CANCELLED, "the sweep was stopped");
    const Status status =
        check_point(check->plan, point, check->limits, check->fault, check->problem);
    check->is_faulty = check->is_faulty || status == STATUS_INVALID;
    return status == STATUS_INVALID ? STATUS_OK : status;
}

// Number k of `samples` among `count`, both ends among them.
static size_t spread(size_t k, size_t samples, size_t count) {
    return samples == count ? k : k * (count - 1) / (samples - 1);
}

static Status check_sample(Check *check, size_t most) {
    const SweepPlan *plan = check->plan;
    const bool is_list = plan->study->mode == SWEEP_LIST;
    const size_t axes = is_list ? 1 : plan->axis_count;
    const size_t share = most / axes > 2 ? most / axes : 2; // of each axis
    TRY(check_next(check, plan->points - 1));
    for (size_t i = 0; i < axes; i++) {
        const size_t count = plan->axes[i].count;
        const bool is_short = is_list || is_range(&plan->study->axes.at[i]);
        const size_t wanted = is_short && share > RANGE_SAMPLES ? RANGE_SAMPLES : share;
        const size_t samples = count < wanted ? count : wanted;
        for (size_t k = i > 0; k < samples; k++)
            TRY(check_next(check, spread(k, samples, count) * plan->axes[i].stride));
    }
    return STATUS_OK;
}

static Status check_all(Check *check) {
    for (size_t i = 0; i < check->plan->points; i++)
        TRY(check_next(check, i));
    return STATUS_OK;
}

Status sweep_check(const SweepPlan *plan, size_t scenes, const SimulationLimits *limits,
                   const Progress *progress, Problem *problem) {
    Check check = {.plan = plan,
                   .limits = limits,
                   .progress = progress,
                   .fault = malloc(sizeof(Problem)),
                   .problem = problem};
    if (check.fault == NULL)
        return no_memory(problem);
    const size_t most = sweep_affordable(plan, scenes);
    const Status status = plan->points > most ? check_sample(&check, most) : check_all(&check);
    free(check.fault);
    return status == STATUS_OK && check.is_faulty ? STATUS_INVALID : status;
}

Status sweep_judge(const SweepStudy *study, const Simulation *simulation, size_t scenes,
                   const SimulationLimits *limits, Problem *problem) {
    SweepPlan *plan;
    Status status = sweep_plan_make(study, simulation, limits, &plan, problem);
    // Without limits it was judged before.
    if (plan != NULL && limits != NULL) {
        const Status points = sweep_check(plan, scenes, limits, NULL, problem);
        status = status == STATUS_OK ? points : status;
    }
    sweep_plan_free(plan);
    return status;
}
