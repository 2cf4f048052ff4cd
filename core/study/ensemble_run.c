// A run is the scene with another seed and nothing sampled; of what it came to, a row of numbers
// stays and what its spectra add to the fold. A run that fails is a row with its reason.
#include "core/study/ensemble_run.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "core/excite/random.h"
#include "core/study/ensemble_rule.h"
#include "core/study/ensemble_spectra.h"
#include "core/study/ensemble_statistics.h"
#include "core/study/member.h"
#include "core/study/tradeoff_ladder.h"

// What a study has at hand while it runs.
typedef struct Session {
    const EnsembleStudy *study;
    const StudyTools *tools;
    Simulation member; // the scene; its seed is each run's
    Ensemble *answer;  // whose table has room for all runs
    Status *statuses;  // of the table's rows
    SpectraFold fold;
    Outcome *like;   // any that ended: the shape of its spectra
    size_t look;     // ended runs at which the target is looked at next
    double expected; // runs, for the progress
    double told;     // progress
    Problem *fault;  // of a run
} Session;

Status ensemble_member(const Simulation *simulation, uint64_t seed, Simulation *target,
                       Problem *problem) {
    TRY(member_copy(simulation, target, problem));
    ((ExcitationRandom *)(void *)target->scene.excitation)->seed = seed;
    return STATUS_OK;
}

static bool has_target(const Session *session) {
    return !isnan(session->study->target);
}

static size_t ended(const Session *session) {
    return (size_t)(session->answer->made - session->answer->failed);
}

// Runs that could end: those that failed are of no population.
static size_t population(const Session *session) {
    return (size_t)(session->study->runs - session->answer->failed);
}

static Status note_failure(Session *session, EnsembleRun *run, Status status, Problem *problem) {
    const Problem *fault = session->fault;
    if (status == STATUS_CANCELLED || status == STATUS_NO_MEMORY)
        return problem_set(problem, status, "%s", fault->detail);
    session->answer->failed++;
    run->steps = (double)NAN;
    run->why = strdup(fault->detail);
    return run->why != NULL ? STATUS_OK
                            : problem_set(problem, STATUS_NO_MEMORY, "no memory for the study");
}

static Status note_outcome(Session *session, EnsembleRun *run, const Outcome *outcome,
                           Problem *problem) {
    run->summary = outcome->summary;
    run->steps = outcome->steps;
    session->answer->steps += outcome->steps;
    if (!ladder_has_force(&session->member))
        run->summary.peak_contact_force = (double)NAN;
    return spectra_add(&session->fold, &outcome->spectrum,
                       has_target(session) && session->study->metric == ENSEMBLE_PSD, problem);
}

static Status make_run(Session *session, Problem *problem) {
    Ensemble *answer = session->answer;
    const StudyTools *tools = session->tools;
    const size_t index = (size_t)answer->made;
    EnsembleRun *run = &answer->table.at[index];
    // What was foretold may change; what was told may not fall.
    const double share = (1 - session->told) / fmax(session->expected - (double)index, 1);
    Stage stage = stage_of(tools->watch, session->told, share);
    const Watch watch = stage_watch(&stage);
    Outcome *outcome = NULL;
    problem_clear(session->fault);
    run->seed = session->study->first_seed + index;
    ((ExcitationRandom *)(void *)session->member.scene.excitation)->seed = run->seed;
    Status status = simulation_run(&session->member, tools->limits, &watch, tools->workspace,
                                   &outcome, session->fault);
    session->told += share;
    session->statuses[index] = status;
    answer->made++;
    answer->table.count++;
    status = status == STATUS_OK ? note_outcome(session, run, outcome, problem)
                                 : note_failure(session, run, status, problem);
    if (session->like == NULL && session->fold.count > 0)
        session->like = outcome;
    else
        outcome_drop(outcome);
    return status;
}

static Status measure_spread(Session *session, Spread *spread, Problem *problem) {
    if (session->study->metric != ENSEMBLE_PSD)
        return statistics_spread(&session->answer->table, session->study->metric, spread, problem);
    *spread = spectra_spread(&session->fold, population(session));
    return STATUS_OK;
}

