// Each mode is a system of its own, q'' = -d q' - w^2 q - participation a_g. The free masses feel
// the base alone: z'' = -a_g, and r = z - x.
//
// With V^2 = p'p + q'W^2 q, V grows by no more than |participation| |a_g| in unit time, and
// |r''| <= reach V + |lean| |a_g|. So r stays within length^2 max|r''| / 8 of its chord.
#include "core/solve/frame_flight.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "core/math/exponential.h"

enum { Q, P, A, B, SIZE, WORTH = 32 };
enum { VALUE, SLOPE, SUM, FALL, GROUND };

void frame_flight_ground(double omega, double length, double ground[2], double fall[2]) {
    const bool is_sine = omega > 0;
    long double system[GROUND * GROUND] = {0}, gain[GROUND * GROUND];
    system[VALUE * GROUND + SLOPE] = is_sine ? omega : 1;
    system[SLOPE * GROUND + VALUE] = is_sine ? -(long double)omega : 0;
    system[SUM * GROUND + VALUE] = 1;
    system[FALL * GROUND + SUM] = 1;
    exponential_increment(system, GROUND, length, gain);
    for (int column = 0; column < 2; column++) {
        ground[column] = (double)gain[SUM * GROUND + column];
        fall[column] = (double)gain[FALL * GROUND + column];
    }
}

static void make_mode(FrameFlight *flight, const Frame *frame, size_t i) {
    const long double share = frame->modes->participation[i], damping = frame->diagonal[i];
    const double omega = frame->turning;
    const bool is_sine = omega > 0;
    long double system[SIZE * SIZE] = {0};
    system[Q * SIZE + P] = 1;
    system[P * SIZE + Q] = -(long double)frame->omega2[i];
    system[P * SIZE + P] = -damping;
    system[P * SIZE + A] = -share;
    system[A * SIZE + B] = is_sine ? omega : 1;
    system[B * SIZE + A] = is_sine ? -(long double)omega : 0;
    long double gain[SIZE * SIZE], forms[2][SIZE * SIZE];
    exponential_increment(system, SIZE, flight->length, gain);
    for (int column = 0; column < 4; column++) {
        flight->q[column][i] = (double)gain[Q * SIZE + column];
        flight->p[column][i] = (double)gain[P * SIZE + column];
    }
    const long double speed[SIZE] = {[P] = 1}, base[SIZE] = {[A] = 1};
    const long double *const pairs[2][2] = {{speed, speed}, {base, speed}};
    exponential_forms(system, SIZE, flight->length, 2, pairs, forms[0]);
    // Off the diagonal both halves count.
    static const int places[7][2] = {{Q, Q}, {Q, P}, {P, P}, {Q, A}, {Q, B}, {P, A}, {P, B}};
    for (int k = 0; k < 7; k++)
        flight->loss[k][i] = (double)(damping * forms[0][places[k][0] * SIZE + places[k][1]] *
                                      (places[k][0] == places[k][1] ? 1 : 2));
    static const int works[4][2] = {{A, Q}, {A, P}, {B, Q}, {B, P}};
    for (int k = 0; k < 4; k++)
        flight->input[k][i] = (double)(share * 2 * forms[1][works[k][0] * SIZE + works[k][1]]);
    static const int bases[3][2] = {{A, A}, {A, B}, {B, B}};
    for (int k = 0; k < 3; k++) {
        const int at = bases[k][0] * SIZE + bases[k][1];
        const long double twice = bases[k][0] == bases[k][1] ? 1 : 2;
        flight->loss_base[k] += (double)(damping * twice * forms[0][at]);
        flight->input_base[k] += (double)(share * twice * forms[1][at]);
    }
}

Status frame_flight_make(FrameFlight *flight, const Frame *frame, Problem *problem) {
    const size_t n = frame->storeys;
    memset(flight, 0, sizeof *flight);
    if (frame->base.base->form == BASE_SAMPLED && frame->base.ratio == 0)
        return STATUS_OK; // a_g has its kinks inside the intervals
    if (frame->diagonal == NULL) {
        // Where making it would cost more than it saves there is none.
        if (frame->plan->count < WORTH * n || !(frame->interval * frame->rate < 0x1p40))
            return STATUS_OK;
        TRY(frame_dense_make(&flight->dense, 1, frame, NULL, problem));
    }
    double **const arrays[] = {
        &flight->q[0],     &flight->q[1],     &flight->q[2],     &flight->q[3],    &flight->p[0],
        &flight->p[1],     &flight->p[2],     &flight->p[3],     &flight->loss[0], &flight->loss[1],
        &flight->loss[2],  &flight->loss[3],  &flight->loss[4],  &flight->loss[5], &flight->loss[6],
        &flight->input[0], &flight->input[1], &flight->input[2], &flight->input[3]};
    const size_t count = frame->diagonal == NULL ? 0 : COUNT(arrays);
    flight->block = calloc((count + 4) * n + 2, sizeof *flight->block);
    if (flight->block == NULL)
        return problem_set(problem, STATUS_NO_MEMORY, "no memory for a run of %zu storeys", n);
    flight->gain_q = flight->block;
    flight->gain_p = flight->block + n;
    flight->start = flight->block + 2 * n;
    for (size_t i = 0; i < count; i++)
        *arrays[i] = flight->block + (i + 4) * n + 2;
    flight->length = frame->interval;
    frame_flight_ground(frame->turning, flight->length, flight->ground, flight->fall);
    for (size_t i = 0; i < n && count > 0; i++)
        make_mode(flight, frame, i);
    return STATUS_OK;
}

