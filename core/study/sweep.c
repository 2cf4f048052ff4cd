// The number of a point in a grid has the indices of its values as digits, the last axis the
// lowest:
//
//     index on axis a = (point / stride_a) mod count_a,  stride_a = product of the later counts
//
// In a list it is the index on every axis. The scene of a point is a copy of the sweep's with these
// values set, completed like any other.
//
// Few points are validated with the request, of many a sample first and the rest when the sweep
// begins. Beyond SWEEP_POINTS, at some 8 us each, the rest is validated as it is made: the row of a
// faulty point says so.
#include "core/study/sweep.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "core/base/json_pointer.h"
#include "core/excitation/recorded_motion.h"
#include "core/study/statistics.h"

enum {
    PLACE = sizeof((Fault){0}.pointer),
    VALIDATED_AT_ONCE = 5000, // points of a small scene, with the request: about 20 ms
    COST_SAMPLES = 64,
    COST_SCENES = 2000, // limit on their work
    AFFORDED_MIN = 16,
    TARGET_SCENES = 10000,
    VALUES_MAX = 1 << 21,
    RANGE_SAMPLES = 512,
};

const char *const sweep_mode_names[] = {"grid", "list", NULL};
const char *const sweep_status_names[] = {"made",   "invalid", "unstable", "limit",
                                          "failed", "pending", NULL};
// The metrics of a point: the summary's numbers in their order, then the solver's steps.
static const char *const sweep_metric_names[] = {
    STUDY_METRICS_SUMMARY(STUDY_METRIC_NAME) "energy_residual", "error_estimate", "trust_horizon",
    "steps", NULL};
static const char *const sweep_default_metrics[] = {STUDY_METRICS_USUAL(STUDY_METRIC_NAME) NULL};

const char *sweep_metric_unit(const char *name) {
    const Field *row = fields_find(summary_fields, name, NULL);
    return row != NULL ? row->unit : NULL;
}

// clang-format off
static const Field sweep_study_fields[] = {
    FIELD_LIST(SweepStudy, axes, study_axis_fields, STUDY_AXES, PRESENCE_REQUIRED, "members that vary; they are set in this order, and in a grid the last axis varies fastest"),
    FIELD_CHOICE(SweepStudy, mode, sweep_mode_names, SWEEP_GRID, "grid: every combination of the axes' values; list: their first values together, then their second, and so on"),
    FIELD_TEXTS(SweepStudy, metrics, sweep_metric_names, sweep_default_metrics, SWEEP_METRICS, PRESENCE_DEFAULT, 0, "metrics kept of each point: numbers of the summary, and steps, the solver's"),
    FIELD_BASE(SweepStudy, names, study_names_fields),
    FIELD_END
};

const Field sweep_axis_values_fields[] = {
    FIELD_TEXT(SweepAxisValues, pointer, 0, PRESENCE_OPTIONAL, 0, "JSON Pointer to the member that varies"),
    FIELD_TEXTS(SweepAxisValues, pointers, NULL, NULL, 0, PRESENCE_OPTIONAL, 0, "all of them, where several are tied"),
    FIELD_TEXT(SweepAxisValues, unit, 0, PRESENCE_OPTIONAL, 0, "of its numbers"),
    FIELD_TEXTS(SweepAxisValues, values, NULL, NULL, 0, PRESENCE_OPTIONAL, FIELD_SCALARS, "all its values"),
    FIELD_END
};

const Field sweep_failure_fields[] = {
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
    FIELD_ITEM_OR_NULL(Sweep, table, sweep_table_fields, PRESENCE_OPTIONAL, "the rows, unless they are stored next to the result"),
    FIELD_END
};
// clang-format on

