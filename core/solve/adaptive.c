// Error-controlled steps by ARKODE's explicit Runge-Kutta stepper (SUNDIALS) over all modes and
// dampers together. A step ends at every sample, at every kink of the base and where a contact
// begins or ends. Contact events follow the rules of contact_events.c, but a stop that is only
// grazed within a step is missed.
//
// The integrated vector is (q, p; r, w), then the integrals of N and N r' of each damper, the work
// of the base, the loss in the structure and the ground velocity. Each damper has three watched
// functions, which are positive until their event:
//
//   in flight    the gaps to its two stops
//   in contact   the penetration (zero force: N); dN/dt, which falls through zero at a peak of N
//   inside       -N; the penetration
//   at rest      N
//
// ARKODE's dense output is far less accurate than its steps, so it gives only a first guess of a
// root. The step is then repeated to end at the root, which Newton's method corrects.
#include <arkode/arkode_erkstep.h>
#include <float.h>
#include <math.h>
#include <nvector/nvector_serial.h>
#include <stdlib.h>
#include <string.h>

#include "core/solve/engine.h"
#include "core/solve/time_stepping.h"

enum { WATCH_FIRST, WATCH_SECOND, WATCH_PEAK, WATCHED }; // functions of each damper
enum { NO_ROOT = -1 };
enum { STAGES = 13, ORDER = 8, EMBEDDED_ORDER = 7 };
enum { TOTALS = 3 };
enum { HALVINGS = 60, RETAKES = 8, ERROR_TEST_FAILURES = 60 };
// Memory that SUNDIALS needs at most, in values of type double: vectors, and all else of each
// vector and of the context.
enum { CLONES_MAX = 40, CLONE_OVERHEAD = 128, CONTEXT_SIZE = 1 << 13 };
static const double TOLERANCE_DEFAULT = 1e-9;
static const double OUTGROWN = 100;      // motion over that of the last error weights
static const double POISED = 1e-4;       // of a step
static const double JUMP = 1e-9;         // relative, of a_g between two steps
static const double SIMULTANEOUS = 1e-9; // dN/dt at a peak over that at the start of its step
static const double ADVANCE_COST = 10;   // solver steps of a step without its derivatives
static const double SCALE_MIN = 1e-290;  // an error weight must not be zero
// Steps of a period of the fastest mode, of a radian of the base and of an event, over 10 to an
// eighth of the digits (the method has order 8); of a radian in contact.
static const double TURN_STEPS = 2, BASE_STEPS = 1, EVENT_STEPS = 7, CONTACT_STEPS = 0.5;

typedef struct Adaptive {
    TimeStepping *stepping;
    SUNContext context;
    void *arkode;
    size_t size;       // of y
    N_Vector y, from;  // now and at the start of the step
    N_Vector within;   // scratch: inside a step, or a derivative
    N_Vector absolute; // error tolerance of each component
    double *rates;     // y' at the last evaluation of the watched functions
    // Watched functions and their slopes (NAN: unknown): at the step's start, its end and inside.
    double *value, *slope, *end_value, *end_slope, *inner_value, *inner_slope;
    double *block;
    double t, t0;      // now and at the start of the step, from the last restart [s]
    double next_step;  // first step after a reset [s]
    double speed;      // largest sqrt(p'p + q'W^2 q) so far
    double push;       // largest |a_g| over an interval so far [m/s^2]
    double rate_calls; // since the cost was last counted
    Slice slice;       // of the base, from t0 on
    bool is_at_knot;   // of the base
    double part;       // longest step until the next one [s]
    size_t events;     // of the state at the last restart; SIZE_MAX: restart
} Adaptive;

// RK8(7)13M of Prince and Dormand, J. Comp. Appl. Math. 7 (1981) 67-75. The error estimate of
// ARKODE's own table of order 8 is zero for y' = f(t), so it does not see a contact begin.
// clang-format off
static const double nodes[STAGES] = {
    0, 1.0 / 18, 1.0 / 12, 1.0 / 8, 5.0 / 16, 3.0 / 8, 59.0 / 400, 93.0 / 200,
    5490023248.0 / 9719169821.0, 13.0 / 20, 1201146811.0 / 1299019798.0, 1, 1};
