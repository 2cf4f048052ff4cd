// One member of the scene serves all runs: what a run changes begins at the scene's own numbers.
//
// Where the motion is chaotic a statistic of one run has no derivative that a step could find: the
// smaller the step, the larger the quotient of what the runs differ by anyway. Three steps, each
// half of the one before, tell it: where their quotients agree there is a slope.
#include "core/study/sensitivity_run.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "core/study/candidate_settings.h"
#include "core/study/contact_sensitivity.h"
#include "core/study/parameter_perturbation.h"
#include "core/study/statistics.h"
#include "core/study/study_run.h"
#include "core/study/uncertainty_bands.h"

// Quotients agree that differ by no more than this part of the largest, or by so little that
// nothing depends on the parameter.
static const double settled_part = 0.1, settled_min = 1e-3;

// What the study has at hand. Its members are the steps, parameter by parameter, down and up by
// each of them, and then the drawn runs.
typedef struct SensitivityWork {
    StudyWork work;
    const SensitivityStudy *study;
    const Simulation *simulation;
    Simulation member; // what each run changes a copy of
    bool has_force;
    Sensitivity *answer;
    Outcome *own;                          // the scene itself
    size_t *rows;                          // of the answer, those that are stepped by
    size_t steps;                          // members
    double (*values)[ENSEMBLE_STATISTICS]; // of each step
    EnsembleRuns runs;                     // drawn ones; "seed" is the run's number
    Status *statuses;                      // of those
    BandDensities densities;
} SensitivityWork;

// A member's run, and what was drawn for it.
typedef struct SensitivityPart {
    MemberPart run;
    Reals restitution, contact_time;
} SensitivityPart;

enum { SIDES = 2, ROW_STEPS = SIDES * SENSITIVITY_STEPS };

static Status no_memory(Problem *problem) {
    return problem_set(problem, STATUS_NO_MEMORY, "no memory for the study's answer");
}

static int parameter_of(const char *name) {
    int parameter = 0;
    while (strcmp(sensitivity_parameter_names[parameter], name) != 0)
        parameter++;
    return parameter;
}

uint64_t sensitivity_runs(const SensitivityStudy *study, const Simulation *simulation) {
    uint64_t count = 1 + study->runs;
    for (size_t i = 0; i < study->parameters.count; i++)
        if (change_refuse(simulation, parameter_of(study->parameters.at[i])) == NULL)
            count += ROW_STEPS;
    return count;
}

// How far a step goes: the study's own, and each half of the one before. Up it may be less.
static double step_of(const SensitivityWork *work, size_t step) {
    return ldexp(work->study->step, -(int)step);
}

static double step_up(const SensitivityWork *work, int parameter, size_t step) {
    return change_max(work->simulation, parameter, step_of(work, step));
}

// Sets the scene of one step.
static void take_step(const SensitivityWork *work, size_t index, Simulation *member) {
    const int parameter = work->answer->response.at[work->rows[index / ROW_STEPS]].parameter;
    const size_t step = index % ROW_STEPS / SIDES;
    const double factor =
        index % SIDES == 0 ? 1 - step_of(work, step) : 1 + step_up(work, parameter, step);
    change_apply(work->simulation, parameter, factor, member);
}

static void drop_run(void *made) {
    SensitivityPart *part = made;
    if (part == NULL)
        return;
    member_clear(&part->run);
    free(part->restitution.at);
    free(part->contact_time.at);
    free(part);
}

static Status make_run(const StudyWork *of, size_t index, const StudyTools *tools, void **made,
                       Problem *problem) {
    const SensitivityWork *work = (const SensitivityWork *)(const void *)of;
    const size_t buffers = change_buffers(work->simulation);
    SensitivityPart *part = calloc(1, sizeof *part);
    Simulation member;
    *made = part;
    if (part == NULL || !reals_make(&part->restitution, buffers) ||
        !reals_make(&part->contact_time, buffers))
        return no_memory(problem);
    Status status = fields_copy(simulation_fields, &work->member, &member);
    if (status != STATUS_OK)
        (void)no_memory(problem);
    else if (index < work->steps)
        take_step(work, index, &member);
    else
        change_draw(work->study, work->simulation, index - work->steps + 1, &member,
                    part->restitution.at, part->contact_time.at);
    if (status == STATUS_OK)
        status = member_run(&member, tools, &part->run, problem);
    simulation_clear(&member);
    return status;
}

// Relative change over relative change.
static double quotient(double low, double high, double value, double width) {
    if (value == 0)
        return low == high ? 0 : (double)NAN;
    return (high - low) / value / width;
}

static void settle(const double quotients[SENSITIVITY_STEPS], SensitivitySlope *slope) {
    double least = INFINITY, most = -INFINITY;
    slope->derivative = quotients[SENSITIVITY_STEPS / 2];
    for (int i = 0; i < SENSITIVITY_STEPS; i++) {
        if (isnan(quotients[i]))
            return;
        least = fmin(least, quotients[i]);
        most = fmax(most, quotients[i]);
    }
    slope->spread = most - least;
    slope->is_settled =
        slope->spread <= fmax(settled_part * fmax(fabs(least), fabs(most)), settled_min);
}

