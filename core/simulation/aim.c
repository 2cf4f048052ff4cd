// Every way is the solver exact with something given up: the tolerance of contacts under a power
// law, or modes of a frame. What it costs in accuracy is foretold in two steps: the error that is
// made at once, and how much a scene makes of an error until its end. The second is a guess (how
// sensitive a rattling mass is shows only in its run) and is made low: a run that falls short tells
// by its own estimate how much the scene really made of it, so that the next one fits, and that
// costs less than a first one that is exacter than asked for.
#include "core/simulation/aim.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "core/plan/truncation.h"
#include "core/result/metric.h"
#include "core/solve/solvers.h"

enum { ATTEMPTS = 3 };
static const double ROUNDING = 1e-15; // of a contact at its exactest, about

// By how much the metric's relative error may be larger than the displacement's. An impact that
// comes a little late falls into another sample interval; of the rms, see metric_error.
static const double gains[METRICS] = {1, 200, 30, 10, 5000, 5};

// By how much lines of a spectrum may be more wrong than the motion's rms.
static const double spectrum_gain = 10;

// Tolerances worth their own run: below, rounding's edge costs hardly more.
static const double tolerance_most = 0.1, tolerance_least = 1e-12;
static const double contact_share = 0.05; // error of displacement per error of a contact
static const double impacts_a_period = 2;
static const double growth_a_period = 0.2; // natural logarithm, where a base drives the mass
static const double growth_most = 40;
static const double margin = 0.3; // of what an estimate says a second run may take

// Of the error asked for, what may be foretold of modes left out: without dampers that is seldom
// less than they do, with them it may be many times less.
static const double modes_margin = 0.7, dampers_margin = 0.1;
static const double modes_worth = 0.75; // keeping more than this part is not worth while

// One way to run the scene: what it gives up.
typedef struct Way {
    double tolerance; // NAN: none
    uint64_t modes;   // COUNT_ABSENT: all are kept
    double predicted; // relative error of the metric
} Way;

typedef struct Aim {
    const Simulation *simulation;
    const AccuracyAuto *asked;
    Plan *plan;
    bool has_tolerance;
    double impacts, growth; // foretold
    double *modes_error;    // of the metric by the modes kept, from 1 on; NULL: all are
} Aim;

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

static double truncation_error(const TruncationError *error, int metric) {
    switch ((Metric)metric) {
    case METRIC_DISPLACEMENT:
        return error->displacement;
    case METRIC_RMS_DISPLACEMENT:
        return error->rms_displacement;
    case METRIC_MEAN_ACCELERATION:
        return error->mean_acceleration;
    case METRIC_PSD: // of any channel, in each of its lines
        return fmin(fmax(error->mean_acceleration, error->displacement) * spectrum_gain, 1);
    default:
        return fmin(gains[metric] * error->displacement, 1);
    }
}

static Status foretell_modes(Aim *aim, Problem *problem) {
    const Scene *scene = &aim->simulation->scene;
    const size_t n = aim->plan->storeys;
    if (aim->plan->modes.count < 2)
        return STATUS_OK;
    TruncationError *errors = calloc(n, sizeof *errors);
    aim->modes_error = calloc(n, sizeof *aim->modes_error);
    Status status = errors == NULL || aim->modes_error == NULL
                        ? problem_set(problem, STATUS_NO_MEMORY, "no memory for the modes")
                        : truncation_predict(aim->plan, scene, errors);
    for (size_t k = 0; k < n && status == STATUS_OK; k++)
        aim->modes_error[k] = truncation_error(&errors[k], aim->asked->metric);
    free(errors);
    return status;
}

static Status aim_make(Aim *aim, const Simulation *simulation, Problem *problem) {
    const Scene *scene = &simulation->scene;
    *aim = (Aim){.simulation = simulation, .asked = asked_of(simulation)};
    TRY(plan_new(scene, simulation->accuracy->kind->name, solver_exact.kind.name, &aim->plan,
                 problem));
    aim->has_tolerance = scene->dampers.count > 0 && aim->plan->form == CONTACT_POWER;
    const double periods = aim->plan->report.modes.at[0].frequency * scene->duration;
    const bool is_driven = excitation_kind(scene_excitation(scene)) != excitations[0];
    aim->impacts = 1 + impacts_a_period * periods * (double)scene->dampers.count;
    aim->growth = is_driven ? exp(fmin(growth_a_period * periods, growth_most)) : 1;
    return foretell_modes(aim, problem);
}

static void aim_clear(Aim *aim) {
    plan_free(aim->plan);
    free(aim->modes_error);
}

// What a relative error of displacement comes to in the metric.
static double metric_error(const Aim *aim, double displacement, const Summary *summary) {
    double gain = gains[aim->asked->metric];
    // Of the rms it is surely no more than the largest difference over the rms.
    if (aim->asked->metric == METRIC_RMS_DISPLACEMENT && summary != NULL)
        gain = summary->peak_displacement / summary->rms_displacement;
    return fmin(gain * displacement, 1);
}

// Of the displacement, by contacts that are wrong by so much each.
static double contact_error(const Aim *aim, double tolerance) {
    return contact_share * tolerance * aim->impacts * aim->growth;
}