static const double stages[STAGES][STAGES] = {
    {0},
    {1.0 / 18},
    {1.0 / 48, 1.0 / 16},
    {1.0 / 32, 0, 3.0 / 32},
    {5.0 / 16, 0, -75.0 / 64, 75.0 / 64},
    {3.0 / 80, 0, 0, 3.0 / 16, 3.0 / 20},
    {29443841.0 / 614563906.0, 0, 0, 77736538.0 / 692538347.0, -28693883.0 / 1125000000.0,
     23124283.0 / 1800000000.0},
    {16016141.0 / 946692911.0, 0, 0, 61564180.0 / 158732637.0, 22789713.0 / 633445777.0,
     545815736.0 / 2771057229.0, -180193667.0 / 1043307555.0},
    {39632708.0 / 573591083.0, 0, 0, -433636366.0 / 683701615.0, -421739975.0 / 2616292301.0,
     100302831.0 / 723423059.0, 790204164.0 / 839813087.0, 800635310.0 / 3783071287.0},
    {246121993.0 / 1340847787.0, 0, 0, -37695042795.0 / 15268766246.0,
     -309121744.0 / 1061227803.0, -12992083.0 / 490766935.0, 6005943493.0 / 2108947869.0,
     393006217.0 / 1396673457.0, 123872331.0 / 1001029789.0},
    {-1028468189.0 / 846180014.0, 0, 0, 8478235783.0 / 508512852.0, 1311729495.0 / 1432422823.0,
     -10304129995.0 / 1701304382.0, -48777925059.0 / 3047939560.0, 15336726248.0 / 1032824649.0,
     -45442868181.0 / 3398467696.0, 3065993473.0 / 597172653.0},
    {185892177.0 / 718116043.0, 0, 0, -3185094517.0 / 667107341.0, -477755414.0 / 1098053517.0,
     -703635378.0 / 230739211.0, 5731566787.0 / 1027545527.0, 5232866602.0 / 850066563.0,
     -4093664535.0 / 808688257.0, 3962137247.0 / 1805957418.0, 65686358.0 / 487910083.0},
    {403863854.0 / 491063109.0, 0, 0, -5068492393.0 / 434740067.0, -411421997.0 / 543043805.0,
     652783627.0 / 914296604.0, 11173962825.0 / 925320556.0, -13158990841.0 / 6184727034.0,
     3936647629.0 / 1978049680.0, -160528059.0 / 685178525.0, 248638103.0 / 1413531060.0}};
static const double weights[STAGES] = {
    14005451.0 / 335480064.0, 0, 0, 0, 0, -59238493.0 / 1068277825.0, 181606767.0 / 758867731.0,
    561292985.0 / 797845732.0, -1041891430.0 / 1371343529.0, 760417239.0 / 1151165299.0,
    118820643.0 / 751138087.0, -528747749.0 / 2220607170.0, 1.0 / 4};
static const double embedded[STAGES] = {
    13451932.0 / 455176623.0, 0, 0, 0, 0, -808719846.0 / 976000145.0,
    1757004468.0 / 5645159321.0, 656045339.0 / 265891186.0, -3867574721.0 / 1518517206.0,
    465885868.0 / 322736535.0, 53011238.0 / 667516719.0, 2.0 / 45, 0};
// clang-format on

static double *adaptive_data(N_Vector vector) {
    return N_VGetArrayPointer(vector);
}

// N of all dampers at y.
static void adaptive_forces(const Adaptive *adaptive, const double *y, double ground) {
    TimeStepping *stepping = adaptive->stepping;
    const ModalState *state = &stepping->state;
    time_stepping_forces(stepping, y);
    if (state->resting > 0)
        time_stepping_elastic(state, y, y + state->mode_count, stepping->elastic);
    for (size_t d = 0; d < state->dampers; d++)
        if (state->damper[d].phase == PHASE_RESTING)
            stepping->force[d] = modal_state_constraint(state, d, stepping->elastic, ground);
}

static void adaptive_rate(Adaptive *adaptive, double t, const double *y, double *out) {
    TimeStepping *stepping = adaptive->stepping;
    const ModalState *state = &stepping->state;
    const size_t m = state->dampers, at_r = 2 * state->mode_count;
    const double ground = slice_at(&adaptive->slice, t - adaptive->t0);
    adaptive->rate_calls++;
    adaptive_forces(adaptive, y, ground);
    time_stepping_rate(stepping, y, ground, out);
    for (size_t d = 0; d < m; d++)
        if (state->damper[d].phase == PHASE_RESTING) // zero but for rounding
            out[at_r + d] = out[at_r + m + d] = 0;
    out[adaptive->size - 1] = ground;
}

static int adaptive_arkode_rate(realtype t, N_Vector y, N_Vector out, void *user) {
    adaptive_rate(user, t, adaptive_data(y), adaptive_data(out));
    return 0;
}

// dN/dt of a damper at rest at (t, y), whose y' is `rates`. N is linear in p, q and a_g.
static double adaptive_rest_slope(const Adaptive *adaptive, size_t d, double t) {
    const TimeStepping *stepping = adaptive->stepping;
    const ModalState *state = &stepping->state;
    const Slice *slice = &adaptive->slice;
    const double omega = slice->omega;
    const Slice rate = omega > 0 ? (Slice){omega * slice->slope, -omega * slice->value, omega}
                                 : (Slice){.value = slice->slope};
    time_stepping_elastic(state, adaptive->rates, adaptive->rates + state->mode_count,
                          stepping->elastic);
    return modal_state_constraint(state, d, stepping->elastic, slice_at(&rate, t - adaptive->t0));
}

