// Steps as long as a tolerance allows, by math/ode.h, over all modes and masses together. They end
// at every sample, at every kink of the base and where a contact begins or ends, which the
// integrator finds as roots; what it does not see, a stop that is grazed within a step, is missed.
// An impact is the exact engine's (contact_events.h), and so is its rule for chatter: where all
// bounces to come take less time than the clock resolves, the mass rests.
#include <float.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "core/solve/adaptive_motion.h"
#include "core/solve/contact_events.h"
#include "core/solve/steps_run.h"

enum { STILL_MAX = 1000 };
static const double POISED = 1e-4; // of a step
static const double JUMP = 1e-9;   // of a_g, from the end of a step to the start of the next

static ContactEvent event_of(const ModalState *state, size_t d, int which) {
    const DamperState *damper = &state->damper[d];
    return (ContactEvent){.damper = d,
                          .s = 1,
                          .side = damper->phase == PHASE_FLIGHT ? (Side)which : damper->side,
                          .is_inwards = damper->phase == PHASE_INSIDE && which == ADAPTIVE_FIRST};
}

// What is beyond its end already, though no step has shown it come there: a buffer let go without
// having been pressed, a stop that rounding or a miss has put behind the mass, a rest without a
// push. A force may still be rounding's before the motion `has_moved`.
static bool find_beyond(ModalState *state, bool has_moved, ContactEvent *event) {
    for (size_t d = 0; d < state->dampers && state->has_stops; d++) {
        DamperState *damper = &state->damper[d];
        const double sign = modal_state_sign(damper->side);
        if (damper->phase == PHASE_CONTACT && sign * damper->r < 0 && sign * damper->w < 0) {
            *event = event_of(state, d, ADAPTIVE_FIRST);
            return true;
        }
        if (damper->phase == PHASE_INSIDE && sign * damper->r < 0) {
            *event = event_of(state, d, ADAPTIVE_SECOND);
            return true;
        }
        if (has_moved &&
            (damper->phase == PHASE_INSIDE || (damper->phase == PHASE_CONTACT &&
                                               state->plan->separation == SEPARATION_ZERO_FORCE))) {
            const double push = sign * steps_contact(state, d, damper->r, damper->w).value;
            if (damper->phase == PHASE_INSIDE ? push > 0 : push < 0) {
                *event = event_of(state, d, ADAPTIVE_FIRST);
                return true;
            }
        }
        // An acceleration that may be rounding alone.
        const double noise = 64 * DBL_EPSILON *
                             (damper->elastic_bound * modal_state_size(state) +
                              fabs(damper->base_coupling * state->base_acceleration));
        if (damper->phase == PHASE_RESTING &&
            sign * damper->force < -noise * damper->effective_mass) {
            *event = event_of(state, d, ADAPTIVE_FIRST);
            event->is_jump = true;
            return true;
        }
        for (int side = 0; side < 2 && damper->phase == PHASE_FLIGHT; side++) {
            const double toward = modal_state_sign((Side)side), speed = toward * damper->w;
            if (modal_state_room(damper, (Side)side) - toward * damper->r > 0)
                continue;
            // A flight that is over before the clock tells: the mass is back as fast as it went.
            const double pull = toward * modal_state_acceleration(state, d);
            const bool is_back = speed <= 0 && -2 * speed < pull * modal_state_clock(state) &&
                                 (damper->zero_gap_terms == 0 || pull > noise);
            // Between stops without clearance an impulse holds whatever the speed.
            const bool is_held =
                state->plan->form == CONTACT_IMPULSIVE && damper->plan->clearance == 0;
            if (!(speed > 0 || is_back || is_held))
                continue;
            damper->w = is_back ? -damper->w : damper->w;
            *event = event_of(state, d, side);
            return true;
        }
    }
    return false;
}

