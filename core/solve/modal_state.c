#include "core/solve/modal_state.h"

#include <float.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "core/math/symmetric_eigen.h"

double frame_time(const Frame *frame) {
    return (double)frame->sample / frame->plan->sample_rate + frame->offset;
}

double frame_clock(const Frame *frame) {
    return 4 * DBL_EPSILON * fmax(frame_time(frame), frame->interval);
}

double frame_room(const FrameDamper *damper, Side side) {
    if (damper->origin == FRAME_FROM_MIDDLE)
        return damper->plan->clearance / 2;
    return damper->origin == (FrameOrigin)side ? 0 : damper->plan->clearance;
}

double frame_middle(const FrameDamper *damper) {
    const double stop = damper->plan->clearance / 2;
    const double origin =
        damper->origin == FRAME_FROM_MIDDLE ? 0 : frame_sign((Side)damper->origin) * stop;
    return damper->plan->offset + origin;
}

void frame_elastic(const Frame *frame, const double *q, const double *p, double *restrict out) {
    const size_t padded = frame->padded;
    if (frame->diagonal != NULL) {
        frame->lanes->mix(padded, 1, frame->diagonal, p, frame->omega2, q, out);
        return;
    }
    frame->lanes->multiply(frame->coupled, padded, p, frame_even(frame->mode_count), out);
    for (size_t i = 0; i < padded; i++)
        out[i] += frame->omega2[i] * q[i];
}

// What a power law says of the present contact.
static ContactForce power_now(const Frame *frame, const FrameDamper *damper) {
    const double sign = frame_sign(damper->side);
    return frame->plan->law->force(&damper->contact, sign * damper->r, sign * damper->w);
}

void frame_feel(Frame *frame) {
    frame_elastic(frame, frame->q, frame->p, frame->elastic);
    if (frame->unmoved != NULL)
        frame->elastic[frame->mode_count] = frame->ground;
    for (size_t d = 0; d < frame->dampers; d++) {
        FrameDamper *damper = &frame->damper[d];
        damper->force = 0;
        if (damper->phase == FRAME_CONTACT && frame->plan->form == CONTACT_POWER)
            damper->force = frame_sign(damper->side) * power_now(frame, damper).value;
        else if (damper->phase == FRAME_CONTACT)
            damper->force =
                damper->contact.stiffness * damper->r + damper->contact.damping * damper->w;
        if (damper->phase != FRAME_RESTING)
            continue;
        for (size_t e = 0; e < frame->dampers; e++)
            if (frame->damper[e].phase == FRAME_RESTING)
                damper->force +=
                    frame->hold[d * frame->dampers + e] *
                    (frame_dot(frame->damper[e].shape, frame->elastic, frame->mode_count) +
                     frame->damper[e].lean * frame->ground);
    }
}

const double *frame_spread_four(const Frame *frame, const double *modal) {
    frame->lanes->multiply_four(frame->spread, frame->tall, modal, frame->padded,
                                frame_even(frame->slot_count), frame->seen);
    return frame->seen;
}

const double *frame_spread(const Frame *frame, const double *modal) {
    frame->lanes->multiply(frame->spread, frame->tall, modal, frame_even(frame->slot_count),
                           frame->seen);
    return frame->seen;
}

double frame_displacement(const Frame *frame, size_t storey) {
    return frame_dot(frame->modes->shapes + storey * frame->mode_count, frame->q,
                     frame->mode_count);
}

double frame_velocity(const Frame *frame, size_t storey) {
    return frame_dot(frame->modes->shapes + storey * frame->mode_count, frame->p,
                     frame->mode_count);
}

double frame_storey_acceleration(const Frame *frame, size_t storey) {
    const size_t n = frame->mode_count;
    double sum = -frame_dot(frame->modes->shapes + storey * n, frame->elastic, n);
    if (frame->unmoved != NULL)
        sum += frame->unmoved[storey] * frame->ground;
    for (size_t d = 0; d < frame->dampers; d++)
        sum += frame->mobility[d * frame->storey_count + storey] * frame->damper[d].force;
    return sum;
}

