// Between two samples lies a whole number of steps. What the ledgers get of a step are integrals by
// a rule of the method's own order, so that the energy balance tells of the method's error.
#include "core/solve/time_stepping.h"

#include <float.h>
#include <math.h>
#include <string.h>

static const double WATCH_WORK = 1e6; // multiplications, about, between looks at the progress

// Energy that neither start nor base gave, over what they did: no error of a sound run.
static const double GROWN = 1e6;
static const double POWER_STEPS = 8;

void steps_elastic(const Frame *frame, const double *q, const double *p, double *restrict out) {
    const size_t n = frame->mode_count;
    for (size_t i = 0; i < n; i++)
        out[i] = frame->omega2[i] * q[i];
    if (frame->diagonal != NULL) {
        for (size_t i = 0; i < n; i++)
            out[i] += frame->diagonal[i] * p[i];
        return;
    }
    for (size_t i = 0; i < n; i++)
        out[i] += frame_dot(frame->damping + i * n, p, n);
}

void steps_rate(Steps *steps, const double *y, double ground, const double *force,
                double *restrict out) {
    const Frame *frame = &steps->frame;
    const size_t n = frame->mode_count, m = frame->dampers;
    double *p1 = out + n, *w1 = out + 2 * n + m;
    steps_elastic(frame, y, y + n, steps->elastic);
    memcpy(out, y + n, n * sizeof *y);
    memcpy(out + 2 * n, y + 2 * n + m, m * sizeof *y);
    for (size_t i = 0; i < n; i++)
        p1[i] = -steps->elastic[i] - frame->modes->participation[i] * ground;
    for (size_t d = 0; d < m; d++)
        w1[d] =
            frame->damper[d].lean * ground + frame_dot(frame->damper[d].shape, steps->elastic, n);
    for (size_t d = 0; d < m; d++) {
        if (force[d] == 0)
            continue;
        for (size_t i = 0; i < n; i++)
            p1[i] += frame->damper[d].shape[i] * force[d];
        for (size_t e = 0; e < m; e++)
            w1[e] -= frame->yield[e * m + d] * force[d];
    }
}

ContactForce steps_contact(const Frame *frame, size_t d, double r, double w) {
    const FrameDamper *damper = &frame->damper[d];
    const double sign = frame_sign(damper->side);
    if (frame->plan->form == CONTACT_POWER) {
        ContactForce force = frame->plan->law->force(&damper->contact, sign * r, sign * w);
        force.value *= sign;
        return force;
    }
    const double k = damper->contact.stiffness, c = damper->contact.damping;
    return (ContactForce){
        .value = k * r + c * w, .by_penetration = k, .by_speed = c, .strain = 0.5 * k * r * r};
}

// Powers at one end of a step, and how they change.
typedef struct End {
    double input, damping, input_rate, damping_rate;
} End;

static End look(Steps *steps, const double *y, double ground, double slope, double *forces,
                double *rates) {
    const Frame *frame = &steps->frame;
    const size_t n = frame->mode_count, m = frame->dampers;
    const double *p = y + n, *r = y + 2 * n, *w = r + m;
    for (size_t d = 0; d < m; d++)
        forces[d] =
            frame->damper[d].phase == FRAME_CONTACT ? steps_contact(frame, d, r[d], w[d]).value : 0;
    steps_rate(steps, y, ground, forces, rates);
    double momentum = frame_dot(frame->carry, p, n), gained = frame_dot(frame->carry, rates + n, n);
    for (size_t d = 0; d < m; d++) {
        momentum += frame->damper[d].plan->mass * w[d];
        gained += frame->damper[d].plan->mass * rates[2 * n + m + d];
    }
    End end = {.input = -ground * momentum, .input_rate = -slope * momentum - ground * gained};
    for (size_t i = 0; i < n; i++) { // D need not be symmetric
        const double drag = steps->elastic[i] - frame->omega2[i] * y[i];
        const double dragged = frame->diagonal != NULL
                                   ? frame->diagonal[i] * rates[n + i]
                                   : frame_dot(frame->damping + i * n, rates + n, n);
        end.damping += drag * p[i];
        end.damping_rate += drag * rates[n + i] + dragged * p[i];
    }
    return end;
}

