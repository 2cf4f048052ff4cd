// k_b and c_b are in proportion to m_e, 1 / m_e = 1 / m + (M^-1)_jj: by the free mass they change
// by m_e / m, by all masses of the structure together by the rest. What a rig measured does not
// change with the scene's masses.
// One member of the scene serves all runs: what a run changes begins at the scene's own numbers.
//
// Where the motion is chaotic a statistic of one run has no derivative that a step could find: the
// smaller the step, the larger the quotient of what the runs differ by anyway. Three steps, each
// half of the one before, tell it: where their quotients agree there is a slope.
// The tables of what is asked and answered, and what of it can be judged before anything runs.
#include "core/study/sensitivity.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "core/contact/identification_sensitivity.h"
#include "core/study/parameter_perturbation.h"
#include "core/study/spectrum_accumulator.h"
#include "core/study/statistics.h"
#include "core/study/study_run.h"
#include "core/study/uncertainty_bands.h"

// Why there are no closed forms; NULL: there are.
static const char *contact_sensitivity_refuse(const ContactLaw *law, const Buffer *buffer) {
    if (law->form == CONTACT_IMPULSIVE)
        return "impulses have no stiffness and no damping";
    if (law->form == CONTACT_POWER)
        return "the stiffness of a power law is that of each approach speed";
    if (buffer->table.count > 0)
        return "the buffer is a table: its numbers are those of each approach speed";
    if (isnan(buffer->contact_time))
        return "stiffness and damping are given themselves";
    return NULL;
}

static SensitivityBuffer contact_sensitivity_buffer(const Damper *damper, Side side) {
    if (damper_buffer(damper, side) == &damper->buffer)
        return SENSITIVITY_BOTH;
    return side == SIDE_LEFT ? SENSITIVITY_LEFT : SENSITIVITY_RIGHT;
}

static void contact_sensitivity_fill(const SensitivityStudy *study, const Damper *damper,
                                     Separation separation, SensitivityStop *stop) {
    const Propagation by = propagate(stop->restitution, separation);
    const SensitivityBuffer place = contact_sensitivity_buffer(damper, (Side)stop->side);
    const size_t number = (size_t)stop->damper - 1;
    const double e = deviation_find(study, number, place, SENSITIVITY_RESTITUTION);
    const double T = deviation_find(study, number, place, SENSITIVITY_CONTACT_TIME);
    const bool is_rig = damper->identified_for == IDENTIFIED_FOR_RIG;
    stop->stiffness_by_restitution = by.stiffness_by_restitution;
    stop->stiffness_by_contact_time = by.stiffness_by_contact_time;
    stop->damping_by_restitution = by.damping_by_restitution;
    stop->damping_by_contact_time = by.damping_by_contact_time;
    stop->by_damper_mass = is_rig ? 0 : stop->effective_mass / damper->mass;
    stop->by_structure_mass = is_rig ? 0 : 1 - stop->effective_mass / damper->mass;
    if (e > 0 || T > 0) {
        stop->stiffness_deviation =
            hypot(by.stiffness_by_restitution * e, by.stiffness_by_contact_time * T);
        stop->damping_deviation =
            hypot(by.damping_by_restitution * e, by.damping_by_contact_time * T);
    }
}

static Status contact_sensitivity_report(const SensitivityStudy *study,
                                         const Simulation *simulation, const DerivedList *derived,
                                         SensitivityStops *stops, Problem *problem) {
    const Scene *scene = &simulation->scene;
    const ContactLaw *law = dampers_contact_law(&scene->dampers, scene_contact(scene));
    *stops = (SensitivityStops){calloc(derived->count + 1, sizeof *stops->at), 0};
    bool is_whole = stops->at != NULL;
    for (size_t i = 0; i < derived->count && is_whole; i++) {
        const Derived *from = &derived->at[i];
        const Damper *damper = &scene->dampers.at[from->damper - 1];
        const char *why = contact_sensitivity_refuse(law, damper_buffer(damper, (Side)from->side));
        const double none = (double)NAN;
        SensitivityStop *stop = &stops->at[stops->count++];
        *stop = (SensitivityStop){from->damper,
                                  from->side,
                                  from->restitution,
                                  from->contact_time,
                                  from->effective_mass,
                                  from->stiffness,
                                  from->damping,
                                  none,
                                  none,
                                  none,
                                  none,
                                  none,
                                  none,
                                  none,
                                  none,
                                  NULL};
        if (why == NULL)
            contact_sensitivity_fill(study, damper, (Separation)scene_contact(scene)->separation,
                                     stop);
        else
            is_whole = (stop->why = strdup(why)) != NULL;
    }
    return is_whole ? STATUS_OK
                    : problem_set(problem, STATUS_NO_MEMORY, "no memory for the study's answer");
}

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
    UncertaintyDensities densities;
} SensitivityWork;

