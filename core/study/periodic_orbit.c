// Shooting: an orbit of p cycles is a zero of P(y) - y, where P is the motion over p cycles, found
// by Newton's method with the matrix P' of the linearised motion; its eigenvalues are the Floquet
// multipliers (Parker and Chua 1989, chapters 3 and 5). Where contact parameters depend on the
// approach speed, P' is by central differences, from a section where all masses are in flight.
//
// A mass that touches no stop is free to stand anywhere: P' then has the multiplier 1, and the
// smallest step that solves the equations is taken.
#include "core/study/periodic_orbit.h"

#include <math.h>
#include <string.h>

#include "core/math/linear_system.h"
#include "core/solve/simd_kernels.h"

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
