// accuracy.target: the cheapest settings that keep a requested error. Every candidate is the solver
// exact with something given up: the tolerance of contacts under a power law, modes of a frame, or
// the duration of contacts. Its error is predicted from the error made at once and from the growth
// of an error until the end. The growth is guessed low on purpose: how sensitive a rattling mass is
// shows only in its run. A run that misses the target estimates its own error, and this calibrates
// the next candidate, which is cheaper than a first run that is too accurate. The constants come
// from random scenes, tests/truth/test_target.c.
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "core/result/response.h"
#include "core/simulation/internal.h"

enum { ATTEMPTS = 3, NAME = 96 };

static const double TURN = 6.28318530717958647693;
static const double ROUNDING = 1e-15;  // relative error of the most accurate contact
static const double ROUNDINGS = 1e-14; // error that a run without growth estimates for itself

// Upper bounds of the metric's relative error over that of the displacement. A slightly late impact
// falls into another sample interval. For the rms see target_rms_gain().
static const double gains[METRIC_COUNT] = {1, 200, 30, 10, 5000, 1, 30, 200};
// The same for lines of a spectrum over the rms of the motion.
static const double spectrum_gain = 10;

// Below the smallest tolerance a run costs as much as at the limit of rounding.
static const double tolerance_max = 0.1, tolerance_min = 1e-12;
static const double contact_share = 0.2; // error of displacement per error of a contact
static const double impacts_a_period = 2;
static const double growth_a_period = 0.2; // natural logarithm, where a base drives the mass
static const double growth_max = 40;
static const double dampers_margin = 0.4; // of the error that modes left out may make with dampers
// Of 150 random frames one in a hundred exceeded the second of these in an impulse run.
static const double strike_share = 5, strike_margin = 20;
static const double strike_worth =
    0.9;                        // impulses that cost a larger part of the whole save nothing
static const double calm = 1e4; // growth of rounding up to which truncation error is bounded
static const double modes_worth = 0.75;  // keeping a larger part of the modes saves nothing
static const double retry_margin = 0.03; // of the tightened error that a second run aims at

// Settings of the solver exact that give something up.
typedef struct Candidate {
    double tolerance;  // of contacts under a power law; NAN: none
    uint64_t modes;    // COUNT_ABSENT: all are kept
    bool is_impulsive; // impulses replace contacts that have a duration
    double predicted;  // relative error of the metric
} Candidate;

// A simulation with a target, and the predictions for it.
typedef struct AccuracyTarget {
    const Simulation *simulation;
    const AccuracyAuto *asked;
    Plan *plan; // with all modes
    bool has_tolerance;
    double impacts, growth;    // number of impacts, growth of an error until the end
    TruncationError *left_out; // by number of modes kept, from 1; NULL: keep all
    double strike_error;       // error of displacement by one impulse; NAN: not possible
} AccuracyTarget;

// Error of the metric by the modes left out.
static double target_modes_error(const AccuracyTarget *target, uint64_t kept) {
    const int metric = target->asked->metric;
    if (kept == COUNT_ABSENT)
        return 0;
    const TruncationError *error = &target->left_out[kept - 1];
    switch ((Metric)metric) {
    case METRIC_RMS_DISPLACEMENT: // over a part of the run oscillating errors may not average out
        return target->simulation->output.statistics_from > 0 ? error->displacement
                                                              : error->rms_displacement;
    case METRIC_MEAN_ACCELERATION:
        return error->mean_acceleration;
    case METRIC_PEAK_BASE_SHEAR: // a sum of accelerations
    case METRIC_PSD:             // of any channel, in each of its lines
        return fmin(fmax(error->mean_acceleration, error->displacement) * spectrum_gain, 1);
    default:
        return fmin(gains[metric] * error->displacement, 1);
    }
}

