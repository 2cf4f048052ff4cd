// Every point is run once for its errors and then timed, in `repeats` rounds over all points: what
// slows the machine for a while is shared out among them. A run that is over in no time is timed
// many at once.
// The tables of what is asked and answered, and what of it can be judged before anything runs.
#include "core/study/tradeoff.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "core/simulation/error_metrics.h"
#include "core/solve/solvers.h"
#include "core/study/candidate_settings.h"
#include "core/study/pareto.h"
#include "core/study/statistics.h"
#include "core/study/study_run.h"

enum { BATCH = 10000 };                   // runs of a timing at most
#define TRADEOFF_BATCH_STEPS 1e5          // about as many solver steps as a timing takes at least
static const double batch_seconds = 5e-3; // of CPU, that a timing takes at least

static SimulationLimits tradeoff_point_limits(const TradeoffStudy *study,
                                              const SimulationLimits *limits) {
    SimulationLimits own = limits != NULL ? *limits : (SimulationLimits){0};
    if (!(own.steps > 0) || own.steps > study->point_steps)
        own.steps = study->point_steps;
    return own;
}

static void tradeoff_predict(const Simulation *simulation, const TradeoffPoints *points,
                             double *steps) {
    for (size_t i = 0; i < points->count; i++)
        steps[i] = candidate_settings_cost(simulation, &points->at[i]);
}

static size_t tradeoff_trim(TradeoffPoints *points, double *steps, double most) {
    size_t count = 0;
    for (size_t i = 0; i < points->count; i++) {
        TradeoffPoint *point = &points->at[i];
        const bool is_finer = count > 0 && !isnan(point->step) && steps[i] > most &&
                              steps[count - 1] > most &&
                              strcmp(point->solver, points->at[count - 1].solver) == 0;
        if (is_finer) {
            fields_clear(tradeoff_point_fields, point);
            continue;
        }
        points->at[count] = *point;
        steps[count++] = steps[i];
    }
    return points->count = count;
}

static double tradeoff_timed_steps(const TradeoffStudy *study, double steps) {
    return steps + (double)study->repeats *
                       (steps > TRADEOFF_BATCH_STEPS ? steps : TRADEOFF_BATCH_STEPS + steps);
}

// What a study has at hand while it runs.
typedef struct TradeoffRun {
    const TradeoffStudy *study;
    const Simulation *simulation;
    const StudyTools *tools;
    SimulationLimits limits; // of a point
    Tradeoff *answer;
    Outcome *reference;
    double *steps;    // foretold, of each point
    double *times;    // [s], `repeats` of each point
    double done, all; // foretold steps
    Problem *fault;   // of a point
} TradeoffRun;

// Runs within the study's progress, of which it is `steps`.
static Status tradeoff_run(TradeoffRun *session, const Simulation *simulation,
                           const SimulationLimits *limits, double steps, Outcome **outcome,
                           Problem *problem) {
    ProgressRange range = progress_range(session->tools->progress, session->done / session->all,
                                         steps / session->all);
    const Progress progress = progress_range_view(&range);
    return simulation_run(simulation, limits, &progress, session->tools->workspace, outcome,
                          problem);
}

static Status tradeoff_copy_text(char **target, const char *text, Problem *problem) {
    *target = strdup(text);
    return *target != NULL ? STATUS_OK
                           : problem_set(problem, STATUS_NO_MEMORY, "no memory for the study");
}

// A point that cannot be measured stands in the table with the reason; what ends all is passed on.
static Status tradeoff_refuse(TradeoffPoint *point, TradeoffStatus as, Status status,
                              const Problem *fault, Problem *problem) {
    if (study_run_ends_all(status))
        return problem_set(problem, status, "%s", fault->detail);
    point->status = (int)as;
    return tradeoff_copy_text(&point->why,
                              fault->count > 0 ? fault->faults[0].detail : fault->detail, problem);
}

// As set_aside, before anything of it is made.
static Status tradeoff_refuse_long(const TradeoffRun *session, size_t index, Problem *problem) {
    char text[160];
    snprintf(text, sizeof text,
             "would take about %.2g solver steps, more than the %.2g that a point may",
             session->steps[index], session->limits.steps);
    TradeoffPoint *point = &session->answer->points.at[index];
    point->status = TRADEOFF_REFUSED;
    return tradeoff_copy_text(&point->why, text, problem);
}