void frame_flight_clear(FrameFlight *flight) {
    frame_dense_clear(&flight->dense);
    free(flight->block);
}

static void gain(FrameFlight *flight, const Frame *frame, const Slice *slice) {
    const double a = slice->value, b = slice->slope, *q = frame->q, *p = frame->p;
    const size_t n = frame->storeys;
    if (flight->dense.block != NULL) {
        memcpy(flight->start, q, n * sizeof *q);
        memcpy(flight->start + n, p, n * sizeof *p);
        flight->start[2 * n] = a;
        flight->start[2 * n + 1] = b;
        memset(flight->gain_q, 0, 2 * n * sizeof *flight->gain_q); // and gain_p
        frame_dense_add(flight->dense.gain, 2 * n, flight->start, 2 * n + 2, flight->gain_q);
        return;
    }
    double *const *const row = flight->q, *const *const speed = flight->p;
    for (size_t i = 0; i < n; i++) {
        flight->gain_q[i] = row[0][i] * q[i] + row[1][i] * p[i] + (row[2][i] * a + row[3][i] * b);
        flight->gain_p[i] =
            speed[0][i] * q[i] + speed[1][i] * p[i] + (speed[2][i] * a + speed[3][i] * b);
    }
}

bool frame_flight_is_clear(const FrameDamper *damper, double gained, double bend, double length) {
    const double sag = bend * length * length / 8;
    const double most = frame_room(damper, SIDE_RIGHT) - sag;
    const double least = sag - frame_room(damper, SIDE_LEFT);
    const double end = damper->r + gained;
    return damper->r < most && end < most && damper->r > least && end > least;
}

static void add_dense_work(const FrameFlight *flight, const Slice *slice, FrameWork *work) {
    const FrameDense *dense = &flight->dense;
    work->damping = frame_dense_form(dense->loss, flight->start, dense->size);
    work->input = -(slice->value * frame_dot(dense->input[0], flight->start, dense->size) +
                    slice->slope * frame_dot(dense->input[1], flight->start, dense->size));
}

static void add_work(const FrameFlight *flight, const Frame *frame, const Slice *slice,
                     FrameWork *work) {
    const double a = slice->value, b = slice->slope, *q = frame->q, *p = frame->p;
    double *const *const l = flight->loss, *const *const w = flight->input;
    double lost[2] = {0, 0}, put[2] = {0, 0};
    const bool is_driven = a != 0 || b != 0;
    for (size_t i = 0; i < frame->storeys; i++) {
        lost[0] += q[i] * (l[0][i] * q[i] + l[1][i] * p[i]);
        lost[1] += p[i] * l[2][i] * p[i];
    }
    for (size_t i = 0; i < frame->storeys && is_driven; i++) {
        lost[0] += q[i] * (l[3][i] * a + l[4][i] * b);
        lost[1] += p[i] * (l[5][i] * a + l[6][i] * b);
        put[0] += a * (w[0][i] * q[i] + w[1][i] * p[i]);
        put[1] += b * (w[2][i] * q[i] + w[3][i] * p[i]);
    }
    const double *lb = flight->loss_base, *ib = flight->input_base;
    work->damping = lost[0] + lost[1] + (a * (lb[0] * a + lb[1] * b) + lb[2] * b * b);
    work->input = -(put[0] + put[1] + (a * (ib[0] * a + ib[1] * b) + ib[2] * b * b));
}

double frame_flight_shaken(const Slice *slice, double length) {
    const double first = fabs(slice->value), last = fabs(slice->value + slice->slope * length);
    return slice->omega > 0 ? first + fabs(slice->slope) : fmax(first, last);
}

bool frame_flight_step(FrameFlight *flight, Frame *frame, const Slice *slice, FrameWork *work) {
    const size_t n = frame->storeys;
    const double length = flight->length;
    gain(flight, frame, slice);
    const double speed = flight->ground[0] * slice->value + flight->ground[1] * slice->slope;
    const double fallen = flight->fall[0] * slice->value + flight->fall[1] * slice->slope;
    const double shaken = frame_flight_shaken(slice, length);
    const double grown = frame->growth * length; // exp(grown) < 1 / (1 - grown)
    if (!(grown < 0.5))
        return false;
    const double most =
        frame->dampers > 0 ? (frame_size(frame) + length * frame->drive * shaken) / (1 - grown) : 0;
    for (size_t d = 0; d < frame->dampers; d++) {
        FrameDamper *damper = &frame->damper[d];
        damper->storey_speed = frame_dot(damper->shape, frame->p, n);
        damper->gained = length * (damper->storey_speed + damper->w) - fallen -
                         frame_dot(damper->shape, flight->gain_q, n);
        if (!frame_flight_is_clear(damper, damper->gained,
                                   damper->reach * most + fabs(damper->lean) * shaken, length))
            return false;
    }
    if (work != NULL) {
        if (flight->dense.block != NULL)
            add_dense_work(flight, slice, work);
        else
            add_work(flight, frame, slice, work);
        work->ground = speed;
    }
    for (size_t d = 0; d < frame->dampers; d++) {
        FrameDamper *damper = &frame->damper[d];
        // Its absolute velocity stays.
        if (work != NULL)
            work->input -=
                damper->plan->mass * speed * (damper->storey_speed + damper->w - speed / 2);
        damper->r += damper->gained;
        damper->w -= speed + frame_dot(damper->shape, flight->gain_p, n);
    }
    for (size_t i = 0; i < n; i++) {
        frame->q[i] += flight->gain_q[i];
        frame->p[i] += flight->gain_p[i];
    }
    return true;
}
