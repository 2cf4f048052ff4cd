// A cycle is one interval of the engine's clock, which starts again with each cycle, so that the
// return map is the same function in every cycle. Only Taylor steps and steps of power laws are
// taken: both serve any length.
//
// Shooting: an orbit of p cycles is a zero of P(y) - y, where P is the motion over p cycles, found
// by Newton's method with the matrix P' of the linearised motion; its eigenvalues are the Floquet
// multipliers (Parker and Chua 1989, chapters 3 and 5). Where contact parameters depend on the
// approach speed, P' is by central differences, from a section where all masses are in flight. A
// mass that touches no stop is free to stand anywhere: P' then has the multiplier 1, and the
// smallest step that solves the equations is taken.
#include "core/solve/cycle_flow.h"

#include <float.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "core/math/linear_system.h"
#include "core/solve/engine.h"
#include "core/solve/simd_kernels.h"

enum { PARTS = 16 }; // of a cycle, at which the section may be
enum { NEWTON_STEPS = 12, FIRST_TRY = 4, WARM_UP = 8, EXTENSION_MAX = 2 };

static const double CLOSED = 1e-13; // change by the map at an orbit
static const double CLOSE = 1e-8;   // a step so small ends at the orbit, but for its square
static const double RETURNED[] = {1e-3, 1e-2}, MOVED[] = {0.05, 0.3}; // while settling, at its end
static const double DIFFERENCE = 1e-6;
static const double STABLE = 1 + 1e-6; // largest multiplier of an orbit that was approached
static const double FARTHEST = 10;     // change by the map
static const double RIDGE = 1e-12;

struct CycleFlow {
    EventEngine engine;
    LinearisedMotion linearised;
    Run run;
    Response response;
    Base base;
    Plan *plan;
    Problem *problem;
    double period; // [s]
    int part;      // of the cycle, at which the section is
    double *kept;  // as modal_state_gather
    DamperState *kept_dampers;
    Orbit orbit;
    double *step, *columns, *left, *history, *first;
    double *block;
};

void cycle_flow_free(CycleFlow *flow) {
    if (flow == NULL)
        return;
    linearised_motion_clear(&flow->linearised);
    event_engine_clear(&flow->engine);
    response_clear(&flow->response);
    plan_free(flow->plan);
    free(flow->block);
    free(flow->kept_dampers);
    free(flow);
}

// u - r of a damper.
static double cycle_flow_origin(const DamperState *damper) {
    return damper->origin == FROM_MIDDLE
               ? 0
               : modal_state_sign((Side)damper->origin) * damper->plan->clearance / 2;
}

Orbit *cycle_flow_orbit(CycleFlow *flow) {
    return &flow->orbit;
}

void cycle_flow_get(const CycleFlow *flow, double *y) {
    const ModalState *state = &flow->engine.state;
    modal_state_gather(state, y);
    for (size_t d = 0; d < state->dampers; d++)
        y[2 * state->mode_count + d] += cycle_flow_origin(&state->damper[d]);
}

// The scales of the present state.
static void cycle_flow_scale(CycleFlow *flow) {
    double *scales = flow->orbit.scales;
    const ModalState *state = &flow->engine.state;
    const size_t n = state->mode_count, m = state->dampers;
    const double omega = 2 * 3.14159265358979323846 / flow->period;
    double squares = 0, largest = DBL_MIN;
    for (size_t i = 0; i < n; i++)
        squares += state->q[i] * state->q[i] + state->p[i] / omega * (state->p[i] / omega);
    const double size = fmax(sqrt(squares), DBL_MIN);
    for (size_t i = 0; i < n; i++)
        largest = fmax(largest, size * state->max_shape[i]);
    for (size_t i = 0; i < n; i++) {
        scales[i] = size;
        scales[n + i] = size * omega;
    }
    for (size_t d = 0; d < m; d++) {
        const double room = state->damper[d].plan->clearance / 2;
        scales[2 * n + d] = room > 0 ? room : largest;
        scales[2 * n + m + d] = scales[2 * n + d] * omega;
    }
}

void cycle_flow_keep(CycleFlow *flow) {
    const ModalState *state = &flow->engine.state;
    modal_state_gather(state, flow->kept);
    memcpy(flow->kept_dampers, state->damper, state->dampers * sizeof *state->damper);
}

