#include "core/study/sweep_run.h"

#include <inttypes.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "core/study/sweep_validation.h"

// What the study has at hand.
typedef struct SweepWork {
    StudyWork work;
    SweepPlan *plan;
    Sweep *answer;
} SweepWork;

size_t sweep_value_index(const Sweep *sweep, size_t axis, size_t point) {
    size_t stride = 1;
    if (sweep->mode == SWEEP_LIST)
        return point;
    for (size_t i = axis + 1; i < sweep->axes.count; i++)
        stride *= sweep->axes.at[i].values.count;
    return point / stride % sweep->axes.at[axis].values.count;
}

static char *scalar_text(const SweepStudy *study, const SweepPlan *plan, size_t axis,
                         size_t index) {
    const Texts *values = &study->axes.at[axis].values;
    if (values->count > 0)
        return strdup(values->at[index]);
    const Scalar *value = &plan->axes[axis].at[index];
    char digits[32];
    text_real(digits, value->number);
    return strdup(digits);
}

static Status tell_axis(const SweepStudy *study, const SweepPlan *plan, size_t axis,
                        SweepTold *told) {
    const SweepValues *values = &plan->axes[axis];
    const char *unit = values->is_tag ? NULL : values->field->unit;
    told->pointer = strdup(values->pointer);
    told->unit = unit == NULL ? NULL : strdup(unit);
    told->values.at = calloc(values->count, sizeof *told->values.at);
    if (told->pointer == NULL || (told->unit == NULL && unit != NULL) || told->values.at == NULL)
        return STATUS_NO_MEMORY;
    for (size_t i = 0; i < values->count; i++) {
        char *text = scalar_text(study, plan, axis, i);
        if (text == NULL)
            return STATUS_NO_MEMORY;
        told->values.at[told->values.count++] = text;
    }
    return STATUS_OK;
}

static Status tell(const SweepStudy *study, const SweepPlan *plan, Sweep *sweep) {
    sweep->points = plan->points;
    sweep->mode = study->mode;
    sweep->axes.at = calloc(plan->axis_count, sizeof *sweep->axes.at);
    sweep->metrics.at = calloc(study->metrics.count, sizeof *sweep->metrics.at);
    if (sweep->axes.at == NULL || sweep->metrics.at == NULL)
        return STATUS_NO_MEMORY;
    for (size_t i = 0; i < plan->axis_count; i++) {
        sweep->axes.count = i + 1;
        TRY(tell_axis(study, plan, i, &sweep->axes.at[i]));
    }
    for (size_t i = 0; i < study->metrics.count; i++) {
        char *name = strdup(study->metrics.at[i]);
        if (name == NULL)
            return STATUS_NO_MEMORY;
        sweep->metrics.at[sweep->metrics.count++] = name;
    }
    return STATUS_OK;
}

Status sweep_tell(const SweepStudy *study, const Simulation *simulation, Sweep *sweep,
                  Problem *problem) {
    SweepPlan *plan;
    TRY(sweep_plan_new(study, simulation, NULL, &plan, problem));
    const Status status = tell(study, plan, sweep);
    sweep_plan_free(plan);
    return status == STATUS_OK ? status
                               : problem_set(problem, status, "no memory for the sweep's axes");
}

static double metric(const char *name, const Outcome *outcome) {
    size_t offset = 0;
    const Field *row = fields_find(summary_fields, name, &offset);
    if (row == NULL)
        return outcome->steps;
    const char *member = (const char *)&outcome->summary + offset + row->offset;
    if (row->kind != FIELD_KIND_COUNT)
        return *(const double *)(const void *)member;
    const uint64_t count = *(const uint64_t *)(const void *)member;
    return count == COUNT_ABSENT ? (double)NAN : (double)count;
}

static SweepStatus kept_status(Status status) {
    return status == STATUS_INVALID    ? SWEEP_INVALID
           : status == STATUS_UNSTABLE ? SWEEP_UNSTABLE
           : status == STATUS_LIMIT    ? SWEEP_LIMIT
                                       : SWEEP_FAILED;
}

Status sweep_run_point(const SweepPlan *plan, size_t point, const SimulationLimits *limits,
                       const Progress *progress, Workspace *workspace, double *values,
                       SweepStatus *status, Problem *fault) {
    const Texts *metrics = &plan->study->metrics;
    Simulation scene;
    Outcome *outcome = NULL;
    problem_clear(fault);
    Status made = sweep_scene(plan, point, true, limits, &scene, fault);
    if (made == STATUS_OK)
        made = simulation_run(&scene, limits, progress, workspace, &outcome, fault);
    simulation_clear(&scene);
    for (size_t i = 0; i < metrics->count; i++)
        values[i] = made == STATUS_OK ? metric(metrics->at[i], outcome) : (double)NAN;
    outcome_unref(outcome);
    *status = made == STATUS_OK ? SWEEP_MADE : kept_status(made);
    return made == STATUS_CANCELLED || made == STATUS_NO_MEMORY ? made : STATUS_OK;
}