// Whether force or penetration of contacts is among the channels.
static bool target_needs_force(const Texts *names) {
    for (size_t i = 0; i < names->count; i++) {
        size_t number;
        const Channel *channel = channel_find(names->at[i], &number);
        if (channel == &channels[CHANNEL_CONTACT_FORCE] ||
            channel == &channels[CHANNEL_PENETRATION])
            return true;
    }
    return false;
}

// Relative error of the displacement by an impulse that comes half a contact early. The damper's
// part in the motion is its mass over the effective mass of its storey.
static double target_strike_error(const AccuracyTarget *target) {
    const Plan *plan = target->plan;
    const Output *output = &target->simulation->output;
    const int metric = target->asked->metric;
    if (plan->form != CONTACT_LINEAR || plan->damper_count == 0 || plan_is_single(plan) ||
        contact_law(scene_contact(&target->simulation->scene))->form != CONTACT_CHOSEN ||
        (metric != METRIC_DISPLACEMENT && metric != METRIC_RMS_DISPLACEMENT) ||
        target_needs_force(&output->channels) || target_needs_force(&output->psd.channels))
        return (double)NAN;
    double worst = 0;
    for (size_t i = 0; i < plan->report.derived.count; i++) {
        const PlanDamper *damper = &plan->dampers[i / 2];
        const double share = fmin(damper->mass / damper->effective_mass - 1, 1);
        const double time = plan->report.derived.at[i].contact_time;
        worst = fmax(worst, share * time * TURN * plan->report.modes.at[0].frequency);
        if (isnan(time))
            return (double)NAN;
    }
    return worst;
}

// Cleared by target_clear, also after a failure.
static Status target_make(AccuracyTarget *target, const Simulation *simulation,
                          const Progress *progress, Problem *problem) {
    const Scene *scene = &simulation->scene;
    *target = (AccuracyTarget){.simulation = simulation,
                               .asked = (const AccuracyAuto *)(const void *)simulation->accuracy};
    TRY(plan_new(scene, simulation->accuracy->kind->name, solver_exact.kind.name, &target->plan,
                 problem));
    target->has_tolerance = scene->dampers.count > 0 && target->plan->form == CONTACT_POWER;
    const double periods = target->plan->report.modes.at[0].frequency * scene->duration;
    const bool is_driven = excitation_kind(scene_excitation(scene)) != excitations[0];
    target->impacts = 1 + impacts_a_period * periods * (double)scene->dampers.count;
    target->growth = is_driven ? exp(fmin(growth_a_period * periods, growth_max)) : 1;
    target->strike_error = target_strike_error(target);
    if (target->plan->modes.count < 2)
        return STATUS_OK;
    target->left_out = calloc(target->plan->modes.count, sizeof *target->left_out);
    return target->left_out == NULL
               ? problem_set(problem, STATUS_NO_MEMORY, "no memory for the modes")
               : truncation_predict(target->plan, scene, progress, target->left_out);
}

static void target_clear(AccuracyTarget *target) {
    plan_free(target->plan);
    free(target->left_out);
}

// Largest displacement of the run over that after statistics_from. An early error is compared with
// a motion that may have decayed since.
static double target_decay(const Outcome *outcome) {
    const double largest = outcome->summary.peak_displacement;
    return fmax(outcome->response.peak_before_window, largest) / largest;
}

// The error of the rms is at most the largest difference over the rms. The difference is that large
// for a part of the run only, so it was less than a twelfth of that in every scene tried. In a late
// part of the run it may be that large all the time.
static double target_rms_gain(const Outcome *outcome) {
    const Summary *summary = &outcome->summary;
    const double shape = summary->peak_displacement / summary->rms_displacement;
    return outcome->response.peak_before_window > 0 ? target_decay(outcome) * shape : 0.2 * shape;
}

// Error of the metric for a relative error of the displacement; `outcome` may be NULL.
static double target_metric_error(const AccuracyTarget *target, double displacement,
                                  const Outcome *outcome) {
    double gain = gains[target->asked->metric];
    if (target->asked->metric == METRIC_RMS_DISPLACEMENT && outcome != NULL)
        gain = target_rms_gain(outcome);
    if (target->asked->metric == METRIC_PEAK_FORCE && outcome != NULL)
        gain *= target_decay(outcome);
    return displacement > 0 ? fmin(gain * displacement, 1) : 0;
}