static const Way whole = {.tolerance = (double)NAN, .modes = COUNT_ABSENT, .predicted = 0};

static bool is_whole(const Way *way) {
    return isnan(way->tolerance) && way->modes == COUNT_ABSENT;
}

static Way whole_way(const Aim *aim) {
    Way way = whole;
    way.predicted = metric_error(aim, contact_error(aim, ROUNDING), NULL);
    return way;
}

// The loosest decade that keeps `error`; NAN: none is worth while.
static double choose_tolerance(const Aim *aim, double error) {
    const double most = error / metric_error(aim, contact_error(aim, ROUNDING), NULL) * ROUNDING;
    const double tolerance = pow(10, floor(log10(fmin(most, tolerance_most)) + 1e-9));
    return tolerance >= tolerance_least * (1 - 1e-9) ? tolerance : (double)NAN;
}

static double modes_share(const Aim *aim) {
    return aim->plan->damper_count > 0 ? dampers_margin : modes_margin;
}

// The fewest modes that keep `error`; COUNT_ABSENT: it takes all.
static uint64_t choose_modes(const Aim *aim, double error) {
    const size_t n = aim->plan->storeys;
    size_t kept = 1;
    while (kept < n && aim->modes_error[kept - 1] > modes_share(aim) * error)
        kept++;
    return (double)kept <= modes_worth * (double)n ? kept : COUNT_ABSENT;
}

// The error of modes left out, of the metric.
static double modes_error(const Aim *aim, const Way *way) {
    return way->modes == COUNT_ABSENT ? 0 : aim->modes_error[way->modes - 1];
}

// The cheapest way foretold to keep `error`.
static Way choose(const Aim *aim, double error) {
    Way way = whole;
    const double share = aim->has_tolerance && aim->modes_error != NULL ? error / 2 : error;
    if (aim->has_tolerance)
        way.tolerance = choose_tolerance(aim, share);
    if (aim->modes_error != NULL)
        way.modes = choose_modes(aim, share);
    const double tolerance = isnan(way.tolerance) ? ROUNDING : way.tolerance;
    way.predicted =
        fmin(metric_error(aim, contact_error(aim, tolerance), NULL) + modes_error(aim, &way), 1);
    return way;
}

static void way_name(const Way *way, char name[96]) {
    int used = snprintf(name, 96, "%s", solver_exact.kind.name);
    if (!isnan(way->tolerance))
        used += snprintf(name + used, 96 - (size_t)used, ", tolerance %.3g", way->tolerance);
    if (way->modes != COUNT_ABSENT)
        snprintf(name + used, 96 - (size_t)used, ", %llu modes", (unsigned long long)way->modes);
}

static void *setting(Variant *accuracy, const char *name) {
    size_t offset = 0;
    const Field *row = fields_find(accuracy->kind->fields, name, &offset);
    return row == NULL ? NULL : (char *)accuracy + offset + row->offset;
}

// The simulation by one way: all but its accuracy is borrowed. Freed by variant_free(accuracy).
static Status view_make(const Simulation *simulation, const Way *way, Simulation *view) {
    *view = *simulation;
    if ((view->accuracy = variant_new(&solver_exact.kind)) == NULL)
        return STATUS_NO_MEMORY;
    double *tolerance = setting(view->accuracy, "tolerance");
    if (tolerance != NULL && !isnan(way->tolerance))
        *tolerance = way->tolerance;
    uint64_t *modes = setting(view->accuracy, "modes");
    if (modes != NULL && way->modes != COUNT_ABSENT)
        *modes = way->modes;
    return STATUS_OK;
}

static double way_steps(const Simulation *simulation, const Way *way) {
    Simulation view;
    if (view_make(simulation, way, &view) != STATUS_OK)
        return 0; // a guess without memory: the run will tell
    const double steps = simulation_cost(&view).steps;
    variant_free(view.accuracy);
    return steps;
}

// The reasons are the target's, not a scene's that asked for a solver and its settings.
static Status tell(const Aim *aim, const Way *way, const char *name, PlanReport *report) {
    static const char *const chosen[] = {"solver", "tolerance", "modes"};
    Decisions *decisions = &report->decisions;
    for (size_t i = 0; i < decisions->count; i++)
        for (size_t k = 0; k < COUNT(chosen); k++) {
            Decision *decision = &decisions->at[i];
            if (strcmp(decision->about, chosen[k]) != 0)
                continue;
            char *why = strdup("accuracy.target chose it");
            if (why == NULL)
                return STATUS_NO_MEMORY;
            free(decision->why);
            decision->why = why;
        }
    const double all = way_steps(aim->simulation, &whole);
    const char *metric = metric_names[aim->asked->metric];
    const size_t before = decisions->count;
    if (is_whole(way))
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
    if (!is_whole(way) && decisions->count > before && all > 0)
        decisions->at[before].saving = fmax(0, 1 - way_steps(aim->simulation, way) / all);
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
    Simulation view;
    TRY(aim_make(&aim, simulation, problem));
    const Way way = choose(&aim, aim.asked->target);
    Status status = view_make(simulation, &way, &view) == STATUS_OK
                        ? STATUS_OK
                        : problem_set(problem, STATUS_NO_MEMORY, "no memory for the plan");
    if (status == STATUS_OK) {
        status = simulation_plan(&view, report, problem);
        variant_free(view.accuracy);
    }
    if (status == STATUS_OK && (status = tell_target(&aim, &way, report, problem)) != STATUS_OK)
        fields_clear(plan_report_fields, report);
    aim_clear(&aim);
    return status;
}

