// A sample interval holds a whole number of steps. The energy integrals of a step use a rule of the
// method's own order, so that the energy balance measures the method's error.
//
// The companion takes steps up to twice as long that end at samples too, but at no other instant of
// the run. A run with one step per sample interval has a companion with one step per two intervals.
// Without contacts the error is proportional to the step to the method's order, so the difference
// of the two runs gives the run's error. Across contacts the error depends on where in a stop the
// steps happen to end; it may be a few times the difference, or as large as the energy error. A run
// with error control has a companion with half the maximum step, also between kinks of the base,
// and a thousandth of the tolerance. It is the more accurate of the two; with a tenth of the
// tolerance it took steps so alike in 1 run of 40 that both were wrong by the same amount.
#include "core/solve/time_stepping.h"

#include <float.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "core/plan/plan.h"

enum { PULSE_PARTS = 8 };
static const double CHECK_COST = 1e6;        // multiplications between two checks, about
static const double ENERGY_GROWTH_MAX = 1e6; // energy over that of start and base; no sound run
static const double POWER_STEPS = 8;         // solver steps of a contact force under a power law
static const double PARTS = 30; // of the fastest period and the shortest contact, per step
static const double SHARE_MAX = 1e12;
static const double COMPANION_FINER = 1e3; // tolerance of the run over that of the companion
static const double TOLERANCE_MIN = 1e-14; // near the rounding error of a step
static const double CONTACT_FACTOR = 6;    // error over difference of the two runs, with contacts
static const double TWO_PI = 6.28318530717958647693;

// clang-format off
const Field accuracy_step_fields[] = {
    FIELD_BASE(AccuracyStep, accuracy, accuracy_fields),
    FIELD_REAL(AccuracyStep, step, "s", ABOVE(0), OPTIONAL, "length of a step, made a whole fraction of the sample interval; if absent a 30th of the fastest mode's period and of the shortest contact, at most the sample interval"),
    FIELD_END
};
// clang-format on

void time_stepping_elastic(const ModalState *state, const double *q, const double *p,
                           double *restrict out) {
    const size_t n = state->mode_count;
    for (size_t i = 0; i < n; i++)
        out[i] = state->omega2[i] * q[i];
    if (state->diagonal != NULL) {
        for (size_t i = 0; i < n; i++)
            out[i] += state->diagonal[i] * p[i];
        return;
    }
    for (size_t i = 0; i < n; i++)
        out[i] += modal_state_dot(state->damping + i * n, p, n);
}

void time_stepping_rate(TimeStepping *stepping, const double *y, double ground,
                        double *restrict out) {
    const ModalState *state = &stepping->state;
    const size_t n = state->mode_count, m = state->dampers;
    const double *p = y + n, *w = p + n + m;
    double *p1 = out + n, *w1 = out + 2 * n + m, *sums = out + stepping->size;
    const double *force = stepping->force;
    double momentum = modal_state_dot(state->momentum_weights, p, n), loss = 0;
    time_stepping_elastic(state, y, p, stepping->elastic);
    memcpy(out, p, n * sizeof *y);
    memcpy(out + 2 * n, w, m * sizeof *y);
    for (size_t i = 0; i < n; i++)
        p1[i] = -stepping->elastic[i] - state->modes->participation[i] * ground;
    for (size_t d = 0; d < m; d++)
        w1[d] = state->damper[d].base_coupling * ground +
                modal_state_dot(state->damper[d].shape, stepping->elastic, n);
    for (size_t d = 0; d < m; d++) {
        sums[d] = force[d];
        sums[m + d] = force[d] * w[d];
        momentum += state->damper[d].plan->mass * w[d];
        if (force[d] == 0)
            continue;
        for (size_t i = 0; i < n; i++)
            p1[i] += state->damper[d].shape[i] * force[d];
        for (size_t e = 0; e < m; e++)
            w1[e] -= state->delassus[e * m + d] * force[d];
    }
    for (size_t i = 0; i < n; i++)
        loss += (stepping->elastic[i] - state->omega2[i] * y[i]) * p[i];
    sums[2 * m] = -ground * momentum;
    sums[2 * m + 1] = loss;
}

