#include "core/simulation/accuracy_target.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "core/result/metric.h"
#include "core/simulation/aim_way.h"
#include "core/solve/solvers.h"

enum { ATTEMPTS = 3 };
static const double margin = 0.03; // of what an estimate says that a second run may take: digits
                                   // are cheap

static const AccuracyAuto *asked_of(const Simulation *simulation) {
    return (const AccuracyAuto *)(const void *)simulation->accuracy;
}

bool aim_is_asked(const Simulation *simulation) {
    return simulation->accuracy->kind == &solvers[0]->kind && !isnan(asked_of(simulation)->target);
}

static const ContactLaw *law_of(const Scene *scene) {
    return dampers_contact_law(&scene->dampers, scene_contact(scene));
}

Status aim_complete(Simulation *simulation, Problem *problem) {
    static const char pointer[] = "/accuracy/metric";
    AccuracyAuto *asked = (AccuracyAuto *)(void *)simulation->accuracy;
    const Scene *scene = &simulation->scene;
    if (asked->accuracy.modes != COUNT_ABSENT)
        return problem_add_real(problem, STATUS_INVALID, "/accuracy/modes",
                                (double)asked->accuracy.modes, NULL,
                                "a target chooses how many modes are kept: leave one of the two "
                                "out");
    if (asked->metric == CHOICE_ABSENT)
        asked->metric = METRIC_DISPLACEMENT;
    if (asked->metric == METRIC_PSD && simulation->output.psd.channels.count == 0)
        return problem_add(problem, STATUS_INVALID, pointer,
                           "psd needs spectra: ask for some in /output/psd");
    if ((asked->metric == METRIC_PEAK_FORCE || asked->metric == METRIC_IMPACTS) &&
        scene->dampers.count == 0)
        return problem_add(problem, STATUS_INVALID, pointer,
                           "%s needs a damper: the scene has none", metric_names[asked->metric]);
    if (asked->metric == METRIC_PEAK_FORCE && law_of(scene)->form == CONTACT_IMPULSIVE)
        return problem_add(problem, STATUS_INVALID, pointer,
                           "peak_force needs contacts with a force: impulses have none, choose "
                           "another contact model");
    return STATUS_OK;
}

// The reasons are the target's, not a scene's that asked for a solver and its settings.
static Status tell(const Aim *aim, const Way *way, const char *name, PlanReport *report) {
    static const char *const chosen[] = {"solver", "tolerance", "modes", "contact_model"};
    const size_t of_target = COUNT(chosen) - (way->is_impulsive ? 0 : 1);
    Decisions *decisions = &report->decisions;
    for (size_t i = 0; i < decisions->count; i++)
        for (size_t k = 0; k < of_target; k++) {
            Decision *decision = &decisions->at[i];
            if (strcmp(decision->about, chosen[k]) != 0)
                continue;
            char *why = strdup("accuracy.target chose it");
            if (why == NULL)
                return STATUS_NO_MEMORY;
            free(decision->why);
            decision->why = why;
        }
    const Way whole = aim_whole(aim);
    const double all = way_cost(aim->simulation, &whole).steps;
    const char *metric = metric_names[aim->asked->metric];
    const size_t before = decisions->count;
    if (way_is_whole(way))
        TRY(decisions_add(decisions, "target", name, way->predicted, NULL,
                          aim->has_tolerance || aim->plan->storeys > 1
                              ? "nothing that could be given up is foretold to keep an error of "
                                "%.3g of %s"
                              : "no cheaper way keeps an error of %.3g of %s: its contacts and its "
                                "flight are known exactly, step for step",
                          aim->asked->target, metric));
    else
        TRY(decisions_add(decisions, "target", name, way->predicted, NULL,
                          "the cheapest way that is foretold to keep an error of %.3g of %s",
                          aim->asked->target, metric));
    if (!way_is_whole(way) && decisions->count > before && all > 0)
        decisions->at[before].saving = fmax(0, 1 - way_cost(aim->simulation, way).steps / all);
    return STATUS_OK;
}

