// Each mode is a system of its own, q'' = -d q' - w^2 q - participation a_g. The free masses feel
// the base alone: z'' = -a_g, and r = z - x.
//
// With V^2 = p'p + q'W^2 q, V' <= growth V + |participation| |a_g|, and |r''| <= elastic_bound V +
// |base_coupling| |a_g|. So r stays within length^2 max|r''| / 8 of its chord.
#include "core/solve/engine.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "core/math/matrix_exponential.h"

enum { Q, P, A, B, WORTH = 32 };
enum { VALUE, SLOPE, SUM, FALL, GROUND };

void flight_ground(double omega, double length, double ground[2], double fall[2]) {
    const bool is_sine = omega > 0;
    long double system[GROUND * GROUND] = {0}, gain[GROUND * GROUND];
    system[VALUE * GROUND + SLOPE] = is_sine ? omega : 1;
    system[SLOPE * GROUND + VALUE] = is_sine ? -(long double)omega : 0;
    system[SUM * GROUND + VALUE] = 1;
    system[FALL * GROUND + SUM] = 1;
    matrix_exponential_increment(system, GROUND, length, gain);
    for (int column = 0; column < 2; column++) {
        ground[column] = (double)gain[SUM * GROUND + column];
        fall[column] = (double)gain[FALL * GROUND + column];
    }
}

static Status flight_make_mode(Flight *flight, const ModalState *state, size_t i,
                               Problem *problem) {
    Transition mode;
    TRY(transition_make_mode(&mode, state, i, problem));
    for (size_t column = 0; column < 4; column++) {
        flight->gains.q[column][i] = mode.gain[column * mode.rows + Q];
        flight->gains.p[column][i] = mode.gain[column * mode.rows + P];
    }
    // Off the diagonal both halves of a form count.
    static const size_t places[FLIGHT_SUMS][2] = {{Q, Q}, {Q, P}, {P, P}, {Q, A},
                                                  {Q, B}, {P, A}, {P, B}};
    for (size_t k = 0; k < FLIGHT_SUMS; k++)
        flight->loss[k][i] = mode.loss[places[k][0] * mode.rows + places[k][1]] *
                             (places[k][0] == places[k][1] ? 1 : 2);
    for (size_t k = 0; k < 4; k++)
        flight->input[k][i] = mode.input[k % 2][k / 2];
    flight->loss_base[0] += mode.loss[A * mode.rows + A];
    flight->loss_base[1] += 2 * mode.loss[A * mode.rows + B];
    flight->loss_base[2] += mode.loss[B * mode.rows + B];
    flight->input_base[0] += mode.input[0][A];
    flight->input_base[1] += mode.input[0][B] + mode.input[1][A];
    flight->input_base[2] += mode.input[1][B];
    transition_clear(&mode);
    return STATUS_OK;
}

Status flight_make(Flight *flight, const ModalState *state, Problem *problem) {
    const size_t n = state->mode_count;
    memset(flight, 0, sizeof *flight);
    if (state->base.base->form == BASE_SAMPLED && state->base.ratio == 0)
        return STATUS_OK; // a_g has kinks inside the intervals
    if (state->diagonal == NULL) {
        // None where making the transition costs more than it saves.
        if (state->plan->count < WORTH * n || !(state->interval * state->rate < 0x1p40))
            return STATUS_OK;
        TRY(transition_make(&flight->transition, 1, state, NULL, problem));
    }
    SimdArray arrays[8 + FLIGHT_SUMS + 4 + 3];
    size_t count = 0;
    const size_t padded = state->padded, own = state->diagonal == NULL ? 0 : padded;
    for (size_t i = 0; i < 4; i++) {
        arrays[count++] = (SimdArray){&flight->gains.q[i], own};
        arrays[count++] = (SimdArray){&flight->gains.p[i], own};
        arrays[count++] = (SimdArray){&flight->input[i], own};
    }
    for (size_t i = 0; i < FLIGHT_SUMS; i++)
        arrays[count++] = (SimdArray){&flight->loss[i], own};
    arrays[count++] = (SimdArray){&flight->sums, FLIGHT_SUMS * padded};
    arrays[count++] = (SimdArray){&flight->gained, FLIGHT_ROWS * simd_kernels_padded(2 * n + 2)};
    arrays[count++] = (SimdArray){&flight->start, FLIGHT_ROWS * (2 * n + 2)};
    flight->block = simd_kernels_allocate(arrays, count);
    if (flight->block == NULL)
        return problem_set(problem, STATUS_NO_MEMORY, "no memory for a run of %zu modes", n);
    flight->length = state->interval;
    flight_ground(state->base_omega, flight->length, flight->ground, flight->fall);
    for (size_t i = 0; i < n && own > 0; i++)
        TRY(flight_make_mode(flight, state, i, problem));
    return STATUS_OK;
}