// Error of the metric where each contact has the relative error `tolerance`.
static double target_contact_error(const AccuracyTarget *target, double tolerance) {
    return target_metric_error(target, contact_share * tolerance * target->impacts * target->growth,
                               NULL);
}

static bool candidate_is_whole(const Candidate *candidate) {
    return isnan(candidate->tolerance) && candidate->modes == COUNT_ABSENT &&
           !candidate->is_impulsive;
}

// Gives nothing up.
static Candidate candidate_whole(const AccuracyTarget *target) {
    return (Candidate){.tolerance = (double)NAN,
                       .modes = COUNT_ABSENT,
                       .predicted = target_contact_error(target, ROUNDING)};
}

// The loosest power of ten that keeps `error`; NAN: none saves anything.
static double target_choose_tolerance(const AccuracyTarget *target, double error) {
    const double most = error / target_contact_error(target, ROUNDING) * ROUNDING;
    const double tolerance = pow(10, floor(log10(fmin(most, tolerance_max)) + 1e-9));
    return tolerance >= tolerance_min * (1 - 1e-9) ? tolerance : (double)NAN;
}

static double target_modes_share(const AccuracyTarget *target) {
    return target->plan->damper_count > 0 ? dampers_margin : 1;
}

// The fewest modes that keep `error`; COUNT_ABSENT: all are needed.
static uint64_t target_choose_modes(const AccuracyTarget *target, double error) {
    const size_t n = target->plan->storeys;
    size_t kept = 1;
    while (kept < n && target_modes_error(target, kept) > target_modes_share(target) * error)
        kept++;
    return (double)kept <= modes_worth * (double)n ? kept : COUNT_ABSENT;
}

// "exact, tolerance 1e-06, 8 modes".
static void candidate_name(const Candidate *candidate, char name[NAME]) {
    int used = snprintf(name, NAME, "%s", solver_exact.kind.name);
    if (!isnan(candidate->tolerance))
        used +=
            snprintf(name + used, NAME - (size_t)used, ", tolerance %.3g", candidate->tolerance);
    if (candidate->modes != COUNT_ABSENT)
        used += snprintf(name + used, NAME - (size_t)used, ", %llu modes",
                         (unsigned long long)candidate->modes);
    if (candidate->is_impulsive)
        snprintf(name + used, NAME - (size_t)used, ", impulses");
}

// The completed simulation with the candidate's settings and without a target. Cleared by
// simulation_clear, also after a failure.
static Status candidate_apply(const Simulation *simulation, const Candidate *candidate,
                              Simulation *applied, Problem *problem) {
    Variant *accuracy = variant_new(&solver_exact.kind);
    Status status = fields_copy(simulation_fields, simulation, applied);
    if (accuracy == NULL || status != STATUS_OK) {
        variant_free(accuracy);
        return problem_set(problem, STATUS_NO_MEMORY, "no memory for a run");
    }
    variant_free(applied->accuracy);
    applied->accuracy = accuracy;
    applied->output.reduction = false; // made once, not for each candidate
    AccuracyExact *settings = (AccuracyExact *)(void *)accuracy;
    settings->tolerance = candidate->tolerance;
    settings->accuracy.modes = candidate->modes;
    if (!candidate->is_impulsive)
        return STATUS_OK;
    TRY(simulation_use_impulses(applied, problem));
    return simulation_validate(applied, NULL, NULL, problem);
}

static Cost candidate_cost(const Simulation *simulation, const Candidate *candidate) {
    Simulation applied = {0};
    Cost cost = {0}; // without memory: the run reports it
    if (candidate_apply(simulation, candidate, &applied, NULL) == STATUS_OK)
        cost = cost_scene(&applied);
    simulation_clear(&applied);
    return cost;
}