void time_stepping_forces(TimeStepping *stepping, const double *y) {
    const ModalState *state = &stepping->state;
    const size_t m = state->dampers;
    const double *r = y + 2 * state->mode_count, *w = r + m;
    for (size_t d = 0; d < m; d++)
        stepping->force[d] = state->damper[d].phase == PHASE_CONTACT
                                 ? step_contact_force(state, d, r[d], w[d]).value
                                 : 0;
}

// Adds to the integrals of the step `weight` seconds at y; `rates` becomes y' and the rates there.
static void time_stepping_add(TimeStepping *stepping, const double *y, double ground, double weight,
                              double *rates) {
    const size_t m = stepping->state.dampers;
    const double *w = y + stepping->size - m;
    double *integrals = stepping->integrals;
    time_stepping_forces(stepping, y);
    time_stepping_rate(stepping, y, ground, rates);
    for (size_t d = 0; d < m; d++) {
        integrals[d] += weight * stepping->force[d];
        integrals[m + d] += weight * stepping->force[d] * w[d];
    }
    integrals[2 * m] += weight * rates[stepping->size + 2 * m];
    integrals[2 * m + 1] += weight * rates[stepping->size + 2 * m + 1];
}

void time_stepping_integrate(TimeStepping *stepping, const double *from, const double *to,
                             double length, bool is_order_4) {
    const double weight = is_order_4 ? length / 6 : length / 2;
    double *first = stepping->rows, *last = first + stepping->row;
    time_stepping_add(stepping, from, stepping->ground[0], weight, first);
    time_stepping_add(stepping, to, stepping->ground[2], weight, last);
    if (!is_order_4)
        return;
    for (size_t i = 0; i < stepping->size; i++) // Hermite's cubic in the middle
        first[i] = (from[i] + to[i]) / 2 + length / 8 * (first[i] - last[i]);
    time_stepping_add(stepping, first, (stepping->ground[0] + stepping->ground[2]) / 2, 4 * weight,
                      last);
}

static void time_stepping_read_base(TimeStepping *stepping, double length) {
    const ModalState *state = &stepping->state;
    Slice slice;
    const double knot = base_cursor_slice(&state->base, state->sample, state->offset, &slice);
    stepping->ground[0] = slice.value;
    for (int k = 1; k <= 2; k++) {
        const double at = k * length / 2;
        if (knot < at * (1 - 1e-9)) {
            (void)base_cursor_slice(&state->base, state->sample, state->offset + at, &slice);
            stepping->ground[k] = slice.value;
        } else {
            stepping->ground[k] = slice_at(&slice, at);
        }
    }
}

static Status time_stepping_check(TimeStepping *stepping) {
    stepping->unchecked_cost = 0;
    return modal_state_check(&stepping->state, stepping->length);
}

static Status time_stepping_unstable(const TimeStepping *stepping) {
    const ModalState *state = &stepping->state;
    const double rate = modal_state_rate(state);
    return problem_set(state->problem, STATUS_UNSTABLE,
                       "%s leaves all bounds at t = %.6g s with a step of %.4g s: the motion has a "
                       "rate of %.4g 1/s, take a step of %.2g s or less, or the solver \"exact\"",
                       stepping->solver->kind.name, modal_state_time(state), stepping->length, rate,
                       fmin(0.2 / rate, stepping->length / 4));
}

