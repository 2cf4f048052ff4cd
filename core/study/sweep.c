// The tables of what is asked and answered, and what of it can be judged before anything runs: few
// points are judged all at once, of many the ends first and the rest when the sweep begins.
#include "core/study/sweep.h"

#include <stdlib.h>
#include <string.h>

#include "core/excitation/recorded_motion.h"
#include "core/study/sweep_run.h"
#include "core/study/sweep_validation.h"

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

static const Field told_fields[] = {
    FIELD_TEXT(SweepTold, pointer, 0, PRESENCE_OPTIONAL, 0, "what varies"),
    FIELD_TEXT(SweepTold, unit, 0, PRESENCE_OPTIONAL, 0, "of its numbers"),
    FIELD_TEXTS(SweepTold, values, NULL, NULL, 0, PRESENCE_OPTIONAL, FIELD_SCALARS, "all that it takes"),
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
    FIELD_LIST(Sweep, axes, told_fields, 0, PRESENCE_DEFAULT, "what varies, in the order of the changes"),
    FIELD_TEXTS(Sweep, metrics, NULL, NULL, 0, PRESENCE_OPTIONAL, 0, "what is kept of each point"),
    FIELD_ITEM_OR_NULL(Sweep, table, table_fields, PRESENCE_OPTIONAL, "the rows, where they are not kept beside the result"),
    FIELD_END
};
// clang-format on

static Status check_metrics(const SweepStudy *study, Problem *problem) {
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

static void fill_spacing(SweepAxes *axes) {
    for (size_t i = 0; i < axes->count; i++)
        if (axes->at[i].values.count == 0 && axes->at[i].spacing == CHOICE_ABSENT)
            axes->at[i].spacing = SWEEP_LINEAR;
}

static Status study_complete(Study *asked, const Simulation *simulation,
                             const SimulationLimits *limits, Problem *problem) {
    SweepStudy *study = (SweepStudy *)(void *)asked;
    fill_spacing(&study->axes);
    const Status metrics = check_metrics(study, problem);
    const Status status = sweep_judge(study, simulation, CHECKED_AT_ONCE, limits, problem);
    return status == STATUS_OK ? metrics : status;
}

static Status study_cost(const Study *asked, const Simulation *simulation,
                         const SimulationLimits *limits, double *steps, Problem *problem) {
    SweepPlan *plan;
    TRY(sweep_plan_new((const SweepStudy *)(const void *)asked, simulation, limits, &plan,
                       problem));
    *steps = sweep_steps(plan, limits);
    sweep_plan_free(plan);
    return STATUS_OK;
}

static const Kind sweep_answer = {"sweep", "what each point came to", answer_fields, sizeof(Sweep)};

const StudyKind study_sweep = {
    .kind = {"sweep", "the scene at many points: a grid or a list of values of its members",
             study_fields, sizeof(SweepStudy)},
    .answer = &sweep_answer,
    .lessen = "ask for fewer points, or a cheaper scene",
    .most_runs = most_runs,
    .complete = study_complete,
    .cost = study_cost,
    .members = &sweep_members,
};