// A member's run, and what was drawn for it.
typedef struct SensitivityPart {
    StudyPart run;
    Reals restitution, contact_time;
} SensitivityPart;

enum { SIDES = 2, ROW_STEPS = SIDES * SENSITIVITY_STEPS };

static Status sensitivity_no_memory(Problem *problem) {
    return problem_set(problem, STATUS_NO_MEMORY, "no memory for the study's answer");
}

static int sensitivity_parameter(const char *name) {
    int parameter = 0;
    while (strcmp(sensitivity_parameter_names[parameter], name) != 0)
        parameter++;
    return parameter;
}

static uint64_t sensitivity_runs(const SensitivityStudy *study, const Simulation *simulation) {
    uint64_t count = 1 + study->runs;
    for (size_t i = 0; i < study->parameters.count; i++)
        if (perturbation_refuse(simulation, sensitivity_parameter(study->parameters.at[i])) == NULL)
            count += ROW_STEPS;
    return count;
}

// How far a step goes: the study's own, and each half of the one before. Up it may be less.
static double sensitivity_step(const SensitivityWork *work, size_t step) {
    return ldexp(work->study->step, -(int)step);
}

static double sensitivity_step_up(const SensitivityWork *work, int parameter, size_t step) {
    return perturbation_max_step(work->simulation, parameter, sensitivity_step(work, step));
}

// Sets the scene of one step.
static void sensitivity_apply_step(const SensitivityWork *work, size_t index, Simulation *member) {
    const int parameter = work->answer->response.at[work->rows[index / ROW_STEPS]].parameter;
    const size_t step = index % ROW_STEPS / SIDES;
    const double factor = index % SIDES == 0 ? 1 - sensitivity_step(work, step)
                                             : 1 + sensitivity_step_up(work, parameter, step);
    perturbation_apply(work->simulation, parameter, factor, member);
}

static void sensitivity_drop(void *made) {
    SensitivityPart *part = made;
    if (part == NULL)
        return;
    study_run_clear(&part->run);
    free(part->restitution.at);
    free(part->contact_time.at);
    free(part);
}

static Status sensitivity_make(const StudyWork *of, size_t index, const StudyTools *tools,
                               void **made, Problem *problem) {
    const SensitivityWork *work = (const SensitivityWork *)(const void *)of;
    const size_t buffers = perturbation_buffers(work->simulation);
    SensitivityPart *part = calloc(1, sizeof *part);
    Simulation member;
    *made = part;
    if (part == NULL || !reals_make(&part->restitution, buffers) ||
        !reals_make(&part->contact_time, buffers))
        return sensitivity_no_memory(problem);
    Status status = fields_copy(simulation_fields, &work->member, &member);
    if (status != STATUS_OK)
        (void)sensitivity_no_memory(problem);
    else if (index < work->steps)
        sensitivity_apply_step(work, index, &member);
    else
        perturbation_draw(work->study, work->simulation, index - work->steps + 1, &member,
                          part->restitution.at, part->contact_time.at);
    if (status == STATUS_OK)
        status = study_run_make(&member, tools, &part->run, problem);
    simulation_clear(&member);
    return status;
}

// Relative change over relative change.
static double sensitivity_quotient(double low, double high, double value, double width) {
    if (value == 0)
        return low == high ? 0 : (double)NAN;
    return (high - low) / value / width;
}