static Status tradeoff_run_reference(TradeoffRun *session, Problem *problem) {
    TradeoffReference *told = &session->answer->reference;
    TradeoffPoint exact;
    Simulation simulation = {0};
    (void)fields_default(tradeoff_point_fields, &exact);
    TRY(tradeoff_copy_text(&told->solver, candidate_settings_reference()->name, problem));
    exact.solver = told->solver;
    Status status = candidate_settings_apply(session->simulation, &exact, session->tools->limits,
                                             &simulation, problem);
    if (status == STATUS_OK)
        status = compare_watch(&simulation, problem);
    if (status == STATUS_OK)
        status = tradeoff_run(session, &simulation, session->tools->limits, TRADEOFF_BATCH_STEPS,
                              &session->reference, problem);
    simulation_clear(&simulation);
    return status;
}

static Compared tradeoff_compared(const Outcome *outcome, const Simulation *simulation,
                                  const TradeoffPoint *point) {
    return (Compared){
        .outcome = outcome,
        .storeys = structure_storeys(scene_structure(&simulation->scene)),
        .has_motion = point == NULL || (isnan(point->duration) && point->segment == COUNT_ABSENT),
        .has_force = study_run_has_force(simulation),
        .horizon = outcome->summary.trust_horizon,
    };
}

static Status tradeoff_measure_errors(TradeoffRun *session, size_t index, Problem *problem) {
    TradeoffPoint *point = &session->answer->points.at[index];
    const double steps = session->steps[index];
    if (steps > session->limits.steps)
        return tradeoff_refuse_long(session, index, problem);
    Simulation simulation = {0};
    Outcome *outcome = NULL;
    problem_clear(session->fault);
    Status status = candidate_settings_apply(session->simulation, point, &session->limits,
                                             &simulation, session->fault);
    TradeoffStatus as = TRADEOFF_REFUSED;
    if (status == STATUS_OK)
        status = compare_watch(&simulation, session->fault);
    if (status == STATUS_OK) {
        as = TRADEOFF_FAILED;
        status =
            tradeoff_run(session, &simulation, &session->limits, steps, &outcome, session->fault);
    }
    if (status == STATUS_OK) {
        const Compared from = tradeoff_compared(session->reference, session->simulation, NULL);
        const Compared to = tradeoff_compared(outcome, &simulation, point);
        point->status = TRADEOFF_MEASURED;
        point->steps = floor(outcome->steps + 0.5); // parts of one are counted too
        point->errors = errors_measure(&from, &to);
    } else {
        status = tradeoff_refuse(point, as, status, session->fault, problem);
    }
    session->done += steps;
    outcome_unref(outcome);
    simulation_clear(&simulation);
    return status;
}

static double tradeoff_cpu(const TradeoffRun *session) {
    return session->tools->cpu(session->tools->cpu_context);
}

// One timing: as many runs as take batch_seconds.
static Status tradeoff_time_point(TradeoffRun *session, size_t index, size_t round,
                                  Problem *problem) {
    TradeoffPoint *point = &session->answer->points.at[index];
    Simulation simulation = {0};
    // It was judged under its limits before.
    Status status =
        candidate_settings_apply(session->simulation, point, NULL, &simulation, problem);
    const double steps = session->steps[index];
    const double end = session->done + fmax(steps, TRADEOFF_BATCH_STEPS);
    size_t runs = 0;
    double took = 0;
    const double began = tradeoff_cpu(session);
    while (status == STATUS_OK && runs < BATCH && took < batch_seconds) {
        Outcome *outcome = NULL;
        const double share = fmin(steps, end - session->done);
        status = tradeoff_run(session, &simulation, &session->limits, share, &outcome, problem);
        outcome_unref(outcome);
        session->done += share;
        runs++;
        took = tradeoff_cpu(session) - began;
    }
    simulation_clear(&simulation);
    TRY(status);
    session->times[index * session->study->repeats + round] = took / (double)runs;
    point->runs += runs;
    session->done = end;
    return STATUS_OK;
}

static void tradeoff_fill_times(TradeoffRun *session) {
    const size_t repeats = session->study->repeats;
    for (size_t i = 0; i < session->answer->points.count; i++) {
        TradeoffPoint *point = &session->answer->points.at[i];
        double *times = &session->times[i * repeats];
        if (point->status != TRADEOFF_MEASURED)
            continue;
        statistics_sort(times, repeats);
        point->cpu_minimum = times[0];
        point->cpu_median = (times[(repeats - 1) / 2] + times[repeats / 2]) / 2;
    }
}

