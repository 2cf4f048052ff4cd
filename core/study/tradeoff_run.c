// Every point is run once for its errors and then timed, in `repeats` rounds over all points: what
// slows the machine for a while is shared out among them. A run that is over in no time is timed
// many at once.
#include "core/study/tradeoff_run.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "core/simulation/error_metrics.h"
#include "core/study/candidate_settings.h"
#include "core/study/pareto.h"
#include "core/study/statistics.h"
#include "core/study/tradeoff_budget.h"

enum { BATCH = 10000 };                   // runs of a timing at most
static const double batch_seconds = 5e-3; // of CPU, that a timing takes at least

// What a study has at hand while it runs.
typedef struct Session {
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
} Session;

// Runs within the study's progress, of which it is `steps`.
static Status run(Session *session, const Simulation *simulation, const SimulationLimits *limits,
                  double steps, Outcome **outcome, Problem *problem) {
    ProgressRange range = progress_range(session->tools->progress, session->done / session->all,
                                         steps / session->all);
    const Progress progress = progress_range_view(&range);
    return simulation_run(simulation, limits, &progress, session->tools->workspace, outcome,
                          problem);
}

static bool ends_all(Status status) {
    return status == STATUS_CANCELLED || status == STATUS_NO_MEMORY;
}

static Status copy_text(char **target, const char *text, Problem *problem) {
    *target = strdup(text);
    return *target != NULL ? STATUS_OK
                           : problem_set(problem, STATUS_NO_MEMORY, "no memory for the study");
}

// A point that cannot be measured stands in the table with the reason; what ends all is passed on.
static Status set_aside(TradeoffPoint *point, TradeoffStatus as, Status status,
                        const Problem *fault, Problem *problem) {
    if (ends_all(status))
        return problem_set(problem, status, "%s", fault->detail);
    point->status = (int)as;
    return copy_text(&point->why, fault->count > 0 ? fault->faults[0].detail : fault->detail,
                     problem);
}

// As set_aside, before anything of it is made.
static Status refuse_long(const Session *session, size_t index, Problem *problem) {
    char text[160];
    snprintf(text, sizeof text,
             "would take about %.2g solver steps, more than the %.2g that a point may",
             session->steps[index], session->limits.steps);
    TradeoffPoint *point = &session->answer->points.at[index];
    point->status = TRADEOFF_REFUSED;
    return copy_text(&point->why, text, problem);
}

static Status make_reference(Session *session, Problem *problem) {
    TradeoffReference *told = &session->answer->reference;
    TradeoffPoint exact;
    Simulation simulation = {0};
    (void)fields_default(tradeoff_point_fields, &exact);
    TRY(copy_text(&told->solver, ladder_reference()->name, problem));
    exact.solver = told->solver;
    Status status =
        ladder_apply(session->simulation, &exact, session->tools->limits, &simulation, problem);
    if (status == STATUS_OK)
        status = compare_watch(&simulation, problem);
    if (status == STATUS_OK)
        status = run(session, &simulation, session->tools->limits, BUDGET_BATCH,
                     &session->reference, problem);
    simulation_clear(&simulation);
    return status;
}

static Compared compare(const Outcome *outcome, const Simulation *simulation,
                        const TradeoffPoint *point) {
    return (Compared){
        .outcome = outcome,
        .storeys = structure_storeys(scene_structure(&simulation->scene)),
        .has_motion = point == NULL || (isnan(point->duration) && point->segment == COUNT_ABSENT),
        .has_force = ladder_has_force(simulation),
        .horizon = outcome->summary.trust_horizon,
    };
}

static Status measure_errors(Session *session, size_t index, Problem *problem) {
    TradeoffPoint *point = &session->answer->points.at[index];
    const double steps = session->steps[index];
    if (steps > session->limits.steps)
        return refuse_long(session, index, problem);
    Simulation simulation = {0};
    Outcome *outcome = NULL;
    problem_clear(session->fault);
    Status status =
        ladder_apply(session->simulation, point, &session->limits, &simulation, session->fault);
    TradeoffStatus as = TRADEOFF_REFUSED;
    if (status == STATUS_OK)
        status = compare_watch(&simulation, session->fault);
    if (status == STATUS_OK) {
        as = TRADEOFF_FAILED;
        status = run(session, &simulation, &session->limits, steps, &outcome, session->fault);
    }
    if (status == STATUS_OK) {
        const Compared from = compare(session->reference, session->simulation, NULL);
        const Compared to = compare(outcome, &simulation, point);
        point->status = TRADEOFF_MEASURED;
        point->steps = floor(outcome->steps + 0.5); // parts of one are counted too
        point->errors = errors_measure(&from, &to);
    } else {
        status = set_aside(point, as, status, session->fault, problem);
    }
    session->done += steps;
    outcome_unref(outcome);
    simulation_clear(&simulation);
    return status;
}