// SIZE_MAX on overflow.
static size_t sweep_points(const SweepStudy *study) {
    size_t points = study->axes.count > 0;
    for (size_t i = 0; i < study->axes.count; i++) {
        const size_t length = study_axis_length(&study->axes.at[i]);
        if (study->mode == SWEEP_LIST && i > 0)
            continue; // all are as long as the first
        if (length > 0 && points > SIZE_MAX / length)
            return SIZE_MAX;
        points *= length;
    }
    return points;
}

void sweep_grid_free(SweepGrid *grid) {
    free(grid);
}

// Index of a point's value on an axis.
static size_t sweep_grid_index(const SweepGrid *grid, size_t axis, size_t point) {
    const SweepValues *values = &grid->axes[axis];
    return point / values->stride % values->count;
}

static StudyValue sweep_grid_value(const SweepGrid *grid, size_t axis, size_t point) {
    const SweepValues *values = &grid->axes[axis];
    if (values->field == NULL) // its pointer is faulty, which is reported already
        return (StudyValue){NULL, (double)NAN};
    return study_axis_value(values->axis, sweep_grid_index(grid, axis, point));
}

Status sweep_grid_scene(const SweepGrid *grid, size_t point, bool is_bare,
                        const SimulationLimits *limits, Simulation *target, Problem *problem) {
    StudyValue values[STUDY_AXES];
    for (size_t i = 0; i < grid->axis_count; i++)
        values[i] = sweep_grid_value(grid, i, point);
    return study_scene_make(grid->simulation, &grid->study->axes, values, &grid->study->names,
                            is_bare, limits, target, problem);
}

// Number of points, at least 16, whose scenes are as much work to complete as `scenes` scenes of
// one storey; SIZE_MAX for SIZE_MAX. Measured: 3 us with one storey, 0.1 ms with 40 and 0.7 ms with
// 100; a record's own samples are copied, those of a named one are not.
static size_t sweep_grid_affordable(const SweepGrid *grid, size_t scenes) {
    const Scene *scene = &grid->simulation->scene;
    const Excitation *excitation = scene_excitation(scene);
    const double n = (double)structure_storeys(scene_structure(scene));
    double cost = 1 + n / 4 + n * n / 64;
    if (excitation_kind(excitation) == &excitation_record)
        cost += 1e-3 * (double)((const ExcitationRecord *)(const void *)excitation)->samples.count;
    // An accuracy target is compared with a run of all modes, of up to 40 ms.
    if (simulation_has_target(grid->simulation) && n > 1)
        cost += TARGET_SCENES;
    if (scenes == SIZE_MAX)
        return SIZE_MAX;
    const size_t max = (size_t)((double)scenes / cost);
    return max > AFFORDED_MIN ? max : AFFORDED_MIN;
}

static Status sweep_grid_make(const void *of, size_t point, const SimulationLimits *limits,
                              Simulation *scene) {
    return sweep_grid_scene(of, point, true, limits, scene, NULL);
}

static Status sweep_grid_check_axes(const SweepStudy *study, Problem *problem) {
    const StudyAxes *axes = &study->axes;
    TRY(study_axes_check(axes, true, "/study/axes", problem));
    for (size_t i = 1; i < axes->count && study->mode == SWEEP_LIST; i++) {
        const size_t length = study_axis_length(&axes->at[i]),
                     first = study_axis_length(&axes->at[0]);
        if (length != first)
            return problem_add(problem, STATUS_INVALID, json_pointer_at("/study/axes", i).at,
                               "has %zu values, the first axis has %zu: in a list all must have "
                               "the same number",
                               length, first);
    }
    return STATUS_OK;
}