Status time_stepping_note(TimeStepping *stepping, double cost) {
    ModalState *state = &stepping->state;
    modal_state_forces(state);
    const EnergyState energy = modal_state_energy(state);
    const double held = energy.kinetic + energy.strain;
    stepping->largest_input = fmax(stepping->largest_input, fabs(state->impacts.energy.input));
    const double max =
        ENERGY_GROWTH_MAX * (stepping->largest_input + state->impacts.energy.initial);
    if (!(held <= max) || !isfinite(held))
        return time_stepping_unstable(stepping);
    if (!state->is_shadow) {
        recorder_peaks(state);
        impact_log_balance(&state->impacts, &energy);
    }
    state->run->work.steps++;
    state->run->steps += cost;
    stepping->unchecked_cost += 20 * cost;
    return stepping->unchecked_cost > CHECK_COST ? time_stepping_check(stepping) : STATUS_OK;
}

void time_stepping_begin(TimeStepping *stepping, double *y) {
    const ModalState *state = &stepping->state;
    modal_state_gather(state, y);
    memset(stepping->integrals, 0, (2 * state->dampers + 2) * sizeof *stepping->integrals);
    step_contact_begin(state, &stepping->contact);
}

static double time_stepping_step_cost(const TimeStepping *stepping) {
    const ModalState *state = &stepping->state;
    size_t touching = 0;
    double setup;
    for (size_t d = 0; d < state->dampers && state->plan->form == CONTACT_POWER; d++)
        touching += state->damper[d].phase == PHASE_CONTACT;
    return stepping->stepper->cost(state->mode_count, state->dampers, state->diagonal == NULL,
                                   &setup) +
           POWER_STEPS * (double)touching;
}

// `offset`: the step's end, from the last sample [s].
static Status time_stepping_advance(TimeStepping *stepping, double length, double offset) {
    ModalState *state = &stepping->state;
    const double *ground = stepping->ground, *integrals = stepping->integrals;
    const size_t m = state->dampers;
    time_stepping_read_base(stepping, length);
    time_stepping_begin(stepping, stepping->y);
    TRY(stepping->stepper->step(stepping, length));
    modal_state_scatter(state, stepping->y);
    state->offset = offset;
    state->base_acceleration = ground[2];
    impact_log_work(&state->impacts, integrals[2 * m], integrals[2 * m + 1]);
    stepping->recorder.base_speed += length / 6 * (ground[0] + 4 * ground[1] + ground[2]);
    if (state->has_stops) {
        state->run->work.stop_searches++;
        step_contact_end(state, &stepping->contact, length);
    }
    return time_stepping_note(stepping, time_stepping_step_cost(stepping));
}

// A step, which is divided where a pulse of the base has a kink inside. All of the pulse may lie
// between two kinks, so several steps lead to each; those of the companion are twice as long.
static Status time_stepping_step(TimeStepping *stepping, double length, double offset) {
    const ModalState *state = &stepping->state;
    const int parts = state->is_shadow ? PULSE_PARTS / 2 : PULSE_PARTS;
    for (Slice slice; state->base.base->form == BASE_PIECES;) {
        const double knot = base_cursor_slice(&state->base, state->sample, state->offset, &slice);
        const double start = state->offset;
        if (!(knot < length * (1 - 1e-9)))
            break;
        for (int k = 1; k <= parts; k++)
            TRY(time_stepping_advance(stepping, knot / parts, start + k * knot / parts));
        length -= knot;
    }
    return time_stepping_advance(stepping, length, offset);
}

// Advances by `length` seconds from the last sample.
static Status time_stepping_cross(TimeStepping *stepping, double length) {
    const double clock = 8 * DBL_EPSILON * stepping->state.plan->duration; // less is rounding
    if (stepping->stepper->interval != NULL)
        return length > clock ? stepping->stepper->interval(stepping, length) : STATUS_OK;
    const double step = stepping->length, whole = floor(length / step * (1 + 1e-9));
    for (double k = 1; k <= whole; k++)
        TRY(time_stepping_step(stepping, step, k * step));
    const double rest = length - whole * step;
    return rest > clock ? time_stepping_step(stepping, rest, length) : STATUS_OK;
}