static void sensitivity_fill_slope(const double quotients[SENSITIVITY_STEPS],
                                   SensitivitySlope *slope) {
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

static void sensitivity_fold_step(SensitivityWork *work, size_t index, StudyPart *run) {
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

static Status sensitivity_fold_draw(SensitivityWork *work, size_t index, SensitivityPart *part,
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
    return uncertainty_bands_add(&work->densities, &part->run.spectrum, (size_t)work->study->runs,
                                 problem);
}

static Status sensitivity_fold(StudyWork *of, size_t index, void *made, Problem *problem) {
    SensitivityWork *work = (SensitivityWork *)(void *)of;
    SensitivityPart *part = made;
    if (part->run.why == NULL)
        work->answer->steps += part->run.steps;
    if (index >= work->steps)
        return sensitivity_fold_draw(work, index - work->steps, part, problem);
    sensitivity_fold_step(work, index, &part->run);
    return STATUS_OK;
}

static Status sensitivity_fill_row(const SensitivityWork *work, size_t index, Problem *problem) {
    SensitivityRow *row = &work->answer->response.at[work->rows[index]];
    const Summary *own = &work->own->summary;
    row->steps.at = calloc(SENSITIVITY_STEPS, sizeof(double));
    row->slopes.at = calloc(ENSEMBLE_STATISTICS, sizeof *row->slopes.at);
    if (row->steps.at == NULL || row->slopes.at == NULL)
        return sensitivity_no_memory(problem);
    for (size_t step = 0; step < SENSITIVITY_STEPS; step++)
        row->steps.at[row->steps.count++] = sensitivity_step(work, step);
    for (int metric = 0; metric < ENSEMBLE_STATISTICS; metric++) {
        double quotients[SENSITIVITY_STEPS];
        if (metric == ENSEMBLE_PEAK_CONTACT_FORCE && !work->has_force)
            continue;
        for (size_t step = 0; step < SENSITIVITY_STEPS; step++) {
            const size_t low = index * ROW_STEPS + step * SIDES;
            const double width =
                sensitivity_step(work, step) + sensitivity_step_up(work, row->parameter, step);
            quotients[step] =
                sensitivity_quotient(work->values[low][metric], work->values[low + 1][metric],
                                     statistics_value(own, metric), width);
        }
        SensitivitySlope *slope = &row->slopes.at[row->slopes.count++];
        *slope = (SensitivitySlope){metric, statistics_value(own, metric), (double)NAN, (double)NAN,
                                    false};
        sensitivity_fill_slope(quotients, slope);
    }
    return STATUS_OK;
}

static Status sensitivity_end(StudyWork *of, const StudyTools *tools, Problem *problem) {
    const SensitivityWork *work = (const SensitivityWork *)(const void *)of;
    for (size_t i = 0; i < work->steps / ROW_STEPS; i++)
        TRY(sensitivity_fill_row(work, i, problem));
    return work->study->runs == 0
               ? STATUS_OK
               : uncertainty_bands_report(&work->runs, work->statuses, &work->densities, work->own,
                                          work->has_force, tools->progress, work->answer, problem);
}

static Status sensitivity_fill_scene(const SensitivityWork *work, Problem *problem) {
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
        return sensitivity_no_memory(problem);
    return contact_sensitivity_report(work->study, work->simulation, &own->plan.derived,
                                      &answer->contact, problem);
}

// The answer's rows, and which of them there are steps for.
static Status sensitivity_make_rows(SensitivityWork *work, Problem *problem) {
    const Texts *parameters = &work->study->parameters;
    SensitivityRows *rows = &work->answer->response;
    size_t stepped = 0;
    rows->at = calloc(parameters->count + 1, sizeof *rows->at);
    work->rows = calloc(parameters->count + 1, sizeof *work->rows);
    if (rows->at == NULL || work->rows == NULL)
        return sensitivity_no_memory(problem);
    for (size_t i = 0; i < parameters->count; i++) {
        SensitivityRow *row = &rows->at[rows->count++];
        row->parameter = sensitivity_parameter(parameters->at[i]);
        const char *refused = perturbation_refuse(work->simulation, row->parameter);
        if (refused == NULL)
            work->rows[stepped++] = i;
        else if ((row->why = strdup(refused)) == NULL)
            return sensitivity_no_memory(problem);
    }
    work->steps = stepped * ROW_STEPS;
    work->values = calloc(work->steps + 1, sizeof *work->values);
    return work->values != NULL ? STATUS_OK : sensitivity_no_memory(problem);
}

static Status sensitivity_make_table(SensitivityWork *work, Problem *problem) {
    const size_t runs = (size_t)work->study->runs;
    if (runs == 0)
        return STATUS_OK;
    work->answer->table.at = calloc(runs, sizeof *work->answer->table.at);
    work->runs.at = calloc(runs, sizeof *work->runs.at);
    work->statuses = calloc(runs, sizeof *work->statuses);
    return work->answer->table.at != NULL && work->runs.at != NULL && work->statuses != NULL
               ? STATUS_OK
               : sensitivity_no_memory(problem);
}

static Status sensitivity_run_scene(SensitivityWork *work, const StudyTools *tools,
                                    Problem *problem) {
    TRY(study_run_copy(work->simulation, &work->member, problem));
    TRY(study_run_fix_solver(&work->member, problem));
    TRY(simulation_run(&work->member, tools->limits, tools->progress, tools->workspace, &work->own,
                       problem));
    TRY(sensitivity_fill_scene(work, problem));
    TRY(sensitivity_make_rows(work, problem));
    return sensitivity_make_table(work, problem);
}

static void sensitivity_free(StudyWork *of) {
    SensitivityWork *work = (SensitivityWork *)(void *)of;
    if (work == NULL)
        return;
    free(work->rows);
    free(work->values);
    free(work->runs.at); // their texts are the table's
    free(work->statuses);
    uncertainty_bands_clear(&work->densities);
    outcome_unref(work->own);
    simulation_clear(&work->member);
    free(work);
}

static bool sensitivity_copy_spread(const SensitivityStudy *study, Sensitivity *answer) {
    static const Field rows[] = {
        FIELD_LIST(Sensitivity, spread, sensitivity_spread_fields, 0, PRESENCE_DEFAULT, NULL),
        FIELD_END};
    Sensitivity source = {.spread = study->spread}, copy; // of both that list alone
    const bool is_copied = fields_copy(rows, &source, &copy) == STATUS_OK;
    if (is_copied)
        answer->spread = copy.spread;
    return is_copied;
}

static Status sensitivity_begin(const Study *asked, const Simulation *simulation,
                                const StudyTools *tools, Variant *told, StudyWork **made,
                                Problem *problem) {
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
    if (work == NULL || answer->distribution == NULL || !sensitivity_copy_spread(study, answer)) {
        free(work);
        return sensitivity_no_memory(problem);
    }
    *work = (SensitivityWork){.study = study,
                              .simulation = simulation,
                              .has_force = study_run_has_force(simulation),
                              .answer = answer};
    const Status status = sensitivity_run_scene(work, tools, problem);
    if (status != STATUS_OK) {
        sensitivity_free(&work->work);
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

static const StudyMembers sensitivity_members = {
    .begin = sensitivity_begin,
    .make = sensitivity_make,
    .fold = sensitivity_fold,
    .drop = sensitivity_drop,
    .end = sensitivity_end,
    .free = sensitivity_free,
};

enum { RUNS = 2000, RUNS_USUAL = 200, SPREADS = 1000 };

// clang-format off
static const char *const buffer_names[] = {
    [SENSITIVITY_BOTH] = "buffer", [SENSITIVITY_LEFT] = "left_buffer", [SENSITIVITY_RIGHT] = "right_buffer", NULL};

const Field sensitivity_spread_fields[] = {
    FIELD_COUNT(SensitivitySpread, damper, NULL, AT_MIN(1), REQUIRED, "number of the damper, from 1"),
    FIELD_CHOICE(SensitivitySpread, buffer, buffer_names, 0, "which of its buffers"),
    FIELD_TEXT(SensitivitySpread, source, 160, PRESENCE_OPTIONAL, 0, "the material and revision that tells it"),
    FIELD_REAL(SensitivitySpread, restitution, NULL, WITHIN(0, 1), OPTIONAL, "relative standard deviation of its restitution; sure if absent"),
    FIELD_REAL(SensitivitySpread, contact_time, NULL, WITHIN(0, 1), OPTIONAL, "likewise of its contact time; of a table all rows are changed by one factor"),
    FIELD_END
};

static const Field study_fields[] = {
    FIELD_TEXTS(SensitivityStudy, parameters, sensitivity_parameter_names, NULL, SENSITIVITY_PARAMETERS, PRESENCE_OPTIONAL, 0, "by what the response is differentiated, of all dampers and sides at once; if absent by all of restitution, contact_time, stiffness, damping, mass (the free masses') and clearance that the scene has"),
    FIELD_REAL(SensitivityStudy, step, NULL, WITHIN(1e-6, 0.2), 0.01, "relative, of the central differences; half and a quarter of it are tried too"),
    FIELD_REAL(SensitivityStudy, restitution_deviation, NULL, WITHIN(0, 0.5), OPTIONAL, "relative standard deviation of every buffer's restitution, 0: it is sure; if absent that of spread"),
    FIELD_REAL(SensitivityStudy, contact_time_deviation, NULL, WITHIN(0, 0.5), OPTIONAL, "likewise of its contact time"),
    FIELD_LIST(SensitivityStudy, spread, sensitivity_spread_fields, SPREADS, PRESENCE_OPTIONAL, "buffer by buffer; if absent what the revisions of the buffers' materials tell of the deviations of restitution and contact_time, of a table the root mean square of its rows"),
    FIELD_COUNT(SensitivityStudy, runs, NULL, WITHIN(0, RUNS), OPTIONAL, "runs with restitution and contact time drawn; 200 if absent, none without a deviation"),
    FIELD_COUNT(SensitivityStudy, seed, NULL, WITHIN(0, 0x1p53 - 1), 1, "of the draws"),
    FIELD_END
};

static const Field stop_fields[] = {
    FIELD_COUNT(SensitivityStop, damper, NULL, AT_MIN(1), OPTIONAL, "number of the damper, from 1"),
    FIELD_CHOICE(SensitivityStop, side, side_names, OPTIONAL, "its stop"),
    FIELD_REAL(SensitivityStop, restitution, NULL, ANY, OPTIONAL, "e"),
    FIELD_REAL(SensitivityStop, contact_time, "s", ANY, OPTIONAL, "T_c"),
    FIELD_REAL(SensitivityStop, effective_mass, "kg", ANY, OPTIONAL, "m_e"),
    FIELD_REAL(SensitivityStop, stiffness, "N/m", ANY, OPTIONAL, "k_b"),
    FIELD_REAL(SensitivityStop, damping, "N s/m", ANY, OPTIONAL, "c_b"),
    FIELD_REAL(SensitivityStop, stiffness_by_restitution, NULL, ANY, OPTIONAL, "relative change of k_b over the relative error of e, in closed form"),
    FIELD_REAL(SensitivityStop, stiffness_by_contact_time, NULL, ANY, OPTIONAL, "over that of T_c"),
    FIELD_REAL(SensitivityStop, damping_by_restitution, NULL, ANY, OPTIONAL, "relative change of c_b over the relative error of e; unknown at e = 1, where there is no damping"),
    FIELD_REAL(SensitivityStop, damping_by_contact_time, NULL, ANY, OPTIONAL, "over that of T_c"),
    FIELD_REAL(SensitivityStop, by_damper_mass, NULL, ANY, OPTIONAL, "relative change of k_b and of c_b over that of the free mass; 0 where a rig's masses identify them"),
    FIELD_REAL(SensitivityStop, by_structure_mass, NULL, ANY, OPTIONAL, "over that of all masses of the structure together"),
    FIELD_REAL(SensitivityStop, stiffness_deviation, NULL, ANY, OPTIONAL, "relative standard deviation of k_b that follows of the stated ones, to first order"),
    FIELD_REAL(SensitivityStop, damping_deviation, NULL, ANY, OPTIONAL, "of c_b"),
    FIELD_TEXT(SensitivityStop, why, 0, PRESENCE_OPTIONAL, 0, "why there are no closed forms"),
    FIELD_END
};

static const Field slope_fields[] = {
    FIELD_CHOICE(SensitivitySlope, metric, ensemble_metric_names, OPTIONAL, "the summary's number of this name"),
    FIELD_REAL(SensitivitySlope, value, NULL, ANY, OPTIONAL, "of the scene itself"),
    FIELD_REAL(SensitivitySlope, derivative, NULL, ANY, OPTIONAL, "its relative change over the parameter's, by the central difference of the middle step"),
    FIELD_REAL(SensitivitySlope, spread, NULL, ANY, OPTIONAL, "the largest less the smallest of all steps' differences"),
    FIELD_FLAG(SensitivitySlope, is_settled, false, "the spread is at most a tenth of the largest, or 0.001: the steps agree. Where it is not, the number is no derivative"),
    FIELD_END
};

static const Field row_fields[] = {
    FIELD_CHOICE(SensitivityRow, parameter, sensitivity_parameter_names, OPTIONAL, "of all dampers and sides at once"),
    FIELD_REALS(SensitivityRow, steps, NULL, ANY, 0, PRESENCE_OPTIONAL, "relative, to either side; a restitution goes up no farther than to 1"),
    FIELD_LIST(SensitivityRow, slopes, slope_fields, 0, PRESENCE_DEFAULT, "statistic by statistic"),
    FIELD_TEXT(SensitivityRow, why, 0, PRESENCE_OPTIONAL, 0, "why there are none, or why a run of them failed"),
    FIELD_END
};

static const Field band_fields[] = {
    FIELD_CHOICE(SensitivityBand, metric, ensemble_metric_names, OPTIONAL, "the summary's number of this name"),
    FIELD_TEXT(SensitivityBand, unit, 0, PRESENCE_OPTIONAL, 0, "of all that follows"),
    FIELD_COUNT(SensitivityBand, count, NULL, AT_MIN(0), 0, "runs that know it"),
    FIELD_REAL(SensitivityBand, value, NULL, ANY, OPTIONAL, "of the scene itself"),
    FIELD_REAL(SensitivityBand, mean, NULL, ANY, OPTIONAL, "mean over the runs"),
    FIELD_REAL(SensitivityBand, standard_deviation, NULL, ANY, OPTIONAL, "of one run"),
    FIELD_REAL(SensitivityBand, low, NULL, ANY, OPTIONAL, "the interval of the mean begins here, by Student's t"),
    FIELD_REAL(SensitivityBand, high, NULL, ANY, OPTIONAL, "and ends here"),
    FIELD_REAL(SensitivityBand, minimum, NULL, ANY, OPTIONAL, "the smallest"),
    FIELD_REAL(SensitivityBand, q05, NULL, ANY, OPTIONAL, "5 % of the runs are below"),
    FIELD_REAL(SensitivityBand, median, NULL, ANY, OPTIONAL, "half of them are"),
    FIELD_REAL(SensitivityBand, q95, NULL, ANY, OPTIONAL, "95 % are"),
    FIELD_REAL(SensitivityBand, maximum, NULL, ANY, OPTIONAL, "the largest"),
    FIELD_END
};

static const Field failure_fields[] = {
    FIELD_TEXT(EnsembleFailure, reason, 0, PRESENCE_OPTIONAL, 0, "in a word"),
    FIELD_COUNT(EnsembleFailure, count, NULL, AT_MIN(1), 0, "runs that failed so"),
    {.name = "first_run", .kind = FIELD_KIND_COUNT, .offset = FIELD_AT(EnsembleFailure, first_seed, uint64_t), .range = AT_MIN(0), .presence = PRESENCE_OPTIONAL, .doc = "the first of them"},
    FIELD_TEXT(EnsembleFailure, detail, 0, PRESENCE_OPTIONAL, 0, "what that one said"),
    FIELD_END
};

static const Field spectrum_fields[] = {
    FIELD_TEXT(SensitivitySpectrum, channel, 0, PRESENCE_OPTIONAL, 0, "channel"),
    FIELD_TEXT(SensitivitySpectrum, unit, 0, PRESENCE_OPTIONAL, 0, "of the densities"),
    FIELD_REALS(SensitivitySpectrum, value, NULL, ANY, 0, PRESENCE_OPTIONAL, "of the scene itself"),
    FIELD_REALS(SensitivitySpectrum, mean, NULL, ANY, 0, PRESENCE_OPTIONAL, "mean of the runs' densities at each frequency"),
    FIELD_REALS(SensitivitySpectrum, q05, NULL, ANY, 0, PRESENCE_OPTIONAL, "5 % of the runs are below, at each frequency for itself"),
    FIELD_REALS(SensitivitySpectrum, median, NULL, ANY, 0, PRESENCE_OPTIONAL, "half of them are"),
    FIELD_REALS(SensitivitySpectrum, q95, NULL, ANY, 0, PRESENCE_OPTIONAL, "95 % are"),
    FIELD_END
};

static const Field draw_fields[] = {
    FIELD_COUNT(SensitivityDraw, run, NULL, AT_MIN(1), OPTIONAL, "its number; what is drawn follows of it and of the seed"),
    FIELD_TEXT(SensitivityDraw, why, 0, PRESENCE_OPTIONAL, 0, "it failed for this reason"),
    FIELD_REALS(SensitivityDraw, restitution, NULL, ANY, 0, PRESENCE_OPTIONAL, "each given buffer's is this times the scene's: damper by damper, that of both sides, left, right"),
    FIELD_REALS(SensitivityDraw, contact_time, NULL, ANY, 0, PRESENCE_OPTIONAL, "likewise"),
    FIELD_ITEM(SensitivityDraw, summary, summary_fields, NULL, PRESENCE_DEFAULT, "as of any run"),
    FIELD_END
};

static const Field answer_fields[] = {
    FIELD_ITEM(Sensitivity, summary, summary_fields, NULL, PRESENCE_DEFAULT, "of the scene itself"),
    FIELD_REAL(Sensitivity, steps, NULL, ANY, 0, "solver steps of all runs, counted"),
    FIELD_LIST(Sensitivity, contact, stop_fields, 0, PRESENCE_DEFAULT, "what errors do to k_b and c_b, stop by stop"),
    FIELD_LIST(Sensitivity, response, row_fields, 0, PRESENCE_DEFAULT, "what changes do to the response, parameter by parameter"),
    FIELD_FLAG(Sensitivity, is_chaotic, false, "the scene goes on beyond its trust horizon"),
    FIELD_TEXT(Sensitivity, why, 0, PRESENCE_OPTIONAL, 0, "what that means for the derivatives of the response"),
    FIELD_COUNT(Sensitivity, runs, NULL, AT_MIN(0), 0, "runs with restitution and contact time drawn, asked for"),
    FIELD_COUNT(Sensitivity, made, NULL, AT_MIN(0), 0, "of those, made"),
    FIELD_COUNT(Sensitivity, failed, NULL, AT_MIN(0), 0, "of those, failed; the others alone are counted in what follows"),
    FIELD_COUNT(Sensitivity, seed, NULL, AT_MIN(0), OPTIONAL, "of the draws"),
    FIELD_REAL(Sensitivity, restitution_deviation, NULL, ANY, OPTIONAL, "relative, stated for all buffers; where it is unknown that of spread was taken"),
    FIELD_REAL(Sensitivity, contact_time_deviation, NULL, ANY, OPTIONAL, "likewise"),
    FIELD_LIST(Sensitivity, spread, sensitivity_spread_fields, 0, PRESENCE_DEFAULT, "the deviations of each buffer, and whose they are"),
    FIELD_TEXT(Sensitivity, distribution, 0, PRESENCE_OPTIONAL, 0, "of the draws, in words"),
    FIELD_REAL(Sensitivity, confidence, NULL, ANY, OPTIONAL, "of the intervals of means"),
    FIELD_LIST(Sensitivity, statistics, band_fields, 0, PRESENCE_DEFAULT, "over the drawn runs"),
    FIELD_LIST(Sensitivity, failures, failure_fields, 0, PRESENCE_DEFAULT, "runs that failed, by their reason"),
    FIELD_REALS(Sensitivity, frequency, "Hz", ANY, 0, PRESENCE_OPTIONAL, "of the spectra"),
    FIELD_LIST(Sensitivity, spectra, spectrum_fields, 0, PRESENCE_DEFAULT, "the drawn runs' densities, channel by channel"),
    FIELD_LIST(Sensitivity, table, draw_fields, 0, PRESENCE_DEFAULT, "every drawn run"),
    FIELD_END
};
// clang-format on

static Status sensitivity_check_deviation(const Simulation *simulation, double deviation,
                                          int parameter, const char *pointer, Problem *problem) {
    const char *why = deviation > 0 ? perturbation_refuse(simulation, parameter) : NULL;
    return why == NULL ? STATUS_OK
                       : problem_add_real(problem, STATUS_INVALID, pointer, deviation, NULL,
                                          "must be left out: %s", why);
}

static Status sensitivity_check_runs(SensitivityStudy *study, const Simulation *simulation,
                                     Problem *problem) {
    const bool has_spread = deviations_exist(study);
    if (study->runs == COUNT_ABSENT)
        study->runs = has_spread ? RUNS_USUAL : 0;
    if (study->runs > 0 && !has_spread)
        return problem_add_real(problem, STATUS_INVALID, "/study/runs", (double)study->runs, NULL,
                                "must be 0 or left out without a spread to draw from: give "
                                "restitution_deviation or contact_time_deviation, or materials "
                                "whose revisions tell theirs");
    const SpectrumRequest *psd = &simulation->output.psd;
    if (psd->channels.count == 0 || study->runs == 0)
        return STATUS_OK;
    const double values = (double)psd->channels.count * ((double)(psd->segment / 2) + 1);
    if (values > STUDY_DENSITIES_MAX)
        return problem_add_real(problem, STATUS_INVALID, "/output/psd/segment",
                                (double)psd->segment, "samples",
                                "gives %.0f densities of all channels, the study takes at most "
                                "%d: ask for shorter segments or fewer channels",
                                values, STUDY_DENSITIES_MAX);
    if (values * (double)study->runs > UNCERTAINTY_DENSITIES_MAX)
        return problem_add_real(problem, STATUS_INVALID, "/study/runs", (double)study->runs, NULL,
                                "must be at most %.0f for spectra of %.0f densities, is %llu: ask "
                                "for fewer, or for shorter segments",
                                floor(UNCERTAINTY_DENSITIES_MAX / values), values,
                                (unsigned long long)study->runs);
    return STATUS_OK;
}

// Those that the scene has stand for themselves, so that equal studies have one form.
static Status sensitivity_fill_parameters(SensitivityStudy *study, const Simulation *simulation,
                                          Problem *problem) {
    if (study->parameters.count > 0)
        return STATUS_OK;
    study->parameters.at = calloc(SENSITIVITY_PARAMETERS, sizeof *study->parameters.at);
    bool is_whole = study->parameters.at != NULL;
    for (int i = 0; i < SENSITIVITY_PARAMETERS && is_whole; i++) {
        if (perturbation_refuse(simulation, i) != NULL)
            continue;
        char *name = strdup(sensitivity_parameter_names[i]);
        study->parameters.at[study->parameters.count] = name;
        study->parameters.count += name != NULL;
        is_whole = name != NULL;
    }
    return is_whole ? STATUS_OK : problem_set(problem, STATUS_NO_MEMORY, "no memory for the study");
}

static Status sensitivity_complete(Study *asked, const Simulation *simulation,
                                   const SimulationLimits *limits, Problem *problem) {
    (void)limits;
    SensitivityStudy *study = (SensitivityStudy *)(void *)asked;
    if (simulation->scene.dampers.count == 0)
        return problem_add(problem, STATUS_INVALID, "/study/kind",
                           "sensitivity is of a damper's numbers: the scene has no damper");
    TRY(deviations_complete(study, simulation, problem));
    const Status restitution = sensitivity_check_deviation(simulation, study->restitution_deviation,
                                                           SENSITIVITY_RESTITUTION,
                                                           "/study/restitution_deviation", problem);
    const Status contact_time = sensitivity_check_deviation(
        simulation, study->contact_time_deviation, SENSITIVITY_CONTACT_TIME,
        "/study/contact_time_deviation", problem);
    const Status runs = sensitivity_check_runs(study, simulation, problem);
    TRY(sensitivity_fill_parameters(study, simulation, problem));
    return restitution != STATUS_OK ? restitution : contact_time != STATUS_OK ? contact_time : runs;
}

static Status sensitivity_cost(const Study *asked, const Simulation *simulation,
                               const SimulationLimits *limits, double *steps, Problem *problem) {
    (void)limits;
    const SensitivityStudy *study = (const SensitivityStudy *)(const void *)asked;
    Simulation member = {0};
    Status status = study_run_copy(simulation, &member, problem);
    if (status == STATUS_OK)
        status = study_run_fix_solver(&member, problem);
    if (status == STATUS_OK)
        *steps = (double)sensitivity_runs(study, simulation) * simulation_cost(&member).steps;
    simulation_clear(&member);
    return status;
}

static const Kind sensitivity_answer = {"sensitivity", "what errors of a buffer's numbers do",
                                        answer_fields, sizeof(Sensitivity)};

const StudyKind study_sensitivity = {
    .kind = {"sensitivity",
             "what errors of restitution, contact time and masses do to k_b, c_b and the response",
             study_fields, sizeof(SensitivityStudy)},
    .answer = &sensitivity_answer,
    .lessen = "ask for fewer runs or parameters",
    .complete = sensitivity_complete,
    .cost = sensitivity_cost,
    .members = &sensitivity_members,
};