// The cheapest candidate that is predicted to keep `error` of the metric.
static Candidate target_choose(const AccuracyTarget *target, double error) {
    Candidate candidate = candidate_whole(target);
    const double share = target->has_tolerance && target->left_out != NULL ? error / 2 : error;
    if (target->has_tolerance)
        candidate.tolerance = target_choose_tolerance(target, share);
    if (target->left_out != NULL)
        candidate.modes = target_choose_modes(target, share);
    const double tolerance = isnan(candidate.tolerance) ? ROUNDING : candidate.tolerance;
    candidate.predicted = fmin(
        target_contact_error(target, tolerance) + target_modes_error(target, candidate.modes), 1);
    const double struck = strike_share * target->strike_error * target->impacts * target->growth;
    if (candidate_is_whole(&candidate) && struck <= error) {
        const Candidate strike = {.tolerance = (double)NAN,
                                  .modes = COUNT_ABSENT,
                                  .is_impulsive = true,
                                  .predicted = target_metric_error(target, struck, NULL)};
        if (candidate_cost(target->simulation, &strike).steps <
            strike_worth * candidate_cost(target->simulation, &candidate).steps)
            return strike;
    }
    return candidate;
}

// Relative error of the metric, estimated by the run itself; NAN: unknown.
static double target_estimate(const AccuracyTarget *target, const Candidate *candidate,
                              const Outcome *outcome) {
    // The run's estimate for modes left out is the prediction.
    const double own = outcome->summary.error_estimate - outcome->response.truncation_error;
    // Where the trajectories have diverged, the distance of their statistics is unknown.
    const int metric = target->asked->metric;
    const bool is_path = metric == METRIC_DISPLACEMENT || metric == METRIC_MEAN_ACCELERATION;
    if (isnan(own) || (own >= 1 && !is_path))
        return (double)NAN;
    double error = own;
    // The error of an impulse grows like a rounding.
    if (candidate->is_impulsive)
        error += strike_margin * target->strike_error * (double)outcome->summary.impacts *
                 fmax(own / ROUNDINGS, target->growth);
    double left_out = target_modes_error(target, candidate->modes) / target_modes_share(target);
    // Impacts make a missing mode grow like a rounding.
    if (left_out > 0 && target->plan->damper_count > 0 && own > calm * ROUNDINGS)
        left_out = 1;
    if ((metric == METRIC_RMS_DISPLACEMENT || metric == METRIC_PEAK_FORCE) && left_out > 0)
        left_out *= target_decay(outcome);
    return fmin(target_metric_error(target, error, outcome) + left_out, 1);
}

// Replaces the reasons of a scene that asks for a solver and its settings by the target, and adds
// the decision for the candidate.
static Status target_add_decisions(const AccuracyTarget *target, const Candidate *candidate,
                                   const char *name, Decisions *decisions) {
    static const char *const chosen[] = {"solver", "tolerance", "modes", "contact_model"};
    const size_t count = COUNT(chosen) - (candidate->is_impulsive ? 0 : 1);
    for (size_t i = 0; i < decisions->count; i++)
        for (size_t k = 0; k < count; k++)
            if (strcmp(decisions->at[i].about, chosen[k]) == 0)
                TRY(status_made(text_format(&decisions->at[i].why, "chosen by accuracy.target")));
    const char *metric = metric_names[target->asked->metric];
    const bool is_whole = candidate_is_whole(candidate);
    return decisions_add(
        decisions, "target", name, candidate->predicted, NULL,
        !is_whole ? "the cheapest settings that are predicted to keep an error of %.3g of %s"
        : target->has_tolerance || target->plan->storeys > 1
            ? "no cheaper settings are predicted to keep an error of %.3g of %s"
            : "no cheaper settings keep an error of %.3g of %s: contacts and flight "
              "have exact solutions",
        target->asked->target, metric);
}

