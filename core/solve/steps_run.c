// The neighbour's steps are up to twice as long and end at samples too, but nowhere else with the
// run's; where the run has one step to a sample interval it has one to two of them. Where no
// contact has begun or ended, errors are as the step to the method's order, which makes the run's
// error of the difference. Across contacts they depend on how far into a stop the steps happen to
// end: there no more can be said than that the error may be some times the difference, or what the
// energies are wrong by. Steps without a fixed length cannot be made longer where samples and kinks
// end them: there the neighbour is the better one, with half the length at most and a hundredth of
// the tolerance.
#include "core/solve/steps_run.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "core/math/ode.h"
#include "core/plan/plan.h"

// Parts of the fastest period and of the shortest contact that a step is of by itself.
static const double PARTS = 30;
static const double SHARE_MAX = 1e12;
static const double FINER = 10; // tolerance
static const double CHANCE = 6; // what the difference is taken for with contacts
static const double TURN = 6.28318530717958647693;

// clang-format off
const Field accuracy_step_fields[] = {
    FIELD_BASE(AccuracyStep, accuracy, accuracy_fields),
    FIELD_REAL(AccuracyStep, step, "s", ABOVE(0), OPTIONAL, "length of a step, made a whole fraction of the sample interval; if absent a 30th of the fastest mode's period and of the shortest contact, at most the sample interval"),
    FIELD_END
};
// clang-format on

// Of an isolated contact; under a power law of one that begins with 1 m/s.
static double contact_time(const PlanDamper *damper, const PlanStop *stop, double speed) {
    const ContactParameters at = stops_freeze(stop, speed);
    const double mass = damper->effective_mass;
    if (stop->contact.law != NULL && stop->contact.law->form == CONTACT_POWER)
        return stop->contact.duration *
               pow(mass * speed * speed / at.stiffness, 1 / (at.exponent + 1)) / speed;
    const Identified found =
        identify_given(mass, at.stiffness, at.damping, (Separation)stop->contact.separation);
    // An overdamped one is as fast as its damping.
    return isfinite(found.contact_time) ? found.contact_time : mass / at.damping;
}

double steps_contact_time(const Plan *plan) {
    double least = INFINITY;
    for (size_t d = 0; d < plan->damper_count && plan->form != CONTACT_IMPULSIVE; d++)
        for (int side = 0; side < 2; side++) {
            const PlanStop *stop = &plan->dampers[d].stops[side];
            const ContactRows *rows = &stop->contact.numbers.rows;
            for (size_t i = 0; i < (rows->count > 0 ? rows->count : 1); i++)
                least = fmin(least, contact_time(&plan->dampers[d], stop,
                                                 rows->count > 0 ? rows->at[i].approach_speed : 1));
        }
    return least;
}

double steps_mode_time(const Plan *plan) {
    const Modes *modes = &plan->modes;
    double fastest = 0;
    if (modes->count == 0 && plan->storeys > 1)
        return TURN / plan->fastest;
    if (modes->count == 0)
        return TURN /
               fmax(sqrt(plan->stiffness[0] / plan->mass[0]), plan->damping[0] / plan->mass[0]);
    for (size_t i = 0; i < modes->count; i++)
        fastest = fmax(fastest, fmax(modes->omega[i], modes->damping[i * modes->count + i]));
    return TURN / fastest;
}

bool steps_may_couple(const Plan *plan) {
    return plan->storeys > 1 && !plan->modes.is_classical;
}

typedef struct Choice {
    double share; // steps in a sample interval
    double kinks; // of the base in it, that lie at step ends; at least 1
    const char *chose, *why;
} Choice;

static Choice choose(const Plan *plan, const Accuracy *accuracy, double base_interval) {
    const double interval = 1 / plan->sample_rate, near = 1e-9 * interval;
    double step =
        accuracy == NULL ? (double)NAN : ((const AccuracyStep *)(const void *)accuracy)->step;
    const bool is_asked = !isnan(step);
    Choice choice = {1, 1, "asked", "the scene asks for it"};
    if (!is_asked) {
        const double mode = steps_mode_time(plan) / PARTS,
                     contact = steps_contact_time(plan) / PARTS;
        choice.chose = mode < contact ? "mode" : "contact";
        choice.why = mode < contact ? "a 30th of the period of the fastest mode"
                                    : "a 30th of the shortest contact";
        step = fmin(mode, contact);
        if (!(step < interval)) {
            choice.chose = "sample";
            choice.why = "the sample interval, for all motion is slower";
        }
    }
    choice.share = fmax(ceil(interval / step * (1 - 1e-9)), 1);
    if (is_asked && fabs(step * choice.share - interval) > near)
        choice.why = "the scene asks for a longer one, but a step ends at every sample";
    // The base's own kinks lie at step ends wherever its grid divides the samples'.
    const double kinks = base_interval > 0 ? nearbyint(interval / base_interval) : 0;
    if (!(kinks > 1 && fabs(interval / base_interval - kinks) <= 1e-9 * kinks))
        return choice;
    choice.kinks = kinks;
    if (fmod(choice.share, kinks) != 0) {
        choice.share = ceil(choice.share / kinks) * kinks;
        choice.why = "a step ends at every sample of the base";
    }
    return choice;
}