// The watched functions of a damper and their slopes.
static void adaptive_watch(Adaptive *adaptive, double t, const double *y, double *value,
                           double *slope) {
    const ModalState *state = &adaptive->stepping->state;
    const size_t m = state->dampers, at_r = 2 * state->mode_count;
    const double *r = y + at_r, *w = r + m;
    adaptive_rate(adaptive, t, y, adaptive->rates);
    for (size_t d = 0; d < m && state->has_stops; d++) {
        const DamperState *damper = &state->damper[d];
        const double sign = modal_state_sign(damper->side);
        double *f = value + WATCHED * d, *f1 = slope + WATCHED * d;
        for (int k = 0; k < WATCHED; k++)
            f[k] = f1[k] = 1;
        if (damper->phase == PHASE_FLIGHT) {
            for (int side = 0; side < 2; side++) {
                const double toward = modal_state_sign((Side)side);
                f[side] = modal_state_room(damper, (Side)side) - toward * r[d];
                f1[side] = -toward * w[d];
            }
        } else if (damper->phase == PHASE_RESTING) {
            f[WATCH_FIRST] = sign * adaptive->stepping->force[d];
            f1[WATCH_FIRST] = sign * adaptive_rest_slope(adaptive, d, t);
        } else {
            const ContactForce force = step_contact_force(state, d, r[d], w[d]);
            const double N1 = sign * (force.by_penetration * w[d] +
                                      force.by_speed * adaptive->rates[at_r + m + d]);
            if (damper->phase == PHASE_INSIDE) {
                f[WATCH_FIRST] = -sign * force.value;
                f1[WATCH_FIRST] = -N1;
                f[WATCH_SECOND] = sign * r[d];
                f1[WATCH_SECOND] = sign * w[d];
                continue;
            }
            const bool is_by_force = state->plan->separation == SEPARATION_ZERO_FORCE;
            f[WATCH_FIRST] = sign * (is_by_force ? force.value : r[d]);
            f1[WATCH_FIRST] = is_by_force ? N1 : sign * w[d];
            f[WATCH_PEAK] = N1;
            f1[WATCH_PEAK] = (double)NAN;
        }
    }
}

static Status adaptive_failed(const Adaptive *adaptive, double t) {
    return problem_set(
        adaptive->stepping->state.problem, STATUS_UNSTABLE,
        "a contact could not be integrated to its end: it is too stiff or leaves what "
        "double precision can hold (%.6g s after its last sample or event)",
        t);
}

// Restarts ARKODE at (t, y) with a first step.
static bool adaptive_reset(Adaptive *adaptive, double t, N_Vector y, double step) {
    return ERKStepReset(adaptive->arkode, t, y) == 0 &&
           ERKStepSetInitStep(adaptive->arkode, step) == 0;
}

// Largest |a_g| over an interval, if the base goes on as it does now.
static double adaptive_push(const Adaptive *adaptive) {
    return fabs(adaptive->slice.value) +
           fabs(adaptive->slice.slope) * adaptive->stepping->state.interval;
}

// Sets the absolute tolerances from a typical magnitude of each component and returns a first step.
static double adaptive_set_tolerances(Adaptive *adaptive) {
    const ModalState *state = &adaptive->stepping->state;
    const size_t n = state->mode_count, m = state->dampers, at_r = 2 * state->mode_count;
    double *scale = adaptive_data(adaptive->absolute), *r = scale + at_r, *w = r + m;
    double *impulse = scale + adaptive->stepping->size,
           *totals = scale + adaptive->stepping->size + 2 * state->dampers;
    double time = state->interval, energy = 0;
    adaptive->push = fmax(adaptive->push, adaptive_push(adaptive));
    adaptive->speed =
        fmax(adaptive->speed, fmax(modal_state_size(state),
                                   state->participation_norm * adaptive->push * state->interval));
    // The dampers will set a structure at rest in motion.
    for (size_t d = 0; d < m; d++) {
        const DamperState *damper = &state->damper[d];
        const double mobility = modal_state_dot(damper->shape, damper->shape, n);
        adaptive->speed =
            fmax(adaptive->speed, damper->effective_mass * fabs(damper->w) * sqrt(mobility));
    }
    for (size_t i = 0; i < n; i++) {
        scale[n + i] = adaptive->speed;
        scale[i] = adaptive->speed / fmax(sqrt(state->omega2[i]), 1 / state->plan->duration);
    }
    for (size_t d = 0; d < m; d++) {
        const DamperState *damper = &state->damper[d];
        const double mass = damper->effective_mass;
        const double wide =
            sqrt(modal_state_dot(damper->shape, damper->shape, n)) * adaptive->speed;
        const double speed =
            fmax(fabs(damper->w), damper->phase == PHASE_CONTACT ? 1e-3 * wide : wide);
        // Near a stop the mass may soon return, and a root is resolved to a part of a step only.
        const double pull = fabs(adaptive->rates[at_r + m + d]);
        if (damper->phase == PHASE_FLIGHT && damper->origin != FROM_MIDDLE && pull > 0)
            time = fmin(time, (fabs(damper->w) + sqrt(2 * pull * fabs(damper->r))) / pull);
        w[d] = speed;
        r[d] = fmax(damper->plan->clearance, speed * state->interval);
        if (damper->phase == PHASE_CONTACT) {
            const double exponent =
                state->plan->form == CONTACT_POWER ? damper->contact.exponent : 1;
            r[d] = pow(mass * speed * speed / damper->contact.stiffness, 1 / (exponent + 1));
            if (speed > 0)
                time = fmin(time, r[d] / speed);
        }
        impulse[d] = mass * speed;
        impulse[m + d] = mass * speed * speed;
        energy += mass * speed * speed;
    }
    totals[0] = totals[1] = energy + adaptive->speed * adaptive->speed;
    totals[2] = adaptive->push * state->interval;
    for (size_t i = 0; i < adaptive->size; i++)
        scale[i] = adaptive->stepping->tolerance * fmax(scale[i], SCALE_MIN);
    return time / (8 * (double)adaptive->stepping->share);
}