void cycle_flow_restore(CycleFlow *flow, const double *y) {
    ModalState *state = &flow->engine.state;
    const size_t n = state->mode_count, m = state->dampers;
    modal_state_scatter(state, y != NULL ? y : flow->kept);
    memcpy(state->damper, flow->kept_dampers, m * sizeof *state->damper);
    modal_state_constrain(state);
    for (size_t d = 0; d < m && y != NULL; d++) {
        DamperState *damper = &state->damper[d];
        if (damper->phase == PHASE_RESTING)
            continue;
        damper->r = y[2 * n + d] - cycle_flow_origin(damper);
        damper->w = y[2 * n + m + d];
    }
}

// Of a mass at rest nothing can change.
static void cycle_flow_clear_resting(const CycleFlow *flow, double *columns, size_t count) {
    const ModalState *state = &flow->engine.state;
    const size_t n = state->mode_count, m = state->dampers, size = flow->linearised.size;
    for (size_t i = 0; i < count; i++)
        for (size_t d = 0; d < m; d++)
            if (state->damper[d].phase == PHASE_RESTING)
                columns[i * size + 2 * n + d] = columns[i * size + 2 * n + m + d] = 0;
}

// Over so many parts of a cycle.
static Status cycle_flow_cross(CycleFlow *flow, int parts) {
    ModalState *state = &flow->engine.state;
    state->offset = flow->period * flow->part / PARTS; // after the zero crossing before
    state->events_at_instant = state->chatter_events = 0;
    state->chatter_time = state->suppress_time = state->suppressed_at = 0;
    TRY(event_engine_cross(&flow->engine, flow->period * (flow->part + parts) / PARTS));
    flow->part = (flow->part + parts) % PARTS;
    return event_engine_check(&flow->engine);
}

Status cycle_flow_run(CycleFlow *flow, size_t cycles, double *columns, size_t count,
                      CycleMotion *motion) {
    ModalState *state = &flow->engine.state;
    LinearisedMotion *linearised = &flow->linearised;
    const uint64_t before = flow->response.impact_count;
    linearised->columns = columns;
    linearised->count = columns != NULL ? count : 0;
    memset(linearised->late, 0, linearised->size * sizeof *linearised->late);
    cycle_flow_clear_resting(flow, columns, linearised->count);
    linearised->is_measured = motion != NULL;
    linearised->peak = 0;
    memset(linearised->squares, 0, state->storey_count * sizeof *linearised->squares);
    Status status = STATUS_OK;
    for (size_t i = 0; i < cycles && status == STATUS_OK; i++)
        status = cycle_flow_cross(flow, PARTS);
    linearised->count = 0;
    linearised->is_measured = false;
    TRY(status);
    if (motion == NULL)
        return STATUS_OK;
    double largest = 0;
    for (size_t j = 0; j < state->storey_count; j++)
        largest = fmax(largest, linearised->squares[j]);
    *motion = (CycleMotion){linearised->peak, sqrt(largest / ((double)cycles * flow->period)),
                            flow->response.impact_count - before};
    return STATUS_OK;
}

bool cycle_flow_is_linearised(const CycleFlow *flow) {
    for (size_t d = 0; d < flow->plan->damper_count; d++)
        if (stops_vary(&flow->plan->dampers[d]))
            return false;
    return flow->plan->form != CONTACT_POWER;
}

bool cycle_flow_is_flying(const CycleFlow *flow) {
    const ModalState *state = &flow->engine.state;
    for (size_t d = 0; d < state->dampers; d++)
        if (state->damper[d].phase != PHASE_FLIGHT)
            return false;
    return true;
}

Status cycle_flow_shift(CycleFlow *flow, bool is_home) {
    for (int i = 0; i < PARTS && (is_home ? flow->part > 0 : !cycle_flow_is_flying(flow)); i++)
        TRY(cycle_flow_cross(flow, 1));
    return STATUS_OK;
}

void cycle_flow_top(const CycleFlow *flow, double *displacement, double *velocity) {
    const ModalState *state = &flow->engine.state;
    const size_t n = state->mode_count;
    const double *shape = state->modes->shapes + (state->storey_count - 1) * n;
    *displacement = modal_state_dot(shape, state->q, n);
    *velocity = modal_state_dot(shape, state->p, n);
}