// Advances to the next sample and records it.
static Status time_stepping_interval(TimeStepping *stepping) {
    ModalState *state = &stepping->state;
    TRY(time_stepping_cross(stepping, state->interval));
    state->sample++;
    state->offset = 0;
    state->run->work.mode_samples += state->mode_count;
    recorder_sample(&stepping->recorder, state);
    return STATUS_OK;
}

// The contact of stop i of all dampers, two to each, in row k of its table over the approach speed,
// or its only one, at 1 m/s.
static bool time_stepping_contact_at(const Plan *plan, size_t i, size_t k, ContactParameters *at) {
    const ContactStop *stop = &plan->dampers[i / 2].stops[i % 2];
    const ContactRows *rows = &stop->numbers.rows;
    if (k >= (rows->count > 0 ? rows->count : 1))
        return false;
    *at = stops_freeze(stop, rows->count > 0 ? rows->at[k].approach_speed : 1);
    return true;
}

// Rejects steps outside the explicit method's stability limit.
static Status time_stepping_check_stability(const TimeStepping *stepping) {
    const ModalState *state = &stepping->state;
    const double limit = stepping->stepper->stability_limit, max = limit / stepping->length;
    if (!(limit > 0))
        return STATUS_OK;
    if (state->rate > max)
        return problem_set(state->problem, STATUS_UNSTABLE,
                           "%s is unstable with a step of %.4g s: the structure's motion has a "
                           "rate of up to %.4g 1/s, so a step must be at most %.3g s",
                           stepping->solver->kind.name, stepping->length, state->rate,
                           limit / state->rate);
    double rate = 0;
    const bool has_rate = state->has_stops && state->plan->form == CONTACT_LINEAR;
    for (size_t i = 0; i < 2 * state->dampers && has_rate; i++) {
        const double mass = state->damper[i / 2].effective_mass;
        ContactParameters at;
        for (size_t k = 0; time_stepping_contact_at(state->plan, i, k, &at); k++)
            rate = fmax(rate, fmax(sqrt(state->stiff + at.stiffness / mass),
                                   state->viscous + at.damping / mass));
    }
    if (rate > max)
        return problem_set(state->problem, STATUS_UNSTABLE,
                           "%s is unstable with a step of %.4g s: a contact has a rate of up to "
                           "%.4g 1/s, so a step must be at most %.3g s",
                           stepping->solver->kind.name, stepping->length, rate, limit / rate);
    return STATUS_OK;
}

Status time_stepping_make_method(TimeStepping *stepping, size_t size) {
    stepping->method = calloc(1, size);
    return stepping->method != NULL
               ? STATUS_OK
               : problem_set(stepping->state.problem, STATUS_NO_MEMORY,
                             "no memory for a run of %zu modes", stepping->state.mode_count);
}

static Status time_stepping_allocate(TimeStepping *stepping) {
    const size_t n = stepping->state.mode_count, m = stepping->state.dampers;
    stepping->size = 2 * (n + m);
    stepping->row = stepping->size + 2 * m + 2;
    stepping->block = calloc(3 * stepping->row + 2 * m + n, sizeof *stepping->block);
    if (stepping->block == NULL)
        return problem_set(stepping->state.problem, STATUS_NO_MEMORY,
                           "no memory for a run of %zu modes", n);
    stepping->y = stepping->block;
    stepping->integrals = stepping->y + stepping->size;
    stepping->rows = stepping->y + stepping->row;
    stepping->force = stepping->rows + 2 * stepping->row;
    stepping->elastic = stepping->force + m;
    stepping->contact = (StepContact){.impulse = stepping->integrals,
                                      .work = stepping->integrals + m,
                                      .strain_before = stepping->elastic + n,
                                      .is_by_place = stepping->stepper->is_by_place};
    return STATUS_OK;
}

