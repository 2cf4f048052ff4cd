// The tables of what is asked and answered, and what of it can be judged before anything runs: few
// points are judged all at once, of many the ends first and the rest when the sweep begins.
#include "core/study/sweep.h"

#include <inttypes.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "core/excitation/recorded_motion.h"
#include "core/study/sweep_grid.h"

// What the study has at hand.
typedef struct SweepWork {
    StudyWork work;
    SweepGrid *plan;
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

static char *sweep_scalar_text(const SweepStudy *study, const SweepGrid *plan, size_t axis,
                               size_t index) {
    const Texts *values = &study->axes.at[axis].values;
    if (values->count > 0)
        return strdup(values->at[index]);
    const Scalar *value = &plan->axes[axis].at[index];
    char digits[32];
    text_real(digits, value->number);
    return strdup(digits);
}

static Status sweep_fill_axis(const SweepStudy *study, const SweepGrid *plan, size_t axis,
                              SweepAxisValues *told) {
    const SweepValues *values = &plan->axes[axis];
    const char *unit = values->is_tag ? NULL : values->field->unit;
    told->pointer = strdup(values->pointer);
    told->unit = unit == NULL ? NULL : strdup(unit);
    told->values.at = calloc(values->count, sizeof *told->values.at);
    if (told->pointer == NULL || (told->unit == NULL && unit != NULL) || told->values.at == NULL)
        return STATUS_NO_MEMORY;
    for (size_t i = 0; i < values->count; i++) {
        char *text = sweep_scalar_text(study, plan, axis, i);
        if (text == NULL)
            return STATUS_NO_MEMORY;
        told->values.at[told->values.count++] = text;
    }
    return STATUS_OK;
}

static Status sweep_fill(const SweepStudy *study, const SweepGrid *plan, Sweep *sweep) {
    sweep->points = plan->points;
    sweep->mode = study->mode;
    sweep->axes.at = calloc(plan->axis_count, sizeof *sweep->axes.at);
    sweep->metrics.at = calloc(study->metrics.count, sizeof *sweep->metrics.at);
    if (sweep->axes.at == NULL || sweep->metrics.at == NULL)
        return STATUS_NO_MEMORY;
    for (size_t i = 0; i < plan->axis_count; i++) {
        sweep->axes.count = i + 1;
        TRY(sweep_fill_axis(study, plan, i, &sweep->axes.at[i]));
    }
    for (size_t i = 0; i < study->metrics.count; i++) {
        char *name = strdup(study->metrics.at[i]);
        if (name == NULL)
            return STATUS_NO_MEMORY;
        sweep->metrics.at[sweep->metrics.count++] = name;
    }
    return STATUS_OK;
}

Status sweep_describe(const SweepStudy *study, const Simulation *simulation, Sweep *sweep,
                      Problem *problem) {
    SweepGrid *plan;
    TRY(sweep_grid_new(study, simulation, NULL, &plan, problem));
    const Status status = sweep_fill(study, plan, sweep);
    sweep_grid_free(plan);
    return status == STATUS_OK ? status
                               : problem_set(problem, status, "no memory for the sweep's axes");
}

static double sweep_metric(const char *name, const Outcome *outcome) {
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

static SweepStatus sweep_status(Status status) {
    return status == STATUS_INVALID    ? SWEEP_INVALID
           : status == STATUS_UNSTABLE ? SWEEP_UNSTABLE
           : status == STATUS_LIMIT    ? SWEEP_LIMIT
                                       : SWEEP_FAILED;
}

static Status sweep_run_point(const SweepGrid *plan, size_t point, const SimulationLimits *limits,
                              const Progress *progress, Workspace *workspace, double *values,
                              SweepStatus *status, Problem *fault) {
    const Texts *metrics = &plan->study->metrics;
    Simulation scene;
    Outcome *outcome = NULL;
    problem_clear(fault);
    Status made = sweep_grid_scene(plan, point, true, limits, &scene, fault);
    if (made == STATUS_OK)
        made = simulation_run(&scene, limits, progress, workspace, &outcome, fault);
    simulation_clear(&scene);
    for (size_t i = 0; i < metrics->count; i++)
        values[i] = made == STATUS_OK ? sweep_metric(metrics->at[i], outcome) : (double)NAN;
    outcome_unref(outcome);
    *status = made == STATUS_OK ? SWEEP_MADE : sweep_status(made);
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

static Status sweep_make(const StudyWork *of, size_t point, const StudyTools *tools, void **made,
                         Problem *problem) {
    const SweepGrid *plan = ((const SweepWork *)(const void *)of)->plan;
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

static void sweep_drop(void *made) {
    SweepPart *part = made;
    if (part != NULL)
        free(part->why);
    free(part);
}

// Only where rows are kept here and nowhere else is there room for them.
static Status sweep_make_table(SweepTable *table, size_t points, size_t metrics, Problem *problem) {
    table->points.at = calloc(points, sizeof(double));
    table->statuses.at = calloc(points, sizeof(double));
    table->values.at = calloc(points * metrics, sizeof(double));
    table->failed = 0;
    return table->points.at != NULL && table->statuses.at != NULL && table->values.at != NULL
               ? STATUS_OK
               : problem_set(problem, STATUS_NO_MEMORY, "no memory for %zu points", points);
}

static Status sweep_fold(StudyWork *of, size_t point, void *made, Problem *problem) {
    SweepTable *table = &((SweepWork *)(void *)of)->answer->table;
    const size_t metrics = ((const SweepWork *)(const void *)of)->plan->study->metrics.count;
    const SweepPart *part = made;
    if (point == 0)
        TRY(sweep_make_table(table, of->members, metrics, problem));
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

static void sweep_free(StudyWork *of) {
    SweepWork *work = (SweepWork *)(void *)of;
    sweep_grid_free(work->plan);
    free(work);
}

static Status sweep_begin(const Study *asked, const Simulation *simulation, const StudyTools *tools,
                          Variant *told, StudyWork **made, Problem *problem) {
    const SweepStudy *study = (const SweepStudy *)(const void *)asked;
    SweepWork *work = calloc(1, sizeof *work);
    if (work == NULL)
        return problem_set(problem, STATUS_NO_MEMORY, "no memory for the sweep");
    work->answer = (Sweep *)(void *)told;
    Status status = sweep_grid_new(study, simulation, tools->limits, &work->plan, problem);
    if (status == STATUS_OK)
        status =
            sweep_grid_check_points(work->plan, SIZE_MAX, tools->limits, tools->progress, problem);
    if (status == STATUS_OK) {
        status = sweep_fill(study, work->plan, work->answer);
        if (status != STATUS_OK)
            (void)problem_set(problem, status, "no memory for the sweep's axes");
    }
    if (status != STATUS_OK) {
        sweep_free(&work->work);
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
    .begin = sweep_begin,
    .make = sweep_make,
    .fold = sweep_fold,
    .drop = sweep_drop,
    .free = sweep_free,
};

// Small scenes' points that are judged while whoever submits them waits: some 20 ms.
enum { CHECKED_AT_ONCE = 5000 };

static const double most_runs = 1000;

const char *const sweep_spacing_names[] = {"linear", "logarithmic", NULL};
const char *const sweep_mode_names[] = {"grid", "list", NULL};
const char *const sweep_status_names[] = {"made",   "invalid", "unstable", "limit",
                                          "failed", "pending", NULL};
const char *const sweep_metric_names[] = {
    "peak_displacement",
    "rms_displacement",
    "peak_acceleration",
    "rms_acceleration",
    "impacts",
    "peak_contact_force",
    "energy_residual",
    "error_estimate",
    "trust_horizon",
    "steps",
    NULL,
};
static const char *const usual_metrics[] = {
    "peak_displacement",
    "rms_displacement",
    "peak_acceleration",
    "rms_acceleration",
    "impacts",
    "peak_contact_force",
    NULL,
};

const char *sweep_metric_unit(const char *name) {
    const Field *row = fields_find(summary_fields, name, NULL);
    return row != NULL ? row->unit : NULL;
}

// clang-format off
static const Field axis_fields[] = {
    FIELD_TEXT(SweepAxis, pointer, 200, PRESENCE_REQUIRED, 0, "JSON Pointer to what varies in the scene, /dampers/0/clearance; a buffer's takes names of materials, /excitation/name names of records, a kind's name (/contact/model) makes it that kind"),
    FIELD_TEXTS(SweepAxis, values, NULL, NULL, SWEEP_AXIS_VALUES, PRESENCE_OPTIONAL, FIELD_SCALARS, "what it takes, one after the other; or a range"),
    FIELD_REAL(SweepAxis, from, NULL, ANY, OPTIONAL, "first number of a range"),
    FIELD_REAL(SweepAxis, to, NULL, ANY, OPTIONAL, "its last"),
    FIELD_COUNT(SweepAxis, count, NULL, WITHIN(2, SWEEP_AXIS_VALUES), OPTIONAL, "how many, both ends among them"),
    FIELD_CHOICE(SweepAxis, spacing, sweep_spacing_names, OPTIONAL, "of a range: by equal differences, or by equal ratios; linear if absent"),
    FIELD_END
};

const Field pinned_record_fields[] = {
    FIELD_TEXT(PinnedRecord, name, RECORD_NAME_SIZE - 1, PRESENCE_REQUIRED, 0, "of an uploaded record"),
    FIELD_TEXT(PinnedRecord, digest, RECORD_DIGEST_SIZE - 1, PRESENCE_OPTIONAL, 0, "SHA-256 of its interval and samples"),
    FIELD_SHARED(PinnedRecord, named),
    FIELD_END
};

static const Field study_fields[] = {
    FIELD_LIST(SweepStudy, axes, axis_fields, SWEEP_AXES, PRESENCE_REQUIRED, "what varies; changes are made in this order, and of a grid the last axis varies fastest"),
    FIELD_CHOICE(SweepStudy, mode, sweep_mode_names, SWEEP_GRID, "grid: every combination of the axes' values; list: their first values together, then their second, and so on"),
    FIELD_TEXTS(SweepStudy, metrics, sweep_metric_names, usual_metrics, SWEEP_METRICS, PRESENCE_DEFAULT, 0, "what is kept of each point: the summary's numbers, and steps, the solver's"),
    FIELD_LIST(SweepStudy, materials, buffer_fields, 0, PRESENCE_OPTIONAL, "numbers of the materials that the scene and the axes name, as they were when it was submitted; need not be given"),
    FIELD_LIST(SweepStudy, records, pinned_record_fields, 0, PRESENCE_OPTIONAL, "ground motions that the axes name, as they were when it was submitted; need not be given"),
    FIELD_END
};

static const Field axis_values_fields[] = {
    FIELD_TEXT(SweepAxisValues, pointer, 0, PRESENCE_OPTIONAL, 0, "what varies"),
    FIELD_TEXT(SweepAxisValues, unit, 0, PRESENCE_OPTIONAL, 0, "of its numbers"),
    FIELD_TEXTS(SweepAxisValues, values, NULL, NULL, 0, PRESENCE_OPTIONAL, FIELD_SCALARS, "all that it takes"),
    FIELD_END
};

static const Field failure_fields[] = {
    FIELD_CHOICE(SweepFailure, status, sweep_status_names, OPTIONAL, "in a word"),
    FIELD_COUNT(SweepFailure, count, NULL, AT_MIN(1), 0, "points that failed so"),
    FIELD_COUNT(SweepFailure, first_point, NULL, AT_MIN(0), OPTIONAL, "the first of them"),
    FIELD_TEXT(SweepFailure, detail, 0, PRESENCE_OPTIONAL, 0, "what that one said"),
    FIELD_END
};

static const Field table_fields[] = {
    FIELD_COUNT(SweepTable, failed, NULL, AT_MIN(0), OPTIONAL, "points that came to nothing"),
    FIELD_REALS(SweepTable, points, NULL, ANY, 0, PRESENCE_OPTIONAL, "numbers of the points that are there, from 0"),
    FIELD_REALS(SweepTable, statuses, NULL, ANY, 0, PRESENCE_OPTIONAL, "what became of each: 0 made"),
    FIELD_REALS(SweepTable, values, NULL, ANY, 0, PRESENCE_OPTIONAL, "the metrics of each"),
    FIELD_LIST(SweepTable, failures, failure_fields, 0, PRESENCE_OPTIONAL, "points that failed, by how"),
    FIELD_END
};

static const Field answer_fields[] = {
    FIELD_COUNT(Sweep, points, NULL, AT_MIN(1), OPTIONAL, "points asked for"),
    FIELD_CHOICE(Sweep, mode, sweep_mode_names, OPTIONAL, "how the axes go together"),
    FIELD_LIST(Sweep, axes, axis_values_fields, 0, PRESENCE_DEFAULT, "what varies, in the order of the changes"),
    FIELD_TEXTS(Sweep, metrics, NULL, NULL, 0, PRESENCE_OPTIONAL, 0, "what is kept of each point"),
    FIELD_ITEM_OR_NULL(Sweep, table, table_fields, PRESENCE_OPTIONAL, "the rows, where they are not kept beside the result"),
    FIELD_END
};
// clang-format on

static Status sweep_check_metrics(const SweepStudy *study, Problem *problem) {
    for (size_t i = 0; i < study->metrics.count; i++)
        for (size_t k = 0; k < i; k++)
            if (strcmp(study->metrics.at[i], study->metrics.at[k]) == 0) {
                char place[sizeof((Fault){0}.pointer)];
                pointer_index(place, sizeof place, "/study/metrics", i);
                return problem_add(problem, STATUS_INVALID, place, "stands there twice");
            }
    if (study->metrics.count == 0)
        return problem_add(problem, STATUS_INVALID, "/study/metrics",
                           "must have at least one: rows of a sweep keep nothing else");
    return STATUS_OK;
}

static void sweep_fill_spacing(SweepAxes *axes) {
    for (size_t i = 0; i < axes->count; i++)
        if (axes->at[i].values.count == 0 && axes->at[i].spacing == CHOICE_ABSENT)
            axes->at[i].spacing = SWEEP_LINEAR;
}

static Status sweep_complete(Study *asked, const Simulation *simulation,
                             const SimulationLimits *limits, Problem *problem) {
    SweepStudy *study = (SweepStudy *)(void *)asked;
    sweep_fill_spacing(&study->axes);
    const Status metrics = sweep_check_metrics(study, problem);
    const Status status = sweep_grid_validate(study, simulation, CHECKED_AT_ONCE, limits, problem);
    return status == STATUS_OK ? metrics : status;
}

static Status sweep_cost(const Study *asked, const Simulation *simulation,
                         const SimulationLimits *limits, double *steps, Problem *problem) {
    SweepGrid *plan;
    TRY(sweep_grid_new((const SweepStudy *)(const void *)asked, simulation, limits, &plan,
                       problem));
    *steps = sweep_grid_steps(plan, limits);
    sweep_grid_free(plan);
    return STATUS_OK;
}

static const Kind sweep_answer = {"sweep", "what each point came to", answer_fields, sizeof(Sweep)};

const StudyKind study_sweep = {
    .kind = {"sweep", "the scene at many points: a grid or a list of values of its members",
             study_fields, sizeof(SweepStudy)},
    .answer = &sweep_answer,
    .lessen = "ask for fewer points, or a cheaper scene",
    .most_runs = most_runs,
    .complete = sweep_complete,
    .cost = sweep_cost,
    .members = &sweep_members,
};