// (W^2 - omega^2 + i omega D) q = -participation a.
double cycle_flow_undamped_peak(const CycleFlow *flow) {
    const ModalState *state = &flow->engine.state;
    const size_t n = state->mode_count, size = 2 * n;
    const double omega = flow->base.omega;
    double *A = calloc(size * size + size, sizeof *A), most = (double)NAN;
    if (A == NULL)
        return most;
    double *b = A + size * size;
    for (size_t i = 0; i < n; i++) {
        A[i * size + i] = A[(n + i) * size + n + i] = state->omega2[i] - omega * omega;
        for (size_t k = 0; k < n; k++) {
            A[i * size + n + k] = -omega * state->damping[i * n + k];
            A[(n + i) * size + k] = omega * state->damping[i * n + k];
        }
        b[i] = -state->participation[i] * flow->base.amplitude;
    }
    if (linear_system_solve(A, b, size, 1))
        for (size_t j = 0; j < state->storey_count; j++) {
            const double *shape = state->modes->shapes + j * n;
            most =
                fmax(most, hypot(modal_state_dot(shape, b, n), modal_state_dot(shape, b + n, n)));
        }
    free(A);
    return isfinite(most) ? most : (double)NAN;
}

double cycle_flow_steps(const CycleFlow *flow) {
    return flow->run.steps;
}

// The storeys' state becomes the plan's initial one.
static void cycle_flow_carry_storeys(CycleFlow *flow, const ModalState *from) {
    const size_t n = from->mode_count;
    for (size_t j = 0; j < from->storey_count; j++) {
        const double *shape = from->modes->shapes + j * n;
        flow->plan->displacement[j] = modal_state_dot(shape, from->q, n);
        flow->plan->velocity[j] = modal_state_dot(shape, from->p, n);
    }
}

// Contacts go on with the parameters of the new stops, but those of power laws end.
static void cycle_flow_carry_dampers(CycleFlow *flow, const ModalState *from) {
    ModalState *state = &flow->engine.state;
    for (size_t d = 0; d < state->dampers; d++) {
        const DamperState *old = &from->damper[d];
        DamperState *damper = &state->damper[d];
        const double limit = old->phase != PHASE_FLIGHT   ? INFINITY
                             : old->origin == FROM_MIDDLE ? damper->plan->clearance / 2
                                                          : damper->plan->clearance;
        damper->w = old->w;
        damper->side = old->side;
        damper->origin = old->origin;
        damper->r = fmin(fmax(old->r, -limit), limit);
        if (flow->plan->form == CONTACT_POWER && old->phase != PHASE_FLIGHT) {
            damper->r = 0;
            damper->w = modal_state_sign(old->side) * fmin(modal_state_sign(old->side) * old->w, 0);
            continue;
        }
        damper->phase = old->phase;
        damper->zero_gap_terms = old->zero_gap_terms;
        damper->row = old->row;
        if (old->phase == PHASE_CONTACT || old->phase == PHASE_INSIDE)
            damper->contact = stops_freeze(&damper->plan->stops[old->side],
                                           fmax(old->row.impact.approach_speed, 0));
    }
    modal_state_constrain(state);
}

static Status cycle_flow_make(CycleFlow *flow, const CycleFlow *from, Problem *problem) {
    ModalState *state = &flow->engine.state;
    if (from != NULL)
        cycle_flow_carry_storeys(flow, &from->engine.state);
    flow->engine.linearised = &flow->linearised;
    TRY(event_engine_make(&flow->engine, &flow->run, exact_tolerance(flow->run.accuracy),
                          &flow->response, problem));
    TRY(linearised_motion_make(&flow->linearised, state, problem));
    state->is_shadow = true;
    const size_t size = flow->orbit.size = flow->linearised.size;
    Orbit *orbit = &flow->orbit;
    const SimdArray arrays[] = {
        {&flow->kept, size},
        {&orbit->scales, size},
        {&orbit->y, size},
        {&orbit->end, size},
        {&orbit->matrix, size * size},
        {&orbit->real, size},
        {&orbit->imaginary, size},
        {&flow->step, size},
        {&flow->columns, size * size},
        {&flow->left, 2 * size * size + 2 * size},
        {&flow->history, (CYCLE_FLOW_PERIOD + 1) * size},
        {&flow->first, size},
    };
    flow->block = simd_kernels_allocate(arrays, COUNT(arrays));
    flow->kept_dampers = calloc(state->dampers + 1, sizeof *flow->kept_dampers);
    if (flow->block == NULL || flow->kept_dampers == NULL)
        return problem_set(problem, STATUS_NO_MEMORY, "no memory for the motion");
    cycle_flow_scale(flow);
    if (from != NULL && from->orbit.size == size)
        memcpy(orbit->scales, from->orbit.scales, size * sizeof *orbit->scales);
    if (from != NULL)
        cycle_flow_carry_dampers(flow, &from->engine.state);
    else
        TRY(event_engine_settle(&flow->engine));
    return STATUS_OK;
}