// `is_shadow`: nothing is recorded. Cleared by time_stepping_clear, also after a failure.
static Status time_stepping_make(TimeStepping *stepping, const Solver *solver, Run *run,
                                 size_t share, double tolerance, bool is_shadow, Response *response,
                                 Problem *problem) {
    ModalState *state = &stepping->state;
    memset(stepping, 0, sizeof *stepping);
    stepping->solver = solver;
    stepping->stepper = solver->stepper;
    stepping->tolerance = tolerance;
    TRY(modal_state_make(state, run, problem));
    state->is_shadow = is_shadow;
    stepping->share = share;
    stepping->length = state->interval / (double)share;
    TRY(time_stepping_allocate(stepping));
    TRY(time_stepping_check_stability(stepping));
    if (!is_shadow)
        TRY(recorder_start(&stepping->recorder, state, response, problem));
    const EnergyState energy = modal_state_energy(state);
    impact_log_start(&state->impacts, response, run->impacts_max, &energy);
    double setup = 0;
    (void)stepping->stepper->cost(state->mode_count, state->dampers, state->diagonal == NULL,
                                  &setup);
    run->steps += setup;
    return stepping->stepper->make(stepping);
}

static void time_stepping_clear(TimeStepping *stepping) {
    if (stepping->method != NULL && stepping->stepper->clear != NULL)
        stepping->stepper->clear(stepping);
    free(stepping->method);
    recorder_clear(&stepping->recorder);
    modal_state_clear(&stepping->state);
    free(stepping->block);
}

// Duration of an isolated contact [s].
static double time_stepping_duration(const PlanDamper *damper, const ContactStop *stop,
                                     const ContactParameters *at) {
    const double mass = damper->effective_mass;
    if (stop->law != NULL && stop->law->form == CONTACT_POWER)
        return stop->duration *
               pow(mass * at->speed * at->speed / at->stiffness, 1 / (at->exponent + 1)) /
               at->speed;
    const Identification found = identification_from_stiffness(mass, at->stiffness, at->damping,
                                                               (Separation)stop->separation);
    // The damping sets the rate of an overdamped one.
    return isfinite(found.contact_time) ? found.contact_time : mass / at->damping;
}

// The shortest of all contacts [s]; INFINITY without any.
static double time_stepping_contact_time(const Plan *plan) {
    double min = INFINITY;
    for (size_t i = 0; i < 2 * plan->damper_count && plan->form != CONTACT_IMPULSIVE; i++) {
        const PlanDamper *damper = &plan->dampers[i / 2];
        ContactParameters at;
        for (size_t k = 0; time_stepping_contact_at(plan, i, k, &at); k++)
            min = fmin(min, time_stepping_duration(damper, &damper->stops[i % 2], &at));
    }
    return min;
}

double time_stepping_mode_time(const Plan *plan) {
    const Modes *modes = &plan->modes;
    double fastest = 0;
    if (modes->count == 0 && plan->storeys > 1)
        return TWO_PI / plan->fastest;
    if (modes->count == 0)
        return TWO_PI /
               fmax(sqrt(plan->stiffness[0] / plan->mass[0]), plan->damping[0] / plan->mass[0]);
    for (size_t i = 0; i < modes->count; i++)
        fastest = fmax(fastest, fmax(modes->omega[i], modes->damping[i * modes->count + i]));
    return TWO_PI / fastest;
}

bool time_stepping_may_couple(const Plan *plan) {
    return plan->storeys > 1 && !plan->modes.is_classical;
}

typedef struct StepChoice {
    double share; // steps in a sample interval
    double kinks; // of the base in a sample interval, that are step ends; at least 1
    const char *chose, *why;
} StepChoice;

static StepChoice time_stepping_choose(const Plan *plan, const Accuracy *accuracy,
                                       double base_interval) {
    const double interval = 1 / plan->sample_rate, near = 1e-9 * interval;
    double step =
        accuracy == NULL ? (double)NAN : ((const AccuracyStep *)(const void *)accuracy)->step;
    const bool is_asked = !isnan(step);
    StepChoice choice = {1, 1, "asked", "the scene asks for it"};
    if (!is_asked) {
        const double mode = time_stepping_mode_time(plan) / PARTS,
                     contact = time_stepping_contact_time(plan) / PARTS;
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
    // Where the base's grid divides the sample grid, a step ends at every kink of the base.
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

Status time_stepping_decide(const Solver *solver, const Accuracy *accuracy, double base_interval,
                            Plan *plan, Problem *problem) {
    const StepChoice choice = time_stepping_choose(plan, accuracy, base_interval);
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
                          solver->stepper->between));
    return STATUS_OK;
}

