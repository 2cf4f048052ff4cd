// A cycle is one interval of the engine's clock, which starts again with each cycle, so that the
// return map is the same function in every cycle. Only Taylor steps and steps of power laws are
// taken: both serve any length.
#include "core/solve/cycle_flow.h"

#include <float.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "core/math/linear_system.h"
#include "core/solve/engine.h"
#include "core/solve/simd_kernels.h"

enum { PARTS = 16 }; // of a cycle, at which the section may be

struct CycleFlow {
    EventEngine engine;
    LinearisedMotion linearised;
    Run run;
    Response response;
    Base base;
    Plan *plan;
    double period; // [s]
    int part;      // of the cycle, at which the section is
    double *kept;  // q and p
    DamperState *kept_dampers;
};

void cycle_flow_free(CycleFlow *flow) {
    if (flow == NULL)
        return;
    linearised_motion_clear(&flow->linearised);
    event_engine_clear(&flow->engine);
    response_clear(&flow->response);
    plan_free(flow->plan);
    free(flow->kept);
    free(flow->kept_dampers);
    free(flow);
}

// u - r of a damper.
static double cycle_flow_origin(const DamperState *damper) {
    return damper->origin == FROM_MIDDLE
               ? 0
               : modal_state_sign((Side)damper->origin) * damper->plan->clearance / 2;
}

size_t cycle_flow_size(const CycleFlow *flow) {
    return flow->linearised.size;
}

void cycle_flow_get(const CycleFlow *flow, double *y) {
    const ModalState *state = &flow->engine.state;
    modal_state_gather(state, y);
    for (size_t d = 0; d < state->dampers; d++)
        y[2 * state->mode_count + d] += cycle_flow_origin(&state->damper[d]);
}

void cycle_flow_set(CycleFlow *flow, const double *y) {
    ModalState *state = &flow->engine.state;
    const size_t n = state->mode_count, m = state->dampers;
    memcpy(state->q, y, n * sizeof *y);
    memcpy(state->p, y + n, n * sizeof *y);
    for (size_t d = 0; d < m; d++) {
        DamperState *damper = &state->damper[d];
        if (damper->phase == PHASE_RESTING)
            continue;
        damper->r = y[2 * n + d] - cycle_flow_origin(damper);
        damper->w = y[2 * n + m + d];
    }
}

void cycle_flow_scales(const CycleFlow *flow, double *scales) {
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
    memcpy(flow->kept, state->q, state->padded * sizeof *flow->kept);
    memcpy(flow->kept + state->padded, state->p, state->padded * sizeof *flow->kept);
    memcpy(flow->kept_dampers, state->damper, state->dampers * sizeof *state->damper);
}