// The answer holds all values of the axes.
static Status sweep_grid_check_size(const SweepStudy *study, const SimulationLimits *limits,
                                    Problem *problem) {
    const size_t points = sweep_points(study);
    const size_t max = limits != NULL && limits->points > 0 ? limits->points : SWEEP_POINTS;
    size_t values = 0;
    for (size_t i = 0; i < study->axes.count; i++)
        values += study_axis_length(&study->axes.at[i]);
    if (limits != NULL && points > max)
        return problem_add(
            problem, STATUS_INVALID, "/study/axes",
            "are %.4g points, at most %zu are allowed: take fewer values%s", (double)points, max,
            study->axes.count > 1 && study->mode == SWEEP_GRID ? " or fewer axes, or mode list"
                                                               : "");
    if (values > VALUES_MAX)
        return problem_add(problem, STATUS_INVALID, "/study/axes",
                           "have %zu values in all, at most %d are allowed: take fewer", values,
                           VALUES_MAX);
    return STATUS_OK;
}

Status sweep_grid_new(const SweepStudy *study, const Simulation *simulation,
                      const SimulationLimits *limits, SweepGrid **made, Problem *problem) {
    *made = NULL;
    TRY(sweep_grid_check_axes(study, problem));
    TRY(sweep_grid_check_size(study, limits, problem));
    SweepGrid *grid = calloc(1, sizeof *grid + study->axes.count * sizeof *grid->axes);
    TRY(status_made(grid != NULL));
    grid->study = study;
    grid->simulation = simulation;
    grid->points = sweep_points(study);
    grid->axis_count = study->axes.count;
    size_t stride = 1;
    for (size_t i = grid->axis_count; i-- > 0;) {
        SweepValues *values = &grid->axes[i];
        values->axis = &study->axes.at[i];
        values->count = study_axis_length(&study->axes.at[i]);
        values->stride = study->mode == SWEEP_LIST ? 1 : stride;
        stride *= values->count;
    }
    *made = grid;
    const Field *rows[STUDY_AXES];
    bool are_tags[STUDY_AXES];
    const Status status =
        study_axes_find(&study->axes, simulation, "/study/axes", rows, are_tags, problem);
    for (size_t i = 0; i < grid->axis_count; i++) {
        grid->axes[i].field = status != STATUS_NO_MEMORY ? rows[i] : NULL;
        grid->axes[i].is_tag = status != STATUS_NO_MEMORY && are_tags[i];
    }
    return study_result(status, problem);
}

// Whether `pointer` is `above` or below it.
static bool sweep_grid_is_below(const char *pointer, const char *above) {
    const size_t length = strlen(above);
    return strncmp(pointer, above, length) == 0 &&
           (pointer[length] == '\0' || pointer[length] == '/');
}

// Adds a fault of a point's scene at its cause: the value of the last axis that sets its place or
// is part of it, else of the only axis, else all axes.
static void sweep_grid_add_fault(const SweepGrid *grid, size_t point, const Fault *fault,
                                 Problem *problem) {
    Fault own = *fault;
    size_t cause = grid->axis_count > 1 ? grid->axis_count : 0;
    for (size_t i = 0; i < grid->axis_count; i++)
        for (size_t k = 0; k < study_axis_pointer_count(grid->axes[i].axis); k++) {
            const char *pointer = study_axis_pointer(grid->axes[i].axis, k);
            if (sweep_grid_is_below(fault->pointer, pointer) ||
                sweep_grid_is_below(pointer, fault->pointer))
                cause = i;
        }
    if (cause == grid->axis_count)
        snprintf(own.pointer, PLACE, "/study/axes");
    else if (study_axis_is_range(grid->axes[cause].axis))
        snprintf(own.pointer, PLACE, "/study/axes/%zu", cause);
    else
        snprintf(own.pointer, PLACE, "/study/axes/%zu/values/%zu", cause,
                 sweep_grid_index(grid, cause, point));
    char detail[sizeof own.detail + PLACE + 64];
    snprintf(detail, sizeof detail, "point %zu, %s: %s", point, fault->pointer, fault->detail);
    text_fit(own.detail, sizeof own.detail, detail);
    problem_add_fault(problem, STATUS_INVALID, &own);
}

typedef struct Validation {
    const SweepGrid *grid;
    const SimulationLimits *limits;
    const Progress *progress;
    Problem *fault, *problem; // of a point, of all
    bool is_faulty;
} Validation;

