// Error-controlled steps by ARKODE's explicit Runge-Kutta stepper (SUNDIALS) over all modes and
// dampers together. A step ends at every sample, at every kink of the base and where a contact
// begins or ends. Contact events follow the rules of contact_events.c, but a stop that is only
// grazed within a step is missed.
//
// The integrated vector is (q, p; r, w), then the integrals of N and N r' of each damper, the work
// of the base, the loss in the structure and the ground velocity, all five from the step's start.
//
// ARKODE's dense output is far less accurate than its steps, so events are sought on the
// polynomials through the values and derivatives of r and N at both ends of a step. The step is
// repeated up to the event, with new polynomials, until it ends there.
#include <arkode/arkode_erkstep.h>
#include <float.h>
#include <math.h>
#include <nvector/nvector_serial.h>
#include <stdlib.h>
#include <string.h>

#include "core/solve/engine.h"
#include "core/solve/time_stepping.h"

enum { STAGES = 13, ORDER = 8, EMBEDDED_ORDER = 7 };
enum { RETAKES = 8, ERROR_TEST_FAILURES = 60 };
// Memory that SUNDIALS needs at most, in values of type double: vectors, and all else of each
// vector and of the context.
enum { CLONES_MAX = 40, CLONE_OVERHEAD = 128, CONTEXT_SIZE = 1 << 13 };
static const double TOLERANCE_DEFAULT = 1e-9;
static const double SHORTEST = 1e-100;  // the powers of a shorter step would underflow [s]
static const double OUTGROWN = 100;     // motion over that of the last error weights
static const double ROOT_ERROR = 1e-9;  // of a step: the error of an Euler step is below rounding
static const double PEAK_ERROR = 1e-9;  // of a force
static const double ADVANCE_COST = 10;  // solver steps of a step without its derivatives
static const double SCALE_MIN = 1e-290; // an error weight must not be zero

typedef struct Adaptive {
    TimeStepping *stepping;
    SUNContext context;
    void *arkode;
    size_t size;       // of the integrated vector
    N_Vector from, y;  // at the start and at the end of the step
    N_Vector absolute; // error tolerance of each component
    double *rates[2];  // y' there
    TaylorStep fit;    // r and N of the dampers through both ends; nothing else of it is used
    double *block;
    double next_step;  // [s]
    double speed;      // largest sqrt(p'p + q'W^2 q) so far
    double push;       // largest |a_g| over an interval so far [m/s^2]
    double rate_calls; // since the cost was last counted
    Slice slice;       // of the base, from the step's start on
    size_t events;     // of the state when the tolerances were set; SIZE_MAX: not yet
} Adaptive;

static void adaptive_rate(Adaptive *adaptive, double t, const double *y, double *out) {
    TimeStepping *stepping = adaptive->stepping;
    const ModalState *state = &stepping->state;
    const size_t n = state->mode_count, m = state->dampers;
    const double ground = slice_at(&adaptive->slice, t);
    adaptive->rate_calls++;
    time_stepping_forces(stepping, y);
    if (state->resting > 0)
        time_stepping_elastic(state, y, y + n, stepping->elastic);
    for (size_t d = 0; d < m && state->resting > 0; d++)
        if (state->damper[d].phase == PHASE_RESTING)
            stepping->force[d] = modal_state_constraint(state, d, stepping->elastic, ground);
    time_stepping_rate(stepping, y, ground, out);
    for (size_t d = 0; d < m; d++)
        if (state->damper[d].phase == PHASE_RESTING) // zero but for rounding
            out[2 * n + d] = out[2 * n + m + d] = 0;
    out[adaptive->size - 1] = ground;
}

static int adaptive_arkode_rate(realtype t, N_Vector y, N_Vector out, void *user) {
    adaptive_rate(user, t, N_VGetArrayPointer(y), N_VGetArrayPointer(out));
    return 0;
}

static Status adaptive_failed(const Adaptive *adaptive, double t) {
    return problem_set(
        adaptive->stepping->state.problem, STATUS_UNSTABLE,
        "a contact could not be integrated to its end: it is too stiff or leaves what "
        "double precision can hold (%.6g s after its last sample or event)",
        t);
}

// Largest |a_g| over an interval, if the base goes on as it does now.
static double adaptive_push(const Adaptive *adaptive) {
    return fabs(adaptive->slice.value) +
           fabs(adaptive->slice.slope) * adaptive->stepping->state.interval;
}

