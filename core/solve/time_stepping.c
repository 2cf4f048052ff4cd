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

void steps_elastic(const ModalState *state, const double *q, const double *p,
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

void steps_rate(Steps *steps, const double *y, double ground, const double *force,
                double *restrict out) {
    const ModalState *state = &steps->state;
    const size_t n = state->mode_count, m = state->dampers;
    double *p1 = out + n, *w1 = out + 2 * n + m;
    steps_elastic(state, y, y + n, steps->elastic);
    memcpy(out, y + n, n * sizeof *y);
    memcpy(out + 2 * n, y + 2 * n + m, m * sizeof *y);
    for (size_t i = 0; i < n; i++)
        p1[i] = -steps->elastic[i] - state->modes->participation[i] * ground;
    for (size_t d = 0; d < m; d++)
        w1[d] = state->damper[d].base_coupling * ground +
                modal_state_dot(state->damper[d].shape, steps->elastic, n);
    for (size_t d = 0; d < m; d++) {
        if (force[d] == 0)
            continue;
        for (size_t i = 0; i < n; i++)
            p1[i] += state->damper[d].shape[i] * force[d];
        for (size_t e = 0; e < m; e++)
            w1[e] -= state->delassus[e * m + d] * force[d];
    }
}

ContactForce steps_contact(const ModalState *state, size_t d, double r, double w) {
    const DamperState *damper = &state->damper[d];
    const double sign = modal_state_sign(damper->side);
    if (state->plan->form == CONTACT_POWER) {
        ContactForce force = state->plan->law->force(&damper->contact, sign * r, sign * w);
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
    const ModalState *state = &steps->state;
    const size_t n = state->mode_count, m = state->dampers;
    const double *p = y + n, *r = y + 2 * n, *w = r + m;
    for (size_t d = 0; d < m; d++)
        forces[d] =
            state->damper[d].phase == PHASE_CONTACT ? steps_contact(state, d, r[d], w[d]).value : 0;
    steps_rate(steps, y, ground, forces, rates);
    double momentum = modal_state_dot(state->momentum_weights, p, n),
           gained = modal_state_dot(state->momentum_weights, rates + n, n);
    for (size_t d = 0; d < m; d++) {
        momentum += state->damper[d].plan->mass * w[d];
        gained += state->damper[d].plan->mass * rates[2 * n + m + d];
    }
    End end = {.input = -ground * momentum, .input_rate = -slope * momentum - ground * gained};
    for (size_t i = 0; i < n; i++) { // D need not be symmetric
        const double drag = steps->elastic[i] - state->omega2[i] * y[i];
        const double dragged = state->diagonal != NULL
                                   ? state->diagonal[i] * rates[n + i]
                                   : modal_state_dot(state->damping + i * n, rates + n, n);
        end.damping += drag * p[i];
        end.damping_rate += drag * rates[n + i] + dragged * p[i];
    }
    return end;
}

void steps_sum(Steps *steps, const double *from, const double *to, double length,
               bool is_corrected) {
    const ModalState *state = &steps->state;
    const size_t n = state->mode_count, m = state->dampers;
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
            if (state->damper[d].phase != PHASE_CONTACT)
                continue;
            const ContactForce force = steps_contact(state, d, r[d], w[d]);
            const double sped = rates[2 * n + m + d];
            const double grown = force.by_penetration * w[d] + force.by_speed * sped;
            sums->impulse[d] += half * force.value + correction * grown;
            sums->work[d] +=
                half * force.value * w[d] + correction * (grown * w[d] + force.value * sped);
        }
    }
}

static void read_base(Steps *steps, double length) {
    const ModalState *state = &steps->state;
    Slice slice;
    const double knot = base_cursor_slice(&state->base, state->sample, state->offset, &slice);
    steps->ground[0] = slice.value;
    for (int k = 1; k <= 2; k++) {
        const double at = k * length / 2;
        if (knot < at * (1 - 1e-9)) {
            (void)base_cursor_slice(&state->base, state->sample, state->offset + at, &slice);
            steps->ground[k] = slice.value;
        } else {
            steps->ground[k] = slice_at(&slice, at);
        }
    }
}

