// Few points are validated with the request, of many a sample first and the rest when the sweep
// begins.
#include "core/study/sweep.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "core/base/json_pointer.h"
#include "core/excitation/recorded_motion.h"

// Points of a small scene that are validated with the request: about 20 ms.
enum { VALIDATED_AT_ONCE = 5000 };

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
static const char *const sweep_default_metrics[] = {
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
static const Field sweep_axis_fields[] = {
    FIELD_TEXT(SweepAxis, pointer, 200, PRESENCE_REQUIRED, 0, "JSON Pointer to the member that varies, such as /dampers/0/clearance; values of a buffer are names of materials, of /excitation/name names of records, of a kind's name (/contact/model) kinds"),
    FIELD_TEXTS(SweepAxis, values, NULL, NULL, SWEEP_AXIS_VALUES, PRESENCE_OPTIONAL, FIELD_SCALARS, "its values in this order; or give a range"),
    FIELD_REAL(SweepAxis, from, NULL, ANY, OPTIONAL, "first value of a range"),
    FIELD_REAL(SweepAxis, to, NULL, ANY, OPTIONAL, "last number of a range"),
    FIELD_COUNT(SweepAxis, count, NULL, WITHIN(2, SWEEP_AXIS_VALUES), OPTIONAL, "number of values, both ends included"),
    FIELD_CHOICE(SweepAxis, spacing, sweep_spacing_names, OPTIONAL, "spacing of a range: equal differences or equal ratios; linear if absent"),
    FIELD_END
};

const Field pinned_record_fields[] = {
    FIELD_TEXT(PinnedRecord, name, RECORD_NAME_SIZE - 1, PRESENCE_REQUIRED, 0, "of an uploaded record"),
    FIELD_TEXT(PinnedRecord, digest, RECORD_DIGEST_SIZE - 1, PRESENCE_OPTIONAL, 0, "SHA-256 of its interval and samples"),
    FIELD_REFCOUNT(PinnedRecord, named),
    FIELD_END
};

static const Field sweep_study_fields[] = {
    FIELD_LIST(SweepStudy, axes, sweep_axis_fields, SWEEP_AXES, PRESENCE_REQUIRED, "members that vary; they are set in this order, and in a grid the last axis varies fastest"),
    FIELD_CHOICE(SweepStudy, mode, sweep_mode_names, SWEEP_GRID, "grid: every combination of the axes' values; list: their first values together, then their second, and so on"),
    FIELD_TEXTS(SweepStudy, metrics, sweep_metric_names, sweep_default_metrics, SWEEP_METRICS, PRESENCE_DEFAULT, 0, "metrics kept of each point: numbers of the summary, and steps, the solver's"),
    FIELD_LIST(SweepStudy, materials, buffer_fields, 0, PRESENCE_OPTIONAL, "numbers of the materials that the scene and the axes name, at submission; filled in if absent"),
    FIELD_LIST(SweepStudy, records, pinned_record_fields, 0, PRESENCE_OPTIONAL, "ground motions that the axes name, at submission; filled in if absent"),
    FIELD_END
};

static const Field sweep_axis_values_fields[] = {
    FIELD_TEXT(SweepAxisValues, pointer, 0, PRESENCE_OPTIONAL, 0, "JSON Pointer to the member that varies"),
    FIELD_TEXT(SweepAxisValues, unit, 0, PRESENCE_OPTIONAL, 0, "of its numbers"),
    FIELD_TEXTS(SweepAxisValues, values, NULL, NULL, 0, PRESENCE_OPTIONAL, FIELD_SCALARS, "all its values"),
    FIELD_END
};

static const Field sweep_failure_fields[] = {
    FIELD_CHOICE(StudyFailure, status, sweep_status_names, OPTIONAL, "reason"),
    FIELD_COUNT(StudyFailure, count, NULL, AT_MIN(1), 0, "points that failed for this reason"),
    {.name = "first_point", .kind = FIELD_KIND_COUNT, .offset = FIELD_AT(StudyFailure, first, uint64_t), .range = AT_MIN(0), .presence = PRESENCE_OPTIONAL, .doc = "the first of them"},
    FIELD_TEXT(StudyFailure, detail, 0, PRESENCE_OPTIONAL, 0, "reason of the first of them"),
    FIELD_END
};

static const Field sweep_table_fields[] = {
    FIELD_COUNT(SweepTable, failed, NULL, AT_MIN(0), OPTIONAL, "points that failed"),
    FIELD_REALS(SweepTable, points, NULL, ANY, 0, PRESENCE_OPTIONAL, "numbers of the points made, from 0"),
    FIELD_REALS(SweepTable, statuses, NULL, ANY, 0, PRESENCE_OPTIONAL, "status of each: 0 is made"),
    FIELD_REALS(SweepTable, values, NULL, ANY, 0, PRESENCE_OPTIONAL, "metrics, row by row"),
    FIELD_LIST(SweepTable, failures, sweep_failure_fields, 0, PRESENCE_OPTIONAL, "failed points by their reason"),
    FIELD_END
};

static const Field sweep_answer_fields[] = {
    FIELD_COUNT(Sweep, points, NULL, AT_MIN(1), OPTIONAL, "points requested"),
    FIELD_CHOICE(Sweep, mode, sweep_mode_names, OPTIONAL, "combination of the axes"),
    FIELD_LIST(Sweep, axes, sweep_axis_values_fields, 0, PRESENCE_DEFAULT, "members that vary, in the order in which they are set"),
    FIELD_TEXTS(Sweep, metrics, NULL, NULL, 0, PRESENCE_OPTIONAL, 0, "metrics kept of each point"),
    FIELD_ITEM_OR_NULL(Sweep, table, sweep_table_fields, PRESENCE_OPTIONAL, "the rows, unless they are stored beside the result"),
    FIELD_END
};
// clang-format on

static Status sweep_check_metrics(const SweepStudy *study, Problem *problem) {
    for (size_t i = 0; i < study->metrics.count; i++)
        for (size_t k = 0; k < i; k++)
            if (strcmp(study->metrics.at[i], study->metrics.at[k]) == 0) {
                char place[sizeof((Fault){0}.pointer)];
                json_pointer_index(place, sizeof place, "/study/metrics", i);
                return problem_add(problem, STATUS_INVALID, place, "is listed twice");
            }
    if (study->metrics.count == 0)
        return problem_add(problem, STATUS_INVALID, "/study/metrics",
                           "must have at least one: a row of a sweep holds nothing else");
    return STATUS_OK;
}

static Status sweep_complete(void *request, const Simulation *simulation,
                             const SimulationLimits *limits, Problem *problem) {
    SweepStudy *study = request;
    SweepGrid *grid;
    for (size_t i = 0; i < study->axes.count; i++) {
        SweepAxis *axis = &study->axes.at[i];
        if (axis->values.count == 0 && axis->spacing == CHOICE_ABSENT)
            axis->spacing = SWEEP_LINEAR;
    }
    const Status metrics = sweep_check_metrics(study, problem);
    Status status = sweep_grid_new(study, simulation, limits, &grid, problem);
    // Without limits the points were validated before.
    if (grid != NULL && limits != NULL) {
        const Status points = sweep_grid_validate(grid, VALIDATED_AT_ONCE, limits, NULL, problem);
        status = status == STATUS_OK ? points : status;
    }
    sweep_grid_free(grid);
    return status == STATUS_OK ? metrics : status;
}

static Status sweep_cost(const void *request, const Simulation *simulation,
                         const SimulationLimits *limits, double *steps, Problem *problem) {
    SweepGrid *grid;
    const Status status = sweep_grid_new(request, simulation, limits, &grid, problem);
    if (status == STATUS_OK)
        *steps = sweep_grid_steps(grid, limits);
    sweep_grid_free(grid);
    return status;
}

size_t sweep_value_index(const Sweep *sweep, size_t axis, size_t point) {
    size_t stride = 1;
    if (sweep->mode == SWEEP_LIST)
        return point;
    for (size_t i = axis + 1; i < sweep->axes.count; i++)
        stride *= sweep->axes.at[i].values.count;
    return point / stride % sweep->axes.at[axis].values.count;
}

static Status sweep_fill_axis(const Texts *texts, const SweepValues *values, SweepAxisValues *axis,
                              Problem *problem) {
    TRY(study_copy_text(values->pointer, &axis->pointer, problem));
    TRY(study_copy_text(values->is_tag ? NULL : values->field->unit, &axis->unit, problem));
    axis->values.at = calloc(values->count, sizeof *axis->values.at);
    if (axis->values.at == NULL)
        return study_no_memory(problem);
    for (size_t i = 0; i < values->count; i++) {
        char digits[32];
        const char *text =
            texts->count > 0 ? texts->at[i] : text_real(digits, values->at[i].number);
        TRY(study_copy_text(text, &axis->values.at[i], problem));
        axis->values.count++;
    }
    return STATUS_OK;
}

static Status sweep_fill(const SweepGrid *grid, Sweep *sweep, Problem *problem) {
    const SweepStudy *study = grid->study;
    sweep->points = grid->points;
    sweep->mode = study->mode;
    sweep->axes.at = calloc(grid->axis_count, sizeof *sweep->axes.at);
    if (sweep->axes.at == NULL)
        return study_no_memory(problem);
    for (size_t i = 0; i < grid->axis_count; i++) {
        sweep->axes.count = i + 1;
        TRY(sweep_fill_axis(&study->axes.at[i].values, &grid->axes[i], &sweep->axes.at[i],
                            problem));
    }
    for (size_t i = 0; i < study->metrics.count; i++)
        TRY(study_add_text(study->metrics.at[i], &sweep->metrics, problem));
    return STATUS_OK;
}

Status sweep_describe(const SweepStudy *study, const Simulation *simulation, Sweep *sweep,
                      Problem *problem) {
    SweepGrid *grid;
    Status status = sweep_grid_new(study, simulation, NULL, &grid, problem);
    if (status == STATUS_OK)
        status = sweep_fill(grid, sweep, problem);
    sweep_grid_free(grid);
    return status;
}

SweepStatus sweep_status(Status status) {
    return status == STATUS_OK         ? SWEEP_MADE
           : status == STATUS_INVALID  ? SWEEP_INVALID
           : status == STATUS_UNSTABLE ? SWEEP_UNSTABLE
           : status == STATUS_LIMIT    ? SWEEP_LIMIT
                                       : SWEEP_FAILED;
}

void sweep_values(const Texts *metrics, const RunRecord *run, double *values) {
    for (size_t i = 0; i < metrics->count; i++) {
        size_t offset = 0;
        const Field *row = fields_find(summary_fields, metrics->at[i], &offset);
        if (row == NULL) {
            values[i] = run->steps;
            continue;
        }
        const void *member = (const char *)&run->summary + offset + row->offset;
        const uint64_t count = row->kind == FIELD_KIND_COUNT ? *(const uint64_t *)member : 0;
        values[i] = row->kind != FIELD_KIND_COUNT ? *(const double *)member
                    : count == COUNT_ABSENT       ? (double)NAN
                                                  : (double)count;
    }
}

typedef struct SweepWork {
    StudyWork work;
    SweepGrid *grid;
    Sweep *answer;
} SweepWork;

static Status sweep_scene(const void *of, size_t member, Simulation *scene, void *part,
                          Problem *problem) {
    const SweepWork *work = of;
    (void)part;
    return sweep_grid_scene(work->grid, member, true, work->work.limits, scene, problem);
}

// Memory for the rows is needed only here: an executor that stores rows does not fold them.
static Status sweep_make_table(SweepTable *table, size_t points, size_t metrics, Problem *problem) {
    table->points.at = calloc(points, sizeof(double));
    table->statuses.at = calloc(points, sizeof(double));
    table->values.at = calloc(points * metrics, sizeof(double));
    table->failed = 0;
    return table->points.at != NULL && table->statuses.at != NULL && table->values.at != NULL
               ? STATUS_OK
               : study_no_memory(problem);
}

static Status sweep_fold(void *of, size_t member, void *made, Problem *problem) {
    SweepWork *work = of;
    const Texts *metrics = &work->grid->study->metrics;
    const StudyPart *part = made;
    const RunRecord *run = &part->run;
    SweepTable *table = &work->answer->table;
    if (member == 0)
        TRY(sweep_make_table(table, work->work.members, metrics->count, problem));
    const SweepStatus status = sweep_status(run->status);
    table->points.at[table->points.count++] = (double)member;
    table->statuses.at[table->statuses.count++] = status;
    sweep_values(metrics, run, &table->values.at[table->values.count]);
    table->values.count += metrics->count;
    if (status == SWEEP_MADE)
        return STATUS_OK;
    table->failed++;
    return study_failures_add(&table->failures, (int)status, NULL, member, run->why, problem);
}

static void sweep_free(void *of) {
    SweepWork *work = of;
    sweep_grid_free(work->grid);
}

static Status sweep_begin(void *of, const StudyTools *tools, Problem *problem) {
    SweepWork *work = of;
    work->answer = work->work.answer;
    TRY(sweep_grid_new(work->work.study, work->work.simulation, tools->limits, &work->grid,
                       problem));
    TRY(sweep_grid_validate(work->grid, SIZE_MAX, tools->limits, tools->progress, problem));
    work->work.members = work->grid->points;
    work->work.part_bytes = sizeof(StudyPart);
    return sweep_fill(work->grid, work->answer, problem);
}

static const Kind sweep_answer = {"sweep", "result of each point", sweep_answer_fields,
                                  sizeof(Sweep)};

const StudyKind study_sweep = {
    .kind = {"sweep", "the scene at many points: a grid or a list of values of its members",
             sweep_study_fields, sizeof(SweepStudy)},
    .answer = &sweep_answer,
    .shorten = "ask for fewer points, or a cheaper scene",
    .max_runs = 1000,
    .complete = sweep_complete,
    .cost = sweep_cost,
    .work_size = sizeof(SweepWork),
    .part_size = sizeof(StudyPart),
    .begin = sweep_begin,
    .scene = sweep_scene,
    .fold = sweep_fold,
    .free = sweep_free,
};