Status cycle_flow_new(Plan *plan, const Run *run, double period, const CycleFlow *from,
                      CycleFlow **made, Problem *problem) {
    CycleFlow *flow = *made = calloc(1, sizeof *flow);
    if (flow == NULL) {
        plan_free(plan);
        return problem_set(problem, STATUS_NO_MEMORY, "no memory for the motion");
    }
    plan->sample_rate = 1 / period;
    plan->duration = period;
    plan->count = 2;
    flow->plan = plan;
    flow->problem = problem;
    flow->period = period;
    flow->part = from != NULL ? from->part : 0;
    flow->response.is_unlisted = true;
    flow->base = *run->base;
    flow->run = *run;
    flow->run.plan = plan;
    flow->run.base = &flow->base;
    const Status status = cycle_flow_make(flow, from, problem);
    if (status != STATUS_OK) {
        cycle_flow_free(flow);
        *made = NULL;
    }
    return status;
}

// --- periodic orbits ---

double cycle_flow_radius(const CycleFlow *flow) {
    return hypot(flow->orbit.real[0], flow->orbit.imaginary[0]);
}

// From a state with the contacts that are kept.
static Status cycle_flow_go(CycleFlow *flow, size_t period, const double *from, double *columns,
                            double *end) {
    cycle_flow_restore(flow, from);
    TRY(cycle_flow_run(flow, period, columns, flow->orbit.size, NULL));
    cycle_flow_get(flow, end);
    return STATUS_OK;
}

static Status cycle_flow_difference(CycleFlow *flow, size_t period) {
    const Orbit *orbit = &flow->orbit;
    const size_t n = orbit->size;
    double *from = flow->left, *ahead = from + n, *behind = ahead + n;
    for (size_t i = 0; i < n; i++) {
        memcpy(from, orbit->y, n * sizeof *from);
        from[i] = orbit->y[i] + DIFFERENCE * orbit->scales[i];
        TRY(cycle_flow_go(flow, period, from, NULL, ahead));
        from[i] = orbit->y[i] - DIFFERENCE * orbit->scales[i];
        TRY(cycle_flow_go(flow, period, from, NULL, behind));
        for (size_t k = 0; k < n; k++)
            flow->columns[i * n + k] = (ahead[k] - behind[k]) / (2 * DIFFERENCE);
    }
    return STATUS_OK;
}

// Largest scaled difference of two states; INFINITY if a number is NaN.
static double cycle_flow_distance(const Orbit *orbit, const double *a, const double *b) {
    double most = 0;
    for (size_t i = 0; i < orbit->size; i++) {
        const double difference = fabs(a[i] - b[i]) / orbit->scales[i];
        if (isnan(difference))
            return (double)INFINITY;
        most = fmax(most, difference);
    }
    return most;
}

double cycle_flow_map(CycleFlow *flow, size_t period, bool has_matrix, Status *status) {
    Orbit *orbit = &flow->orbit;
    const size_t n = orbit->size;
    const bool has_columns = has_matrix && cycle_flow_is_linearised(flow);
    *status = has_matrix && !has_columns ? cycle_flow_difference(flow, period) : STATUS_OK;
    for (size_t i = 0; i < n * n && has_columns; i++)
        flow->columns[i] = i % (n + 1) == 0 ? orbit->scales[i % n] : 0;
    if (*status == STATUS_OK)
        *status =
            cycle_flow_go(flow, period, orbit->y, has_columns ? flow->columns : NULL, orbit->end);
    if (*status != STATUS_OK)
        return (double)NAN;
    for (size_t i = 0; i < n && has_matrix; i++)
        for (size_t k = 0; k < n; k++)
            orbit->matrix[k * n + i] = flow->columns[i * n + k] / orbit->scales[k];
    return cycle_flow_distance(orbit, orbit->end, orbit->y);
}