double time_stepping_cost(const Solver *solver, const Accuracy *accuracy,
                          const SolverDemand *demand, const Plan *plan) {
    double setup;
    const double each = solver->stepper->cost(plan_mode_count(plan), plan->damper_count,
                                              time_stepping_may_couple(plan), &setup);
    const StepChoice choice = time_stepping_choose(plan, accuracy, demand->base_interval);
    const double steps = choice.share * plan->duration * plan->sample_rate;
    const double companion = choice.share == choice.kinks && choice.kinks > 1 ? 2 : 0.5;
    const double m = (double)plan->damper_count;
    const double equations =
        solver->stepper->equations * m * m * m * demand->pressed / plan->duration;
    const double sets = solver->stepper->is_by_contacts ? fmin(demand->impacts, pow(3, m)) : 0;
    return (1 + companion) * (each + equations) * steps + (2 + sets) * setup;
}

typedef struct Pair {
    TimeStepping run, companion;
    Plan plan; // of the companion: a shallow copy of the run's
    Run companion_run;
    Response companion_response;
    size_t stride;                 // samples of the run in one interval of the companion
    double step_ratio;             // the companion's step over the run's
    bool is_kinked;                // the base has kinks within steps
    bool is_known;                 // the companion has not failed
    double largest, worst;         // displacement, and difference of displacements [m]
    double horizon;                // [s]; NAN: not reached
    double first_contact;          // no contact has begun before [s]; NAN: none has
    double slowest[SCENE_DAMPERS]; // approach speed of any contact, as seen at samples [m/s]
} Pair;

static bool pair_has_contact(const Pair *pair) {
    const Response *response = pair->run.state.impacts.response;
    bool has_contact = response->impact_count + response->resting_count > 0;
    for (size_t d = 0; d < pair->run.state.dampers; d++)
        has_contact = has_contact || pair->run.state.damper[d].row.is_open;
    return has_contact;
}

// The run's error over the difference of the two runs.
static double pair_factor(const Pair *pair) {
    if (pair->run.tolerance > 0)
        return 2;
    if (pair_has_contact(pair))
        return CONTACT_FACTOR;
    // With a kink of the base inside a step, the error depends on the kink's place.
    return pair->is_kinked ? 1
                           : 1 / fabs(pow(pair->step_ratio, pair->run.solver->stepper->order) - 1);
}

// Advances the companion to the run's sample, and compares the two. While they are further apart
// than the largest displacement so far, the companion waits: the motion may just have begun.
static Status pair_follow(Pair *pair) {
    const ModalState *state = &pair->run.state;
    Run *run = state->run;
    pair->largest = fmax(pair->largest, state->impacts.response->peaks.displacement);
    if (!pair->is_known || state->sample % pair->stride != 0 ||
        pair_factor(pair) * pair->worst > pair->largest)
        return STATUS_OK;
    Status status = STATUS_OK;
    pair->companion_run.steps = run->steps;
    while (pair->companion.state.sample * pair->stride < state->sample && status == STATUS_OK) {
        status = time_stepping_interval(&pair->companion);
        run->work.neighbour_samples += pair->stride;
    }
    run->steps = pair->companion_run.steps;
    if (status != STATUS_OK) {
        pair->is_known = !isnan(pair->horizon); // two motions that have parted stay so
        pair->worst = INFINITY;
        return time_stepping_check(&pair->run); // the cause may be the run's own limit
    }
    pair->worst = modal_state_difference(state, state->q, pair->companion.state.q, pair->worst);
    if (pair_factor(pair) * pair->worst <= RESPONSE_DIVERGENCE * pair->largest)
        pair->horizon = (double)NAN;
    else if (isnan(pair->horizon))
        pair->horizon = (double)(state->sample - pair->stride) / state->plan->sample_rate;
    return STATUS_OK;
}