// Restarts the integration from the present state.
static Status adaptive_restart(Adaptive *adaptive) {
    const ModalState *state = &adaptive->stepping->state;
    double *y = adaptive_data(adaptive->y);
    memset(y, 0, adaptive->size * sizeof *y);
    time_stepping_begin(adaptive->stepping, y);
    adaptive->t = adaptive->t0 = 0;
    adaptive->events = state->events;
    adaptive_watch(adaptive, 0, y, adaptive->value, adaptive->slope);
    adaptive->next_step = adaptive_set_tolerances(adaptive);
    // ARKODE copies the tolerances.
    return adaptive_reset(adaptive, 0, adaptive->y, adaptive->next_step) &&
                   ERKStepSVtolerances(adaptive->arkode, adaptive->stepping->tolerance,
                                       adaptive->absolute) == 0
               ? STATUS_OK
               : adaptive_failed(adaptive, 0);
}

// Evaluates the watched functions at t, inside the step just taken.
static bool adaptive_look_inside(Adaptive *adaptive, double t) {
    if (ERKStepGetDky(adaptive->arkode, t, 0, adaptive->within) != 0)
        return false;
    adaptive_watch(adaptive, t, adaptive_data(adaptive->within), adaptive->inner_value,
                   adaptive->inner_slope);
    return true;
}

// Halves [*low, *high] towards the sign change of `at`[i], which is inner_value or inner_slope and
// has the sign `sign` at *low.
static bool adaptive_bisect(Adaptive *adaptive, const double *at, size_t i, double sign,
                            double *low, double *high) {
    for (int step = 0; step < HALVINGS; step++) {
        const double middle = *low + (*high - *low) / 2;
        if (middle <= *low || middle >= *high)
            break;
        if (!adaptive_look_inside(adaptive, middle))
            return false;
        *(sign * at[i] > 0 ? low : high) = middle;
    }
    return true;
}

// Whether function i falls to zero in the step that ends at t1; *t is an estimate of the instant.
// The slopes reveal a function that dips below zero and returns within the step.
static bool adaptive_has_root(Adaptive *adaptive, size_t i, double t1, double *t) {
    const bool is_above =
        adaptive->value[i] > 0 || (adaptive->value[i] == 0 && adaptive->slope[i] > 0);
    double low = adaptive->t0, high = t1;
    if (!is_above)
        return false;
    if (adaptive->end_value[i] > 0) {
        if (!(adaptive->slope[i] < 0 && adaptive->end_slope[i] > 0) ||
            !adaptive_bisect(adaptive, adaptive->inner_slope, i, -1, &low, &high) ||
            !adaptive_look_inside(adaptive, high) || adaptive->inner_value[i] > 0)
            return false;
        low = adaptive->t0;
    }
    if (!adaptive_bisect(adaptive, adaptive->inner_value, i, 1, &low, &high))
        return false;
    *t = high;
    return true;
}

// Moves y from t by dt with one Euler step.
static void adaptive_move(Adaptive *adaptive, double t, double dt) {
    adaptive_rate(adaptive, t, adaptive_data(adaptive->y), adaptive_data(adaptive->within));
    N_VLinearSum(1, adaptive->y, dt, adaptive->within, adaptive->y);
    adaptive->t = t + dt;
}

// Repeats the step to end at the root of function i: by Newton's method, or by secants where the
// slope is unknown.
static bool adaptive_step_to_root(Adaptive *adaptive, size_t i, double t1, double guess) {
    const double t0 = adaptive->t0;
    double t = guess, other = t1, value = adaptive->end_value[i];
    for (int retake = 0; retake < RETAKES; retake++) {
        double reached;
        N_VScale(1, adaptive->from, adaptive->y);
        if (t > t0 && (!adaptive_reset(adaptive, t0, adaptive->from, t - t0) ||
                       ERKStepSetStopTime(adaptive->arkode, t) != 0 ||
                       ERKStepEvolve(adaptive->arkode, t, adaptive->y, &reached, ARK_NORMAL) < 0))
            return false;
        adaptive->t = t;
        adaptive_watch(adaptive, t, adaptive_data(adaptive->y), adaptive->inner_value,
                       adaptive->inner_slope);
        const double now = adaptive->inner_value[i], known = adaptive->inner_slope[i];
        const double off = now / (isnan(known) ? (now - value) / (t - other) : known);
        if (!isfinite(off))
            break;
        if (fabs(off) <= 1e-9 * (t1 - t0)) { // the error of an Euler step is below rounding
            adaptive_move(adaptive, t, -off);
            break;
        }
        other = t;
        value = now;
        t = fmin(fmax(t - off, t0), t1);
    }
    return true;
}