Status steps_decide(const Accuracy *accuracy, const Stepper *stepper, double base_interval,
                    Plan *plan, Problem *problem) {
    const Choice choice = choose(plan, accuracy, base_interval);
    Decisions *decisions = &plan->report.decisions;
    if (!(choice.share <= SHARE_MAX))
        return problem_add_real(problem, STATUS_INVALID, "/accuracy/step",
                                1 / (plan->sample_rate * choice.share), "s",
                                "must be at least %.3g s, a 1e12th of the sample interval",
                                1 / (plan->sample_rate * SHARE_MAX));
    TRY(decisions_add(decisions, "step", choice.chose, 1 / (plan->sample_rate * choice.share), "s",
                      "%s; %.0f to a sample interval", choice.why, choice.share));
    if (plan->damper_count > 0)
        TRY(decisions_add(decisions, "contact_switching", "step_ends", 1, NULL,
                          "contacts begin and end at step ends only, so across a contact the error "
                          "is of first order in the step; between contacts %s",
                          stepper->between));
    return STATUS_OK;
}

double steps_cost(const Accuracy *accuracy, const Stepper *stepper, double base_interval,
                  const Plan *plan) {
    double making;
    const double each =
        stepper->cost(plan_mode_count(plan), plan->damper_count, steps_may_couple(plan), &making);
    const Choice choice = choose(plan, accuracy, base_interval);
    const double steps = choice.share * plan->duration * plan->sample_rate;
    const double beside = choice.share == choice.kinks && choice.kinks > 1 ? 2 : 0.5; // neighbour's
    return (1 + beside) * each * steps + 2 * making;
}

// The run, and beside it one whose error is known to be another.
typedef struct Pair {
    Steps run, near;
    Plan plan; // a copy: what it points to is the run's
    Run near_run;
    Response near_response;
    size_t stride;                 // samples of the run in one interval of the neighbour
    double longer;                 // the neighbour's step over the run's
    bool is_kinked;                // the base has kinks within steps
    bool is_known;                 // the neighbour has not failed
    bool is_finished;              // nothing more to learn
    size_t compared;               // samples
    double largest, worst;         // displacement, and difference of displacements [m]
    double horizon;                // [s]; NAN: not reached
    double touched_at;             // no contact has begun before [s]; NAN: none has
    double slowest[SCENE_DAMPERS]; // that a contact began with, as seen at samples [m/s]; 0: none
    double *apart;                 // of the modes
} Pair;

// How much of the difference is the run's error.
static bool is_touched(const Pair *pair) {
    const Response *response = pair->run.state.impacts.response;
    bool is_touched = response->impact_count + response->resting_count > 0;
    for (size_t d = 0; d < pair->run.state.dampers; d++)
        is_touched = is_touched || pair->run.state.damper[d].row.is_open;
    return is_touched;
}

static double part_of(const Pair *pair) {
    if (pair->run.tolerance > 0)
        return 2;
    if (is_touched(pair))
        return CHANCE;
    // Where a step has a kink of the base inside, its error is as that lies.
    return pair->is_kinked ? 1 : 1 / fabs(pow(pair->longer, pair->run.stepper->order) - 1);
}

static void compare(Pair *pair) {
    const ModalState *state = &pair->run.state, *near = &pair->near.state;
    const size_t n = state->mode_count;
    double difference = 0, bound = 0;
    pair->compared++;
    for (size_t i = 0; i < n; i++) {
        pair->apart[i] = state->q[i] - near->q[i];
        bound += state->max_shape[i] * fabs(pair->apart[i]);
    }
    pair->largest = fmax(pair->largest, state->impacts.response->peaks.displacement);
    if (bound <= pair->worst)
        return;
    for (size_t j = 0; j < state->storey_count; j++)
        difference =
            fmax(difference, fabs(modal_state_dot(state->modes->shapes + j * n, pair->apart, n)));
    pair->worst = fmax(pair->worst, difference);
    if (isnan(pair->horizon) && !(part_of(pair) * difference <= RESPONSE_PARTING * pair->largest))
        pair->horizon = (double)(state->sample - pair->stride) / state->plan->sample_rate;
    pair->is_finished = part_of(pair) * difference > pair->largest;
}