static Status happen(ModalState *state, const ContactEvent *event) {
    const size_t most = STILL_MAX * state->dampers;
    state->events++;
    if (++state->events_at_instant > most)
        return problem_set(state->problem, STATUS_UNSTABLE,
                           "more than %zu contact events at one instant, t = %.17g s", most,
                           modal_state_time(state));
    contact_event_apply(state, event);
    return impact_log_status(&state->impacts, state->problem);
}

enum { RATES = 13 };              // of an ordinary step
static const double ADVANCE = 10; // solver steps of an advance beside its rates

static double adaptive_cost(size_t modes, size_t dampers, bool is_coupled, double *making) {
    const double n = (double)modes, m = (double)dampers;
    *making = 0;
    return 100 + 3 * n * (1 + m) + (is_coupled ? 0.1 * n * n : 0);
}

// What has been done since the last time, which many roots may have made much of.
static double take_cost(Adaptive *own) {
    const ModalState *state = &own->steps->state;
    double making;
    const double usual =
        adaptive_cost(state->mode_count, state->dampers, state->diagonal == NULL, &making);
    const double cost = ADVANCE + *own->rated * (usual - ADVANCE) / RATES;
    *own->rated = 0;
    return cost;
}

static Status happen_apart(Adaptive *own, const ContactEvent *event) {
    TRY(steps_note(own->steps, take_cost(own)));
    return happen(&own->steps->state, event);
}

// A mass at rest between stops without clearance is beyond one as soon as anything moves, which is
// no root: only the step's end shows it.
static bool is_poised(const Adaptive *own) {
    const ModalState *state = &own->steps->state;
    const bool is_still =
        own->slice.value == 0 && own->slice.slope == 0 && modal_state_size(state) == 0;
    for (size_t d = 0; d < state->dampers && !is_still; d++) {
        const DamperState *damper = &state->damper[d];
        if (damper->phase == PHASE_FLIGHT && damper->plan->clearance == 0 && damper->r == 0 &&
            damper->w == 0)
            return true;
    }
    return false;
}

// One step, at most `length` long, and the event at its end.
static Status advance(Adaptive *own, double length) {
    Steps *steps = own->steps;
    ModalState *state = &steps->state;
    ContactEvent event;
    double to;
    int root;
    const double before_jump = state->base_acceleration;
    const double knot = base_cursor_slice(&state->base, state->sample, state->offset, &own->slice);
    state->base_acceleration = own->slice.value;
    // Where a base ends at once the motion begins anew: the integrator still holds the rate before.
    if (fabs(state->base_acceleration - before_jump) >
        JUMP * (fabs(state->base_acceleration) + fabs(before_jump)))
        own->events = SIZE_MAX;
    if (own->events == state->events && adaptive_motion_has_outgrown(own))
        own->events = SIZE_MAX;
    if (own->events != state->events) {
        modal_state_forces(state);
        if (find_beyond(state, false, &event))
            return happen_apart(own, &event);
        TRY(adaptive_motion_start(own));
    }
    const double from = own->at;
    memcpy(own->before, own->y, own->size * sizeof *own->y);
    length = fmin(fmin(length, knot), steps->length);
    state->run->work.stop_searches += state->has_stops;
    if (is_poised(own))
        length *= POISED;
    TRY(ode_step(own->ode, from + length, &to, own->y, &root, state->problem));
    const double taken = root == ODE_NO_ROOT && to >= from + length ? length : to - from;
    own->at = to;
    adaptive_motion_take(own, taken);
    state->offset += taken;
    state->base_acceleration = slice_at(&own->slice, taken);
    if (taken > modal_state_clock(state))
        state->events_at_instant = 0;
    TRY(steps_note(steps, take_cost(own)));
    if (root != ODE_NO_ROOT) {
        const size_t d = (size_t)root / ADAPTIVE_WATCHED;
        const bool is_peak = root % ADAPTIVE_WATCHED == ADAPTIVE_PEAK;
        event = event_of(state, d, root % ADAPTIVE_WATCHED);
        if (!is_peak)
            return happen(state, &event);
    }
    return find_beyond(state, taken > 0, &event) ? happen(state, &event) : STATUS_OK;
}