// One step, at most to `until`. It ends at the first root of a watched function, whose index is
// *root, or without one: NO_ROOT.
static Status adaptive_evolve(Adaptive *adaptive, double until, int *root) {
    const ModalState *state = &adaptive->stepping->state;
    const size_t watched = state->has_stops ? WATCHED * state->dampers : 0;
    double t1, first = 0;
    *root = NO_ROOT;
    adaptive->t0 = adaptive->t;
    N_VScale(1, adaptive->y, adaptive->from);
    if (until - adaptive->t0 <=
        16 * DBL_EPSILON * fabs(adaptive->t0)) { // below ARKODE's resolution
        adaptive_move(adaptive, adaptive->t0, until - adaptive->t0);
        adaptive->t = until;
        memcpy(adaptive->end_value, adaptive->value, watched * sizeof *adaptive->value);
        memcpy(adaptive->end_slope, adaptive->slope, watched * sizeof *adaptive->slope);
        return adaptive_reset(adaptive, until, adaptive->y, adaptive->next_step)
                   ? STATUS_OK
                   : adaptive_failed(adaptive, adaptive->t0);
    }
    if (ERKStepSetStopTime(adaptive->arkode, until) != 0 ||
        ERKStepEvolve(adaptive->arkode, until, adaptive->y, &t1, ARK_ONE_STEP) < 0 ||
        !(t1 > adaptive->t0))
        return adaptive_failed(adaptive, adaptive->t0);
    adaptive_watch(adaptive, t1, adaptive_data(adaptive->y), adaptive->end_value,
                   adaptive->end_slope);
    for (size_t i = 0; i < watched; i++) {
        double at;
        if (adaptive_has_root(adaptive, i, t1, &at) && (*root == NO_ROOT || at < first)) {
            *root = (int)i;
            first = at;
        }
    }
    adaptive->next_step = t1 - adaptive->t0;
    if (*root == NO_ROOT) {
        adaptive->t = t1;
        return STATUS_OK;
    }
    if (!adaptive_step_to_root(adaptive, (size_t)*root, t1, first))
        return adaptive_failed(adaptive, first);
    adaptive_watch(adaptive, adaptive->t, adaptive_data(adaptive->y), adaptive->end_value,
                   adaptive->end_slope);
    // It has fallen, whatever the sign of the rounding error.
    adaptive->end_value[*root] = fmin(adaptive->end_value[*root], 0);
    // So have the peaks of other dampers at the same instant.
    for (size_t i = WATCH_PEAK; i < watched; i += WATCHED)
        if (adaptive->end_value[i] <= SIMULTANEOUS * adaptive->value[i])
            adaptive->end_value[i] = fmin(adaptive->end_value[i], 0);
    return adaptive_reset(adaptive, adaptive->t, adaptive->y, adaptive->next_step)
               ? STATUS_OK
               : adaptive_failed(adaptive, first);
}

// Largest |N| in a step of a damper at rest, by the cubic through N and dN/dt at its ends.
static double adaptive_rest_peak(const Adaptive *adaptive, size_t d, double length) {
    const size_t i = WATCHED * d + WATCH_FIRST;
    const double from = adaptive->value[i], by = adaptive->end_value[i] - from,
                 slope = length * adaptive->slope[i], end_slope = length * adaptive->end_slope[i];
    const double cubic[] = {from, slope, 3 * by - 2 * slope - end_slope,
                            slope + end_slope - 2 * by};
    double at;
    return linear_motion_largest(cubic, COUNT(cubic) - 1, 0, &at);
}

// Copies a step of `length` seconds from y to the state and the logs.
static void adaptive_accept(Adaptive *adaptive, double length) {
    TimeStepping *stepping = adaptive->stepping;
    ModalState *state = &stepping->state;
    const size_t m = state->dampers;
    const double *sums = adaptive_data(adaptive->y) + stepping->size,
                 *before = adaptive_data(adaptive->from) + stepping->size;
    step_contact_begin(state, &stepping->contact);
    modal_state_scatter(state, adaptive_data(adaptive->y));
    for (size_t i = 0; i < 2 * m + 2; i++)
        stepping->integrals[i] = sums[i] - before[i];
    for (size_t d = 0; d < m; d++) {
        DamperState *damper = &state->damper[d];
        if (damper->zero_gap_terms > 0) {
            contact_event_leave(damper, false);
            state->events += damper->zero_gap_terms > 0; // this restarts the integration
        }
        if (damper->row.is_open)
            step_contact_log(state, &stepping->contact, d, length);
        if (damper->phase == PHASE_RESTING)
            impact_log_force(&state->impacts, &damper->row,
                             adaptive_rest_peak(adaptive, d, length));
    }
    memcpy(adaptive->value, adaptive->end_value, WATCHED * m * sizeof *adaptive->value);
    memcpy(adaptive->slope, adaptive->end_slope, WATCHED * m * sizeof *adaptive->slope);
    impact_log_work(&state->impacts, stepping->integrals[2 * m], stepping->integrals[2 * m + 1]);
    stepping->recorder.base_speed += sums[2 * m + 2] - before[2 * m + 2];
}

static ContactEvent adaptive_event(const ModalState *state, size_t d, int watch) {
    const DamperState *damper = &state->damper[d];
    return (ContactEvent){.damper = d,
                          .s = 1,
                          .side = damper->phase == PHASE_FLIGHT ? (Side)watch : damper->side,
                          .is_inwards = damper->phase == PHASE_INSIDE && watch == WATCH_FIRST};
}