static Status follow(Pair *pair) {
    Run *run = pair->run.state.run;
    if (pair->is_finished || pair->run.state.sample % pair->stride != 0)
        return STATUS_OK;
    pair->near_run.steps = run->steps;
    const Status status = steps_interval(&pair->near);
    run->steps = pair->near_run.steps;
    run->work.neighbour_samples += pair->stride;
    if (status == STATUS_OK) {
        compare(pair);
        return STATUS_OK;
    }
    pair->is_finished = true;
    pair->is_known = false;
    return steps_check(&pair->run); // it may have been told to stop
}

// So many samples in one interval of the neighbour, and so many steps in that.
static void set_pace(Pair *pair, size_t stride, size_t share) {
    const Plan *plan = pair->run.state.plan;
    pair->stride = stride;
    pair->longer = (double)(pair->run.share * stride) / (double)share;
    pair->plan = *plan;
    pair->plan.sample_rate /= (double)stride;
    pair->plan.count = (plan->count - 1) / stride + 1;
}

static void start_near(Pair *pair, const Stepper *stepper, size_t kinks, double tolerance) {
    const ModalState *state = &pair->run.state;
    // Of the pieces that the base's kinks make.
    const size_t own = pair->run.share / kinks;
    const size_t share = tolerance > 0 ? 2
                         : own > 1     ? kinks * (own > 2 ? own / 2 + 1 : 1)
                         : kinks > 1   ? 2 * kinks // none is longer: a shorter one
                                       : 1;
    const Base *base = state->run->base;
    pair->is_kinked = base->form == BASE_PIECES ||
                      (base->form == BASE_SAMPLED && kinks == 1 && state->base.ratio == 0);
    pair->horizon = pair->touched_at = NAN;
    set_pace(pair, pair->run.share > 1 || tolerance > 0 ? 1 : 2, share);
    pair->near_run = (Run){.plan = &pair->plan,
                           .base = state->run->base,
                           .progress = state->run->progress,
                           .steps_max = state->run->steps_max,
                           .is_clear = state->run->is_clear};
    pair->near_response.is_unlisted = true;
    pair->apart = malloc(state->mode_count * sizeof *pair->apart);
    const double finer = fmax(tolerance / FINER, tolerance > 0 ? ODE_TOLERANCE : 0);
    Status status = pair->apart == NULL ? STATUS_NO_MEMORY
                                        : steps_make(&pair->near, stepper, &pair->near_run, share,
                                                     finer, true, &pair->near_response, NULL);
    if (status == STATUS_UNSTABLE && share < pair->run.share * pair->stride) {
        // Longer steps are unstable where the run's are not: shorter ones then.
        steps_clear(&pair->near);
        response_clear(&pair->near_response);
        pair->near_response.is_unlisted = true;
        set_pace(pair, 1, 2 * pair->run.share);
        status = steps_make(&pair->near, stepper, &pair->near_run, 2 * pair->run.share, finer, true,
                            &pair->near_response, NULL);
    }
    pair->is_known = status == STATUS_OK;
    pair->is_finished = !pair->is_known;
}

// What one contact a step late moves a storey by, within the time that its speed turns in [m]: both
// runs may be as late by chance.
static double jolt_of(const Pair *pair, const DamperState *damper, double impulse) {
    const ModalState *state = &pair->run.state;
    const Peaks *peaks = &state->impacts.response->peaks;
    const double h = pair->run.length, speed = pair->slowest[damper - state->damper];
    double slowest = INFINITY, late = h / 2;
    for (size_t i = 0; i < state->mode_count; i++)
        slowest = fmin(slowest, sqrt(state->omega2[i]));
    // Peaks may be those of the end of the run alone.
    const bool is_whole = !(state->run->statistics_from > 0);
    const double velocity = is_whole ? peaks->velocity : pair->largest * state->rate;
    // Of a long contact no more than acts while that lasts.
    if (is_whole && state->plan->form != CONTACT_IMPULSIVE &&
        peaks->contact_force < impulse * slowest)
        impulse = peaks->contact_force / slowest;
    // A power law's factors are the speed's, which changes while the mass is not yet seen.
    if (state->plan->form == CONTACT_POWER && speed > 0)
        late = fmax(late, fmin(velocity * state->rate * h / speed, 1) *
                              fmin(1 / slowest, state->plan->duration));
    return impulse * damper->max_mobility * late;
}