double frame_acceleration(const Frame *frame, size_t d) {
    const FrameDamper *damper = &frame->damper[d];
    double sum =
        damper->lean * frame->ground + frame_dot(damper->shape, frame->elastic, frame->mode_count);
    for (size_t e = 0; e < frame->dampers; e++)
        sum -= frame->yield[d * frame->dampers + e] * frame->damper[e].force;
    return sum;
}

EnergyState frame_energy(const Frame *frame) {
    EnergyState energy = {0.5 * frame_dot(frame->p, frame->p, frame->mode_count), 0};
    for (size_t i = 0; i < frame->mode_count; i++)
        energy.strain += 0.5 * frame->omega2[i] * frame->q[i] * frame->q[i];
    for (size_t d = 0; d < frame->dampers; d++) {
        const FrameDamper *damper = &frame->damper[d];
        const double z = frame_dot(damper->shape, frame->p, frame->mode_count) + damper->w;
        energy.kinetic += 0.5 * damper->plan->mass * z * z;
        if (damper->phase == FRAME_CONTACT && frame->plan->form == CONTACT_POWER)
            energy.strain += power_now(frame, damper).strain;
        else if (damper->phase == FRAME_CONTACT)
            energy.strain += 0.5 * damper->contact.stiffness * damper->r * damper->r;
    }
    return energy;
}

double frame_size_of(const Frame *frame, const double *q, const double *p) {
    double squares[4] = {0, 0, 0, 0};
    size_t i = 0;
    for (; i + 2 <= frame->mode_count; i += 2)
        for (size_t j = 0; j < 2; j++) {
            squares[j] += p[i + j] * p[i + j];
            squares[2 + j] += frame->omega2[i + j] * q[i + j] * q[i + j];
        }
    if (i < frame->mode_count)
        squares[0] += p[i] * p[i] + frame->omega2[i] * q[i] * q[i];
    return sqrt((squares[0] + squares[1]) + (squares[2] + squares[3]));
}

double frame_size(const Frame *frame) {
    return frame_size_of(frame, frame->q, frame->p);
}

// With lambda^2 + c lambda + k = 0 for the Rayleigh quotients c and k of any mode, |lambda| is at
// most the larger of c and sqrt(k); a contact adds to each quotient no more than its own over m_e.
double frame_rate(const Frame *frame) {
    double stiff = frame->stiff, viscous = frame->viscous;
    bool is_touching = false;
    for (size_t d = 0; d < frame->dampers; d++) {
        const FrameDamper *damper = &frame->damper[d];
        if (damper->phase != FRAME_CONTACT)
            continue;
        is_touching = true;
        stiff += damper->contact.stiffness / damper->effective_mass;
        viscous += damper->contact.damping / damper->effective_mass;
    }
    return is_touching ? fmax(fmax(sqrt(stiff), viscous), frame->rate) : frame->rate;
}

// The inverse of `yield` among the dampers that rest, by Gauss and Jordan; it is positive definite.
static void invert_hold(Frame *frame) {
    const size_t n = frame->dampers;
    double *left = frame->scratch, *right = frame->hold;
    for (size_t i = 0; i < n; i++) {
        const bool is_held = frame->damper[i].phase == FRAME_RESTING;
        for (size_t j = 0; j < n; j++) {
            const bool are_held = is_held && frame->damper[j].phase == FRAME_RESTING;
            left[i * n + j] = are_held ? frame->yield[i * n + j] : i == j;
            right[i * n + j] = is_held && i == j;
        }
    }
    for (size_t k = 0; k < n; k++) {
        const double pivot = left[k * n + k];
        for (size_t j = 0; j < n; j++) {
            left[k * n + j] /= pivot;
            right[k * n + j] /= pivot;
        }
        for (size_t i = 0; i < n; i++) {
            const double factor = left[i * n + k];
            if (i == k || factor == 0)
                continue;
            for (size_t j = 0; j < n; j++) {
                left[i * n + j] -= factor * left[k * n + j];
                right[i * n + j] -= factor * right[k * n + j];
            }
        }
    }
}

void frame_hold_make(Frame *frame) {
    frame->resting = 0;
    for (size_t d = 0; d < frame->dampers; d++)
        frame->resting += frame->damper[d].phase == FRAME_RESTING;
    if (frame->resting > 0)
        invert_hold(frame);
}