// What the base gains in speed over a step, piece by piece.
static double base_gain(const ModalState *state, double length) {
    double gain = 0, done = 0;
    while (length - done > 1e-12 * length) {
        Slice slice;
        const double knot =
            base_cursor_slice(&state->base, state->sample, state->offset + done, &slice);
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
    const ModalState *state = &steps->state;
    Slice slice;
    if (state->base.base->form != BASE_PIECES ||
        !(base_cursor_slice(&state->base, state->sample, state->offset, &slice) < length))
        return;
    if (steps->most_unseen == 0)
        steps->unseen_since = modal_state_time(state);
    steps->unseen += base_gain(state, length) - seen;
    steps->most_unseen = fmax(steps->most_unseen, fabs(steps->unseen));
}

static Status unstable(const Steps *steps) {
    const ModalState *state = &steps->state;
    return problem_set(state->problem, STATUS_UNSTABLE,
                       "%s leaves all bounds at t = %.6g s with a step of %.4g s: the motion has a "
                       "rate of %.4g 1/s, take a step of %.2g s or less, or the solver \"exact\"",
                       steps->stepper->name, modal_state_time(state), steps->length,
                       modal_state_rate(state),
                       fmin(0.2 / modal_state_rate(state), steps->length / 4));
}

Status steps_check(Steps *steps) {
    ModalState *state = &steps->state;
    const Run *run = state->run;
    steps->watched = 0;
    if (run->steps_max > 0 && run->steps > run->steps_max)
        return problem_set(state->problem, STATUS_LIMIT,
                           SOLVER_STOPPED "t = %.6g s of %.6g s, by steps of %.4g s",
                           run->steps_max, run->steps_max * SOLVER_STEP, modal_state_time(state),
                           state->plan->duration, steps->length);
    if (!progress_advance(run->progress, modal_state_time(state) / state->plan->duration))
        return problem_set(state->problem, STATUS_CANCELLED, "cancelled at t = %.6g s",
                           modal_state_time(state));
    return impact_log_status(&state->impacts, state->problem);
}

// Takes peaks and the balance at a step's end, and tells a motion without bounds.
static Status note(Steps *steps) {
    ModalState *state = &steps->state;
    modal_state_forces(state);
    const EnergyState energy = modal_state_energy(state);
    const double held = energy.kinetic + energy.strain;
    steps->largest_in = fmax(steps->largest_in, fabs(state->impacts.energy.input));
    const double most = GROWN * (steps->largest_in + state->impacts.energy.initial);
    if (!(held <= most) || !isfinite(held))
        return unstable(steps);
    if (state->is_shadow)
        return STATUS_OK;
    recorder_peaks(state);
    impact_log_balance(&state->impacts, &energy);
    return STATUS_OK;
}

Status steps_note(Steps *steps, double cost) {
    TRY(note(steps));
    steps->state.run->work.steps++;
    steps->state.run->steps += cost;
    steps->watched += 20 * cost;
    return steps->watched > WATCH_WORK ? steps_check(steps) : STATUS_OK;
}

static void gather(const ModalState *state, double *y) {
    const size_t n = state->mode_count, m = state->dampers;
    memcpy(y, state->q, n * sizeof *y);
    memcpy(y + n, state->p, n * sizeof *y);
    for (size_t d = 0; d < m; d++) {
        y[2 * n + d] = state->damper[d].r;
        y[2 * n + m + d] = state->damper[d].w;
    }
}

static void scatter(ModalState *state, const double *y) {
    const size_t n = state->mode_count, m = state->dampers;
    memcpy(state->q, y, n * sizeof *y);
    memcpy(state->p, y + n, n * sizeof *y);
    for (size_t d = 0; d < m; d++) {
        state->damper[d].r = y[2 * n + d];
        state->damper[d].w = y[2 * n + m + d];
    }
}

// Forces under a power law take several powers a step.
static double contact_cost(const Steps *steps) {
    const ModalState *state = &steps->state;
    size_t touching = 0;
    for (size_t d = 0; d < state->dampers && state->plan->form == CONTACT_POWER; d++)
        touching += state->damper[d].phase == PHASE_CONTACT;
    return POWER_STEPS * (double)touching;
}

// `offset`: of the step's end.
static Status step(Steps *steps, double length, double offset) {
    ModalState *state = &steps->state;
    const size_t m = state->dampers;
    double making;
    const double cost =
        steps->stepper->cost(state->mode_count, m, state->diagonal == NULL, &making);
    StepSums *sums = &steps->sums;
    read_base(steps, length);
    gather(state, steps->y);
    sums->input = sums->damping = 0;
    memset(sums->impulse, 0, 2 * m * sizeof *sums->impulse);
    for (size_t d = 0; d < m && state->has_stops; d++)
        steps->before[d] = state->damper[d].phase == PHASE_CONTACT
                               ? steps_contact(state, d, state->damper[d].r, 0).strain
                               : 0;
    const double gain = length / 6 * (steps->ground[0] + 4 * steps->ground[1] + steps->ground[2]);
    look_for_unseen(steps, length, gain);
    TRY(steps->stepper->step(steps, length));
    scatter(state, steps->y);
    state->offset = offset;
    state->base_acceleration = steps->ground[2];
    impact_log_work(&state->impacts, sums->input, sums->damping);
    steps->record.base_speed += gain;
    if (state->has_stops) {
        state->run->work.stop_searches++;
        steps_turn(steps, length);
    }
    return steps_note(steps, cost + contact_cost(steps));
}

void steps_take_sample(Steps *steps) {
    ModalState *state = &steps->state;
    if (state->is_shadow)
        return;
    state->base_acceleration = base_cursor_at(&state->base, state->sample);
    modal_state_forces(state);
    if (state->sample == steps->record.statistics_start && state->sample > 0)
        recorder_forget(state);
    flight_buffer_take(&steps->trail, state, steps->record.base_speed);
    recorder_take(&steps->record, state, 1);
    recorder_peaks(state);
}

Status steps_interval(Steps *steps) {
    ModalState *state = &steps->state;
    if (steps->stepper->cross != NULL)
        TRY(steps->stepper->cross(steps, state->interval));
    for (size_t k = 1; k <= steps->share && steps->stepper->cross == NULL; k++)
        TRY(step(steps, steps->length, (double)k * steps->length));
    state->sample++;
    state->offset = 0;
    state->run->work.mode_samples += state->mode_count;
    steps_take_sample(steps);
    return STATUS_OK;
}

Status steps_finish(Steps *steps, double length) {
    const double clock = 8 * DBL_EPSILON * steps->state.plan->duration; // less is rounding
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