// Sets the tolerances from a typical magnitude of each component, and a first step. They last until
// the next event.
static Status adaptive_set_tolerances(Adaptive *adaptive) {
    const TimeStepping *stepping = adaptive->stepping;
    const ModalState *state = &stepping->state;
    const size_t n = state->mode_count, m = state->dampers;
    double *scale = N_VGetArrayPointer(adaptive->absolute), *p = scale + n, *r = p + n, *w = r + m;
    double *impulse = w + m, *work = impulse + m, *totals = work + m;
    double time = state->interval, energy = 0;
    adaptive->events = state->events;
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
        p[i] = adaptive->speed;
        scale[i] = adaptive->speed / fmax(sqrt(state->omega2[i]), 1 / state->plan->duration);
    }
    for (size_t d = 0; d < m; d++) {
        const DamperState *damper = &state->damper[d];
        const double mass = damper->effective_mass;
        const double wide =
            sqrt(modal_state_dot(damper->shape, damper->shape, n)) * adaptive->speed;
        const double speed =
            fmax(fabs(damper->w), damper->phase == PHASE_CONTACT ? 1e-3 * wide : wide);
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
        work[d] = mass * speed * speed;
        energy += work[d];
    }
    totals[0] = totals[1] = energy + adaptive->speed * adaptive->speed;
    totals[2] = adaptive->push * state->interval;
    for (size_t i = 0; i < adaptive->size; i++)
        scale[i] = stepping->tolerance * fmax(scale[i], SCALE_MIN);
    adaptive->next_step = time / (8 * (double)stepping->share);
    return ERKStepSVtolerances(adaptive->arkode, stepping->tolerance, adaptive->absolute) == 0
               ? STATUS_OK
               : adaptive_failed(adaptive, 0);
}

// Whether motion or base have outgrown these tolerances. Those of a base at rest mean nothing.
static bool adaptive_has_outgrown(const Adaptive *adaptive) {
    return adaptive_push(adaptive) > OUTGROWN * adaptive->push ||
           modal_state_size(&adaptive->stepping->state) > OUTGROWN * adaptive->speed;
}

// Moves from the step's start at most to `length`, by one step or by several. Returns the time
// reached, 0 after a failure.
static double adaptive_advance(Adaptive *adaptive, double length, int task) {
    void *arkode = adaptive->arkode;
    double reached = 0;
    N_VScale(1, adaptive->from, adaptive->y);
    // Without a stop ARKODE proposes the next step by the error alone.
    return ERKStepReset(arkode, 0, adaptive->from) == 0 &&
                   ERKStepSetInitStep(arkode, length) == 0 &&
                   ERKStepSetStopTime(arkode, task == ARK_NORMAL ? length : DBL_MAX) == 0 &&
                   ERKStepEvolve(arkode, length, adaptive->y, &reached, task) >= 0
               ? reached
               : 0;
}

// Fits the polynomials to a step of `length` that has ended.
static void adaptive_fit(Adaptive *adaptive, double length) {
    const ModalState *state = &adaptive->stepping->state;
    const size_t n = state->mode_count, m = state->dampers;
    TaylorStep *fit = &adaptive->fit;
    fit->length = length;
    fit->degree = 5;
    for (size_t d = 0; d < m; d++) {
        double *r = fit->r + d * (POLYNOMIAL_DEGREE_MAX + 1), r0[3], r1[3];
        double *N = fit->force + d * (POLYNOMIAL_DEGREE_MAX + 1), slope[2];
        for (int end = 0; end < 2; end++) {
            const double *y =
                N_VGetArrayPointer(end == 0 ? adaptive->from : adaptive->y) + 2 * n + d;
            const double *rates = adaptive->rates[end], w = y[m], w1 = rates[2 * n + m + d];
            const ContactForce force = step_contact_force(state, d, *y, w);
            double *value = end == 0 ? r0 : r1;
            value[0] = *y;
            value[1] = length * w;
            value[2] = length * length * w1;
            N[end] = rates[adaptive->stepping->size + d];
            slope[end] = length * (force.by_penetration * w + force.by_speed * w1);
        }
        // Its slope is known in contact only.
        const double gain = N[1] - N[0];
        const bool is_cubic = state->damper[d].phase == PHASE_CONTACT;
        N[1] = is_cubic ? slope[0] : gain;
        N[2] = is_cubic ? 3 * gain - 2 * slope[0] - slope[1] : 0;
        N[3] = is_cubic ? slope[0] + slope[1] - 2 * gain : 0;
        N[4] = 0;
        const double r2 = r0[2] / 2, off = r1[0] - r0[0] - r0[1] - r2, off1 = r1[1] - r0[1] - r0[2],
                     off2 = r1[2] - r0[2];
        r[0] = r0[0];
        r[1] = r0[1];
        r[2] = r2;
        r[3] = 10 * off - 4 * off1 + off2 / 2;
        r[4] = 7 * off1 - 15 * off - off2;
        r[5] = 6 * off - 3 * off1 + off2 / 2;
        if (r[0] == 0 && r[1] == 0 && r[2] == 0) { // which way it leaves, only the end can say
            r[3] = r1[0];
            r[4] = r[5] = 0;
        }
    }
}

