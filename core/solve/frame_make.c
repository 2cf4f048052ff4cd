// How a Frame comes to be: from a plan, its modes and its dampers.
#include "core/solve/modal_state.h"

#include <float.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "core/math/symmetric_eigen.h"

static const double NEARLY = 1e-9;

// (M^-1)_jk from the modes; 0 where it is no more than rounding, lest a hit on one storey stir a
// mass that rests on another.
static double mobility(const Modes *modes, size_t j, size_t k) {
    const double *a = modes->shapes + j * modes->count, *b = modes->shapes + k * modes->count;
    long double sum = 0, size = 0;
    for (size_t i = 0; i < modes->count; i++) {
        const long double term = (long double)a[i] * b[i];
        sum += term;
        size += fabsl(term);
    }
    return fabsl(sum) <= 4 * DBL_EPSILON * size ? 0 : (double)sum;
}

static void make_damper(Frame *frame, size_t d) {
    const Plan *plan = frame->plan;
    const size_t n = frame->mode_count, storeys = frame->storey_count;
    FrameDamper *damper = &frame->damper[d];
    const PlanDamper *planned = &plan->dampers[d];
    *damper = (FrameDamper){.plan = planned,
                            .shape = frame->shapes + d * frame->padded,
                            .lean = plan->influence[planned->storey] - 1 -
                                    (frame->unmoved != NULL ? frame->unmoved[planned->storey] : 0),
                            .phase = FRAME_FLIGHT,
                            .origin = FRAME_FROM_MIDDLE,
                            .r = planned->position,
                            .w = planned->velocity};
    memcpy(frame->shapes + d * frame->padded, frame->modes->shapes + planned->storey * n,
           n * sizeof *frame->shapes);
    for (size_t j = 0; j < storeys; j++) {
        frame->mobility[d * storeys + j] = mobility(frame->modes, planned->storey, j);
        damper->thrust = fmax(damper->thrust, fabs(frame->mobility[d * storeys + j]));
    }
    for (size_t e = 0; e < frame->dampers; e++)
        frame->yield[d * frame->dampers + e] =
            mobility(frame->modes, planned->storey, plan->dampers[e].storey) +
            (d == e ? 1 / planned->mass : 0);
    damper->effective_mass = 1 / frame->yield[d * frame->dampers + d];
    double stiff = 0, size = 0;
    for (size_t i = 0; i < n; i++) {
        frame->carry[i] += planned->mass * damper->shape[i];
        stiff += damper->shape[i] * damper->shape[i] * frame->omega2[i];
        size += damper->shape[i] * damper->shape[i];
    }
    damper->reach = sqrt(stiff) + sqrt(size) * frame->viscous;
}

// How fast energy may grow by what of D gives it, though D should only take: of D's symmetric part,
// `even_part`.
static double find_growth(const double *even_part, size_t n) {
    double lowest = 0, largest = 0;
    for (size_t i = 0; i < n; i++) {
        const double own = even_part[i * n + i];
        double others = 0;
        for (size_t j = 0; j < n; j++)
            others += j == i ? 0 : fabs(even_part[i * n + j]);
        lowest = fmin(lowest, own - others); // Gershgorin
        largest = fmax(largest, own);
    }
    // D takes energy, or nearly: scaled to a unit diagonal, D + NEARLY I is positive definite.
    return linear_find_indefinite(n, even_part, NEARLY) == 0 ? NEARLY * largest : -lowest;
}