static Status tradeoff_measure_all(TradeoffRun *session, Problem *problem) {
    const TradeoffPoints *points = &session->answer->points;
    TRY(tradeoff_run_reference(session, problem));
    const Compared reference = tradeoff_compared(session->reference, session->simulation, NULL);
    session->answer->reference.yardstick = yardstick_make(&reference);
    session->done += TRADEOFF_BATCH_STEPS;
    for (size_t i = 0; i < points->count; i++)
        TRY(tradeoff_measure_errors(session, i, problem));
    outcome_unref(session->reference);
    session->reference = NULL;
    for (size_t round = 0; round < session->study->repeats; round++)
        for (size_t i = 0; i < points->count; i++) {
            if (!progress_advance(session->tools->progress, session->done / session->all))
                return problem_set(problem, STATUS_CANCELLED, "the study was stopped");
            if (points->at[i].status == TRADEOFF_MEASURED)
                TRY(tradeoff_time_point(session, i, round, problem));
        }
    tradeoff_fill_times(session);
    return STATUS_OK;
}

static Status tradeoff_measure(const TradeoffStudy *study, const Simulation *simulation,
                               const StudyTools *tools, Tradeoff *answer, Problem *problem) {
    answer->metric = study->metric;
    answer->error = study->error;
    answer->repeats = study->repeats;
    answer->trial = study->trial;
    TRY(candidate_settings_list(study, simulation, &answer->points, problem));
    const size_t count = answer->points.count;
    TradeoffRun session = {.study = study,
                           .simulation = simulation,
                           .tools = tools,
                           .limits = tradeoff_point_limits(study, tools->limits),
                           .answer = answer,
                           .steps = calloc(count + 1, sizeof(double)),
                           .times = calloc(count * study->repeats + 1, sizeof(double)),
                           .all = TRADEOFF_BATCH_STEPS,
                           .fault = calloc(1, sizeof(Problem))};
    Status status = STATUS_OK;
    if (session.steps == NULL || session.times == NULL || session.fault == NULL)
        status = problem_set(problem, STATUS_NO_MEMORY, "no memory for the study's points");
    if (status == STATUS_OK) {
        tradeoff_predict(simulation, &answer->points, session.steps);
        const size_t left = tradeoff_trim(&answer->points, session.steps, session.limits.steps);
        for (size_t i = 0; i < left; i++)
            if (session.steps[i] <= session.limits.steps)
                session.all += tradeoff_timed_steps(study, session.steps[i]);
        status = tradeoff_measure_all(&session, problem);
    }
    if (status == STATUS_OK) {
        pareto_mark(&answer->points, study->metric);
        status =
            pareto_recommend(&answer->points, study->metric, study->error, &answer->recommendation);
        if (status != STATUS_OK)
            (void)problem_set(problem, status, "no memory for the study's answer");
    }
    outcome_unref(session.reference);
    free(session.steps);
    free(session.times);
    free(session.fault);
    return status;
}

enum { SOLVERS = 32, REPEATS = 1000 };

static const double usual_errors[METRICS] = {1e-3, 1e-2, 1e-2, 0, 0.1, 1e-3};
const char *const tradeoff_status_names[] = {"measured", "refused", "failed", NULL};

// clang-format off
static const Field study_fields[] = {
    FIELD_REAL(TradeoffStudy, error, NULL, AT_MIN(0), OPTIONAL, "error wanted, in the metric's unit; 1e-3 if absent, 1e-2 of mean_acceleration and peak_force, no impact, 0.1 dB"),
    FIELD_CHOICE(TradeoffStudy, metric, metric_names, METRIC_DISPLACEMENT, "what the error is of"),
    FIELD_COUNT(TradeoffStudy, repeats, NULL, WITHIN(1, REPEATS), 5, "timings of each point; the smallest and the median are told"),
    FIELD_TEXTS(TradeoffStudy, solvers, NULL, NULL, SOLVERS, PRESENCE_OPTIONAL, 0, "solvers that are tried; all if absent"),
    FIELD_REAL(TradeoffStudy, point_steps, NULL, WITHIN(1, 1e15), 5e7, "solver steps that a point may be foretold to take; it is refused beyond"),
    FIELD_COUNT(TradeoffStudy, trial, NULL, AT_MIN(1), 1, "another number measures the CPU times anew; the same one is answered from what was measured"),
    FIELD_END
};