static void fold_step(SensitivityWork *work, size_t index, MemberPart *run) {
    char **why = &work->answer->response.at[work->rows[index / ROW_STEPS]].why;
    for (int metric = 0; metric < ENSEMBLE_STATISTICS; metric++)
        work->values[index][metric] =
            run->why == NULL ? statistics_value(&run->summary, metric) : (double)NAN;
    if (run->why == NULL)
        return;
    free(*why);
    *why = run->why;
    run->why = NULL;
}

static Status fold_draw(SensitivityWork *work, size_t index, SensitivityPart *part,
                        Problem *problem) {
    Sensitivity *answer = work->answer;
    SensitivityDraw *told = &answer->table.at[index];
    EnsembleRun *kept = &work->runs.at[index];
    *told = (SensitivityDraw){.run = index + 1,
                              .why = part->run.why,
                              .restitution = part->restitution,
                              .contact_time = part->contact_time,
                              .summary = part->run.summary};
    part->run.why = NULL;
    part->restitution = part->contact_time = (Reals){NULL, 0};
    answer->table.count++;
    *kept = (EnsembleRun){.seed = index + 1, .why = told->why, .summary = told->summary};
    work->runs.count++;
    work->statuses[index] = part->run.status;
    answer->made++;
    if (told->why != NULL) {
        answer->failed++;
        return STATUS_OK;
    }
    if (!work->has_force)
        kept->summary.peak_contact_force = (double)NAN; // of no statistic
    return band_keep(&work->densities, &part->run.spectrum, (size_t)work->study->runs, problem);
}

static Status fold_run(StudyWork *of, size_t index, void *made, Problem *problem) {
    SensitivityWork *work = (SensitivityWork *)(void *)of;
    SensitivityPart *part = made;
    if (part->run.why == NULL)
        work->answer->steps += part->run.steps;
    if (index >= work->steps)
        return fold_draw(work, index - work->steps, part, problem);
    fold_step(work, index, &part->run);
    return STATUS_OK;
}

static Status tell_row(const SensitivityWork *work, size_t index, Problem *problem) {
    SensitivityRow *row = &work->answer->response.at[work->rows[index]];
    const Summary *own = &work->own->summary;
    row->steps.at = calloc(SENSITIVITY_STEPS, sizeof(double));
    row->slopes.at = calloc(ENSEMBLE_STATISTICS, sizeof *row->slopes.at);
    if (row->steps.at == NULL || row->slopes.at == NULL)
        return no_memory(problem);
    for (size_t step = 0; step < SENSITIVITY_STEPS; step++)
        row->steps.at[row->steps.count++] = step_of(work, step);
    for (int metric = 0; metric < ENSEMBLE_STATISTICS; metric++) {
        double quotients[SENSITIVITY_STEPS];
        if (metric == ENSEMBLE_PEAK_CONTACT_FORCE && !work->has_force)
            continue;
        for (size_t step = 0; step < SENSITIVITY_STEPS; step++) {
            const size_t low = index * ROW_STEPS + step * SIDES;
            const double width = step_of(work, step) + step_up(work, row->parameter, step);
            quotients[step] = quotient(work->values[low][metric], work->values[low + 1][metric],
                                       statistics_value(own, metric), width);
        }
        SensitivitySlope *slope = &row->slopes.at[row->slopes.count++];
        *slope = (SensitivitySlope){metric, statistics_value(own, metric), (double)NAN, (double)NAN,
                                    false};
        settle(quotients, slope);
    }
    return STATUS_OK;
}

static Status end_runs(StudyWork *of, const StudyTools *tools, Problem *problem) {
    const SensitivityWork *work = (const SensitivityWork *)(const void *)of;
    for (size_t i = 0; i < work->steps / ROW_STEPS; i++)
        TRY(tell_row(work, i, problem));
    return work->study->runs == 0
               ? STATUS_OK
               : band_tell(&work->runs, work->statuses, &work->densities, work->own,
                           work->has_force, tools->progress, work->answer, problem);
}

static Status tell_own(const SensitivityWork *work, Problem *problem) {
    Sensitivity *answer = work->answer;
    const Outcome *own = work->own;
    const double horizon = own->summary.trust_horizon;
    char text[280];
    answer->summary = own->summary;
    answer->steps = own->steps;
    answer->is_chaotic = !isnan(horizon);
    if (answer->is_chaotic)
        snprintf(text, sizeof text,
                 "rounding alone parts the trajectory after %.4g s: beyond that a small step of a "
                 "parameter makes another trajectory, and slopes of its statistics need not "
                 "settle; the spread tells which do",
                 horizon);
    else
        snprintf(text, sizeof text,
                 "the trajectory is the scene's own to the end: slopes that do not settle belong "
                 "to what jumps, as numbers of impacts do, or to steps that are too large");
    answer->why = strdup(text);
    if (answer->why == NULL)
        return no_memory(problem);
    return sensitivity_contact(work->study, work->simulation, &own->plan.derived, &answer->contact,
                               problem);
}