// D, which need not be symmetric, its norm and how far it is from only taking energy.
static Status make_damping(Frame *frame) {
    const size_t n = frame->mode_count;
    const double *damping = frame->damping = frame->modes->damping;
    double *even_part = calloc(n * n, sizeof *even_part);
    if (even_part == NULL)
        return STATUS_NO_MEMORY;
    double rows = 0, columns = 0, squares = 0;
    for (size_t i = 0; i < n; i++) {
        double row = 0, column = 0;
        for (size_t j = 0; j < n; j++) {
            const double here = damping[i * n + j], there = damping[j * n + i];
            row += fabs(here);
            column += fabs(there);
            squares += here * here;
            even_part[i * n + j] = (here + there) / 2;
        }
        rows = fmax(rows, row);
        columns = fmax(columns, column);
        frame->diagonal[i] = damping[i * n + i];
    }
    frame->viscous = fmin(sqrt(rows * columns), sqrt(squares));
    frame->growth = find_growth(even_part, n);
    free(even_part);
    if (frame->modes->is_classical)
        return STATUS_OK;
    frame->diagonal = NULL;
    frame->coupled = calloc(frame_even(n) * frame->padded, sizeof *frame->coupled);
    if (frame->coupled == NULL)
        return STATUS_NO_MEMORY;
    for (size_t i = 0; i < n; i++)
        for (size_t j = 0; j < n; j++)
            frame->coupled[j * frame->padded + i] = damping[i * n + j];
    return STATUS_OK;
}

// q = shapes' M x: the modes are normal. `carried` is scratch.
static void make_modal(const Frame *frame, const double *values, long double *carried,
                       double *modal) {
    const size_t n = frame->mode_count, storeys = frame->storey_count;
    for (size_t j = 0; j < storeys; j++) {
        carried[j] = 0;
        for (size_t k = 0; k < storeys; k++)
            carried[j] += (long double)frame->plan->mass[j * storeys + k] * values[k];
    }
    for (size_t i = 0; i < n; i++) {
        long double sum = 0;
        for (size_t j = 0; j < storeys; j++)
            sum += frame->modes->shapes[j * n + i] * carried[j];
        modal[i] = (double)sum;
    }
}

static Status make_room(Frame *frame) {
    const size_t n = frame->padded, m = frame->dampers;
    double **const arrays[] = {&frame->omega2, &frame->diagonal, &frame->carry,   &frame->share,
                               &frame->q,      &frame->p,        &frame->elastic, &frame->widest,
                               &frame->shapes, &frame->spread,   &frame->seen,    &frame->mobility,
                               &frame->yield,  &frame->hold,     &frame->scratch, &frame->unmoved};
    const size_t tall = frame->tall, all = frame_even(frame->slot_count) * tall;
    const size_t sizes[] = {
        n, n, n, n, n, n, n, n, m * n, all, FRAME_FOUR * tall, m * tall, m * m, m * m, m * m, tall,
    };
    size_t total = frame_lanes_room(0);
    for (size_t i = 0; i < COUNT(sizes); i++)
        total += sizes[i];
    frame->block = calloc(total, sizeof *frame->block);
    frame->damper = calloc(m > 0 ? m : 1, sizeof *frame->damper);
    if (frame->block == NULL || frame->damper == NULL)
        return STATUS_NO_MEMORY;
    double *at = frame_lanes_start(frame->block);
    for (size_t i = 0; i < COUNT(sizes); i++) {
        *arrays[i] = at;
        at += sizes[i];
    }
    return STATUS_OK;
}

// What the base does to storeys through modes that are left out; 0 where it is no more than
// rounding.
static void make_unmoved(Frame *frame) {
    const size_t n = frame->mode_count;
    double most = 0;
    for (size_t j = 0; j < frame->storey_count; j++) {
        const double own = frame->plan->influence[j];
        long double sum = own, size = fabs(own);
        for (size_t i = 0; i < n; i++) {
            const long double term =
                (long double)frame->modes->shapes[j * n + i] * frame->modes->participation[i];
            sum -= term;
            size += fabsl(term);
        }
        frame->unmoved[j] = fabsl(sum) <= 8 * DBL_EPSILON * size ? 0 : (double)sum;
        frame->spread[n * frame->tall + j] = -frame->unmoved[j];
        most = fmax(most, fabs(frame->unmoved[j]));
    }
    frame->widest[n] = most;
}