const Field tradeoff_point_fields[] = {
    FIELD_TEXT(TradeoffPoint, name, 0, PRESENCE_OPTIONAL, 0, "for people"),
    FIELD_TEXT(TradeoffPoint, solver, 0, PRESENCE_OPTIONAL, 0, "solver"),
    FIELD_REAL(TradeoffPoint, step, "s", ANY, OPTIONAL, "its step"),
    FIELD_REAL(TradeoffPoint, tolerance, NULL, ANY, OPTIONAL, "its tolerance"),
    FIELD_TEXT(TradeoffPoint, contact_model, 0, PRESENCE_OPTIONAL, 0, "contact model in place of the scene's"),
    FIELD_REAL(TradeoffPoint, sample_rate, "Hz", ANY, OPTIONAL, "sample rate in place of the scene's; the base keeps its own"),
    FIELD_REAL(TradeoffPoint, duration, "s", ANY, OPTIONAL, "duration in place of the scene's"),
    FIELD_COUNT(TradeoffPoint, segment, "samples", AT_MIN(1), OPTIONAL, "segment of the spectra in place of the scene's"),
    FIELD_COUNT(TradeoffPoint, modes, NULL, AT_MIN(1), OPTIONAL, "modes that it keeps; all if absent"),
    FIELD_CHOICE(TradeoffPoint, status, tradeoff_status_names, TRADEOFF_MEASURED, "whether it was run"),
    FIELD_TEXT(TradeoffPoint, why, 0, PRESENCE_OPTIONAL, 0, "why it was not measured"),
    FIELD_REAL(TradeoffPoint, cpu_minimum, "s", ANY, OPTIONAL, "CPU time of a run with the scene's own output, the smallest timing; a measurement, another time will differ"),
    FIELD_REAL(TradeoffPoint, cpu_median, "s", ANY, OPTIONAL, "median of the timings; a measurement"),
    FIELD_COUNT(TradeoffPoint, runs, NULL, AT_MIN(0), 0, "runs that were timed: short ones are timed many at once"),
    FIELD_REAL(TradeoffPoint, steps, NULL, ANY, OPTIONAL, "solver steps, counted"),
    FIELD_ITEM(TradeoffPoint, errors, error_fields, NULL, PRESENCE_DEFAULT, "differences from the reference"),
    FIELD_FLAG(TradeoffPoint, is_best, false, "no other point is both cheaper and closer by the metric; follows from measured times"),
    FIELD_END
};

static const Field reference_fields[] = {
    FIELD_TEXT(TradeoffReference, solver, 0, PRESENCE_OPTIONAL, 0, "solver that the points are compared with"),
    FIELD_BASE(TradeoffReference, yardstick, yardstick_fields),
    FIELD_END
};

static const Field recommendation_fields[] = {
    FIELD_COUNT(TradeoffRecommendation, point, NULL, AT_MIN(1), OPTIONAL, "number of the point, from 1: the cheapest that keeps the error, or the closest that takes at most 1.25 times as long; unknown: none keeps it; follows from measured times"),
    FIELD_TEXT(TradeoffRecommendation, why, 0, PRESENCE_OPTIONAL, 0, "the reason"),
    FIELD_END
};

static const Field answer_fields[] = {
    FIELD_CHOICE(Tradeoff, metric, metric_names, OPTIONAL, "what the error wanted is of"),
    FIELD_REAL(Tradeoff, error, NULL, ANY, OPTIONAL, "error wanted"),
    FIELD_COUNT(Tradeoff, repeats, NULL, AT_MIN(1), OPTIONAL, "timings of each point"),
    FIELD_COUNT(Tradeoff, trial, NULL, AT_MIN(1), OPTIONAL, "number of the measurement"),
    FIELD_ITEM(Tradeoff, reference, reference_fields, NULL, PRESENCE_DEFAULT, "what the points are compared with"),
    FIELD_LIST(Tradeoff, points, tradeoff_point_fields, 0, PRESENCE_DEFAULT, "the ways tried"),
    FIELD_ITEM(Tradeoff, recommendation, recommendation_fields, NULL, PRESENCE_DEFAULT, "the point to take"),
    FIELD_END
};
// clang-format on

static Status tradeoff_check_metric(const TradeoffStudy *study, const Simulation *simulation,
                                    Problem *problem) {
    static const char pointer[] = "/study/metric";
    if (study->metric == METRIC_PSD && simulation->output.psd.channels.count == 0)
        return problem_add(problem, STATUS_INVALID, pointer,
                           "psd needs spectra: ask for some in /output/psd");
    if (study->metric == METRIC_PEAK_FORCE && !study_run_has_force(simulation))
        return problem_add(
            problem, STATUS_INVALID, pointer, "peak_force needs contacts with a force: %s",
            simulation->scene.dampers.count > 0 ? "impulses have none, choose another contact model"
                                                : "the scene has no damper");
    if (study->metric == METRIC_IMPACTS && simulation->scene.dampers.count == 0)
        return problem_add(problem, STATUS_INVALID, pointer,
                           "impacts needs a damper: the scene has none");
    return STATUS_OK;
}

