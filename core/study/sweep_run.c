#include "core/study/sweep_run.h"

#include <inttypes.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "core/study/sweep_judge.h"

static const double check_share = 0.02; // of the way, to judge all points

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
                       const Watch *watch, Workspace *workspace, double *values,
                       SweepStatus *status, Problem *fault) {
    const Texts *metrics = &plan->study->metrics;
    Simulation scene;
    Outcome *outcome = NULL;
    problem_clear(fault);
    Status made = sweep_scene(plan, point, true, limits, &scene, fault);
    if (made == STATUS_OK)
        made = simulation_run(&scene, limits, watch, workspace, &outcome, fault);
    simulation_clear(&scene);
    for (size_t i = 0; i < metrics->count; i++)
        values[i] = made == STATUS_OK ? metric(metrics->at[i], outcome) : (double)NAN;
    outcome_drop(outcome);
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

static Status make_rows(const SweepPlan *plan, const StudyTools *tools, SweepTable *table,
                        Problem *fault, Problem *problem) {
    const size_t metrics = plan->study->metrics.count;
    Stage stage = stage_of(tools->watch, check_share, 1 - check_share);
    for (size_t i = 0; i < plan->points; i++) {
        SweepStatus status;
        if (!stage_advance(&stage, (double)i / (double)plan->points))
            return problem_set(problem, STATUS_CANCELLED, "the sweep was stopped");
        // What a long point tells of itself is little of the whole.
        Stage part = stage_of(tools->watch,
                              check_share + (1 - check_share) * (double)i / (double)plan->points,
                              (1 - check_share) / (double)plan->points);
        const Watch watch = stage_watch(&part);
        Status made = sweep_run_point(plan, i, tools->limits, &watch, tools->workspace,
                                      &table->values.at[i * metrics], &status, fault);
        if (made == STATUS_OK && status != SWEEP_MADE) {
            table->failed++;
            made = sweep_add_failure(&table->failures, status, i, fault->detail);
        }
        if (made != STATUS_OK)
            return problem_set(problem, made, "point %zu: %s", i,
                               made == STATUS_NO_MEMORY ? "no memory" : fault->detail);
        table->points.at[i] = (double)i;
        table->statuses.at[i] = status;
    }
    return STATUS_OK;
}

Status sweep_run_all(const SweepStudy *study, const Simulation *simulation, const StudyTools *tools,
                     Sweep *answer, Problem *problem) {
    SweepPlan *plan;
    SweepTable *table = &answer->table;
    TRY(sweep_plan_new(study, simulation, tools->limits, &plan, problem));
    Stage stage = stage_of(tools->watch, 0, check_share);
    const Watch watch = stage_watch(&stage);
    Problem *fault = malloc(sizeof *fault);
    Status status = sweep_check(plan, false, tools->limits, &watch, problem);
    if (status == STATUS_OK)
        status = tell(study, plan, answer);
    if (status == STATUS_OK) {
        const size_t points = plan->points;
        table->failed = 0;
        table->points = (Reals){calloc(points, sizeof(double)), points};
        table->statuses = (Reals){calloc(points, sizeof(double)), points};
        table->values = (Reals){calloc(points * study->metrics.count, sizeof(double)),
                                points * study->metrics.count};
        if (fault == NULL || table->points.at == NULL || table->statuses.at == NULL ||
            table->values.at == NULL) {
            table->points.count = table->statuses.count = table->values.count = 0;
            status = problem_set(problem, STATUS_NO_MEMORY, "no memory for %zu points", points);
        }
    }
    if (status == STATUS_OK)
        status = make_rows(plan, tools, table, fault, problem);
    free(fault);
    sweep_plan_free(plan);
    return status;
}