void cycle_flow_restore(CycleFlow *flow) {
    ModalState *state = &flow->engine.state;
    memcpy(state->q, flow->kept, state->padded * sizeof *flow->kept);
    memcpy(state->p, flow->kept + state->padded, state->padded * sizeof *flow->kept);
    memcpy(state->damper, flow->kept_dampers, state->dampers * sizeof *state->damper);
    modal_state_constrain(state);
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

// To `time` after the zero crossing before.
static Status cycle_flow_cross(CycleFlow *flow, double time) {
    ModalState *state = &flow->engine.state;
    state->events_at_instant = state->chatter_events = 0;
    state->chatter_time = state->suppress_time = state->suppressed_at = 0;
    TRY(event_engine_cross(&flow->engine, time));
    TRY(event_engine_check(&flow->engine));
    state->offset = time;
    return STATUS_OK;
}

static double cycle_flow_part_time(const CycleFlow *flow, int part) {
    return flow->period * part / PARTS;
}

Status cycle_flow_run(CycleFlow *flow, size_t cycles, double *columns, size_t count,
                      CycleMotion *motion) {
    ModalState *state = &flow->engine.state;
    LinearisedMotion *linearised = &flow->linearised;
    const uint64_t before = flow->response.impact_count;
    linearised->columns = columns;
    linearised->count = columns != NULL ? count : 0;
    cycle_flow_clear_resting(flow, columns, linearised->count);
    linearised->is_measured = motion != NULL;
    linearised->peak = 0;
    memset(linearised->squares, 0, state->storey_count * sizeof *linearised->squares);
    Status status = STATUS_OK;
    const double start = cycle_flow_part_time(flow, flow->part);
    for (size_t i = 0; i < cycles && status == STATUS_OK; i++) {
        state->offset = start;
        status = cycle_flow_cross(flow, start + flow->period);
    }
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
    for (int i = 0; i < PARTS && (is_home ? flow->part > 0 : !cycle_flow_is_flying(flow)); i++) {
        flow->engine.state.offset = cycle_flow_part_time(flow, flow->part);
        flow->part++;
        TRY(cycle_flow_cross(flow, cycle_flow_part_time(flow, flow->part)));
        flow->part %= PARTS;
    }
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

double cycle_flow_period(const CycleFlow *flow) {
    return flow->period;
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
    flow->kept = calloc(2 * state->padded, sizeof *flow->kept);
    flow->kept_dampers = calloc(state->dampers + 1, sizeof *flow->kept_dampers);
    if (flow->kept == NULL || flow->kept_dampers == NULL)
        return problem_set(problem, STATUS_NO_MEMORY, "no memory for the motion");
    if (from != NULL)
        cycle_flow_carry_dampers(flow, &from->engine.state);
    else
        TRY(event_engine_settle(&flow->engine));
    return STATUS_OK;
}

Status cycle_flow_new(const CycleFlowInputs *inputs, const CycleFlow *from, CycleFlow **made,
                      Problem *problem) {
    CycleFlow *flow = *made = calloc(1, sizeof *flow);
    if (flow == NULL) {
        plan_free(inputs->plan);
        return problem_set(problem, STATUS_NO_MEMORY, "no memory for the motion");
    }
    flow->plan = inputs->plan;
    flow->base = inputs->base;
    flow->period = inputs->period;
    flow->plan->sample_rate = 1 / inputs->period;
    flow->plan->duration = inputs->period;
    flow->plan->count = 2;
    flow->part = from != NULL ? from->part : 0;
    flow->response.is_unlisted = true;
    flow->run = (Run){.plan = flow->plan,
                      .base = &flow->base,
                      .progress = inputs->progress,
                      .accuracy = inputs->accuracy,
                      .steps_max = inputs->steps_max};
    const Status status = cycle_flow_make(flow, from, problem);
    if (status != STATUS_OK) {
        cycle_flow_free(flow);
        *made = NULL;
    }
    return status;
}

// --- periodic orbits ---

// Shooting: an orbit of p cycles is a zero of P(y) - y, where P is the motion over p cycles, found
// by Newton's method with the matrix P' of the linearised motion; its eigenvalues are the Floquet
// multipliers (Parker and Chua 1989, chapters 3 and 5). Where contact parameters depend on the
// approach speed, P' is by central differences, from a section where all masses are in flight.
//
// A mass that touches no stop is free to stand anywhere: P' then has the multiplier 1, and the
// smallest step that solves the equations is taken.

enum { NEWTON_STEPS = 20, FIRST_TRY = 4, WARM_UP = 8 };

static const double CLOSED = 1e-13; // change by the map at an orbit
static const double CLOSE = 1e-8;   // a step so small ends at the orbit, but for its square
static const double RETURNED[] = {1e-3, 1e-2}, MOVED[] = {0.05, 0.3}; // while settling, at its end
static const double DIFFERENCE = 1e-6;
static const double STABLE = 1 + 1e-6; // largest multiplier of an orbit that was approached
static const double FARTHEST = 10;     // step of Newton's method
static const double RIDGE = 1e-12;

Status orbit_search_make(OrbitSearch *search, size_t size, size_t max_period) {
    *search = (OrbitSearch){.size = size, .max_period = max_period};
    const SimdArray arrays[] = {
        {&search->scales, size},
        {&search->y, size},
        {&search->end, size},
        {&search->matrix, size * size},
        {&search->real, size},
        {&search->imaginary, size},
        {&search->step, size},
        {&search->columns, size * size},
        {&search->left, 2 * size * size},
        {&search->history, (max_period + 1) * size},
        {&search->first, size},
    };
    search->block = simd_kernels_allocate(arrays, COUNT(arrays));
    return status_made(search->block != NULL);
}

void orbit_search_clear(OrbitSearch *search) {
    free(search->block);
    *search = (OrbitSearch){0};
}

static Status orbit_search_run(CycleFlow *flow, size_t period, const double *from, double *end) {
    cycle_flow_restore(flow);
    cycle_flow_set(flow, from);
    TRY(cycle_flow_run(flow, period, NULL, 0, NULL));
    cycle_flow_get(flow, end);
    return STATUS_OK;
}

static Status orbit_search_run_differences(OrbitSearch *search, CycleFlow *flow, size_t period) {
    const size_t n = search->size;
    double *from = search->left, *ahead = from + n, *behind = ahead + n;
    for (size_t i = 0; i < n; i++) {
        memcpy(from, search->y, n * sizeof *from);
        from[i] = search->y[i] + DIFFERENCE * search->scales[i];
        TRY(orbit_search_run(flow, period, from, ahead));
        from[i] = search->y[i] - DIFFERENCE * search->scales[i];
        TRY(orbit_search_run(flow, period, from, behind));
        for (size_t k = 0; k < n; k++)
            search->columns[i * n + k] = (ahead[k] - behind[k]) / (2 * DIFFERENCE);
    }
    return orbit_search_run(flow, period, search->y, search->end);
}

static Status orbit_search_run_matrix(OrbitSearch *search, CycleFlow *flow, size_t period) {
    const size_t n = search->size;
    if (!cycle_flow_is_linearised(flow))
        return orbit_search_run_differences(search, flow, period);
    memset(search->columns, 0, n * n * sizeof *search->columns);
    for (size_t i = 0; i < n; i++)
        search->columns[i * n + i] = search->scales[i];
    cycle_flow_restore(flow);
    cycle_flow_set(flow, search->y);
    TRY(cycle_flow_run(flow, period, search->columns, n, NULL));
    cycle_flow_get(flow, search->end);
    return STATUS_OK;
}

// Largest scaled difference of two states.
static double orbit_search_distance(const OrbitSearch *search, const double *a, const double *b) {
    double most = 0;
    for (size_t i = 0; i < search->size; i++) {
        const double difference = fabs(a[i] - b[i]) / search->scales[i];
        most = difference <= most ? most : difference; // NaN counts as the largest
    }
    return most;
}

double orbit_search_map(OrbitSearch *search, CycleFlow *flow, size_t period, bool has_matrix,
                        Status *status) {
    const size_t n = search->size;
    *status = has_matrix ? orbit_search_run_matrix(search, flow, period)
                         : orbit_search_run(flow, period, search->y, search->end);
    if (*status != STATUS_OK)
        return (double)NAN;
    for (size_t i = 0; i < n && has_matrix; i++)
        for (size_t k = 0; k < n; k++)
            search->matrix[k * n + i] = search->columns[i * n + k] / search->scales[k];
    return orbit_search_distance(search, search->end, search->y);
}

Status orbit_search_multiply(OrbitSearch *search) {
    memcpy(search->left, search->matrix, search->size * search->size * sizeof *search->left);
    const Status status =
        linear_system_eigenvalues(search->size, search->left, search->real, search->imaginary);
    if (status == STATUS_INVALID)
        search->real[0] = (double)NAN;
    return status == STATUS_NO_MEMORY ? status : STATUS_OK;
}

double orbit_search_radius(const OrbitSearch *search) {
    return hypot(search->real[0], search->imaginary[0]);
}

// The step of Newton's method: (I - P') step = P(y) - y, or the smallest one of least squares.
static void orbit_search_solve(OrbitSearch *search) {
    const size_t n = search->size;
    double *A = search->left, *normal = A + n * n, *step = search->step, most = 0;
    for (size_t i = 0; i < n; i++) {
        step[i] = (search->end[i] - search->y[i]) / search->scales[i];
        for (size_t k = 0; k < n; k++)
            A[i * n + k] = (i == k) - search->matrix[i * n + k];
    }
    const bool is_solved = linear_system_solve(A, step, n, 1);
    for (size_t i = 0; i < n; i++)
        most = fabs(step[i]) <= most ? most : fabs(step[i]);
    if (is_solved && most <= FARTHEST)
        return;
    double largest = 0;
    for (size_t i = 0; i < n; i++)
        for (size_t k = 0; k < n; k++)
            A[i * n + k] = (i == k) - search->matrix[i * n + k];
    for (size_t i = 0; i < n; i++) {
        step[i] = 0;
        for (size_t k = 0; k < n; k++) {
            double sum = 0;
            for (size_t l = 0; l < n; l++)
                sum += A[l * n + i] * A[l * n + k];
            normal[i * n + k] = sum;
            step[i] += A[k * n + i] * (search->end[k] - search->y[k]) / search->scales[k];
        }
        largest = fmax(largest, normal[i * n + i]);
    }
    for (size_t i = 0; i < n; i++)
        normal[i * n + i] += RIDGE * largest;
    (void)linear_system_solve(normal, step, n, 1);
}

Status orbit_search_shoot(OrbitSearch *search, CycleFlow *flow, size_t period, bool *is_found,
                          Problem *problem) {
    Status status = STATUS_OK;
    *is_found = false;
    cycle_flow_scales(flow, search->scales);
    cycle_flow_keep(flow);
    cycle_flow_get(flow, search->y);
    for (int i = 0; i < NEWTON_STEPS && !*is_found; i++) {
        const double change = orbit_search_map(search, flow, period, true, &status);
        if (!(change < FARTHEST))
            break;
        orbit_search_solve(search);
        double step = 0;
        for (size_t k = 0; k < search->size; k++) {
            search->y[k] += search->step[k] * search->scales[k];
            step = fmax(step, fabs(search->step[k]));
        }
        *is_found = change <= CLOSED || step <= CLOSE;
    }
    cycle_flow_restore(flow);
    if (status != STATUS_OK && !orbit_search_is_lost(status, problem))
        return status;
    if (!*is_found)
        return STATUS_OK;
    cycle_flow_set(flow, search->y);
    return orbit_search_multiply(search);
}

// Whether the last `count` sections of the history return to an orbit that attracts.
static Status orbit_search_try(OrbitSearch *search, CycleFlow *flow, size_t count, bool is_last,
                               size_t *period, Problem *problem) {
    const size_t rows = search->max_period + 1, n = search->size;
    const double *now = search->history + count % rows * n;
    cycle_flow_scales(flow, search->scales);
    for (size_t p = 1; p <= search->max_period && p <= count; p++) {
        bool is_found;
        if (!(orbit_search_distance(search, now, search->history + (count - p) % rows * n) <=
              RETURNED[is_last]))
            continue;
        cycle_flow_get(flow, search->first);
        TRY(orbit_search_shoot(search, flow, p, &is_found, problem));
        if (is_found && orbit_search_radius(search) <= STABLE &&
            orbit_search_distance(search, search->y, search->first) <= MOVED[is_last]) {
            *period = p;
            return STATUS_OK;
        }
        if (is_found)
            cycle_flow_restore(flow);
    }
    return STATUS_OK;
}

Status orbit_search_settle(OrbitSearch *search, CycleFlow *flow, size_t cycles, size_t *period,
                           Problem *problem) {
    const bool needs_flight = !cycle_flow_is_linearised(flow);
    size_t next = FIRST_TRY;
    *period = 0;
    if (needs_flight)
        TRY(cycle_flow_shift(flow, false));
    for (size_t count = 0;; count++) {
        const bool is_last = count >= cycles;
        cycle_flow_get(flow, search->history + count % (search->max_period + 1) * search->size);
        if (is_last && needs_flight)
            TRY(cycle_flow_shift(flow, false));
        if ((count >= next || is_last) && (!needs_flight || cycle_flow_is_flying(flow))) {
            TRY(orbit_search_try(search, flow, count, is_last, period, problem));
            next *= 2;
        }
        if (is_last || *period > 0)
            return STATUS_OK;
        TRY(cycle_flow_run(flow, 1, NULL, 0, NULL));
    }
}

// The change of one column, which returns to its first size (Benettin 1980).
static double orbit_search_growth(const OrbitSearch *search, double *column) {
    double size = 0;
    for (size_t i = 0; i < search->size; i++)
        size += column[i] / search->scales[i] * (column[i] / search->scales[i]);
    size = sqrt(size);
    for (size_t i = 0; i < search->size; i++)
        column[i] /= size;
    return log(size);
}

Status orbit_search_wander(OrbitSearch *search, CycleFlow *flow, size_t cycles, double *exponent,
                           size_t points, double (*section)[2], CycleMotion *motion) {
    const bool is_linearised = cycle_flow_is_linearised(flow);
    double *column = search->step, sum = 0, squares = 0;
    cycle_flow_scales(flow, search->scales);
    memcpy(column, search->scales, search->size * sizeof *column);
    (void)orbit_search_growth(search, column);
    *motion = (CycleMotion){0};
    for (size_t i = 0; i < cycles + WARM_UP; i++) {
        CycleMotion cycle;
        TRY(cycle_flow_run(flow, 1, is_linearised ? column : NULL, 1, &cycle));
        const double growth = is_linearised ? orbit_search_growth(search, column) : (double)NAN;
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
    *exponent = isfinite(sum) ? sum / (double)cycles : (double)NAN;
    return STATUS_OK;
}
