// Steps as long as a tolerance allows, by math/ode.h, over all modes and masses together. They end
// at every sample, at every kink of the base and where a contact begins or ends, which the
// integrator finds as roots; what it does not see, a stop that is grazed within a step, is missed.
// An impact is the exact engine's (frame_events.h), and so is its rule for chatter: where all
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

static FrameEvent event_of(const Frame *frame, size_t d, int which) {
    const FrameDamper *damper = &frame->damper[d];
    return (FrameEvent){.damper = d,
                        .s = 1,
                        .side = damper->phase == FRAME_FLIGHT ? (Side)which : damper->side,
                        .is_inwards = damper->phase == FRAME_INSIDE && which == ADAPTIVE_FIRST};
}

// What is beyond its end already, though no step has shown it come there: a buffer let go without
// having been pressed, a stop that rounding or a miss has put behind the mass, a rest without a
// push. A force may still be rounding's before the motion `has_moved`.
static bool find_beyond(Frame *frame, bool has_moved, FrameEvent *event) {
    for (size_t d = 0; d < frame->dampers && frame->has_stops; d++) {
        FrameDamper *damper = &frame->damper[d];
        const double sign = frame_sign(damper->side);
        if (damper->phase == FRAME_CONTACT && sign * damper->r < 0 && sign * damper->w < 0) {
            *event = event_of(frame, d, ADAPTIVE_FIRST);
            return true;
        }
        if (damper->phase == FRAME_INSIDE && sign * damper->r < 0) {
            *event = event_of(frame, d, ADAPTIVE_SECOND);
            return true;
        }
        if (has_moved &&
            (damper->phase == FRAME_INSIDE || (damper->phase == FRAME_CONTACT &&
                                               frame->plan->separation == SEPARATION_ZERO_FORCE))) {
            const double push = sign * steps_contact(frame, d, damper->r, damper->w).value;
            if (damper->phase == FRAME_INSIDE ? push > 0 : push < 0) {
                *event = event_of(frame, d, ADAPTIVE_FIRST);
                return true;
            }
        }
        // An acceleration that may be rounding alone.
        const double noise =
            64 * DBL_EPSILON *
            (damper->reach * frame_size(frame) + fabs(damper->lean * frame->ground));
        if (damper->phase == FRAME_RESTING &&
            sign * damper->force < -noise * damper->effective_mass) {
            *event = event_of(frame, d, ADAPTIVE_FIRST);
            event->is_jump = true;
            return true;
        }
        for (int side = 0; side < 2 && damper->phase == FRAME_FLIGHT; side++) {
            const double toward = frame_sign((Side)side), speed = toward * damper->w;
            if (frame_room(damper, (Side)side) - toward * damper->r > 0)
                continue;
            // A flight that is over before the clock tells: the mass is back as fast as it went.
            const double pull = toward * frame_acceleration(frame, d);
            const bool is_back = speed <= 0 && -2 * speed < pull * frame_clock(frame) &&
                                 (damper->leaving == 0 || pull > noise);
            // Between stops without clearance an impulse holds whatever the speed.
            const bool is_held =
                frame->plan->form == CONTACT_IMPULSIVE && damper->plan->clearance == 0;
            if (!(speed > 0 || is_back || is_held))
                continue;
            damper->w = is_back ? -damper->w : damper->w;
            *event = event_of(frame, d, side);
            return true;
        }
    }
    return false;
}

static Status happen(Frame *frame, const FrameEvent *event) {
    const size_t most = STILL_MAX * frame->dampers;
    frame->events++;
    if (++frame->still_events > most)
        return problem_set(frame->problem, STATUS_UNSTABLE,
                           "more than %zu contact events at one instant, t = %.17g s", most,
                           frame_time(frame));
    frame_happen(frame, event);
    return ledger_status(&frame->ledger, frame->problem);
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
    const Frame *frame = &own->steps->frame;
    double making;
    const double usual =
        adaptive_cost(frame->mode_count, frame->dampers, frame->diagonal == NULL, &making);
    const double cost = ADVANCE + *own->rated * (usual - ADVANCE) / RATES;
    *own->rated = 0;
    return cost;
}