Status cycle_flow_multiply(CycleFlow *flow) {
    Orbit *orbit = &flow->orbit;
    memcpy(flow->left, orbit->matrix, orbit->size * orbit->size * sizeof *flow->left);
    const Status status =
        linear_system_eigenvalues(orbit->size, flow->left, orbit->real, orbit->imaginary);
    if (status == STATUS_INVALID)
        orbit->real[0] = (double)NAN;
    return status == STATUS_NO_MEMORY ? status : STATUS_OK;
}

// The step of Newton's method: (I - P') step = P(y) - y, the smallest one of least squares. False:
// there is none.
static bool cycle_flow_solve(CycleFlow *flow) {
    const Orbit *orbit = &flow->orbit;
    const size_t n = orbit->size;
    double *A = flow->left, *normal = A + n * n, *step = flow->step, largest = 0;
    for (size_t i = 0; i < n * n; i++)
        A[i] = (i % (n + 1) == 0) - orbit->matrix[i];
    for (size_t i = 0; i < n; i++) {
        step[i] = 0;
        for (size_t k = 0; k < n; k++) {
            double sum = 0;
            for (size_t l = 0; l < n; l++)
                sum += A[l * n + i] * A[l * n + k];
            normal[i * n + k] = sum;
            step[i] += A[k * n + i] * (orbit->end[k] - orbit->y[k]) / orbit->scales[k];
        }
        largest = fmax(largest, normal[i * n + i]);
    }
    for (size_t i = 0; i < n; i++)
        normal[i * n + i] += RIDGE * largest;
    bool is_solved = linear_system_solve(normal, step, n, 1);
    for (size_t i = 0; i < n; i++)
        is_solved = is_solved && isfinite(step[i]);
    return is_solved;
}

Status cycle_flow_shoot(CycleFlow *flow, size_t period) {
    Orbit *orbit = &flow->orbit;
    Status status = STATUS_OK;
    orbit->period = 0;
    cycle_flow_scale(flow);
    cycle_flow_keep(flow);
    cycle_flow_get(flow, orbit->y);
    for (int i = 0; i < NEWTON_STEPS && orbit->period == 0; i++) {
        const double change = cycle_flow_map(flow, period, true, &status);
        if (!(change < FARTHEST) || !cycle_flow_solve(flow))
            break;
        double step = 0;
        for (size_t k = 0; k < orbit->size; k++) {
            orbit->y[k] += flow->step[k] * orbit->scales[k];
            step = fmax(step, fabs(flow->step[k]));
        }
        orbit->period = change <= CLOSED || step <= CLOSE ? period : 0;
    }
    cycle_flow_restore(flow, orbit->period > 0 ? orbit->y : NULL);
    if (status == STATUS_UNSTABLE || status == STATUS_LIMIT) {
        problem_clear(flow->problem); // ends only the search
        return STATUS_OK;
    }
    return orbit->period > 0 ? cycle_flow_multiply(flow) : status;
}

// What an orbit beside an aperiodic motion lets expect of it.
typedef struct CycleFlowForecast {
    double cycles;   // cycles that it takes to leave the orbit, or to reach it; 0: it is not near
    bool has_stable; // the orbit is stable, so that the motion may end on it
} CycleFlowForecast;