Cost aim_cost(const Simulation *simulation) {
    Aim aim;
    Simulation view;
    Cost cost = {0};
    if (aim_make(&aim, simulation, NULL) == STATUS_OK) {
        const Way way = choose(&aim, aim.asked->target);
        if (view_make(simulation, &way, &view) == STATUS_OK) {
            cost = simulation_cost(&view);
            variant_free(view.accuracy);
        }
    }
    aim_clear(&aim);
    return cost;
}

// What is at hand while one way after the other is run.
typedef struct Session {
    Aim aim;
    const SimulationLimits *limits;
    const Watch *watch;
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

// The run's own estimate, as the metric has it; NAN: unknown.
static double estimate(const Aim *aim, const Way *way, const Outcome *outcome) {
    // Of modes left out it says only what was foretold of them.
    const double own = outcome->summary.error_estimate - outcome->response.given_up;
    // Where the paths have parted their statistics are near each other, nobody knows how near.
    const bool is_path =
        aim->asked->metric == METRIC_DISPLACEMENT || aim->asked->metric == METRIC_MEAN_ACCELERATION;
    if (isnan(own) || (own >= 1 && !is_path))
        return (double)NAN;
    return fmin(
        metric_error(aim, own, &outcome->summary) + modes_error(aim, way) / modes_share(aim), 1);
}

// Runs one way. A cheap one that fails leaves no outcome; `estimated` is 1 then.
static Status run_way(Session *session, const Way *way, double *estimated, Problem *problem) {
    Simulation view;
    const double left = 1 - session->done;
    Stage stage = stage_of(session->watch, session->done, is_whole(way) ? left : left / 2);
    const Watch watch = stage_watch(&stage);
    outcome_drop(session->outcome);
    session->outcome = NULL;
    if (view_make(session->aim.simulation, way, &view) != STATUS_OK)
        return problem_set(problem, STATUS_NO_MEMORY, "no memory for a run");
    Problem *fault = is_whole(way) ? problem : calloc(1, sizeof *fault);
    Status status = simulation_run(&view, session->limits, &watch, session->workspace,
                                   &session->outcome, fault);
    variant_free(view.accuracy);
    *estimated = 1;
    if (status == STATUS_OK) {
        *estimated = estimate(&session->aim, way, session->outcome);
        session->steps += session->outcome->steps;
        work_add(&session->work, &session->outcome->work);
        if (add_attempt(session, way, *estimated, session->outcome->steps) != STATUS_OK)
            status = problem_set(fault, STATUS_NO_MEMORY, "no memory for a run");
    } else if (!is_whole(way) && status != STATUS_CANCELLED && status != STATUS_NO_MEMORY) {
        status = STATUS_OK;
    }
    if (fault != problem) {
        if (status != STATUS_OK)
            problem_set(problem, status, "%s", fault != NULL ? fault->detail : "no memory");
        free(fault);
    }
    session->done = stage.from + stage.share;
    return status;
}

// What fell short by so much is tightened as much, and a little more.
static Way tighten(const Session *session, const Way *way, double estimated) {
    const Aim *aim = &session->aim;
    const double share = aim->asked->target / estimated * margin;
    // Paths that have parted for good do not tell how fast.
    if (session->attempts.count + 1 >= ATTEMPTS || !(estimated < 0.3))
        return whole_way(aim);
    const Way next = choose(aim, way->predicted * share);
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

static Status finish(Session *session, const Way *way, double estimated, Problem *problem) {
    Outcome *outcome = session->outcome;
    PlanTarget *target = &outcome->plan.target;
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

Status aim_run(const Simulation *simulation, const SimulationLimits *limits, const Watch *watch,
               Workspace *workspace, Outcome **outcome, Problem *problem) {
    Session session = {.limits = limits, .watch = watch, .workspace = workspace};
    double estimated = 1;
    Status status = aim_make(&session.aim, simulation, problem);
    Way way = whole;
    if (status == STATUS_OK) {
        way = choose(&session.aim, session.aim.asked->target);
        status = run_way(&session, &way, &estimated, problem);
    }
    while (status == STATUS_OK && !is_whole(&way) && !(estimated <= session.aim.asked->target)) {
        way = tighten(&session, &way, estimated);
        status = run_way(&session, &way, &estimated, problem);
    }
    if (status == STATUS_OK)
        status = finish(&session, &way, estimated, problem);
    if (status == STATUS_OK)
        *outcome = session.outcome;
    else
        outcome_drop(session.outcome);
    PlanTarget none = {.attempts = session.attempts};
    fields_clear(target_fields, &none);
    aim_clear(&session.aim);
    return status;
}