// Acceleration of a damper that may be rounding noise [m/s^2].
static double adaptive_noise(const ModalState *state, const DamperState *damper) {
    return 64 * DBL_EPSILON *
           (damper->elastic_bound * modal_state_size(state) +
            fabs(damper->base_coupling * state->base_acceleration));
}

// An event of a damper that is past its end without a root in a step: a buffer released without
// having been compressed, a stop behind the mass by rounding or a miss, a rest without a push.
// Before the motion `has_moved`, a force may be rounding noise.
static bool adaptive_find_overdue_of(ModalState *state, size_t d, bool has_moved,
                                     ContactEvent *event) {
    DamperState *damper = &state->damper[d];
    const double sign = modal_state_sign(damper->side);
    if (damper->phase == PHASE_CONTACT && sign * damper->r <= 0 && sign * damper->w < 0) {
        *event = adaptive_event(state, d, WATCH_FIRST);
        return true;
    }
    if (damper->phase == PHASE_INSIDE &&
        (sign * damper->r < 0 || (damper->r == 0 && sign * damper->w < 0))) {
        *event = adaptive_event(state, d, WATCH_SECOND);
        return true;
    }
    if (has_moved &&
        (damper->phase == PHASE_INSIDE ||
         (damper->phase == PHASE_CONTACT && state->plan->separation == SEPARATION_ZERO_FORCE))) {
        const double push = sign * step_contact_force(state, d, damper->r, damper->w).value;
        if (damper->phase == PHASE_INSIDE ? push > 0 : push < 0) {
            *event = adaptive_event(state, d, WATCH_FIRST);
            return true;
        }
    }
    const double noise = adaptive_noise(state, damper);
    if (damper->phase == PHASE_RESTING && sign * damper->force < -noise * damper->effective_mass) {
        *event = adaptive_event(state, d, WATCH_FIRST);
        event->is_jump = true;
        return true;
    }
    for (int side = 0; side < 2 && damper->phase == PHASE_FLIGHT; side++) {
        const double toward = modal_state_sign((Side)side), speed = toward * damper->w;
        if (modal_state_room(damper, (Side)side) - toward * damper->r > 0)
            continue;
        // A flight shorter than the clock's resolution: the mass is back with the same speed.
        const double pull = toward * modal_state_acceleration(state, d);
        const bool is_back = speed <= 0 && -2 * speed < pull * modal_state_clock(state) &&
                             (damper->zero_gap_terms == 0 || pull > noise);
        // Between stops without clearance an impulse holds the mass at any speed.
        const bool is_held = state->plan->form == CONTACT_IMPULSIVE && damper->plan->clearance == 0;
        if (!(speed > 0 || is_back || is_held))
            continue;
        damper->w = is_back ? -damper->w : damper->w;
        *event = adaptive_event(state, d, is_held && damper->w > 0 ? SIDE_RIGHT : side);
        return true;
    }
    return false;
}

static bool adaptive_find_overdue(ModalState *state, bool has_moved, ContactEvent *event) {
    for (size_t d = 0; d < state->dampers && state->has_stops; d++)
        if (adaptive_find_overdue_of(state, d, has_moved, event))
            return true;
    return false;
}

static double adaptive_step_cost(size_t modes, size_t dampers, bool is_coupled, double *setup) {
    const double n = (double)modes, m = (double)dampers;
    *setup = 0;
    return 100 + 3 * n * (1 + m) + (is_coupled ? 0.1 * n * n : 0);
}

// Cost since the last call. A search for roots may have evaluated y' many times.
static double adaptive_count_cost(Adaptive *adaptive) {
    const ModalState *state = &adaptive->stepping->state;
    double setup;
    const double usual =
        adaptive_step_cost(state->mode_count, state->dampers, state->diagonal == NULL, &setup);
    const double cost = ADVANCE_COST + adaptive->rate_calls * (usual - ADVANCE_COST) / STAGES;
    adaptive->rate_calls = 0;
    return cost;
}

// A mass at rest between stops without clearance passes one as soon as anything moves. That is no
// root; only the end of a step shows it.
static bool adaptive_is_poised(const Adaptive *adaptive) {
    const ModalState *state = &adaptive->stepping->state;
    const bool is_still =
        adaptive->slice.value == 0 && adaptive->slice.slope == 0 && modal_state_size(state) == 0;
    for (size_t d = 0; d < state->dampers && !is_still; d++) {
        const DamperState *damper = &state->damper[d];
        if (damper->phase == PHASE_FLIGHT && damper->plan->clearance == 0 && damper->r == 0 &&
            damper->w == 0)
            return true;
    }
    return false;
}

// Whether motion or base have outgrown the error weights of the last restart. Those of a base at
// rest mean nothing.
static bool adaptive_has_outgrown(const Adaptive *adaptive) {
    return adaptive_push(adaptive) > OUTGROWN * adaptive->push ||
           modal_state_size(&adaptive->stepping->state) > OUTGROWN * adaptive->speed;
}