// Looks at the error, and foretells how many runs it will take.
static Status look(Session *session, bool *is_enough, Problem *problem) {
    EnsembleTarget *target = &session->answer->target;
    const size_t count = ended(session), all = population(session);
    Spread spread;
    TRY(measure_spread(session, &spread, problem));
    // A statistic that no run knows has no mean.
    target->estimated_error = spread.count > 0 ? rule_error(&spread, count, all) : (double)NAN;
    *is_enough = target->estimated_error <= session->study->target;
    // It ends where it is looked at.
    const size_t fewest = rule_predict(&spread, all, session->study->target);
    size_t foretold = count;
    while (foretold < fewest)
        foretold = rule_next_look(foretold);
    foretold = foretold < all ? foretold : all;
    if (target->pilot == COUNT_ABSENT && count > 1) {
        target->pilot = count;
        target->predicted_runs = foretold;
    }
    session->expected = (double)(foretold + session->answer->failed);
    session->look = rule_next_look(count);
    return STATUS_OK;
}

static Status make_runs(Session *session, Problem *problem) {
    const uint64_t runs = session->study->runs;
    bool is_enough = false;
    while (session->answer->made < runs && !is_enough) {
        if (!watch_advance(session->tools->watch, session->told))
            return problem_set(problem, STATUS_CANCELLED, "the study was stopped");
        TRY(make_run(session, problem));
        const bool is_last = session->answer->made == runs;
        if (has_target(session) && (is_last || ended(session) >= session->look))
            TRY(look(session, &is_enough, problem));
    }
    return STATUS_OK;
}

static Status tell_target(const Session *session, Problem *problem) {
    EnsembleTarget *target = &session->answer->target;
    if (!has_target(session))
        return STATUS_OK;
    const char *name = ensemble_metric_names[session->study->metric];
    const unsigned long long made = (unsigned long long)session->answer->made,
                             all = (unsigned long long)session->study->runs;
    char text[320];
    target->error = session->study->target;
    target->metric = session->study->metric;
    target->confidence = ENSEMBLE_CONFIDENCE;
    target->is_kept = target->estimated_error <= target->error;
    if (isnan(target->estimated_error))
        snprintf(text, sizeof text, "no run of %llu came to an end that tells %s", all, name);
    else if (made == all)
        snprintf(text, sizeof text,
                 "all %llu runs were made: no fewer were sure to keep the mean of %s within %g",
                 all, name, target->error);
    else
        snprintf(text, sizeof text,
                 "%llu of %llu runs keep the mean of %s within %g of that of all: within %.2g with "
                 "%g %% confidence",
                 made, all, name, target->error, target->estimated_error, 100 * target->confidence);
    target->why = strdup(text);
    return target->why != NULL ? STATUS_OK
                               : problem_set(problem, STATUS_NO_MEMORY, "no memory for the study");
}

static Status tell(const Session *session, Problem *problem) {
    Ensemble *answer = session->answer;
    TRY(tell_target(session, problem));
    for (int metric = 0; metric < ENSEMBLE_STATISTICS; metric++)
        TRY(statistics_fold(&answer->table, metric, ensemble_statistic(&answer->statistics, metric),
                            problem));
    statistics_trust(&answer->table, &answer->trust);
    TRY(statistics_failures(&answer->table, session->statuses, &answer->failures, problem));
    return session->like == NULL
               ? STATUS_OK
               : spectra_tell(&session->fold, &session->like->spectrum, answer, problem);
}

Status ensemble_make(const EnsembleStudy *study, const Simulation *simulation,
                     const StudyTools *tools, Ensemble *answer, Problem *problem) {
    const size_t runs = (size_t)study->runs;
    Session session = {.study = study,
                       .tools = tools,
                       .answer = answer,
                       .statuses = calloc(runs, sizeof(Status)),
                       .look = ENSEMBLE_PILOT,
                       .expected = (double)runs,
                       .fault = calloc(1, sizeof(Problem))};
    answer->runs = study->runs;
    answer->first_seed = study->first_seed;
    answer->confidence = ENSEMBLE_INTERVAL;
    answer->table.at = calloc(runs, sizeof *answer->table.at);
    for (size_t i = 0; i < runs && answer->table.at != NULL; i++)
        (void)fields_default(summary_fields, &answer->table.at[i].summary);
    Status status = STATUS_OK;
    if (session.statuses == NULL || session.fault == NULL || answer->table.at == NULL)
        status = problem_set(problem, STATUS_NO_MEMORY, "no memory for %zu runs", runs);
    if (status == STATUS_OK)
        status = ensemble_member(simulation, study->first_seed, &session.member, problem);
    if (status == STATUS_OK)
        status = make_runs(&session, problem);
    if (status == STATUS_OK)
        status = tell(&session, problem);
    outcome_drop(session.like);
    spectra_clear(&session.fold);
    simulation_clear(&session.member);
    free(session.statuses);
    free(session.fault);
    return status;
}