static Status happen_apart(Adaptive *own, const FrameEvent *event) {
    TRY(steps_note(own->steps, take_cost(own)));
    return happen(&own->steps->frame, event);
}

// A mass at rest between stops without clearance is beyond one as soon as anything moves, which is
// no root: only the step's end shows it.
static bool is_poised(const Adaptive *own) {
    const Frame *frame = &own->steps->frame;
    const bool is_still = own->slice.value == 0 && own->slice.slope == 0 && frame_size(frame) == 0;
    for (size_t d = 0; d < frame->dampers && !is_still; d++) {
        const FrameDamper *damper = &frame->damper[d];
        if (damper->phase == FRAME_FLIGHT && damper->plan->clearance == 0 && damper->r == 0 &&
            damper->w == 0)
            return true;
    }
    return false;
}

// One step, at most `length` long, and the event at its end.
static Status advance(Adaptive *own, double length) {
    Steps *steps = own->steps;
    Frame *frame = &steps->frame;
    FrameEvent event;
    double to;
    int root;
    const double before_jump = frame->ground;
    const double knot = base_cursor_slice(&frame->base, frame->sample, frame->offset, &own->slice);
    frame->ground = own->slice.value;
    // Where a base ends at once the motion begins anew: the integrator still holds the rate before.
    if (fabs(frame->ground - before_jump) > JUMP * (fabs(frame->ground) + fabs(before_jump)))
        own->events = SIZE_MAX;
    if (own->events == frame->events && adaptive_motion_has_outgrown(own))
        own->events = SIZE_MAX;
    if (own->events != frame->events) {
        frame_feel(frame);
        if (find_beyond(frame, false, &event))
            return happen_apart(own, &event);
        TRY(adaptive_motion_start(own));
    }
    const double from = own->at;
    memcpy(own->before, own->y, own->size * sizeof *own->y);
    length = fmin(fmin(length, knot), steps->length);
    frame->run->work.stop_searches += frame->has_stops;
    if (is_poised(own))
        length *= POISED;
    TRY(ode_step(own->ode, from + length, &to, own->y, &root, frame->problem));
    const double taken = root == ODE_NO_ROOT && to >= from + length ? length : to - from;
    own->at = to;
    adaptive_motion_take(own, taken);
    frame->offset += taken;
    frame->ground = slice_at(&own->slice, taken);
    if (taken > frame_clock(frame))
        frame->still_events = 0;
    TRY(steps_note(steps, take_cost(own)));
    if (root != ODE_NO_ROOT) {
        const size_t d = (size_t)root / ADAPTIVE_WATCHED;
        const bool is_peak = root % ADAPTIVE_WATCHED == ADAPTIVE_PEAK;
        event = event_of(frame, d, root % ADAPTIVE_WATCHED);
        if (!is_peak)
            return happen(frame, &event);
    }
    return find_beyond(frame, taken > 0, &event) ? happen(frame, &event) : STATUS_OK;
}

static Status adaptive_cross(Steps *steps, double length) {
    Adaptive *own = steps->own;
    Frame *frame = &steps->frame;
    const double clock = 2 * DBL_EPSILON * length;
    while (length - frame->offset > clock) {
        const double before = frame->offset;
        const size_t events = frame->events;
        TRY(advance(own, length - frame->offset));
        if (frame->offset == before && frame->events == events && own->at == 0)
            return problem_set(frame->problem, STATUS_UNSTABLE,
                               "the motion is too fast to be followed at t = %.6g s: a step of "
                               "1/%.6g s is below the clock's resolution",
                               frame_time(frame), frame_rate(frame));
    }
    return STATUS_OK;
}

static Status adaptive_make(Steps *steps) {
    Frame *frame = &steps->frame;
    Adaptive *own = calloc(1, sizeof *own);
    steps->own = own;
    if (own == NULL)
        return problem_set(frame->problem, STATUS_NO_MEMORY, "no memory for a run");
    TRY(adaptive_motion_make(own, steps));
    // A mass that starts on a stop may touch it at t = 0.
    FrameEvent event;
    for (frame_feel(frame); find_beyond(frame, false, &event); frame_feel(frame))
        TRY(happen(frame, &event));
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