// One step of at most `length` seconds, and the event at its end.
// After a restart: a rest whose force is 0 and falls ends now. Rests on one storey end together,
// and the root of one of them is that of all.
static bool adaptive_find_end_of_rest(const Adaptive *adaptive, ContactEvent *event) {
    const ModalState *state = &adaptive->stepping->state;
    for (size_t d = 0; d < state->dampers && state->has_stops; d++) {
        const DamperState *damper = &state->damper[d];
        const size_t i = WATCHED * d + WATCH_FIRST;
        if (damper->phase == PHASE_RESTING && adaptive->slope[i] < 0 &&
            adaptive->value[i] <= adaptive_noise(state, damper) * damper->effective_mass) {
            *event = adaptive_event(state, d, WATCH_FIRST);
            return true;
        }
    }
    return false;
}

static Status adaptive_step(Adaptive *adaptive, double length) {
    TimeStepping *stepping = adaptive->stepping;
    ModalState *state = &stepping->state;
    ContactEvent event;
    int root;
    const double a0 = state->base_acceleration;
    const double knot =
        base_cursor_slice(&state->base, state->sample, state->offset, &adaptive->slice);
    const double a1 = adaptive->slice.value;
    state->base_acceleration = a1;
    // ARKODE keeps y' from the end of the last step, which a jump of the base invalidates.
    if (fabs(a1 - a0) > JUMP * (fabs(a1) + fabs(a0)) || adaptive_has_outgrown(adaptive))
        adaptive->events = SIZE_MAX;
    if (adaptive->events != state->events) {
        modal_state_forces(state);
        if (adaptive_find_overdue(state, false, &event)) {
            TRY(time_stepping_note(stepping, adaptive_count_cost(adaptive)));
            return contact_event_apply(state, &event);
        }
        TRY(adaptive_restart(adaptive));
        if (adaptive_find_end_of_rest(adaptive, &event))
            return contact_event_apply(state, &event);
    }
    // The companion's steps are shorter than the run's where kinks of the base limit both.
    if (adaptive->is_at_knot)
        adaptive->part = knot / (double)stepping->share;
    length = fmin(fmin(length, knot), fmin(adaptive->part, stepping->length));
    state->run->work.stop_searches += state->has_stops;
    if (adaptive_is_poised(adaptive))
        length *= POISED;
    const double until = adaptive->t + length;
    TRY(adaptive_evolve(adaptive, until, &root));
    const double done =
        root == NO_ROOT && adaptive->t >= until ? length : adaptive->t - adaptive->t0;
    adaptive_accept(adaptive, done);
    adaptive->is_at_knot = done >= knot;
    state->offset += done;
    state->base_acceleration = slice_at(&adaptive->slice, done);
    if (done > modal_state_clock(state))
        state->events_at_instant = 0;
    TRY(time_stepping_note(stepping, adaptive_count_cost(adaptive)));
    if (root != NO_ROOT && root % WATCHED != WATCH_PEAK) {
        event = adaptive_event(state, (size_t)root / WATCHED, root % WATCHED);
        return contact_event_apply(state, &event);
    }
    return adaptive_find_overdue(state, done > 0, &event) ? contact_event_apply(state, &event)
                                                          : STATUS_OK;
}

static Status adaptive_interval(TimeStepping *stepping, double length) {
    Adaptive *adaptive = stepping->method;
    ModalState *state = &stepping->state;
    const double clock = 2 * DBL_EPSILON * length;
    while (length - state->offset > clock) {
        const double before = state->offset;
        const size_t events = state->events;
        TRY(adaptive_step(adaptive, length - state->offset));
        if (state->offset == before && state->events == events && adaptive->t == 0)
            return problem_set(state->problem, STATUS_UNSTABLE,
                               "the motion is too fast to be followed at t = %.6g s: a step of "
                               "1/%.6g s is below the clock's resolution",
                               modal_state_time(state), modal_state_rate(state));
    }
    return STATUS_OK;
}

static bool adaptive_set_method(void *arkode) {
    double rows[STAGES * STAGES], at[STAGES], sums[STAGES], second[STAGES];
    memcpy(rows, stages, sizeof rows);
    memcpy(at, nodes, sizeof at);
    memcpy(sums, weights, sizeof sums);
    memcpy(second, embedded, sizeof second);
    ARKodeButcherTable table =
        ARKodeButcherTable_Create(STAGES, ORDER, EMBEDDED_ORDER, at, rows, sums, second);
    const bool is_set = table != NULL && ERKStepSetTable(arkode, table) == 0;
    ARKodeButcherTable_Free(table);
    return is_set;
}

static void adaptive_ignore_message(int code, const char *module, const char *function,
                                    char *message, void *user) {
    (void)code, (void)module, (void)function, (void)message, (void)user;
}