// Where in the step a contact force has its first peak above those so far; 1: at its end.
static double adaptive_find_peak(const Adaptive *adaptive) {
    const ModalState *state = &adaptive->stepping->state;
    double first = 1;
    for (size_t d = 0; d < state->dampers; d++) {
        const DamperState *damper = &state->damper[d];
        const double least = impact_log_least_force(&state->impacts, &damper->row);
        double at = 1;
        if (damper->phase == PHASE_CONTACT)
            (void)linear_motion_largest(taylor_step_force(&adaptive->fit, d), 3,
                                        (1 + PEAK_ERROR) * least, &at);
        first = at > 0 ? fmin(first, at) : first;
    }
    return first;
}

// Computes a step of at most *length from the present state, which becomes the step's own; 0: an
// event occurs at once. The step ends at the first event, or at the peak of a force before it.
static Status adaptive_evolve(Adaptive *adaptive, double *length, ContactEvent *event,
                              bool *is_event) {
    TimeStepping *stepping = adaptive->stepping;
    ModalState *state = &stepping->state;
    double *from = N_VGetArrayPointer(adaptive->from), *y = N_VGetArrayPointer(adaptive->y);
    const double knot =
        base_cursor_slice(&state->base, state->sample, state->offset, &adaptive->slice);
    state->base_acceleration = adaptive->slice.value;
    time_stepping_begin(stepping, from);
    adaptive_rate(adaptive, 0, from, adaptive->rates[0]);
    if (adaptive->events != state->events || adaptive_has_outgrown(adaptive))
        TRY(adaptive_set_tolerances(adaptive));
    const double longest = fmin(fmin(*length, knot), fmin(stepping->length, adaptive->next_step));
    double part = 0, reached = adaptive_advance(adaptive, longest, ARK_ONE_STEP);
    *is_event = false;
    if (ERKStepGetCurrentStep(adaptive->arkode, &adaptive->next_step) != 0)
        return adaptive_failed(adaptive, 0);
    for (int retake = 0; 1 - part > ROOT_ERROR && retake <= RETAKES; retake++) {
        if (retake > 0) // a little longer, so that the polynomials reach the event
            reached = adaptive_advance(adaptive, reached * part * (1 + ROOT_ERROR / 2), ARK_NORMAL);
        if (!(reached > 0))
            return adaptive_failed(adaptive, 0);
        adaptive_rate(adaptive, reached, y, adaptive->rates[1]);
        adaptive_fit(adaptive, reached);
        ContactEvent next;
        const bool is_next = contact_event_find(state, &adaptive->fit, &next);
        const double peak = adaptive_find_peak(adaptive);
        // A step too short for the event that led to it: rounding hides where that occurs.
        const bool is_hidden =
            *is_event && reached < modal_state_clock(state) && !(is_next && next.s > 0.5);
        part = is_next ? next.s : 1;
        if (is_next)
            *event = next;
        if (is_hidden || (is_next && part * reached < SHORTEST)) {
            *is_event = true;
            *length = 0;
            return STATUS_OK;
        }
        *is_event = is_next && part <= peak;
        part = fmin(part, peak);
    }
    *is_event = *is_event && 1 - part <= ROOT_ERROR;
    *length = *is_event ? part * reached : reached;
    for (size_t i = 0; i < adaptive->size && *is_event; i++)
        y[i] -= (reached - *length) * adaptive->rates[1][i];
    return STATUS_OK;
}