// Starts a companion with `share` steps in `stride` samples of the run.
static Status pair_make_companion(Pair *pair, size_t stride, size_t share) {
    const Plan *plan = pair->run.state.plan;
    const Run *run = pair->run.state.run;
    const double tolerance = pair->run.tolerance;
    pair->stride = stride;
    pair->step_ratio = (double)(pair->run.share * stride) / (double)share;
    pair->plan = *plan;
    pair->plan.sample_rate /= (double)stride;
    pair->plan.count = (plan->count - 1) / stride + 1;
    pair->companion_run = (Run){.plan = &pair->plan,
                                .base = run->base,
                                .progress = run->progress,
                                .steps_max = run->steps_max,
                                .is_clear = run->is_clear};
    pair->companion_response.is_unlisted = true;
    return time_stepping_make(&pair->companion, pair->run.solver, &pair->companion_run, share,
                              tolerance > 0 ? fmax(tolerance / COMPANION_FINER, TOLERANCE_MIN) : 0,
                              true, &pair->companion_response, NULL);
}

static void pair_start_companion(Pair *pair, size_t kinks) {
    const ModalState *state = &pair->run.state;
    const Base *base = state->run->base;
    const bool is_controlled = pair->run.tolerance > 0;
    // Steps between two kinks of the base.
    const size_t own = pair->run.share / kinks;
    const size_t share = is_controlled ? 2
                         : own > 1     ? kinks * (own > 2 ? own / 2 + 1 : 1)
                         : kinks > 1   ? 2 * kinks // kinks exclude longer steps
                                       : 1;
    const size_t stride = pair->run.share > 1 || is_controlled ? 1 : 2;
    pair->is_kinked = base->form == BASE_SAMPLED && kinks == 1 && state->base.ratio == 0;
    pair->horizon = pair->first_contact = NAN;
    Status status = pair_make_companion(pair, stride, share);
    if (status == STATUS_UNSTABLE && share < pair->run.share * stride) {
        // Longer steps are unstable where the run's are not: take shorter ones.
        time_stepping_clear(&pair->companion);
        response_clear(&pair->companion_response);
        status = pair_make_companion(pair, 1, 2 * pair->run.share);
    }
    pair->is_known = status == STATUS_OK;
}

// Displacement of a storey by one contact that begins a step late [m]: both runs may be equally
// late by chance. The velocity change acts until the motion reverses.
static double pair_delay_error(const Pair *pair) {
    const ModalState *state = &pair->run.state;
    const Peaks *peaks = &state->impacts.response->peaks;
    const double h = pair->run.length;
    // Peaks may cover the end of the run only.
    const bool is_whole = !(state->run->statistics_from > 0);
    const double velocity = is_whole ? peaks->velocity : pair->largest * state->rate;
    double slowest = INFINITY, max = 0;
    for (size_t i = 0; i < state->mode_count; i++)
        slowest = fmin(slowest, sqrt(state->omega2[i]));
    for (size_t d = 0; d < state->dampers && !(pair->run.tolerance > 0); d++) {
        const DamperState *damper = &state->damper[d];
        const double open = damper->row.is_open ? fabs(damper->row.impact.impulse) : 0;
        double impulse = fmax(state->impacts.impulse[d], open), delay = h / 2;
        // Of a long contact the force acts for a part of the slowest period only.
        if (is_whole && state->plan->form != CONTACT_IMPULSIVE)
            impulse = fmin(impulse, peaks->contact_force / slowest);
        // The parameters of a power law depend on the approach speed, which changes during the
        // delay.
        if (state->plan->form == CONTACT_POWER && pair->slowest[d] > 0)
            delay = fmax(delay, fmin(velocity * state->rate * h / pair->slowest[d], 1) *
                                    fmin(1 / slowest, state->plan->duration));
        max = fmax(max, impulse * damper->max_mobility * delay);
    }
    return max;
}