void flight_clear(Flight *flight) {
    transition_clear(&flight->transition);
    free(flight->block);
}

// Fills rows 1 to count of the buffer.
static void flight_step_coupled(const Flight *flight, FlightBuffer *buffer, const ModalState *state,
                                size_t count) {
    const size_t n = state->mode_count, padded = state->padded;
    double *start = flight->start, *gained = flight->gained;
    for (size_t k = 0; k < count; k++) {
        const size_t now = k * padded, next = now + padded;
        memcpy(start, buffer->q + now, n * sizeof *start);
        memcpy(start + n, buffer->p + now, n * sizeof *start);
        start[2 * n] = buffer->a[k];
        start[2 * n + 1] = buffer->b[k];
        state->lanes->multiply(flight->transition.gain, flight->transition.rows, start, 2 * n + 2,
                               gained);
        for (size_t i = 0; i < n; i++) {
            buffer->q[next + i] = buffer->q[now + i] + gained[i];
            buffer->p[next + i] = buffer->p[now + i] + gained[n + i];
            buffer->moved[next + i] = buffer->moved[now + i] + gained[i];
            buffer->sped[next + i] = buffer->sped[now + i] + gained[n + i];
        }
    }
}

static void flight_step(const Flight *flight, FlightBuffer *buffer, const ModalState *state,
                        const Slice *slices, size_t count) {
    const size_t n = state->mode_count;
    memcpy(buffer->q, state->q, n * sizeof *buffer->q);
    memcpy(buffer->p, state->p, n * sizeof *buffer->p);
    for (size_t k = 0; k < count; k++) {
        buffer->a[k] = slices[k].value;
        buffer->b[k] = slices[k].slope;
        buffer->ground[k] =
            flight->ground[0] * slices[k].value + flight->ground[1] * slices[k].slope;
    }
    if (flight->transition.block != NULL)
        flight_step_coupled(flight, buffer, state, count);
    else
        state->lanes->fly(&flight->gains, state->padded, count, buffer->a, buffer->b, buffer->q,
                          buffer->p, buffer->moved, buffer->sped);
}

bool flight_is_clear(const DamperState *damper, double from, double to, double bend,
                     double length) {
    const double sag = bend * length * length / 8;
    const double most = modal_state_room(damper, SIDE_RIGHT) - sag;
    const double least = sag - modal_state_room(damper, SIDE_LEFT);
    return from < most && to < most && from > least && to > least;
}