// Shapes and what is made of them.
static void make_modes(Frame *frame) {
    const size_t n = frame->mode_count;
    const Modes *modes = frame->modes;
    for (size_t i = 0; i < n; i++) {
        frame->omega2[i] = modes->omega[i] * modes->omega[i];
        frame->stiff = fmax(frame->stiff, frame->omega2[i]);
        frame->share[i] = frame->carry[i] = modes->participation[i];
        for (size_t j = 0; j < frame->storey_count; j++) {
            const double shape = modes->shapes[j * n + i];
            frame->widest[i] = fmax(frame->widest[i], fabs(shape));
            frame->spread[i * frame->tall + j] = shape;
        }
    }
    if (frame->slot_count > n)
        make_unmoved(frame);
    else
        frame->unmoved = NULL;
}

static void frame_of(Frame *frame, Run *run, Problem *problem) {
    const Plan *plan = run->plan;
    memset(frame, 0, sizeof *frame);
    frame->run = run;
    frame->has_stops = run->plan->damper_count > 0 && !run->is_clear;
    frame->plan = plan;
    frame->problem = problem;
    frame->modes = plan->modes.count == 0 ? &frame->own_modes : &plan->modes;
    frame->lanes = &frame_lanes_kinds[frame_lanes_widest()];
    frame->dampers = plan->damper_count;
    frame->interval = 1 / plan->sample_rate;
    frame->storey_count = plan->storeys;
    frame->tall = frame_lanes_padded(plan->storeys);
    frame->mode_count = plan->modes.count == 0 ? plan->storeys : plan->modes.count;
    frame->slot_count = frame->mode_count + plan->is_truncated;
    frame->padded = frame_lanes_padded(frame->slot_count);
}

Status frame_make(Frame *frame, Run *run, Problem *problem) {
    const Plan *plan = run->plan;
    const size_t n = plan->storeys;
    frame_of(frame, run, problem);
    if (plan->modes.count == 0)
        TRY(modes_make(&frame->own_modes, n, plan->mass, plan->stiffness, plan->damping,
                       plan->influence, problem));
    if (make_room(frame) != STATUS_OK || make_damping(frame) != STATUS_OK)
        return problem_set(problem, STATUS_NO_MEMORY, "no memory for a run of %zu storeys", n);
    make_modes(frame);
    frame->drive = sqrt(
        frame_dot(frame->modes->participation, frame->modes->participation, frame->mode_count));
    frame->rate = fmax(fmax(sqrt(frame->stiff), frame->viscous), 1e-300);
    // A pulse that is over sooner is flown through by arcs alone.
    frame->turning = run->base->omega * frame->interval <= 4 || run->base->form == BASE_SINE
                         ? run->base->omega
                         : 0;
    const long double turn = (long double)frame->turning * frame->interval;
    frame->turned[0] = (double)cosl(turn);
    frame->turned[1] = (double)sinl(turn);
    bool is_sound = isfinite(frame->rate) && isfinite(run->base->omega);
    for (size_t d = 0; d < frame->dampers; d++) {
        make_damper(frame, d);
        const double m = frame->damper[d].effective_mass;
        is_sound = is_sound && m > 0 && isfinite(m);
    }
    if (!is_sound)
        return problem_set(
            problem, STATUS_UNSTABLE,
            "the scene's masses and stiffnesses are too far apart for double precision");
    long double *carried = malloc(n * sizeof *carried);
    if (carried == NULL)
        return problem_set(problem, STATUS_NO_MEMORY, "no memory for a run of %zu storeys", n);
    make_modal(frame, plan->displacement, carried, frame->q);
    make_modal(frame, plan->velocity, carried, frame->p);
    free(carried);
    base_cursor_make(&frame->base, run->base, plan->sample_rate);
    frame->ground = base_cursor_at(&frame->base, 0);
    return STATUS_OK;
}

void frame_clear(Frame *frame) {
    modes_clear(&frame->own_modes);
    free(frame->damper);
    free(frame->coupled);
    free(frame->block);
}
