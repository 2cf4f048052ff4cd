// One member of the scene serves all runs: what a run changes begins at the scene's own numbers.
//
// Where the motion is chaotic a statistic of one run has no derivative that a step could find: the
// smaller the step, the larger the quotient of what the runs differ by anyway. Three steps, each
// half of the one before, tell it: where their quotients agree there is a slope.
#include "core/study/sensitivity_run.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "core/study/ensemble_statistics.h"
#include "core/study/member.h"
#include "core/study/sensitivity_band.h"
#include "core/study/sensitivity_change.h"
#include "core/study/sensitivity_contact.h"
#include "core/study/tradeoff_ladder.h"

// Quotients agree that differ by no more than this part of the largest, or by so little that
// nothing depends on the parameter.
static const double settled_part = 0.1, settled_least = 1e-3;

// What a study has at hand while it runs.
typedef struct Session {
    const SensitivityStudy *study;
    const Simulation *simulation;
    const StudyTools *tools;
    Simulation member;
    Sensitivity *answer;
    Outcome *own;      // the scene itself
    double done, all;  // runs
    EnsembleRuns runs; // drawn ones; "seed" is the run's number
    Status *statuses;  // of those
    BandDensities densities;
    Problem *fault; // of a run
} Session;

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
            count += 2 * SENSITIVITY_STEPS;
    return count;
}

// Runs the member as it stands.
static Status run(Session *session, Outcome **outcome) {
    const StudyTools *tools = session->tools;
    Stage stage = stage_of(tools->watch, session->done / session->all, 1 / session->all);
    const Watch watch = stage_watch(&stage);
    problem_clear(session->fault);
    *outcome = NULL;
    if (!watch_advance(tools->watch, session->done / session->all))
        return problem_set(session->fault, STATUS_CANCELLED, "the study was stopped");
    const Status status = simulation_run(&session->member, tools->limits, &watch, tools->workspace,
                                         outcome, session->fault);
    session->done++;
    if (status == STATUS_OK)
        session->answer->steps += (*outcome)->steps;
    return status;
}

// STATUS_OK where the study goes on without this run, whose reason *why is then.
static Status forgive(const Session *session, Status status, char **why, Problem *problem) {
    if (member_ends_all(status))
        return problem_set(problem, status, "%s", session->fault->detail);
    free(*why);
    *why = member_why(session->fault);
    return *why != NULL ? STATUS_OK : no_memory(problem);
}

// The statistics with `factor` times a parameter; all NAN, and *why, where the run failed.
static Status measure(Session *session, int parameter, double factor,
                      double values[ENSEMBLE_STATISTICS], char **why, Problem *problem) {
    Outcome *outcome;
    change_apply(session->simulation, parameter, factor, &session->member);
    const Status status = run(session, &outcome);
    for (int metric = 0; metric < ENSEMBLE_STATISTICS; metric++)
        values[metric] =
            status == STATUS_OK ? statistics_value(&outcome->summary, metric) : (double)NAN;
    outcome_drop(outcome);
    return status == STATUS_OK ? STATUS_OK : forgive(session, status, why, problem);
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
        slope->spread <= fmax(settled_part * fmax(fabs(least), fabs(most)), settled_least);
}

static Status make_row(Session *session, int parameter, SensitivityRow *row, Problem *problem) {
    const char *refused = change_refuse(session->simulation, parameter);
    row->parameter = parameter;
    if (refused != NULL)
        return (row->why = strdup(refused)) != NULL ? STATUS_OK : no_memory(problem);
    row->steps.at = calloc(SENSITIVITY_STEPS, sizeof(double));
    row->slopes.at = calloc(ENSEMBLE_STATISTICS, sizeof *row->slopes.at);
    if (row->steps.at == NULL || row->slopes.at == NULL)
        return no_memory(problem);
    double quotients[ENSEMBLE_STATISTICS][SENSITIVITY_STEPS];
    double step = session->study->step;
    for (int i = 0; i < SENSITIVITY_STEPS; i++, step /= 2) {
        double low[ENSEMBLE_STATISTICS], high[ENSEMBLE_STATISTICS];
        const double up = change_most(session->simulation, parameter, step);
        row->steps.at[row->steps.count++] = step;
        TRY(measure(session, parameter, 1 - step, low, &row->why, problem));
        TRY(measure(session, parameter, 1 + up, high, &row->why, problem));
        for (int metric = 0; metric < ENSEMBLE_STATISTICS; metric++)
            quotients[metric][i] =
                quotient(low[metric], high[metric],
                         statistics_value(&session->own->summary, metric), step + up);
    }
    change_apply(session->simulation, parameter, 1, &session->member);
    for (int metric = 0; metric < ENSEMBLE_STATISTICS; metric++) {
        if (metric == ENSEMBLE_PEAK_CONTACT_FORCE && !ladder_has_force(session->simulation))
            continue;
        SensitivitySlope *slope = &row->slopes.at[row->slopes.count++];
        *slope = (SensitivitySlope){metric, statistics_value(&session->own->summary, metric),
                                    (double)NAN, (double)NAN, false};
        settle(quotients[metric], slope);
    }
    return STATUS_OK;
}