static void flight_add_coupled_work(const Flight *flight, const FlightBuffer *buffer,
                                    const ModalState *state, size_t count, StepWork *work) {
    const Transition *transition = &flight->transition;
    const size_t n = state->mode_count, size = transition->size;
    for (size_t from = 0; from < count; from += FLIGHT_ROWS) {
        const size_t many = count - from < FLIGHT_ROWS ? count - from : FLIGHT_ROWS;
        for (size_t k = from; k < from + many; k++) {
            double *start = flight->start + (k - from) * size;
            memcpy(start, buffer->q + k * state->padded, n * sizeof *start);
            memcpy(start + n, buffer->p + k * state->padded, n * sizeof *start);
            start[2 * n] = buffer->a[k];
            start[2 * n + 1] = buffer->b[k];
            work->input -= buffer->a[k] * modal_state_dot(transition->input[0], start, size) +
                           buffer->b[k] * modal_state_dot(transition->input[1], start, size);
        }
        state->lanes->multiply_four(transition->loss, transition->rows, flight->start, size, size,
                                    flight->gained);
        for (size_t k = 0; k < many; k++)
            work->damping += modal_state_dot(flight->gained + k * transition->rows,
                                             flight->start + k * size, size);
    }
}

static void flight_add_work(const Flight *flight, const FlightBuffer *buffer,
                            const ModalState *state, size_t count, StepWork *work) {
    const size_t n = state->mode_count;
    const size_t padded = state->padded;
    double *sums = flight->sums;
    memset(sums, 0, FLIGHT_SUMS * padded * sizeof *sums);
    state->lanes->sum(padded, count, buffer->a, buffer->b, buffer->q, buffer->p, sums);
    for (size_t j = 0; j < FLIGHT_SUMS; j++)
        work->damping += modal_state_dot(flight->loss[j], sums + j * padded, n);
    // The sums' last four are over (q value, q slope, p value, p slope).
    for (size_t j = 0; j < 4; j++)
        work->input -= modal_state_dot(flight->input[j], sums + (3 + j) * padded, n);
    const double *lb = flight->loss_base, *ib = flight->input_base;
    for (size_t k = 0; k < count; k++) {
        const double a = buffer->a[k], b = buffer->b[k];
        work->damping += a * (lb[0] * a + lb[1] * b) + lb[2] * b * b;
        work->input -= a * (ib[0] * a + ib[1] * b) + ib[2] * b * b;
    }
}

double flight_max_ground(const Slice *slice, double length) {
    const double first = fabs(slice->value), last = fabs(slice->value + slice->slope * length);
    return slice->omega > 0 ? first + fabs(slice->slope) : fmax(first, last);
}

// Rows 1 to count of r and z of one damper, whose absolute velocity is constant.
static void flight_move_damper(const Flight *flight, FlightBuffer *buffer, const ModalState *state,
                               size_t d, size_t count, const Slice *slices) {
    const DamperState *damper = &state->damper[d];
    double *r = buffer->r + d * FLIGHT_BUFFER_ROWS, *z = buffer->z + d * FLIGHT_BUFFER_ROWS,
           far = damper->r;
    double moved[FLIGHT_BUFFER_ROWS];
    state->lanes->dot(state->padded, count, damper->shape, buffer->moved + state->padded, moved);
    r[0] = damper->r;
    z[0] = modal_state_dot(damper->shape, buffer->p, state->mode_count) + damper->w;
    for (size_t k = 0; k < count; k++) {
        far += flight->length * z[k] -
               (flight->fall[0] * slices[k].value + flight->fall[1] * slices[k].slope);
        r[k + 1] = far - moved[k];
        z[k + 1] = z[k] - buffer->ground[k];
    }
}

// Bound of sqrt(p'p + q'W^2 q) over `many` intervals that begin with `size`.
static double flight_bound_size(const Flight *flight, const ModalState *state, double size,
                                double max_ground, size_t many) {
    const double length = (double)many * flight->length;
    const double left = 1 - state->growth * length; // exp(growth length) < 1 / left
    return left > 0.5 ? (size + length * state->participation_norm * max_ground) / left : INFINITY;
}