static Status adaptive_cross(Steps *steps, double length) {
    Adaptive *own = steps->own;
    ModalState *state = &steps->state;
    const double clock = 2 * DBL_EPSILON * length;
    while (length - state->offset > clock) {
        const double before = state->offset;
        const size_t events = state->events;
        TRY(advance(own, length - state->offset));
        if (state->offset == before && state->events == events && own->at == 0)
            return problem_set(state->problem, STATUS_UNSTABLE,
                               "the motion is too fast to be followed at t = %.6g s: a step of "
                               "1/%.6g s is below the clock's resolution",
                               modal_state_time(state), modal_state_rate(state));
    }
    return STATUS_OK;
}

static Status adaptive_make(Steps *steps) {
    ModalState *state = &steps->state;
    Adaptive *own = calloc(1, sizeof *own);
    steps->own = own;
    if (own == NULL)
        return problem_set(state->problem, STATUS_NO_MEMORY, "no memory for a run");
    TRY(adaptive_motion_make(own, steps));
    // A mass that starts on a stop may touch it at t = 0.
    ContactEvent event;
    for (modal_state_forces(state); find_beyond(state, false, &event); modal_state_forces(state))
        TRY(happen(state, &event));
    return STATUS_OK;
}

static void adaptive_clear(Steps *steps) {
    Adaptive *own = steps->own;
    if (own != NULL)
        adaptive_motion_free(own);
    free(own);
    steps->own = NULL;
}

static const Stepper stepper = {.name = "adaptive",
                                .make = adaptive_make,
                                .cross = adaptive_cross,
                                .clear = adaptive_clear,
                                .cost = adaptive_cost};

static const double usual = 1e-9;

static double tolerance_of(const Accuracy *accuracy) {
    return accuracy == NULL ? usual
                            : ((const AccuracyTolerance *)(const void *)accuracy)->tolerance;
}

static Status run_all(Run *run, Response *response, Problem *problem) {
    return steps_run_pair(run, &stepper, 1, 1, tolerance_of(run->accuracy), response, problem);
}

static Status decide(const Accuracy *accuracy, double base_interval, Plan *plan, Problem *problem) {
    (void)base_interval;
    (void)problem;
    return decisions_add(
        &plan->report.decisions, "tolerance", tolerance_of(accuracy) == usual ? "usual" : "asked",
        tolerance_of(accuracy), NULL,
        "of each step; a step ends at every sample, at kinks of the base and where "
        "a contact begins or ends, and a stop grazed within a step is missed");
}

// Steps of a sample, of the base's kinks, and of the fastest mode; a contact takes some steps for
// its digits. At a guess seven contacts a second, many of them at once where there are many
// dampers.
static double cost(const Accuracy *accuracy, double base_interval, const Plan *plan) {
    const double digits = -log10(tolerance_of(accuracy)), each = pow(10, digits / 8) / 2;
    double making, steps = plan->sample_rate;
    if (base_interval > 0)
        steps = fmax(steps, 1 / base_interval);
    steps = fmax(steps, each / steps_mode_time(plan)) +
            7 * 25 * each * sqrt((double)plan->damper_count);
    const double one =
        adaptive_cost(plan_mode_count(plan), plan->damper_count, steps_may_couple(plan), &making);
    return 3 * one * steps * plan->duration; // the neighbour takes twice as many
}

// clang-format off
static const Field adaptive_fields[] = {
    FIELD_BASE(AccuracyTolerance, accuracy, accuracy_fields),
    FIELD_REAL(AccuracyTolerance, tolerance, NULL, WITHIN(1e-13, 1e-2), 1e-9, "relative error that a step may make"),
    FIELD_END
};
// clang-format on

const Solver solver_adaptive = {
    .kind = {"adaptive", "steps as long as a tolerance allows, events found as roots",
             adaptive_fields, sizeof(AccuracyTolerance)},
    .run = run_all,
    .decide = decide,
    .cost = cost,
};