static Status tell_target(const Aim *aim, const Way *way, PlanReport *report, Problem *problem) {
    char name[96];
    way_name(way, name);
    PlanTarget *target = &report->target;
    target->error = aim->asked->target;
    target->metric = aim->asked->metric;
    target->predicted_error = way->predicted;
    target->way = strdup(name);
    const Status status = target->way == NULL ? STATUS_NO_MEMORY : tell(aim, way, name, report);
    return status == STATUS_OK ? STATUS_OK : problem_set(problem, status, "no memory for the plan");
}

Status aim_plan(const Simulation *simulation, PlanReport *report, Problem *problem) {
    Aim aim;
    Simulation target = {0};
    Status status = aim_make(&aim, simulation, problem);
    if (status == STATUS_OK) {
        const Way way = aim_choose(&aim, aim.asked->target);
        status = way_apply(simulation, &way, &target, problem);
        if (status == STATUS_OK)
            status = simulation_plan(&target, report, problem);
        if (status == STATUS_OK && (status = tell_target(&aim, &way, report, problem)) != STATUS_OK)
            fields_clear(plan_report_fields, report);
    }
    simulation_clear(&target);
    aim_clear(&aim);
    return status;
}

Cost aim_cost(const Simulation *simulation) {
    Aim aim;
    Cost cost = {0};
    if (aim_make(&aim, simulation, NULL) == STATUS_OK) {
        const Way way = aim_choose(&aim, aim.asked->target);
        cost = way_cost(simulation, &way);
    }
    aim_clear(&aim);
    return cost;
}

// What is at hand while one way after the other is run.
typedef struct Session {
    Aim aim;
    const SimulationLimits *limits;
    const Progress *progress;
    Workspace *workspace;
    double done;      // of the whole
    double steps;     // of all runs
    Work work;        // of all runs
    Outcome *outcome; // of the last run; NULL: it failed
    PlanAttempts attempts;
} Session;

static Status add_attempt(Session *session, const Way *way, double estimated, double steps) {
    PlanAttempts *attempts = &session->attempts;
    PlanAttempt *at = realloc(attempts->at, (attempts->count + 1) * sizeof *at);
    if (at == NULL)
        return STATUS_NO_MEMORY;
    attempts->at = at;
    char name[96];
    way_name(way, name);
    char *text = strdup(name);
    if (text == NULL)
        return STATUS_NO_MEMORY;
    at[attempts->count++] = (PlanAttempt){text, way->predicted, estimated, steps};
    return STATUS_OK;
}

// Runs one way. A cheap one that fails leaves no outcome; `estimated` is 1 then.
static Status run_way(Session *session, const Way *way, double *estimated, Problem *problem) {
    Simulation target = {0};
    const double left = 1 - session->done;
    ProgressRange range =
        progress_range(session->progress, session->done, way_is_whole(way) ? left : left / 2);
    const Progress progress = progress_range_view(&range);
    outcome_unref(session->outcome);
    session->outcome = NULL;
    Problem *fault = way_is_whole(way) ? problem : calloc(1, sizeof *fault);
    Status status = way_apply(session->aim.simulation, way, &target, fault);
    if (status == STATUS_OK)
        status = simulation_run(&target, session->limits, &progress, session->workspace,
                                &session->outcome, fault);
    simulation_clear(&target);
    *estimated = 1;
    if (status == STATUS_OK) {
        *estimated = aim_estimate(&session->aim, way, session->outcome);
        session->steps += session->outcome->steps;
        work_add(&session->work, &session->outcome->work);
        if (add_attempt(session, way, *estimated, session->outcome->steps) != STATUS_OK)
            status = problem_set(fault, STATUS_NO_MEMORY, "no memory for a run");
    } else if (!way_is_whole(way) && status != STATUS_CANCELLED && status != STATUS_NO_MEMORY) {
        status = add_attempt(session, way, (double)NAN, (double)NAN);
    }
    if (fault != problem) {
        if (status != STATUS_OK)
            problem_set(problem, status, "%s", fault != NULL ? fault->detail : "no memory");
        free(fault);
    }
    session->done = range.from + range.share;
    return status;
}

// What fell short by so much is tightened as much, and a little more.
static Way tighten(const Session *session, const Way *way, double estimated) {
    const Aim *aim = &session->aim;
    const double share = aim->asked->target / estimated * margin;
    // Paths that have parted for good do not tell how fast.
    if (session->attempts.count + 1 >= ATTEMPTS || !(estimated < 0.3))
        return aim_whole(aim);
    const Way next = aim_choose(aim, way->predicted * share);
    return next;
}