static Status target_report(const AccuracyTarget *target, const Candidate *candidate,
                            PlanReport *report, Problem *problem) {
    char name[NAME];
    candidate_name(candidate, name);
    report->target.error = target->asked->target;
    report->target.metric = target->asked->metric;
    report->target.predicted_error = candidate->predicted;
    if (!text_format(&report->target.way, "%s", name) ||
        target_add_decisions(target, candidate, name, &report->decisions) != STATUS_OK)
        return problem_set(problem, STATUS_NO_MEMORY, "no memory for the plan");
    return STATUS_OK;
}

Status accuracy_target_plan(const Simulation *simulation, PlanReport *report, Problem *problem) {
    AccuracyTarget target;
    Simulation applied = {0};
    Status status = target_make(&target, simulation, NULL, problem);
    if (status == STATUS_OK) {
        const Candidate candidate = target_choose(&target, target.asked->target);
        status = candidate_apply(simulation, &candidate, &applied, problem);
        if (status == STATUS_OK)
            status = plan_scene(&applied, report, problem);
        if (status == STATUS_OK) {
            status = target_report(&target, &candidate, report, problem);
            if (status != STATUS_OK)
                fields_clear(plan_report_fields, report);
        }
    }
    simulation_clear(&applied);
    target_clear(&target);
    return status;
}

Cost accuracy_target_cost(const Simulation *simulation) {
    AccuracyTarget target;
    Cost cost = {0};
    if (target_make(&target, simulation, NULL, NULL) == STATUS_OK) {
        const Candidate candidate = target_choose(&target, target.asked->target);
        cost = candidate_cost(simulation, &candidate);
        if (target.left_out != NULL)
            cost.steps += cost_truncation(simulation);
        cost.cpu_seconds = cost.steps * SOLVER_STEP;
    }
    target_clear(&target);
    return cost;
}

// The runs of one candidate after the other.
typedef struct TargetSearch {
    AccuracyTarget target;
    const SimulationLimits *limits;
    const Progress *progress;
    Workspace *workspace;
    double done;       // part of the progress
    double steps;      // of all runs
    WorkCounters work; // of all runs
    Outcome *outcome;  // of the last run; NULL: it failed
    double estimated;  // error of the last run; 1: it failed
    PlanAttempts attempts;
} TargetSearch;

// Runs one candidate. A run that fails and gives something up leaves no outcome; the search goes
// on.
static Status search_run(TargetSearch *search, const Candidate *candidate, Problem *problem) {
    Simulation applied = {0};
    const bool is_whole = candidate_is_whole(candidate);
    const double share = (1 - search->done) * (is_whole ? 1 : 0.5);
    const Progress progress =
        progress_range_view(&(ProgressRange){search->progress, search->done, share, 0});
    outcome_unref(search->outcome);
    search->outcome = NULL;
    search->estimated = 1;
    search->done += share;
    Problem *fault = is_whole ? problem : NULL; // another candidate follows
    Status status = candidate_apply(search->target.simulation, candidate, &applied, fault);
    if (status == STATUS_OK)
        status = run_scene(&applied, search->limits, &progress, search->workspace, NULL,
                           &search->outcome, fault);
    simulation_clear(&applied);
    PlanAttempt attempt = {NULL, candidate->predicted, (double)NAN, (double)NAN};
    if (status == STATUS_OK) {
        attempt.estimated_error = search->estimated =
            target_estimate(&search->target, candidate, search->outcome);
        attempt.steps = search->outcome->steps;
        search->steps += attempt.steps;
        work_counters_add(&search->work, &search->outcome->work);
    } else if (is_whole || status == STATUS_CANCELLED || status == STATUS_NO_MEMORY) {
        return problem_set(problem, status,
                           status == STATUS_CANCELLED ? "cancelled" : "no memory for a run");
    }
    char name[NAME];
    candidate_name(candidate, name);
    PlanAttempt *added = list_append(&search->attempts, sizeof *added);
    if (added == NULL || (attempt.way = strdup(name)) == NULL)
        return problem_set(problem, STATUS_NO_MEMORY, "no memory for a run");
    *added = attempt;
    return STATUS_OK;
}