// Makes the scene of a point.
static Status sweep_grid_validate_point(Validation *of, size_t point) {
    Simulation target;
    TRY(study_advance(of->progress, (double)point / (double)of->grid->points, of->problem));
    problem_clear(of->fault);
    const Status status = sweep_grid_scene(of->grid, point, true, of->limits, &target, of->fault);
    simulation_clear(&target);
    if (status == STATUS_OK)
        return status;
    if (status != STATUS_INVALID)
        return problem_set(of->problem, status, "%s", of->fault->detail);
    for (size_t i = 0; i < of->fault->count && i < PROBLEM_FAULTS; i++)
        sweep_grid_add_fault(of->grid, point, &of->fault->faults[i], of->problem);
    of->is_faulty = true;
    return STATUS_OK;
}

static Status sweep_grid_validate_sample(Validation *of, size_t max) {
    const SweepGrid *grid = of->grid;
    const bool is_list = grid->study->mode == SWEEP_LIST;
    const size_t axes = is_list ? 1 : grid->axis_count;
    const size_t share = max / axes > 2 ? max / axes : 2; // of each axis
    TRY(sweep_grid_validate_point(of, grid->points - 1));
    for (size_t i = 0; i < axes; i++) {
        const size_t count = grid->axes[i].count;
        const bool is_short = is_list || study_axis_is_range(grid->axes[i].axis);
        const size_t wanted = is_short && share > RANGE_SAMPLES ? RANGE_SAMPLES : share;
        const size_t samples = count < wanted ? count : wanted;
        // Both ends are among them.
        for (size_t k = i > 0; k < samples; k++) {
            const size_t index = samples == count ? k : k * (count - 1) / (samples - 1);
            TRY(sweep_grid_validate_point(of, index * grid->axes[i].stride));
        }
    }
    return STATUS_OK;
}