static Status warn(const Session *session, double estimated) {
    const Aim *aim = &session->aim;
    const Summary *summary = &session->outcome->summary;
    const char *metric = metric_names[aim->asked->metric];
    char until[64] = "";
    if (estimated <= aim->asked->target)
        return STATUS_OK;
    if (!isnan(summary->trust_horizon))
        snprintf(until, sizeof until, "; to t = %.6g s the path is known to %g",
                 summary->trust_horizon, RESPONSE_PARTING);
    if (isnan(estimated))
        return warnings_add(&session->outcome->warnings, "/accuracy/target",
                            "whether the error of %s is below %.3g is not known: rounding parts "
                            "the path from the scene's own within the run%s",
                            metric, aim->asked->target, until);
    return warnings_add(&session->outcome->warnings, "/accuracy/target",
                        "the error of %s is about %.2g, more than %.3g: double precision gives no "
                        "better%s",
                        metric, estimated, aim->asked->target, until);
}

// Of steps, tolerances and modes that are too coarse the target's own warning speaks, for it chose
// them.
static void drop_advice(Warnings *warnings) {
    size_t left = 0;
    for (size_t i = 0; i < warnings->count; i++) {
        const char *pointer = warnings->at[i].pointer;
        if (strcmp(pointer, "/accuracy") == 0 || strcmp(pointer, "/accuracy/modes") == 0)
            fields_clear(warning_fields, &warnings->at[i]);
        else
            warnings->at[left++] = warnings->at[i];
    }
    warnings->count = left;
}

static Status finish(Session *session, const Way *way, double estimated, Problem *problem) {
    Outcome *outcome = session->outcome;
    PlanTarget *target = &outcome->plan.target;
    drop_advice(&outcome->warnings);
    TRY(tell_target(&session->aim, way, &outcome->plan, problem));
    target->estimated_error = estimated;
    target->verdict = isnan(estimated)                          ? VERDICT_UNKNOWN
                      : estimated <= session->aim.asked->target ? VERDICT_KEPT
                                                                : VERDICT_MISSED;
    target->attempts = session->attempts;
    session->attempts = (PlanAttempts){NULL, 0};
    outcome->steps = session->steps;
    outcome->work = session->work;
    return warn(session, estimated) == STATUS_OK
               ? STATUS_OK
               : problem_set(problem, STATUS_NO_MEMORY, "no memory for a warning");
}

// *outcome is of the way told by `way`.
static Status reach(const Simulation *simulation, const SimulationLimits *limits,
                    const Progress *progress, Workspace *workspace, Way *way, Outcome **outcome,
                    Problem *problem) {
    Session session = {.limits = limits, .progress = progress, .workspace = workspace};
    double estimated = 1;
    Status status = aim_make(&session.aim, simulation, problem);
    if (status == STATUS_OK) {
        *way = aim_choose(&session.aim, session.aim.asked->target);
        status = run_way(&session, way, &estimated, problem);
    }
    while (status == STATUS_OK && !way_is_whole(way) && !(estimated <= session.aim.asked->target)) {
        *way = tighten(&session, way, estimated);
        status = run_way(&session, way, &estimated, problem);
    }
    if (status == STATUS_OK)
        status = finish(&session, way, estimated, problem);
    if (status == STATUS_OK)
        *outcome = session.outcome;
    else
        outcome_unref(session.outcome);
    PlanTarget none = {.attempts = session.attempts};
    fields_clear(target_fields, &none);
    aim_clear(&session.aim);
    return status;
}

Status aim_run(const Simulation *simulation, const SimulationLimits *limits,
               const Progress *progress, Workspace *workspace, Outcome **outcome,
               Problem *problem) {
    Way way = {0};
    return reach(simulation, limits, progress, workspace, &way, outcome, problem);
}

Status aim_settle(const Simulation *simulation, const SimulationLimits *limits,
                  const Progress *progress, Workspace *workspace, Simulation *settled,
                  Problem *problem) {
    Way way = {0};
    Outcome *outcome = NULL;
    memset(settled, 0, sizeof *settled);
    TRY(reach(simulation, limits, progress, workspace, &way, &outcome, problem));
    outcome_unref(outcome);
    return way_apply(simulation, &way, settled, problem);
}