// The next candidate: tightened by the factor that the last one missed, with a margin.
static Candidate search_tighten(const TargetSearch *search, const Candidate *candidate) {
    const AccuracyTarget *target = &search->target;
    // Trajectories that have diverged do not show how fast errors grow.
    if (search->attempts.count + 1 >= ATTEMPTS || !(search->estimated < 0.3))
        return candidate_whole(target);
    const double share = target->asked->target / search->estimated * retry_margin;
    return target_choose(target, candidate->predicted * share);
}

static Status search_warn(const TargetSearch *search) {
    const AccuracyTarget *target = &search->target;
    const Summary *summary = &search->outcome->summary;
    const char *metric = metric_names[target->asked->metric];
    char until[80] = "";
    if (search->estimated <= target->asked->target)
        return STATUS_OK;
    if (!isnan(summary->trust_horizon))
        snprintf(until, sizeof until, "; up to t = %.6g s the trajectory is valid to %g",
                 summary->trust_horizon, RESPONSE_DIVERGENCE);
    if (isnan(search->estimated))
        return warnings_add(
            &search->outcome->warnings, "/accuracy/target",
            "whether the error of %s is below %.3g is unknown: rounding errors grow "
            "until the trajectory diverges within the run%s",
            metric, target->asked->target, until);
    return warnings_add(&search->outcome->warnings, "/accuracy/target",
                        "the error of %s is about %.2g, more than %.3g: double precision allows no "
                        "smaller one%s",
                        metric, search->estimated, target->asked->target, until);
}

// The target chose steps, tolerances and modes, so its own warning replaces those about them.
static void search_drop_warnings(Warnings *warnings) {
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

static Status search_finish(TargetSearch *search, const Candidate *candidate, Problem *problem) {
    Outcome *outcome = search->outcome;
    PlanTarget *reported = &outcome->plan.target;
    search_drop_warnings(&outcome->warnings);
    TRY(target_report(&search->target, candidate, &outcome->plan, problem));
    reported->estimated_error = search->estimated;
    reported->verdict = isnan(search->estimated)                            ? VERDICT_UNKNOWN
                        : search->estimated <= search->target.asked->target ? VERDICT_KEPT
                                                                            : VERDICT_MISSED;
    reported->attempts = search->attempts;
    search->attempts = (PlanAttempts){NULL, 0};
    outcome->steps = search->steps;
    outcome->work = search->work;
    return search_warn(search) == STATUS_OK
               ? STATUS_OK
               : problem_set(problem, STATUS_NO_MEMORY, "no memory for a warning");
}

Status accuracy_target_run(const Simulation *simulation, const SimulationLimits *limits,
                           const Progress *progress, Workspace *workspace, Simulation *settled,
                           Outcome **outcome, Problem *problem) {
    TargetSearch search = {.limits = limits, .progress = progress, .workspace = workspace};
    Candidate candidate = {0};
    Status status = target_make(&search.target, simulation, progress, problem);
    if (status == STATUS_OK) {
        candidate = target_choose(&search.target, search.target.asked->target);
        status = search_run(&search, &candidate, problem);
    }
    while (status == STATUS_OK && !candidate_is_whole(&candidate) &&
           !(search.estimated <= search.target.asked->target)) {
        candidate = search_tighten(&search, &candidate);
        status = search_run(&search, &candidate, problem);
    }
    if (status == STATUS_OK)
        status = search_finish(&search, &candidate, problem);
    if (status == STATUS_OK && settled != NULL)
        status = candidate_apply(simulation, &candidate, settled, problem);
    if (status == STATUS_OK)
        *outcome = search.outcome;
    else
        outcome_unref(search.outcome);
    fields_clear(target_fields, &(PlanTarget){.attempts = search.attempts});
    target_clear(&search.target);
    return status;
}