static Status make_rows(Session *session, Problem *problem) {
    const Texts *parameters = &session->study->parameters;
    SensitivityRows *rows = &session->answer->response;
    rows->at = calloc(parameters->count + 1, sizeof *rows->at);
    if (rows->at == NULL)
        return no_memory(problem);
    for (size_t i = 0; i < parameters->count; i++)
        TRY(make_row(session, parameter_of(parameters->at[i]), &rows->at[rows->count++], problem));
    return STATUS_OK;
}

static Status make_draw(Session *session, size_t index, Problem *problem) {
    const size_t buffers = change_buffers(session->simulation);
    SensitivityDraw *told = &session->answer->table.at[index];
    EnsembleRun *kept = &session->runs.at[index];
    Outcome *outcome;
    told->run = kept->seed = index + 1;
    told->restitution = (Reals){calloc(buffers + 1, sizeof(double)), buffers};
    told->contact_time = (Reals){calloc(buffers + 1, sizeof(double)), buffers};
    session->answer->table.count++;
    session->runs.count++;
    if (told->restitution.at == NULL || told->contact_time.at == NULL)
        return no_memory(problem);
    change_draw(session->study, session->simulation, index + 1, &session->member,
                told->restitution.at, told->contact_time.at);
    const Status status = run(session, &outcome);
    session->statuses[index] = status;
    session->answer->made++;
    if (status != STATUS_OK) {
        TRY(forgive(session, status, &told->why, problem));
        session->answer->failed++;
        return (kept->why = strdup(told->why)) != NULL ? STATUS_OK : no_memory(problem);
    }
    kept->summary = told->summary = outcome->summary;
    if (!ladder_has_force(session->simulation))
        kept->summary.peak_contact_force = (double)NAN; // of no statistic
    const Status done =
        band_keep(&session->densities, &outcome->spectrum, (size_t)session->study->runs, problem);
    outcome_drop(outcome);
    return done;
}

static Status make_draws(Session *session, Problem *problem) {
    const size_t runs = (size_t)session->study->runs;
    Sensitivity *answer = session->answer;
    if (runs == 0)
        return STATUS_OK;
    answer->table.at = calloc(runs, sizeof *answer->table.at);
    session->runs.at = calloc(runs, sizeof *session->runs.at);
    session->statuses = calloc(runs, sizeof *session->statuses);
    if (answer->table.at == NULL || session->runs.at == NULL || session->statuses == NULL)
        return no_memory(problem);
    for (size_t i = 0; i < runs; i++) {
        (void)fields_default(summary_fields, &answer->table.at[i].summary);
        TRY(make_draw(session, i, problem));
    }
    return band_tell(&session->runs, session->statuses, &session->densities, session->own,
                     ladder_has_force(session->simulation), answer, problem);
}

static Status tell_own(Session *session, Problem *problem) {
    Sensitivity *answer = session->answer;
    const Outcome *own = session->own;
    const double horizon = own->summary.trust_horizon;
    char text[280];
    answer->summary = own->summary;
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
    return sensitivity_contact(session->study, session->simulation, &own->plan.derived,
                               &answer->contact, problem);
}

static Status make_all(Session *session, Problem *problem) {
    TRY(member_copy(session->simulation, &session->member, problem));
    TRY(member_settle(&session->member, problem));
    const Status status = run(session, &session->own);
    if (status != STATUS_OK)
        return problem_set(problem, status, "%s", session->fault->detail);
    TRY(tell_own(session, problem));
    TRY(make_rows(session, problem));
    return make_draws(session, problem);
}

Status sensitivity_make(const SensitivityStudy *study, const Simulation *simulation,
                        const StudyTools *tools, Sensitivity *answer, Problem *problem) {
    Session session = {.study = study,
                       .simulation = simulation,
                       .tools = tools,
                       .answer = answer,
                       .all = (double)sensitivity_runs(study, simulation),
                       .fault = calloc(1, sizeof(Problem))};
    answer->runs = study->runs;
    answer->seed = study->seed;
    answer->restitution_deviation = study->restitution_deviation;
    answer->contact_time_deviation = study->contact_time_deviation;
    answer->confidence = ENSEMBLE_INTERVAL;
    answer->distribution = strdup(
        "log-normal factors of mean 1 and the stated relative deviation, each buffer's "
        "restitution and contact time for themselves; a restitution beyond 1 is drawn again");
    const Status status = session.fault == NULL || answer->distribution == NULL
                              ? no_memory(problem)
                              : make_all(&session, problem);
    for (size_t i = 0; i < session.runs.count; i++)
        free(session.runs.at[i].why);
    free(session.runs.at);
    free(session.statuses);
    band_clear(&session.densities);
    outcome_drop(session.own);
    simulation_clear(&session.member);
    free(session.fault);
    return status;
}
