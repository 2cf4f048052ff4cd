// The classical Runge-Kutta method of order 4. Each stage derives the contact force from the
// penetration there, which serves every contact law with a force. Where a contact begins or ends
// inside a step, the force jumps or bends between the stages and the order drops to one.
#include <math.h>

#include "core/plan/plan.h"
#include "core/solve/time_stepping.h"

enum { STAGES = 4 };

// `method` is the state at a stage, then y' and the rates of the integrals at all stages.
static Status rk4_make(TimeStepping *stepping) {
    return time_stepping_make_method(stepping,
                                     (stepping->size + STAGES * stepping->row) * sizeof(double));
}

// N at r and r'. A mass in flight meets its stop with the speed of the step's start.
static double rk4_force(const TimeStepping *stepping, size_t d, double r, double w) {
    const ModalState *state = &stepping->state;
    DamperState *damper = &state->damper[d];
    if (state->plan->form == CONTACT_IMPULSIVE)
        return 0;
    const double right = r - modal_state_room(damper, SIDE_RIGHT);
    const double left = -r - modal_state_room(damper, SIDE_LEFT);
    const Side side = right > left ? SIDE_RIGHT : SIDE_LEFT;
    const double sign = modal_state_sign(side), p = side == SIDE_RIGHT ? right : left;
    if (!(p > 0))
        return 0;
    if (damper->phase == PHASE_FLIGHT || damper->side != side) {
        if (damper->phase != PHASE_FLIGHT)
            return 0; // it crossed all the clearance: the next step begins that contact
        damper->side = side;
        damper->contact = stops_freeze(&damper->plan->stops[side], fabs(damper->w));
    }
    const double force = step_contact_force(state, d, sign * p, w).value;
    return state->plan->separation == SEPARATION_ZERO_FORCE && sign * force < 0 ? 0 : force;
}

// The step times the stages' weighted mean of a slope; `sixth` is a sixth of the step.
static double rk4_gain(const double *slope, size_t row, double sixth) {
    return sixth * (slope[0] + 2 * (slope[row] + slope[2 * row]) + slope[3 * row]);
}

static Status rk4_step(TimeStepping *stepping, double length) {
    static const double nodes[STAGES] = {0, 0.5, 0.5, 1};
    const size_t n = stepping->state.mode_count, m = stepping->state.dampers, row = stepping->row;
    double *y = stepping->y, *w = y + 2 * n + m;
    double *stage = stepping->method, *slopes = stage + stepping->size;
    for (size_t k = 0; k < STAGES; k++) {
        const double *last = slopes + (k > 0 ? k - 1 : 0) * row;
        const double part = nodes[k] * length;
        for (size_t i = 0; i < stepping->size; i++)
            stage[i] = k == 0 ? y[i] : y[i] + part * last[i];
        for (size_t d = 0; d < m; d++)
            stepping->force[d] = rk4_force(stepping, d, stage[2 * n + d], stage[2 * n + m + d]);
        time_stepping_rate(stepping, stage, stepping->ground[(k + 1) / 2], slopes + k * row);
    }
    const double sixth = length / 6;
    for (size_t i = stepping->size; i < row; i++)
        stepping->integrals[i - stepping->size] = rk4_gain(slopes + i, row, sixth);
    // The step's end may be the first point inside a stop: this freezes the parameters there.
    for (size_t i = 2 * n; i < 2 * n + m; i++)
        (void)rk4_force(stepping, i - 2 * n, y[i] + rk4_gain(slopes + i, row, sixth), w[i - 2 * n]);
    for (size_t i = 0; i < stepping->size; i++)
        y[i] += rk4_gain(slopes + i, row, sixth);
    return STATUS_OK;
}

static double rk4_step_cost(size_t modes, size_t dampers, bool is_coupled, double *setup) {
    const double n = (double)modes, m = (double)dampers;
    *setup = 0;
    return 4 + 0.15 * n * (1 + m) + (is_coupled ? 0.02 : 0.008) * n * n;
}

static const Stepper rk4_stepper = {.order = 4,
                                    .between = "it is of order 4",
                                    .is_by_place = true,
                                    .stability_limit = 2.785,
                                    .make = rk4_make,
                                    .step = rk4_step,
                                    .cost = rk4_step_cost};

const Solver solver_rk4 = {
    .kind = {"rk4", "the classical Runge-Kutta method of order 4, contacts switched at step ends",
             accuracy_step_fields, sizeof(AccuracyStep)},
    .run = time_stepping_run,
    .decide = time_stepping_decide,
    .cost = time_stepping_cost,
    .stepper = &rk4_stepper,
};