Status sweep_grid_validate(const SweepGrid *grid, size_t scenes, const SimulationLimits *limits,
                           const Progress *progress, Problem *problem) {
    Validation of = {grid, limits, progress, malloc(sizeof(Problem)), problem, false};
    Status status = STATUS_OK;
    TRY(status_made(of.fault != NULL));
    const size_t max = sweep_grid_affordable(grid, scenes);
    if (grid->points > max)
        status = sweep_grid_validate_sample(&of, max);
    else
        for (size_t i = 0; i < grid->points && status == STATUS_OK; i++)
            status = sweep_grid_validate_point(&of, i);
    free(of.fault);
    return status == STATUS_OK && of.is_faulty ? STATUS_INVALID : status;
}

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
        StudyAxis *axis = &study->axes.at[i];
        if (axis->values.count == 0 && axis->spacing == CHOICE_ABSENT)
            axis->spacing = STUDY_LINEAR;
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
                         const SimulationLimits *limits, double *steps) {
    SweepGrid *grid;
    Status status = sweep_grid_new(request, simulation, limits, &grid, NULL);
    if (status == STATUS_OK) {
        const size_t afforded = sweep_grid_affordable(grid, COST_SCENES);
        status =
            study_sample_cost(sweep_grid_make, grid, grid->points,
                              afforded < COST_SAMPLES ? afforded : COST_SAMPLES, limits, steps);
    }
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

static Status sweep_fill(const SweepGrid *grid, Sweep *sweep) {
    const Texts *metrics = &grid->study->metrics;
    sweep->points = grid->points;
    sweep->mode = grid->study->mode;
    for (size_t i = 0; i < grid->axis_count; i++) {
        const SweepValues *values = &grid->axes[i];
        SweepAxisValues *axis = list_append(&sweep->axes, sizeof *axis);
        TRY(status_made(axis != NULL));
        TRY(text_copy(study_axis_pointer(values->axis, 0), &axis->pointer));
        for (size_t k = 0; k < values->axis->pointers.count; k++)
            TRY(texts_append(&axis->pointers, values->axis->pointers.at[k]));
        TRY(text_copy(values->is_tag ? NULL : values->field->unit, &axis->unit));
        for (size_t k = 0; k < values->count; k++) {
            char digits[32];
            TRY(texts_append(&axis->values,
                             study_axis_is_range(values->axis)
                                 ? text_real(digits, study_axis_value(values->axis, k).number)
                                 : values->axis->values.at[k]));
        }
    }
    for (size_t i = 0; i < metrics->count; i++)
        TRY(texts_append(&sweep->metrics, metrics->at[i]));
    return STATUS_OK;
}

Status sweep_describe(const SweepStudy *study, const Simulation *simulation, Sweep *sweep,
                      Problem *problem) {
    SweepGrid *grid;
    Status status = sweep_grid_new(study, simulation, NULL, &grid, problem);
    if (status == STATUS_OK)
        status = sweep_fill(grid, sweep);
    sweep_grid_free(grid);
    return study_result(status, problem);
}

SweepStatus sweep_status(Status status) {
    return status == STATUS_OK         ? SWEEP_MADE
           : status == STATUS_INVALID  ? SWEEP_INVALID
           : status == STATUS_UNSTABLE ? SWEEP_UNSTABLE
           : status == STATUS_LIMIT    ? SWEEP_LIMIT
                                       : SWEEP_FAILED;
}

void sweep_values(const Texts *metrics, const RunRecord *run, double *values) {
    for (size_t i = 0; i < metrics->count; i++)
        values[i] = strcmp(metrics->at[i], "steps") == 0
                        ? run->steps
                        : study_summary_value(&run->summary, metrics->at[i]);
}

static void sweep_references(void *request, StudyReferences *references) {
    SweepStudy *study = request;
    *references = (StudyReferences){
        .axes = &study->axes, .axes_place = "/study/axes", .names = &study->names};
}

typedef struct SweepWork {
    StudyWork work;
    SweepGrid *grid;
    Sweep *answer;
} SweepWork;

static Status sweep_scene(const void *of, size_t member, Simulation *scene, StudyPart *part,
                          Problem *problem) {
    const SweepWork *work = of;
    (void)part;
    return sweep_grid_scene(work->grid, member, true, work->work.limits, scene, problem);
}

static Status sweep_fold(void *of, size_t member, StudyPart *part) {
    SweepWork *work = of;
    const Texts *metrics = &work->grid->study->metrics;
    const RunRecord *run = &part->run;
    const SweepStatus status = sweep_status(run->status);
    SweepTable *table = &work->answer->table;
    double values[SWEEP_METRICS];
    sweep_values(metrics, run, values);
    TRY(study_add_real((double)member, &table->points));
    TRY(study_add_real(status, &table->statuses));
    for (size_t i = 0; i < metrics->count; i++)
        TRY(study_add_real(values[i], &table->values));
    if (member == 0)
        table->failed = 0;
    if (status == SWEEP_MADE)
        return STATUS_OK;
    table->failed++;
    return study_failures_add(&table->failures, (int)status, NULL, member, run->why);
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
    if (!tools->is_validated && work->grid->points <= SWEEP_POINTS)
        TRY(sweep_grid_validate(work->grid, SIZE_MAX, tools->limits, tools->progress, problem));
    work->work.members = work->grid->points;
    work->work.part_bytes = sizeof(StudyPart);
    return sweep_fill(work->grid, work->answer);
}

const StudyKind study_sweep = {
    .kind = {"sweep", "the scene at many points: a grid or a list of values of its members",
             sweep_study_fields, sizeof(SweepStudy)},
    .answer = &(const Kind){"sweep", "result of each point", sweep_answer_fields, sizeof(Sweep)},
    .shorten = "ask for fewer points, or a cheaper scene",
    .document = "table",
    .references = sweep_references,
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