void steps_sum(Steps *steps, const double *from, const double *to, double length,
               bool is_corrected) {
    const Frame *frame = &steps->frame;
    const size_t n = frame->mode_count, m = frame->dampers;
    const double slope = (steps->ground[2] - steps->ground[0]) / length;
    const double half = length / 2, twelfth = is_corrected ? length * length / 12 : 0;
    const double *const states[2] = {from, to};
    double *rates = steps->force + m;
    StepSums *sums = &steps->sums;
    for (int k = 0; k < 2; k++) {
        const double correction = k == 0 ? twelfth : -twelfth;
        const double *r = states[k] + 2 * n, *w = r + m;
        const End end =
            look(steps, states[k], steps->ground[k == 0 ? 0 : 2], slope, steps->force, rates);
        sums->input += half * end.input + correction * end.input_rate;
        sums->damping += half * end.damping + correction * end.damping_rate;
        for (size_t d = 0; d < m; d++) {
            if (frame->damper[d].phase != FRAME_CONTACT)
                continue;
            const ContactForce force = steps_contact(frame, d, r[d], w[d]);
            const double sped = rates[2 * n + m + d];
            const double grown = force.by_penetration * w[d] + force.by_speed * sped;
            sums->impulse[d] += half * force.value + correction * grown;
            sums->work[d] +=
                half * force.value * w[d] + correction * (grown * w[d] + force.value * sped);
        }
    }
}

static void read_base(Steps *steps, double length) {
    const Frame *frame = &steps->frame;
    Slice slice;
    const double knot = base_cursor_slice(&frame->base, frame->sample, frame->offset, &slice);
    steps->ground[0] = slice.value;
    for (int k = 1; k <= 2; k++) {
        const double at = k * length / 2;
        if (knot < at * (1 - 1e-9)) {
            (void)base_cursor_slice(&frame->base, frame->sample, frame->offset + at, &slice);
            steps->ground[k] = slice.value;
        } else {
            steps->ground[k] = slice_at(&slice, at);
        }
    }
}

// What the base gains in speed over a step, piece by piece.
static double base_gain(const Frame *frame, double length) {
    double gain = 0, done = 0;
    while (length - done > 1e-12 * length) {
        Slice slice;
        const double knot =
            base_cursor_slice(&frame->base, frame->sample, frame->offset + done, &slice);
        const double h = fmin(knot, length - done), turn = slice.omega * h;
        gain += slice.omega > 0
                    ? (slice.value * sin(turn) + slice.slope * (1 - cos(turn))) / slice.omega
                    : (slice.value + slice.slope * h / 2) * h;
        done += h;
    }
    return gain;
}

// A pulse shorter than a step may lie between all instants at which steps look at the base, those
// of a neighbour too.
static void look_for_unseen(Steps *steps, double length, double seen) {
    const Frame *frame = &steps->frame;
    Slice slice;
    if (frame->base.base->form != BASE_PIECES ||
        !(base_cursor_slice(&frame->base, frame->sample, frame->offset, &slice) < length))
        return;
    if (steps->most_unseen == 0)
        steps->unseen_since = frame_time(frame);
    steps->unseen += base_gain(frame, length) - seen;
    steps->most_unseen = fmax(steps->most_unseen, fabs(steps->unseen));
}

static Status unstable(const Steps *steps) {
    const Frame *frame = &steps->frame;
    return problem_set(frame->problem, STATUS_UNSTABLE,
                       "%s leaves all bounds at t = %.6g s with a step of %.4g s: the motion has a "
                       "rate of %.4g 1/s, take a step of %.2g s or less, or the solver \"exact\"",
                       steps->stepper->name, frame_time(frame), steps->length, frame_rate(frame),
                       fmin(0.2 / frame_rate(frame), steps->length / 4));
}

Status steps_check(Steps *steps) {
    Frame *frame = &steps->frame;
    const Run *run = frame->run;
    steps->watched = 0;
    if (run->steps_max > 0 && run->steps > run->steps_max)
        return problem_set(frame->problem, STATUS_LIMIT,
                           SOLVER_STOPPED "t = %.6g s of %.6g s, by steps of %.4g s",
                           run->steps_max, run->steps_max * SOLVER_STEP, frame_time(frame),
                           frame->plan->duration, steps->length);
    if (!progress_advance(run->progress, frame_time(frame) / frame->plan->duration))
        return problem_set(frame->problem, STATUS_CANCELLED, "cancelled at t = %.6g s",
                           frame_time(frame));
    return ledger_status(&frame->ledger, frame->problem);
}

// Takes peaks and the balance at a step's end, and tells a motion without bounds.
static Status note(Steps *steps) {
    Frame *frame = &steps->frame;
    frame_feel(frame);
    const EnergyState energy = frame_energy(frame);
    const double held = energy.kinetic + energy.strain;
    steps->largest_in = fmax(steps->largest_in, fabs(frame->ledger.energy.input));
    const double most = GROWN * (steps->largest_in + frame->ledger.energy.initial);
    if (!(held <= most) || !isfinite(held))
        return unstable(steps);
    if (frame->is_shadow)
        return STATUS_OK;
    frame_record_peaks(frame);
    ledger_balance(&frame->ledger, &energy);
    return STATUS_OK;
}