Status sweep_add_failure(SweepFailures *failures, SweepStatus status, uint64_t point,
                         const char *detail) {
    for (size_t i = 0; i < failures->count; i++)
        if (failures->at[i].status == (int)status) {
            failures->at[i].count++;
            return STATUS_OK;
        }
    SweepFailure *at = realloc(failures->at, (failures->count + 1) * sizeof *at);
    char *text = strdup(detail);
    if (at != NULL)
        failures->at = at;
    if (at == NULL || text == NULL) {
        free(text);
        return STATUS_NO_MEMORY;
    }
    at[failures->count++] = (SweepFailure){(int)status, 1, point, text};
    return STATUS_OK;
}

static Status make_point(const StudyWork *of, size_t point, const StudyTools *tools, void **made,
                         Problem *problem) {
    const SweepPlan *plan = ((const SweepWork *)(const void *)of)->plan;
    SweepPart *part = calloc(1, sizeof *part + plan->study->metrics.count * sizeof(double));
    *made = part;
    if (part == NULL)
        return problem_set(problem, STATUS_NO_MEMORY, "no memory for a point");
    TRY(sweep_run_point(plan, point, tools->limits, tools->progress, tools->workspace, part->values,
                        &part->status, problem));
    if (part->status == SWEEP_MADE)
        return STATUS_OK;
    part->why = strdup(problem->detail);
    problem_clear(problem);
    return part->why != NULL ? STATUS_OK
                             : problem_set(problem, STATUS_NO_MEMORY, "no memory for a point");
}

static void drop_point(void *made) {
    SweepPart *part = made;
    if (part != NULL)
        free(part->why);
    free(part);
}

// Only where rows are kept here and nowhere else is there room for them.
static Status lay_table(SweepTable *table, size_t points, size_t metrics, Problem *problem) {
    table->points.at = calloc(points, sizeof(double));
    table->statuses.at = calloc(points, sizeof(double));
    table->values.at = calloc(points * metrics, sizeof(double));
    table->failed = 0;
    return table->points.at != NULL && table->statuses.at != NULL && table->values.at != NULL
               ? STATUS_OK
               : problem_set(problem, STATUS_NO_MEMORY, "no memory for %zu points", points);
}

static Status fold_point(StudyWork *of, size_t point, void *made, Problem *problem) {
    SweepTable *table = &((SweepWork *)(void *)of)->answer->table;
    const size_t metrics = ((const SweepWork *)(const void *)of)->plan->study->metrics.count;
    const SweepPart *part = made;
    if (point == 0)
        TRY(lay_table(table, of->members, metrics, problem));
    table->points.at[table->points.count++] = (double)point;
    table->statuses.at[table->statuses.count++] = part->status;
    memcpy(&table->values.at[table->values.count], part->values, metrics * sizeof *part->values);
    table->values.count += metrics;
    if (part->status == SWEEP_MADE)
        return STATUS_OK;
    table->failed++;
    const Status added = sweep_add_failure(&table->failures, part->status, point, part->why);
    return added == STATUS_OK ? added : problem_set(problem, added, "no memory for a point");
}

static void free_points(StudyWork *of) {
    SweepWork *work = (SweepWork *)(void *)of;
    sweep_plan_free(work->plan);
    free(work);
}

static Status begin_points(const Study *asked, const Simulation *simulation,
                           const StudyTools *tools, Variant *told, StudyWork **made,
                           Problem *problem) {
    const SweepStudy *study = (const SweepStudy *)(const void *)asked;
    SweepWork *work = calloc(1, sizeof *work);
    if (work == NULL)
        return problem_set(problem, STATUS_NO_MEMORY, "no memory for the sweep");
    work->answer = (Sweep *)(void *)told;
    Status status = sweep_plan_new(study, simulation, tools->limits, &work->plan, problem);
    if (status == STATUS_OK)
        status = sweep_check(work->plan, SIZE_MAX, tools->limits, tools->progress, problem);
    if (status == STATUS_OK) {
        status = tell(study, work->plan, work->answer);
        if (status != STATUS_OK)
            (void)problem_set(problem, status, "no memory for the sweep's axes");
    }
    if (status != STATUS_OK) {
        free_points(&work->work);
        return status;
    }
    work->work =
        (StudyWork){.kind = &study_sweep,
                    .members = work->plan->points,
                    .wanted = work->plan->points,
                    .expected = work->plan->points,
                    .part_bytes = sizeof(SweepPart) + study->metrics.count * sizeof(double)};
    *made = &work->work;
    return STATUS_OK;
}

const StudyMembers sweep_members = {
    .begin = begin_points,
    .make = make_point,
    .fold = fold_point,
    .drop = drop_point,
    .free = free_points,
};