static double largest_jolt(const Pair *pair) {
    const ModalState *state = &pair->run.state;
    double most = 0;
    for (size_t d = 0; d < state->dampers && !(pair->run.tolerance > 0); d++) {
        const DamperState *damper = &state->damper[d];
        const double open = damper->row.is_open ? fabs(damper->row.impact.impulse) : 0;
        most = fmax(most, jolt_of(pair, damper, fmax(state->impacts.impulse[d], open)));
    }
    return most;
}

// What a storey moves by at most that the steps did not see of the base [m].
static double largest_unseen(const Pair *pair) {
    const ModalState *state = &pair->run.state;
    double most = 0;
    for (size_t i = 0; i < state->mode_count && pair->run.most_unseen > 0; i++)
        most += state->max_shape[i] * fabs(state->modes->participation[i]) *
                fmin(1 / sqrt(state->omega2[i]), state->plan->duration);
    return most * pair->run.most_unseen;
}

static void tell(const Pair *pair, Response *response) {
    const double unseen = largest_unseen(pair);
    const double size = fmax(fmax(pair->largest, response->peaks.displacement), unseen);
    const ImpactLog *ledger = &pair->run.state.impacts;
    const double balance =
        ledger->largest_energy > 0 ? ledger->largest_balance / ledger->largest_energy : 0;
    const double error =
        size > 0 ? fmax(fmax(part_of(pair) * pair->worst, largest_jolt(pair)), unseen) / size : 0;
    response->has_trust = pair->is_known && pair->compared > 0;
    response->is_stepped = true;
    response->error_estimate = fmin(fmax(error, balance / 2), 1);
    response->trust_horizon = pair->horizon;
    if (largest_jolt(pair) > RESPONSE_PARTING * size)
        response->trust_horizon = fmin(response->trust_horizon, pair->touched_at);
    if (unseen > RESPONSE_PARTING * size)
        response->trust_horizon = fmin(response->trust_horizon, pair->run.unseen_since);
    // It was found before the displacement had grown.
    if (response->error_estimate <= RESPONSE_PARTING)
        response->trust_horizon = NAN;
}

static Status solve(Pair *pair, Response *response) {
    ModalState *state = &pair->run.state;
    const Plan *plan = state->plan;
    steps_take_sample(&pair->run);
    while (state->sample + 1 < plan->count) {
        const double before = modal_state_time(state);
        TRY(steps_interval(&pair->run));
        if (isnan(pair->touched_at) && is_touched(pair))
            pair->touched_at = before;
        for (size_t d = 0; d < state->dampers; d++) {
            const double speed = state->damper[d].contact.speed;
            if (speed > 0 && !(pair->slowest[d] > 0 && pair->slowest[d] <= speed))
                pair->slowest[d] = speed;
        }
        TRY(follow(pair));
    }
    tell(pair, response);
    // The duration may end between samples.
    TRY(steps_finish(&pair->run, plan->duration - (double)state->sample / plan->sample_rate));
    return recorder_ledger(state);
}

Status steps_run_pair(Run *run, const Stepper *stepper, size_t share, size_t kinks,
                      double tolerance, Response *response, Problem *problem) {
    Pair *pair = calloc(1, sizeof *pair);
    if (pair == NULL)
        return problem_set(problem, STATUS_NO_MEMORY, "no memory for a run");
    Status status =
        steps_make(&pair->run, stepper, run, share, tolerance, false, response, problem);
    if (status == STATUS_OK) {
        start_near(pair, stepper, kinks, tolerance);
        status = solve(pair, response);
    }
    if (pair->run.record.block != NULL)
        recorder_finish(&pair->run.record, &pair->run.state, response);
    steps_clear(&pair->run);
    steps_clear(&pair->near);
    response_clear(&pair->near_response);
    free(pair->apart);
    free(pair);
    return status;
}

Status steps_run(Run *run, const Stepper *stepper, Response *response, Problem *problem) {
    const Base *base = run->base;
    const Choice choice =
        choose(run->plan, run->accuracy, base->form == BASE_SAMPLED ? base->interval : 0);
    if (!(choice.share <= SHARE_MAX))
        return problem_set(problem, STATUS_LIMIT,
                           "the scene moves too fast for %s: %.3g steps to a sample interval, at "
                           "most %.3g are possible",
                           stepper->name, choice.share, SHARE_MAX);
    if (stepper->is_linear_only && run->plan->form == CONTACT_POWER)
        return problem_set(problem, STATUS_INVALID,
                           "%s serves linear contact and impulses, not a power law", stepper->name);
    return steps_run_pair(run, stepper, (size_t)choice.share, (size_t)choice.kinks, 0, response,
                          problem);
}
