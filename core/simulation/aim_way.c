// Every way is the solver exact with something given up: the tolerance of contacts under a power
// law, modes of a frame, or the time that contacts take. What it costs in accuracy is foretold in
// two steps: the error that is made at once, and how much a scene makes of an error until its end.
// The second is a guess (how sensitive a rattling mass is shows only in its run) and is made low: a
// run that falls short tells by its own estimate how much the scene really made of it, so that the
// next one fits, and that costs less than a first one that is exacter than asked for. The constants
// are what tests/truth/test_target.c shows over random scenes.
#include "core/simulation/aim_way.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>

#include "core/plan/modal_truncation.h"
#include "core/result/metric.h"
#include "core/simulation/impulse_variant.h"
#include "core/solve/exact_accuracy.h"
#include "core/solve/solvers.h"

static const double TURN = 6.28318530717958647693;
static const double ROUNDING = 1e-15;  // of a contact at its exactest, about
static const double ROUNDINGS = 1e-14; // what a calm run's own estimate comes to

// By how much the metric's relative error may be larger than the displacement's. An impact that
// comes a little late falls into another sample interval; of the rms, see metric_error.
static const double gains[METRICS] = {1, 200, 30, 10, 5000, 1};

// By how much lines of a spectrum may be more wrong than the motion's rms.
static const double spectrum_gain = 10;

// Tolerances worth their own run: below, rounding's edge costs hardly more.
static const double tolerance_max = 0.1, tolerance_min = 1e-12;
static const double contact_share = 0.2; // error of displacement per error of a contact
static const double impacts_a_period = 2;
static const double growth_a_period = 0.2; // natural logarithm, where a base drives the mass
static const double growth_max = 40;
// less than they do, with them it may be many times less.
static const double modes_margin = 0.7, dampers_margin = 0.4;
// Of 150 random frames one in a hundred had more than the second of these in an impulse run.
static const double strike_share = 5, strike_margin = 20;
static const double strike_worth = 0.9; // impulses that take more of the whole save nothing
static const double calm = 1e4; // roundings that a run with fewer modes and dampers may come to
static const double modes_worth = 0.75; // keeping more than this part is not worth while