// The number of intervals, at most `count`, that surely keep a damper between its stops; |r''| is
// at most `bend`.
static size_t flight_count_clear(const Flight *flight, const FlightBuffer *buffer,
                                 const ModalState *state, size_t d, double bend,
                                 const Slice *slices, size_t count) {
    const DamperState *damper = &state->damper[d];
    const double *r = buffer->r + d * FLIGHT_BUFFER_ROWS, length = flight->length;
    double least = r[0], most = r[0];
    for (size_t k = 1; k <= count; k++) {
        least = r[k] < least ? r[k] : least;
        most = r[k] > most ? r[k] : most;
    }
    if (flight_is_clear(damper, least, most, bend, length))
        return count;
    for (size_t k = 0; k < count; k++) {
        if (flight_is_clear(damper, r[k], r[k + 1], bend, length))
            continue;
        // The bound of this interval alone is closer.
        const double max_ground = flight_max_ground(&slices[k], length);
        const double size = modal_state_size_of(state, buffer->q + k * state->padded,
                                                buffer->p + k * state->padded);
        const double own =
            damper->elastic_bound * flight_bound_size(flight, state, size, max_ground, 1) +
            fabs(damper->base_coupling) * max_ground;
        if (!flight_is_clear(damper, r[k], r[k + 1], own, length))
            return k;
    }
    return count;
}

// An estimate of the number of intervals until the next stop: more would be computed in vain.
static size_t flight_guess_count(const Flight *flight, const ModalState *state, size_t count) {
    for (size_t d = 0; d < state->dampers; d++) {
        const DamperState *damper = &state->damper[d];
        const double step = fabs(damper->w) * flight->length;
        const double room = damper->w > 0 ? modal_state_room(damper, SIDE_RIGHT) - damper->r
                                          : modal_state_room(damper, SIDE_LEFT) + damper->r;
        if (room < (double)(count - 1) * step)
            count = 1 + (size_t)fmax(room / step, 0);
    }
    return count;
}

size_t flight_run(Flight *flight, FlightBuffer *buffer, ModalState *state, const Slice *slices,
                  size_t count, StepWork *work) {
    const size_t n = state->mode_count;
    double max_ground = 0;
    if (state->has_stops)
        count = flight_guess_count(flight, state, count);
    flight_step(flight, buffer, state, slices, count);
    for (size_t k = 0; k < count; k++)
        max_ground = fmax(max_ground, flight_max_ground(&slices[k], flight->length));
    const double most = state->has_stops ? flight_bound_size(flight, state, modal_state_size(state),
                                                             max_ground, count)
                                         : 0;
    for (size_t d = 0; d < state->dampers; d++) {
        const DamperState *damper = &state->damper[d];
        const double bend = damper->elastic_bound * most + fabs(damper->base_coupling) * max_ground;
        flight_move_damper(flight, buffer, state, d, count, slices);
        if (state->has_stops)
            count = flight_count_clear(flight, buffer, state, d, bend, slices, count);
    }
    if (count == 0)
        return 0;
    if (work != NULL) {
        *work = (StepWork){0};
        if (flight->transition.block != NULL)
            flight_add_coupled_work(flight, buffer, state, count, work);
        else
            flight_add_work(flight, buffer, state, count, work);
    }
    const size_t end = count * state->padded;
    double speed = 0;
    for (size_t k = 0; k < count; k++)
        speed += buffer->ground[k];
    for (size_t d = 0; d < state->dampers; d++) {
        DamperState *damper = &state->damper[d];
        const double *z = buffer->z + d * FLIGHT_BUFFER_ROWS;
        for (size_t k = 0; k < count && work != NULL; k++)
            work->input -= damper->plan->mass * buffer->ground[k] * (z[k] - buffer->ground[k] / 2);
        damper->r = buffer->r[d * FLIGHT_BUFFER_ROWS + count];
        damper->w -= speed + modal_state_dot(damper->shape, buffer->sped + end, n);
        damper->force = 0;
    }
    memcpy(state->q, buffer->q + end, n * sizeof *state->q);
    memcpy(state->p, buffer->p + end, n * sizeof *state->p);
    return count;
}