static Status tradeoff_check_solvers(const TradeoffStudy *study, Problem *problem) {
    const char *names[SOLVERS + 1] = {NULL};
    for (size_t i = 0, count = 0; solvers[i] != NULL && count < SOLVERS; i++)
        if (solvers[i]->run != NULL)
            names[count++] = solvers[i]->kind.name;
    Status status = STATUS_OK;
    for (size_t i = 0; i < study->solvers.count; i++) {
        size_t at = 0;
        while (names[at] != NULL && strcmp(names[at], study->solvers.at[i]) != 0)
            at++;
        if (names[at] != NULL)
            continue;
        char place[sizeof((Fault){0}.pointer)];
        pointer_index(place, sizeof place, "/study/solvers", i);
        status = texts_refuse(names, study->solvers.at[i], place, problem);
    }
    return status;
}

// All storeys are compared, whatever channels the scene asks for.
static Status tradeoff_check_values(const Simulation *simulation, const SimulationLimits *limits,
                                    Problem *problem) {
    const double storeys = (double)structure_storeys(scene_structure(&simulation->scene));
    const double values = 2 * storeys * (double)scene_sample_count(&simulation->scene);
    if (limits == NULL || limits->samples == 0 || values <= 4 * (double)limits->samples)
        return STATUS_OK;
    return problem_add(problem, STATUS_INVALID, "/study",
                       "compares displacement and mean_acceleration of every storey, %.3g values, "
                       "must be at most %.3g: take a shorter duration or a lower sample_rate",
                       values, 4 * (double)limits->samples);
}

static Status tradeoff_complete(Study *asked, const Simulation *simulation,
                                const SimulationLimits *limits, Problem *problem) {
    TradeoffStudy *study = (TradeoffStudy *)(void *)asked;
    if (study->metric == CHOICE_ABSENT)
        study->metric = METRIC_DISPLACEMENT;
    if (isnan(study->error))
        study->error = usual_errors[study->metric];
    const Status metric = tradeoff_check_metric(study, simulation, problem);
    const Status names = tradeoff_check_solvers(study, problem);
    const Status values = tradeoff_check_values(simulation, limits, problem);
    return metric != STATUS_OK ? metric : names != STATUS_OK ? names : values;
}

static Status tradeoff_cost(const Study *asked, const Simulation *simulation,
                            const SimulationLimits *limits, double *steps, Problem *problem) {
    const TradeoffStudy *study = (const TradeoffStudy *)(const void *)asked;
    TradeoffPoints points;
    *steps = 0;
    Status status = candidate_settings_list(study, simulation, &points, problem);
    double *each = calloc(points.count + 1, sizeof *each);
    if (status == STATUS_OK && each == NULL)
        status = problem_set(problem, STATUS_NO_MEMORY, "no memory for the study's points");
    if (status == STATUS_OK) {
        const double most = tradeoff_point_limits(study, limits).steps;
        tradeoff_predict(simulation, &points, each);
        for (size_t i = 0; i < points.count; i++)
            if (each[i] <= most)
                *steps += tradeoff_timed_steps(study, each[i]);
    }
    free(each);
    Tradeoff answer = {.points = points};
    fields_clear(answer_fields, &answer);
    return status;
}

static Status study_measure(const Study *asked, const Simulation *simulation,
                            const StudyTools *tools, Variant *answer, Problem *problem) {
    return tradeoff_measure((const TradeoffStudy *)(const void *)asked, simulation, tools,
                            (Tradeoff *)(void *)answer, problem);
}

static const Kind tradeoff_answer = {"tradeoff", "what speed costs in accuracy, measured",
                                     answer_fields, sizeof(Tradeoff)};

const StudyKind study_tradeoff = {
    .kind = {"tradeoff",
             "error against CPU time over solvers, steps and what else may be traded for speed",
             study_fields, sizeof(TradeoffStudy)},
    .answer = &tradeoff_answer,
    .lessen = "ask for fewer solvers or repeats, or lower point_steps",
    .is_measured = true,
    .complete = tradeoff_complete,
    .cost = tradeoff_cost,
    .run = study_measure,
};