// The answer's rows, and which of them there are steps for.
static Status lay_rows(SensitivityWork *work, Problem *problem) {
    const Texts *parameters = &work->study->parameters;
    SensitivityRows *rows = &work->answer->response;
    size_t stepped = 0;
    rows->at = calloc(parameters->count + 1, sizeof *rows->at);
    work->rows = calloc(parameters->count + 1, sizeof *work->rows);
    if (rows->at == NULL || work->rows == NULL)
        return no_memory(problem);
    for (size_t i = 0; i < parameters->count; i++) {
        SensitivityRow *row = &rows->at[rows->count++];
        row->parameter = parameter_of(parameters->at[i]);
        const char *refused = change_refuse(work->simulation, row->parameter);
        if (refused == NULL)
            work->rows[stepped++] = i;
        else if ((row->why = strdup(refused)) == NULL)
            return no_memory(problem);
    }
    work->steps = stepped * ROW_STEPS;
    work->values = calloc(work->steps + 1, sizeof *work->values);
    return work->values != NULL ? STATUS_OK : no_memory(problem);
}

static Status lay_table(SensitivityWork *work, Problem *problem) {
    const size_t runs = (size_t)work->study->runs;
    if (runs == 0)
        return STATUS_OK;
    work->answer->table.at = calloc(runs, sizeof *work->answer->table.at);
    work->runs.at = calloc(runs, sizeof *work->runs.at);
    work->statuses = calloc(runs, sizeof *work->statuses);
    return work->answer->table.at != NULL && work->runs.at != NULL && work->statuses != NULL
               ? STATUS_OK
               : no_memory(problem);
}

static Status begin_all(SensitivityWork *work, const StudyTools *tools, Problem *problem) {
    TRY(member_copy(work->simulation, &work->member, problem));
    TRY(member_settle(&work->member, problem));
    TRY(simulation_run(&work->member, tools->limits, tools->progress, tools->workspace, &work->own,
                       problem));
    TRY(tell_own(work, problem));
    TRY(lay_rows(work, problem));
    return lay_table(work, problem);
}

static void free_runs(StudyWork *of) {
    SensitivityWork *work = (SensitivityWork *)(void *)of;
    if (work == NULL)
        return;
    free(work->rows);
    free(work->values);
    free(work->runs.at); // their texts are the table's
    free(work->statuses);
    band_clear(&work->densities);
    outcome_unref(work->own);
    simulation_clear(&work->member);
    free(work);
}

static bool copy_spread(const SensitivityStudy *study, Sensitivity *answer) {
    static const Field rows[] = {
        FIELD_LIST(Sensitivity, spread, sensitivity_spread_fields, 0, PRESENCE_DEFAULT, NULL),
        FIELD_END};
    Sensitivity source = {.spread = study->spread}, copy; // of both that list alone
    const bool is_copied = fields_copy(rows, &source, &copy) == STATUS_OK;
    if (is_copied)
        answer->spread = copy.spread;
    return is_copied;
}

static Status begin_runs(const Study *asked, const Simulation *simulation, const StudyTools *tools,
                         Variant *told, StudyWork **made, Problem *problem) {
    const SensitivityStudy *study = (const SensitivityStudy *)(const void *)asked;
    Sensitivity *answer = (Sensitivity *)(void *)told;
    SensitivityWork *work = calloc(1, sizeof *work);
    answer->runs = study->runs;
    answer->seed = study->seed;
    answer->restitution_deviation = study->restitution_deviation;
    answer->contact_time_deviation = study->contact_time_deviation;
    answer->confidence = ENSEMBLE_INTERVAL;
    answer->distribution = strdup(
        study->spread.count == 0
            ? "log-normal factors of mean 1 and the stated relative deviation, each buffer's "
              "restitution and contact time for themselves; a restitution beyond 1 is drawn again"
            : "log-normal factors of mean 1 and the relative deviations of spread, each buffer's "
              "restitution and contact time for themselves, all rows of a table by one factor; a "
              "restitution beyond 1 is drawn again");
    if (work == NULL || answer->distribution == NULL || !copy_spread(study, answer)) {
        free(work);
        return no_memory(problem);
    }
    *work = (SensitivityWork){.study = study,
                              .simulation = simulation,
                              .has_force = ladder_has_force(simulation),
                              .answer = answer};
    const Status status = begin_all(work, tools, problem);
    if (status != STATUS_OK) {
        free_runs(&work->work);
        return status;
    }
    const size_t members = work->steps + (size_t)study->runs;
    const size_t densities =
        work->own->spectrum.densities.count * work->own->spectrum.densities.rows;
    work->work = (StudyWork){.kind = &study_sensitivity,
                             .members = members,
                             .wanted = members,
                             .expected = members,
                             .bytes = outcome_bytes(work->own) +
                                      sizeof(double) * densities * (size_t)study->runs,
                             .part_bytes = sizeof(SensitivityPart) + sizeof(double) * densities};
    *made = &work->work;
    return STATUS_OK;
}

const StudyMembers sensitivity_members = {
    .begin = begin_runs,
    .make = make_run,
    .fold = fold_run,
    .drop = drop_run,
    .end = end_runs,
    .free = free_runs,
};