// Searches an orbit that attracts the motion and to which the last `count` sections of the history
// return; at the end also one of a single cycle anywhere.
static Status cycle_flow_try(CycleFlow *flow, size_t count, size_t max_period, bool is_last,
                             CycleFlowForecast *forecast) {
    Orbit *orbit = &flow->orbit;
    const size_t rows = max_period + 1, n = orbit->size;
    const double *now = flow->history + count % rows * n;
    *forecast = (CycleFlowForecast){0};
    cycle_flow_scale(flow);
    for (size_t p = 1; p <= max_period && p <= count; p++) {
        const bool returns =
            cycle_flow_distance(orbit, now, flow->history + (count - p) % rows * n) <=
            RETURNED[is_last];
        if (!returns && !(is_last && p == 1))
            continue;
        cycle_flow_get(flow, flow->first);
        TRY(cycle_flow_shoot(flow, p));
        if (orbit->period == 0)
            continue;
        const double radius = cycle_flow_radius(flow),
                     distance = cycle_flow_distance(orbit, orbit->y, flow->first);
        const bool is_stable = radius <= STABLE, is_near = distance <= MOVED[is_last];
        if (is_stable && is_near && returns)
            return STATUS_OK;
        // Beside a neutral one it may stay for ever.
        if (is_near && !(fabs(radius - 1) < STABLE - 1))
            forecast->cycles =
                fmax(forecast->cycles,
                     (double)p * -log(is_stable ? RETURNED[0] : distance) / fabs(log(radius)));
        forecast->has_stable = forecast->has_stable || is_stable;
        orbit->period = 0;
        cycle_flow_restore(flow, NULL);
    }
    return STATUS_OK;
}

Status cycle_flow_settle(CycleFlow *flow, size_t cycles, size_t max_period) {
    const bool needs_flight = !cycle_flow_is_linearised(flow);
    const double extension_max = EXTENSION_MAX * (double)cycles;
    Orbit *orbit = &flow->orbit;
    size_t next = FIRST_TRY, end = cycles;
    bool is_late = false;
    orbit->period = 0;
    orbit->is_settled = true;
    if (needs_flight)
        TRY(cycle_flow_shift(flow, false));
    for (size_t count = 0;; count++) {
        const bool is_last = count >= end;
        cycle_flow_get(flow, flow->history + count % (max_period + 1) * orbit->size);
        if (is_last && needs_flight)
            TRY(cycle_flow_shift(flow, false));
        if ((count >= next || is_last) && (!needs_flight || cycle_flow_is_flying(flow))) {
            CycleFlowForecast forecast;
            TRY(cycle_flow_try(flow, count, max_period, is_last, &forecast));
            next *= 2;
            if (is_last && orbit->period == 0) {
                orbit->is_settled = !forecast.has_stable && !(is_late && forecast.cycles > 0);
                if (end == cycles) {
                    is_late = forecast.cycles > extension_max;
                    end += (size_t)ceil(fmin(forecast.cycles, extension_max));
                }
            }
        }
        if (count >= end || orbit->period > 0)
            return STATUS_OK;
        TRY(cycle_flow_run(flow, 1, NULL, 0, NULL));
    }
}

// The change of one column, which returns to its first size (Benettin 1980).
static double cycle_flow_growth(const Orbit *orbit, double *column) {
    double size = 0;
    for (size_t i = 0; i < orbit->size; i++)
        size += column[i] / orbit->scales[i] * (column[i] / orbit->scales[i]);
    size = sqrt(size);
    for (size_t i = 0; i < orbit->size; i++)
        column[i] /= size;
    return log(size);
}

Status cycle_flow_run_aperiodic(CycleFlow *flow, size_t cycles, double *exponent, size_t points,
                                double (*section)[2], CycleMotion *motion) {
    const bool is_linearised = cycle_flow_is_linearised(flow);
    const Orbit *orbit = &flow->orbit;
    double *column = flow->step, sum = 0, squares = 0;
    cycle_flow_scale(flow);
    memcpy(column, orbit->scales, orbit->size * sizeof *column);
    (void)cycle_flow_growth(orbit, column);
    *motion = (CycleMotion){0};
    for (size_t i = 0; i < cycles + WARM_UP; i++) {
        CycleMotion cycle;
        TRY(cycle_flow_run(flow, 1, is_linearised ? column : NULL, 1, &cycle));
        const double growth = is_linearised ? cycle_flow_growth(orbit, column) : (double)NAN;
        if (i < WARM_UP)
            continue;
        sum += growth;
        motion->peak_displacement = fmax(motion->peak_displacement, cycle.peak_displacement);
        squares += cycle.rms_displacement * cycle.rms_displacement;
        motion->impacts += cycle.impacts;
        if (i - WARM_UP < points)
            cycle_flow_top(flow, &section[i - WARM_UP][0], &section[i - WARM_UP][1]);
    }
    motion->rms_displacement = sqrt(squares / (double)cycles);
    *exponent = isfinite(sum) ? sum / ((double)cycles * flow->period) : (double)NAN;
    return STATUS_OK;
}