static void pair_report(const Pair *pair, Response *response) {
    const double delay = pair_delay_error(pair);
    const double size = fmax(pair->largest, response->peaks.displacement);
    const ModalState *state = &pair->run.state;
    const ImpactLog *log = &state->impacts;
    const double balance = log->largest_energy > 0 ? log->largest_balance / log->largest_energy : 0;
    double error = size > 0 ? fmax(pair_factor(pair) * pair->worst, delay) / size : 0;
    // Rounding shifts the phases of both runs.
    if (pair->run.tolerance > 0 && size > 0)
        error = fmax(error, 2 * DBL_EPSILON * (1 + state->rate * state->plan->duration));
    response->has_trust = pair->is_known && pair->companion.state.sample > 0;
    response->is_stepped = true;
    response->error_estimate = fmin(fmax(error, balance / 2), 1);
    response->trust_horizon = pair->horizon;
    if (delay > RESPONSE_DIVERGENCE * size)
        response->trust_horizon = fmin(response->trust_horizon, pair->first_contact);
    // The horizon was found before the displacement had grown.
    if (response->error_estimate <= RESPONSE_DIVERGENCE)
        response->trust_horizon = NAN;
}

static Status pair_run(Pair *pair, Response *response) {
    ModalState *state = &pair->run.state;
    const Plan *plan = state->plan;
    recorder_sample(&pair->run.recorder, state);
    while (state->sample + 1 < plan->count) {
        const double before = modal_state_time(state);
        TRY(time_stepping_interval(&pair->run));
        if (isnan(pair->first_contact) && pair_has_contact(pair))
            pair->first_contact = before;
        for (size_t d = 0; d < state->dampers; d++) {
            const double speed = state->damper[d].contact.speed;
            if (speed > 0 && !(pair->slowest[d] > 0 && pair->slowest[d] <= speed))
                pair->slowest[d] = speed;
        }
        TRY(pair_follow(pair));
    }
    pair_report(pair, response);
    // The duration may end between samples.
    const double rest = plan->duration - (double)state->sample / plan->sample_rate;
    TRY(time_stepping_cross(&pair->run, rest));
    TRY(time_stepping_check(&pair->run));
    return recorder_finish_log(state);
}

Status time_stepping_run_pair(const Solver *solver, Run *run, size_t share, size_t kinks,
                              double tolerance, Response *response, Problem *problem) {
    Pair *pair = calloc(1, sizeof *pair);
    if (pair == NULL)
        return problem_set(problem, STATUS_NO_MEMORY, "no memory for a run");
    Status status =
        time_stepping_make(&pair->run, solver, run, share, tolerance, false, response, problem);
    if (status == STATUS_OK) {
        pair_start_companion(pair, kinks);
        status = pair_run(pair, response);
    }
    if (pair->run.recorder.block != NULL)
        recorder_finish(&pair->run.recorder, &pair->run.state, response);
    time_stepping_clear(&pair->run);
    time_stepping_clear(&pair->companion);
    response_clear(&pair->companion_response);
    free(pair);
    return status;
}

Status time_stepping_run(const Solver *solver, Run *run, Response *response, Problem *problem) {
    const Base *base = run->base;
    const StepChoice choice = time_stepping_choose(run->plan, run->accuracy,
                                                   base->form == BASE_SAMPLED ? base->interval : 0);
    if (!(choice.share <= SHARE_MAX))
        return problem_set(problem, STATUS_LIMIT,
                           "the scene moves too fast for %s: %.3g steps to a sample interval, at "
                           "most %.3g are possible",
                           solver->kind.name, choice.share, SHARE_MAX);
    return time_stepping_run_pair(solver, run, (size_t)choice.share, (size_t)choice.kinks, 0,
                                  response, problem);
}