static double cpu(const Session *session) {
    return session->tools->cpu(session->tools->cpu_context);
}

// One timing: as many runs as take batch_seconds.
static Status time_point(Session *session, size_t index, size_t round, Problem *problem) {
    TradeoffPoint *point = &session->answer->points.at[index];
    Simulation simulation = {0};
    // It was judged under its limits before.
    Status status = ladder_apply(session->simulation, point, NULL, &simulation, problem);
    const double steps = session->steps[index];
    const double end = session->done + fmax(steps, BUDGET_BATCH);
    size_t runs = 0;
    double took = 0;
    const double began = cpu(session);
    while (status == STATUS_OK && runs < BATCH && took < batch_seconds) {
        Outcome *outcome = NULL;
        const double share = fmin(steps, end - session->done);
        status = run(session, &simulation, &session->limits, share, &outcome, problem);
        outcome_unref(outcome);
        session->done += share;
        runs++;
        took = cpu(session) - began;
    }
    simulation_clear(&simulation);
    TRY(status);
    session->times[index * session->study->repeats + round] = took / (double)runs;
    point->runs += runs;
    session->done = end;
    return STATUS_OK;
}

static void tell_times(Session *session) {
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

static Status measure_all(Session *session, Problem *problem) {
    const TradeoffPoints *points = &session->answer->points;
    TRY(make_reference(session, problem));
    const Compared reference = compare(session->reference, session->simulation, NULL);
    session->answer->reference.yardstick = yardstick_make(&reference);
    session->done += BUDGET_BATCH;
    for (size_t i = 0; i < points->count; i++)
        TRY(measure_errors(session, i, problem));
    outcome_unref(session->reference);
    session->reference = NULL;
    for (size_t round = 0; round < session->study->repeats; round++)
        for (size_t i = 0; i < points->count; i++) {
            if (!progress_advance(session->tools->progress, session->done / session->all))
                return problem_set(problem, STATUS_CANCELLED, "the study was stopped");
            if (points->at[i].status == TRADEOFF_MEASURED)
                TRY(time_point(session, i, round, problem));
        }
    tell_times(session);
    return STATUS_OK;
}

Status tradeoff_measure(const TradeoffStudy *study, const Simulation *simulation,
                        const StudyTools *tools, Tradeoff *answer, Problem *problem) {
    answer->metric = study->metric;
    answer->error = study->error;
    answer->repeats = study->repeats;
    answer->trial = study->trial;
    TRY(ladder_make(study, simulation, &answer->points, problem));
    const size_t count = answer->points.count;
    Session session = {.study = study,
                       .simulation = simulation,
                       .tools = tools,
                       .limits = budget_point(study, tools->limits),
                       .answer = answer,
                       .steps = calloc(count + 1, sizeof(double)),
                       .times = calloc(count * study->repeats + 1, sizeof(double)),
                       .all = BUDGET_BATCH,
                       .fault = calloc(1, sizeof(Problem))};
    Status status = STATUS_OK;
    if (session.steps == NULL || session.times == NULL || session.fault == NULL)
        status = problem_set(problem, STATUS_NO_MEMORY, "no memory for the study's points");
    if (status == STATUS_OK) {
        budget_foretell(simulation, &answer->points, session.steps);
        const size_t left = budget_trim(&answer->points, session.steps, session.limits.steps);
        for (size_t i = 0; i < left; i++)
            if (session.steps[i] <= session.limits.steps)
                session.all += budget_timed(study, session.steps[i]);
        status = measure_all(&session, problem);
    }
    if (status == STATUS_OK) {
        choice_mark(&answer->points, study->metric);
        status = choice_make(&answer->points, study->metric, study->error, &answer->recommendation);
        if (status != STATUS_OK)
            (void)problem_set(problem, status, "no memory for the study's answer");
    }
    outcome_unref(session.reference);
    free(session.steps);
    free(session.times);
    free(session.fault);
    return status;
}