static const AccuracyAuto *asked_of(const Simulation *simulation) {
    return (const AccuracyAuto *)(const void *)simulation->accuracy;
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

// Whether a channel, or a density, of contacts is asked for.
static bool is_force_asked(const Texts *names) {
    for (size_t i = 0; i < names->count; i++) {
        size_t number;
        const Channel *channel = channel_find(names->at[i], &number);
        if (channel == &channels[CHANNEL_CONTACT_FORCE] ||
            channel == &channels[CHANNEL_PENETRATION])
            return true;
    }
    return false;
}

// Of the displacement, relative: a push that comes as a blow, half a contact earlier. The damper's
// part in the motion is its mass over what its storey seems to weigh.
static double foretell_strike(const Aim *aim) {
    const Plan *plan = aim->plan;
    const Output *output = &aim->simulation->output;
    const int metric = aim->asked->metric;
    if (plan->form != CONTACT_LINEAR || plan->damper_count == 0 || plan_is_single(plan) ||
        contact_law(scene_contact(&aim->simulation->scene))->form != CONTACT_CHOSEN ||
        (metric != METRIC_DISPLACEMENT && metric != METRIC_RMS_DISPLACEMENT) ||
        is_force_asked(&output->channels) || is_force_asked(&output->psd.channels))
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
    // A part of the run has not the time in which errors that swing otherwise even out.
    const bool is_part = aim->simulation->output.statistics_from > 0;
    const int metric = aim->asked->metric == METRIC_RMS_DISPLACEMENT && is_part
                           ? METRIC_DISPLACEMENT
                           : aim->asked->metric;
    for (size_t k = 0; k < n && status == STATUS_OK; k++)
        aim->modes_error[k] = truncation_error(&errors[k], metric);
    free(errors);
    return status;
}

Status aim_make(Aim *aim, const Simulation *simulation, Problem *problem) {
    const Scene *scene = &simulation->scene;
    *aim = (Aim){.simulation = simulation, .asked = asked_of(simulation)};
    TRY(plan_new(scene, simulation->accuracy->kind->name, solver_exact.kind.name, &aim->plan,
                 problem));
    aim->has_tolerance = scene->dampers.count > 0 && aim->plan->form == CONTACT_POWER;
    const double periods = aim->plan->report.modes.at[0].frequency * scene->duration;
    const bool is_driven = excitation_kind(scene_excitation(scene)) != excitations[0];
    aim->impacts = 1 + impacts_a_period * periods * (double)scene->dampers.count;
    aim->growth = is_driven ? exp(fmin(growth_a_period * periods, growth_max)) : 1;
    aim->strike_error = foretell_strike(aim);
    return foretell_modes(aim, problem);
}

void aim_clear(Aim *aim) {
    plan_free(aim->plan);
    free(aim->modes_error);
}

// The largest displacement of the run over that which its numbers are of: an error made before
// statistics_from is beside a motion that may have died away since.
static double faded(const Outcome *outcome) {
    const double largest = outcome->summary.peak_displacement;
    return fmax(outcome->response.earlier, largest) / largest;
}

// Of the rms the error is surely no more than the largest difference over the rms; as the
// difference is that large for a part of the run only, it was less than a twelfth of that in every
// scene tried. A late part of the run may be off by as much all the time.
static double rms_gain(const Outcome *outcome) {
    const Summary *summary = &outcome->summary;
    const double shape = summary->peak_displacement / summary->rms_displacement;
    return outcome->response.earlier > 0 ? faded(outcome) * shape : 0.2 * shape;
}

// What a relative error of displacement comes to in the metric.
static double metric_error(const Aim *aim, double displacement, const Outcome *outcome) {
    double gain = gains[aim->asked->metric];
    if (aim->asked->metric == METRIC_RMS_DISPLACEMENT && outcome != NULL)
        gain = rms_gain(outcome);
    if (aim->asked->metric == METRIC_PEAK_FORCE && outcome != NULL)
        gain *= faded(outcome);
    return displacement > 0 ? fmin(gain * displacement, 1) : 0;
}

// Of the displacement, by contacts that are wrong by so much each.
static double contact_error(const Aim *aim, double tolerance) {
    return contact_share * tolerance * aim->impacts * aim->growth;
}

static const Way whole = {.tolerance = (double)NAN, .modes = COUNT_ABSENT};

bool way_is_whole(const Way *way) {
    return isnan(way->tolerance) && way->modes == COUNT_ABSENT && !way->is_impulsive;
}

Way aim_whole(const Aim *aim) {
    Way way = whole;
    way.predicted = metric_error(aim, contact_error(aim, ROUNDING), NULL);
    return way;
}

// The loosest decade that keeps `error`; NAN: none is worth while.
static double choose_tolerance(const Aim *aim, double error) {
    const double most = error / metric_error(aim, contact_error(aim, ROUNDING), NULL) * ROUNDING;
    const double tolerance = pow(10, floor(log10(fmin(most, tolerance_max)) + 1e-9));
    return tolerance >= tolerance_min * (1 - 1e-9) ? tolerance : (double)NAN;
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

// Of the displacement, by impulses in place of contacts. NAN: they are not to be had.
static double strikes_error(const Aim *aim, double growth) {
    return strike_share * aim->strike_error * aim->impacts * growth;
}

// The cheapest way foretold to keep `error`.
Way aim_choose(const Aim *aim, double error) {
    Way way = whole;
    const double share = aim->has_tolerance && aim->modes_error != NULL ? error / 2 : error;
    if (aim->has_tolerance)
        way.tolerance = choose_tolerance(aim, share);
    if (aim->modes_error != NULL)
        way.modes = choose_modes(aim, share);
    const double tolerance = isnan(way.tolerance) ? ROUNDING : way.tolerance;
    way.predicted =
        fmin(metric_error(aim, contact_error(aim, tolerance), NULL) + modes_error(aim, &way), 1);
    const double struck = strikes_error(aim, aim->growth);
    if (way_is_whole(&way) && struck <= error) {
        const Way strike = {.tolerance = (double)NAN,
                            .modes = COUNT_ABSENT,
                            .is_impulsive = true,
                            .predicted = metric_error(aim, struck, NULL)};
        if (way_cost(aim->simulation, &strike).steps <
            strike_worth * way_cost(aim->simulation, &way).steps)
            return strike;
    }
    return way;
}

void way_name(const Way *way, char name[96]) {
    int used = snprintf(name, 96, "%s", solver_exact.kind.name);
    if (!isnan(way->tolerance))
        used += snprintf(name + used, 96 - (size_t)used, ", tolerance %.3g", way->tolerance);
    if (way->modes != COUNT_ABSENT)
        used += snprintf(name + used, 96 - (size_t)used, ", %llu modes",
                         (unsigned long long)way->modes);
    if (way->is_impulsive)
        snprintf(name + used, 96 - (size_t)used, ", impulses");
}

Status way_apply(const Simulation *simulation, const Way *way, Simulation *target,
                 Problem *problem) {
    Variant *accuracy = variant_new(&solver_exact.kind);
    Status status = fields_copy(simulation_fields, simulation, target);
    if (accuracy == NULL || status != STATUS_OK) {
        variant_free(accuracy);
        return problem_set(problem, STATUS_NO_MEMORY, "no memory for a run");
    }
    variant_free(target->accuracy);
    target->accuracy = accuracy;
    target->output.reduction = false; // of the whole, not of each way
    AccuracyExact *settings = (AccuracyExact *)(void *)accuracy;
    settings->tolerance = way->tolerance;
    settings->accuracy.modes = way->modes;
    if (!way->is_impulsive)
        return STATUS_OK;
    TRY(impulses_take(target, problem));
    return simulation_complete(target, NULL, NULL, problem);
}

Cost way_cost(const Simulation *simulation, const Way *way) {
    Simulation target = {0};
    Cost cost = {0}; // a guess without memory: the run will tell
    if (way_apply(simulation, way, &target, NULL) == STATUS_OK)
        cost = simulation_cost(&target);
    simulation_clear(&target);
    return cost;
}

double aim_estimate(const Aim *aim, const Way *way, const Outcome *outcome) {
    // Of modes left out it says only what was foretold of them.
    const double own = outcome->summary.error_estimate - outcome->response.given_up;
    // Where the paths have parted their statistics are near each other, nobody knows how near.
    const bool is_path =
        aim->asked->metric == METRIC_DISPLACEMENT || aim->asked->metric == METRIC_MEAN_ACCELERATION;
    if (isnan(own) || (own >= 1 && !is_path))
        return (double)NAN;
    double error = own;
    // What became of a rounding becomes of a blow that is a push.
    if (way->is_impulsive)
        error += strike_margin * aim->strike_error * (double)outcome->summary.impacts *
                 fmax(own / ROUNDINGS, aim->growth);
    double left_out = modes_error(aim, way) / modes_share(aim);
    // What impacts make of a rounding they make of a mode that is missing.
    if (left_out > 0 && aim->plan->damper_count > 0 && own > calm * ROUNDINGS)
        left_out = 1;
    const int metric = aim->asked->metric;
    if ((metric == METRIC_RMS_DISPLACEMENT || metric == METRIC_PEAK_FORCE) && left_out > 0)
        left_out *= faded(outcome);
    return fmin(metric_error(aim, error, outcome) + left_out, 1);
}