Status steps_note(Steps *steps, double cost) {
    TRY(note(steps));
    steps->frame.run->work.steps++;
    steps->frame.run->steps += cost;
    steps->watched += 20 * cost;
    return steps->watched > WATCH_WORK ? steps_check(steps) : STATUS_OK;
}

static void gather(const Frame *frame, double *y) {
    const size_t n = frame->mode_count, m = frame->dampers;
    memcpy(y, frame->q, n * sizeof *y);
    memcpy(y + n, frame->p, n * sizeof *y);
    for (size_t d = 0; d < m; d++) {
        y[2 * n + d] = frame->damper[d].r;
        y[2 * n + m + d] = frame->damper[d].w;
    }
}

static void scatter(Frame *frame, const double *y) {
    const size_t n = frame->mode_count, m = frame->dampers;
    memcpy(frame->q, y, n * sizeof *y);
    memcpy(frame->p, y + n, n * sizeof *y);
    for (size_t d = 0; d < m; d++) {
        frame->damper[d].r = y[2 * n + d];
        frame->damper[d].w = y[2 * n + m + d];
    }
}

// Forces under a power law take several powers a step.
static double contact_cost(const Steps *steps) {
    const Frame *frame = &steps->frame;
    size_t touching = 0;
    for (size_t d = 0; d < frame->dampers && frame->plan->form == CONTACT_POWER; d++)
        touching += frame->damper[d].phase == FRAME_CONTACT;
    return POWER_STEPS * (double)touching;
}

// `offset`: of the step's end.
static Status step(Steps *steps, double length, double offset) {
    Frame *frame = &steps->frame;
    const size_t m = frame->dampers;
    double making;
    const double cost =
        steps->stepper->cost(frame->mode_count, m, frame->diagonal == NULL, &making);
    StepSums *sums = &steps->sums;
    read_base(steps, length);
    gather(frame, steps->y);
    sums->input = sums->damping = 0;
    memset(sums->impulse, 0, 2 * m * sizeof *sums->impulse);
    for (size_t d = 0; d < m && frame->has_stops; d++)
        steps->before[d] = frame->damper[d].phase == FRAME_CONTACT
                               ? steps_contact(frame, d, frame->damper[d].r, 0).strain
                               : 0;
    const double gain = length / 6 * (steps->ground[0] + 4 * steps->ground[1] + steps->ground[2]);
    look_for_unseen(steps, length, gain);
    TRY(steps->stepper->step(steps, length));
    scatter(frame, steps->y);
    frame->offset = offset;
    frame->ground = steps->ground[2];
    ledger_work(&frame->ledger, sums->input, sums->damping);
    steps->record.base_speed += gain;
    if (frame->has_stops) {
        frame->run->work.stop_searches++;
        steps_turn(steps, length);
    }
    return steps_note(steps, cost + contact_cost(steps));
}

void steps_take_sample(Steps *steps) {
    Frame *frame = &steps->frame;
    if (frame->is_shadow)
        return;
    frame->ground = base_cursor_at(&frame->base, frame->sample);
    frame_feel(frame);
    if (frame->sample == steps->record.statistics_start && frame->sample > 0)
        frame_record_forget(frame);
    frame_trail_take(&steps->trail, frame, steps->record.base_speed);
    frame_record_take(&steps->record, frame, 1);
    frame_record_peaks(frame);
}

Status steps_interval(Steps *steps) {
    Frame *frame = &steps->frame;
    if (steps->stepper->cross != NULL)
        TRY(steps->stepper->cross(steps, frame->interval));
    for (size_t k = 1; k <= steps->share && steps->stepper->cross == NULL; k++)
        TRY(step(steps, steps->length, (double)k * steps->length));
    frame->sample++;
    frame->offset = 0;
    frame->run->work.mode_samples += frame->mode_count;
    steps_take_sample(steps);
    return STATUS_OK;
}

Status steps_finish(Steps *steps, double length) {
    const double clock = 8 * DBL_EPSILON * steps->frame.plan->duration; // less is rounding
    const double whole = floor(length / steps->length * (1 + 1e-9));
    if (steps->stepper->cross != NULL) {
        if (length > clock)
            TRY(steps->stepper->cross(steps, length));
        return steps_check(steps);
    }
    for (double k = 1; k <= whole; k++)
        TRY(step(steps, steps->length, k * steps->length));
    const double rest = length - whole * steps->length;
    if (rest > clock)
        TRY(step(steps, rest, length));
    return steps_check(steps);
}