// Copies a step of `length` seconds, at whose end `hit` occurs unless NULL, to the state and the
// logs.
static void adaptive_accept(Adaptive *adaptive, double length, const ContactEvent *hit) {
    TimeStepping *stepping = adaptive->stepping;
    ModalState *state = &stepping->state;
    const size_t m = state->dampers;
    const double *y = N_VGetArrayPointer(adaptive->y), *sums = y + stepping->size;
    time_stepping_scatter(state, y);
    memcpy(stepping->integrals, sums, 2 * m * sizeof *sums);
    for (size_t d = 0; d < m; d++) {
        DamperState *damper = &state->damper[d];
        const double origin = modal_state_sign((Side)damper->origin);
        damper->just_begun = false;
        // A mass released from rest stays on its stop until the gap opens beyond rounding.
        if (damper->zero_gap_terms > 0 && origin * damper->r < 0)
            damper->zero_gap_terms = 0;
        else if (damper->zero_gap_terms > 0 &&
                 !(hit != NULL && hit->damper == d && origin * damper->w > 0))
            damper->r = damper->w = 0;
        if (damper->row.is_open)
            step_contact_log(state, &stepping->contact, d, length);
    }
    impact_log_work(&state->impacts, sums[2 * m], sums[2 * m + 1]);
    stepping->recorder.base_speed += sums[2 * m + 2];
    state->offset += length;
    state->base_acceleration = slice_at(&adaptive->slice, length);
    if (length > modal_state_clock(state))
        state->events_at_instant = 0;
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

// Advances by at most `length` seconds and applies the event at the end.
static Status adaptive_step(Adaptive *adaptive, double length) {
    ModalState *state = &adaptive->stepping->state;
    ContactEvent event;
    bool is_event = false;
    TRY(adaptive_evolve(adaptive, &length, &event, &is_event));
    if (length > 0)
        adaptive_accept(adaptive, length, is_event ? &event : NULL);
    TRY(time_stepping_note(adaptive->stepping, adaptive_count_cost(adaptive)));
    return is_event ? contact_event_apply(state, &event) : STATUS_OK;
}

static Status adaptive_interval(TimeStepping *stepping, double length) {
    ModalState *state = &stepping->state;
    const double clock = 2 * DBL_EPSILON * length;
    while (length - state->offset > clock) {
        const double before = state->offset;
        const size_t events = state->events;
        TRY(adaptive_step(stepping->method, length - state->offset));
        if (state->offset == before && state->events == events)
            return problem_set(state->problem, STATUS_UNSTABLE,
                               "the motion is too fast to be followed at t = %.6g s: a step of "
                               "1/%.6g s is below the clock's resolution",
                               modal_state_time(state), modal_state_rate(state));
    }
    return STATUS_OK;
}

// RK8(7)13M of Prince and Dormand, J. Comp. Appl. Math. 7 (1981) 67-75. The error estimate of
// ARKODE's own table of order 8 is zero for y' = f(t), so it does not see a contact begin.
static bool adaptive_set_method(void *arkode) {
    // clang-format off
    double nodes[STAGES] = {
        0, 1.0 / 18, 1.0 / 12, 1.0 / 8, 5.0 / 16, 3.0 / 8, 59.0 / 400, 93.0 / 200,
        5490023248.0 / 9719169821.0, 13.0 / 20, 1201146811.0 / 1299019798.0, 1, 1};
    double stages[STAGES][STAGES] = {
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
    double weights[STAGES] = {
        14005451.0 / 335480064.0, 0, 0, 0, 0, -59238493.0 / 1068277825.0, 181606767.0 / 758867731.0,
        561292985.0 / 797845732.0, -1041891430.0 / 1371343529.0, 760417239.0 / 1151165299.0,
        118820643.0 / 751138087.0, -528747749.0 / 2220607170.0, 1.0 / 4};
    double embedded[STAGES] = {
        13451932.0 / 455176623.0, 0, 0, 0, 0, -808719846.0 / 976000145.0,
        1757004468.0 / 5645159321.0, 656045339.0 / 265891186.0, -3867574721.0 / 1518517206.0,
        465885868.0 / 322736535.0, 53011238.0 / 667516719.0, 2.0 / 45, 0};
    // clang-format on
    ARKodeButcherTable table = ARKodeButcherTable_Create(STAGES, ORDER, EMBEDDED_ORDER, nodes,
                                                         stages[0], weights, embedded);
    const bool is_set = table != NULL && ERKStepSetTable(arkode, table) == 0;
    ARKodeButcherTable_Free(table);
    return is_set;
}

static void adaptive_ignore_message(int code, const char *module, const char *function,
                                    char *message, void *user) {
    (void)code, (void)module, (void)function, (void)message, (void)user;
}

static bool adaptive_allocate(Adaptive *adaptive) {
    const size_t series = adaptive->stepping->state.dampers * (POLYNOMIAL_DEGREE_MAX + 1);
    const size_t count = 2 * (adaptive->size + series);
    // SUNDIALS crashes where an allocation fails, so the memory for it is reserved first and then
    // returned to the allocator.
    const size_t reserve = CLONES_MAX * (adaptive->size + CLONE_OVERHEAD) + CONTEXT_SIZE;
    adaptive->block = calloc(count + reserve, sizeof *adaptive->block);
    double *block = realloc(adaptive->block, count * sizeof *block);
    if (block == NULL)
        return false;
    adaptive->block = adaptive->rates[0] = block;
    adaptive->rates[1] = block + adaptive->size;
    adaptive->fit.r = adaptive->rates[1] + adaptive->size;
    adaptive->fit.force = adaptive->fit.r + series;
    if (SUNContext_Create(NULL, &adaptive->context) != 0)
        return false;
    N_Vector *const vectors[] = {&adaptive->from, &adaptive->y, &adaptive->absolute};
    for (size_t i = 0; i < COUNT(vectors); i++) {
        *vectors[i] = N_VNew_Serial((sunindextype)adaptive->size, adaptive->context);
        if (*vectors[i] == NULL)
            return false;
        N_VConst(0, *vectors[i]);
    }
    adaptive->arkode = ERKStepCreate(adaptive_arkode_rate, 0, adaptive->from, adaptive->context);
    // Every step starts anew, so that a step's error alone can control the next one.
    return adaptive->arkode != NULL &&
           ERKStepSetErrHandlerFn(adaptive->arkode, adaptive_ignore_message, NULL) == 0 &&
           ERKStepSetUserData(adaptive->arkode, adaptive) == 0 &&
           adaptive_set_method(adaptive->arkode) &&
           ERKStepSetAdaptivityMethod(adaptive->arkode, ARK_ADAPT_I, 1, 0, NULL) == 0 &&
           ERKStepSetInterpolantType(adaptive->arkode, ARK_INTERP_LAGRANGE) == 0 &&
           ERKStepSetMaxErrTestFails(adaptive->arkode, ERROR_TEST_FAILURES) == 0;
}

static Status adaptive_make(TimeStepping *stepping) {
    ModalState *state = &stepping->state;
    Adaptive *adaptive = calloc(1, sizeof *adaptive);
    stepping->method = adaptive;
    if (adaptive != NULL) {
        adaptive->stepping = stepping;
        adaptive->size = stepping->row + 1;
        adaptive->events = SIZE_MAX;
    }
    if (adaptive == NULL || !adaptive_allocate(adaptive))
        return problem_set(state->problem, STATUS_NO_MEMORY, "no memory for a run");
    // A mass that starts on a stop may touch it at t = 0.
    for (bool is_event = true; is_event;) {
        ContactEvent event;
        double length = state->interval;
        TRY(adaptive_evolve(adaptive, &length, &event, &is_event));
        is_event = is_event && length == 0;
        if (is_event)
            TRY(contact_event_apply(state, &event));
    }
    return STATUS_OK;
}

static void adaptive_clear(TimeStepping *stepping) {
    Adaptive *adaptive = stepping->method;
    if (adaptive->arkode != NULL)
        ERKStepFree(&adaptive->arkode);
    N_Vector const vectors[] = {adaptive->from, adaptive->y, adaptive->absolute};
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

// Steps for samples, kinks of the base and the fastest mode; a contact takes a number of steps that
// depends on the tolerance. Assumed are seven contacts a second, and many of them simultaneous
// where there are many dampers.
static double adaptive_cost(const Solver *solver, const Accuracy *accuracy, double base_interval,
                            const Plan *plan) {
    (void)solver;
    const double digits = -log10(adaptive_tolerance(accuracy)), each = pow(10, digits / 8) / 2;
    double setup, steps = plan->sample_rate;
    if (base_interval > 0)
        steps = fmax(steps, 1 / base_interval);
    steps = fmax(steps, each / time_stepping_mode_time(plan)) +
            7 * 12 * each * sqrt((double)plan->damper_count);
    const double one = adaptive_step_cost(plan_mode_count(plan), plan->damper_count,
                                          time_stepping_may_couple(plan), &setup);
    return 3 * one * steps * plan->duration; // the companion takes twice as many
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