static bool adaptive_allocate(Adaptive *adaptive) {
    const size_t watched = WATCHED * adaptive->stepping->state.dampers + 1;
    const size_t count = adaptive->size + 6 * watched;
    // SUNDIALS crashes where an allocation fails, so the memory for it is reserved first and then
    // returned to the allocator.
    const size_t reserve = CLONES_MAX * (adaptive->size + CLONE_OVERHEAD) + CONTEXT_SIZE;
    adaptive->block = calloc(count + reserve, sizeof *adaptive->block);
    double *block = realloc(adaptive->block, count * sizeof *block);
    if (block == NULL)
        return false;
    adaptive->block = block;
    if (SUNContext_Create(NULL, &adaptive->context) != 0)
        return false;
    adaptive->rates = adaptive->block;
    double **const arrays[] = {&adaptive->value,       &adaptive->slope,
                               &adaptive->end_value,   &adaptive->end_slope,
                               &adaptive->inner_value, &adaptive->inner_slope};
    for (size_t i = 0; i < COUNT(arrays); i++)
        *arrays[i] = adaptive->rates + adaptive->size + i * watched;
    N_Vector *const vectors[] = {&adaptive->y, &adaptive->from, &adaptive->within,
                                 &adaptive->absolute};
    for (size_t i = 0; i < COUNT(vectors); i++) {
        *vectors[i] = N_VNew_Serial((sunindextype)adaptive->size, adaptive->context);
        if (*vectors[i] == NULL)
            return false;
        N_VConst(0, *vectors[i]);
    }
    adaptive->arkode = ERKStepCreate(adaptive_arkode_rate, 0, adaptive->y, adaptive->context);
    return adaptive->arkode != NULL &&
           ERKStepSetErrHandlerFn(adaptive->arkode, adaptive_ignore_message, NULL) == 0 &&
           ERKStepSetUserData(adaptive->arkode, adaptive) == 0 &&
           adaptive_set_method(adaptive->arkode) &&
           ERKStepSetMaxErrTestFails(adaptive->arkode, ERROR_TEST_FAILURES) == 0 &&
           ERKStepSVtolerances(adaptive->arkode, adaptive->stepping->tolerance,
                               adaptive->absolute) == 0;
}

static Status adaptive_make(TimeStepping *stepping) {
    ModalState *state = &stepping->state;
    Adaptive *adaptive = calloc(1, sizeof *adaptive);
    stepping->method = adaptive;
    if (adaptive != NULL) {
        adaptive->stepping = stepping;
        adaptive->size = stepping->size + 2 * state->dampers + TOTALS;
        adaptive->events = SIZE_MAX;
        adaptive->is_at_knot = true;
    }
    if (adaptive == NULL || !adaptive_allocate(adaptive))
        return problem_set(state->problem, STATUS_NO_MEMORY, "no memory for a run");
    // A mass that starts on a stop may touch it at t = 0.
    ContactEvent event;
    for (modal_state_forces(state); adaptive_find_overdue(state, false, &event);
         modal_state_forces(state))
        TRY(contact_event_apply(state, &event));
    return STATUS_OK;
}

static void adaptive_clear(TimeStepping *stepping) {
    Adaptive *adaptive = stepping->method;
    if (adaptive->arkode != NULL)
        ERKStepFree(&adaptive->arkode);
    N_Vector const vectors[] = {adaptive->y, adaptive->from, adaptive->within, adaptive->absolute};
    for (size_t i = 0; i < COUNT(vectors); i++)
        if (vectors[i] != NULL)
            N_VDestroy(vectors[i]);
    if (adaptive->context != NULL)
        SUNContext_Free(&adaptive->context);
    free(adaptive->block);
}

static double adaptive_tolerance(const Accuracy *accuracy) {
    return accuracy == NULL ? TOLERANCE_DEFAULT
                            : ((const AccuracyTolerance *)(const void *)accuracy)->tolerance;
}

static const Stepper adaptive_stepper = {.make = adaptive_make,
                                         .interval = adaptive_interval,
                                         .clear = adaptive_clear,
                                         .cost = adaptive_step_cost};

static Status adaptive_run(const Solver *solver, Run *run, Response *response, Problem *problem) {
    return time_stepping_run_pair(solver, run, 1, 1, adaptive_tolerance(run->accuracy), response,
                                  problem);
}

static Status adaptive_decide(const Solver *solver, const Accuracy *accuracy, double base_interval,
                              Plan *plan, Problem *problem) {
    (void)solver, (void)base_interval, (void)problem;
    const double tolerance = adaptive_tolerance(accuracy);
    return decisions_add(
        &plan->report.decisions, "tolerance", tolerance == TOLERANCE_DEFAULT ? "usual" : "asked",
        tolerance, NULL,
        "of each step; a step ends at every sample, at kinks of the base and where "
        "a contact begins or ends, and a stop grazed within a step is missed");
}

// Steps end at samples and at kinks of the base, and are as short as the fastest motion needs under
// the tolerance; in contacts stability limits them.
static double adaptive_cost(const Solver *solver, const Accuracy *accuracy,
                            const SolverDemand *demand, const Plan *plan) {
    (void)solver;
    const double digits = -log10(adaptive_tolerance(accuracy)), each = pow(10, digits / 8);
    double setup, ends = plan->sample_rate;
    if (demand->base_interval > 0)
        ends = fmax(ends, 1 / demand->base_interval);
    const double mode = TURN_STEPS * each / time_stepping_mode_time(plan);
    const double base = BASE_STEPS * each * demand->base_rate;
    const double steps = fmax(ends, fmax(mode, base)) * plan->duration +
                         CONTACT_STEPS * demand->radians + EVENT_STEPS * each * demand->impacts;
    const double one = adaptive_step_cost(plan_mode_count(plan), plan->damper_count,
                                          time_stepping_may_couple(plan), &setup);
    return 3.3 * one * steps; // the companion takes more than twice as many
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
    .run = adaptive_run,
    .decide = adaptive_decide,
    .cost = adaptive_cost,
    .stepper = &adaptive_stepper,
};
