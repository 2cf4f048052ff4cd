// The classical Runge-Kutta method of order 4. Each stage derives the contact force from the
// penetration there, which serves every contact law with a force. Where a contact begins or ends
// inside a step, the force jumps or bends between the stages and the order drops to one.
#include <stdlib.h>

#include "core/plan/plan.h"
#include "core/solve/time_stepping.h"

enum { STAGES = 4 };

typedef struct Rk4 {
    double *stage;  // the state at a stage
    double *slopes; // of all stages: y' and the rates of the energy integrals
    double *force;
    size_t row; // from one stage's slopes to the next
    double values[];
} Rk4;

static Status rk4_make(TimeStepping *stepping) {
    const size_t size = stepping->size, m = stepping->state.dampers, row = size + 2 * m + 2;
    Rk4 *rk4 = calloc(1, sizeof *rk4 + (size + STAGES * row + m) * sizeof *rk4->values);
    if (rk4 == NULL)
        return problem_set(stepping->state.problem, STATUS_NO_MEMORY, "no memory for a run");
    rk4->row = row;
    rk4->stage = rk4->values;
    rk4->slopes = rk4->stage + size;
    rk4->force = rk4->slopes + STAGES * row;
    stepping->method = rk4;
    return STATUS_OK;
}

// N at r and r'. A mass in flight at the step's start meets its stop with the speed `approach`.
static double rk4_force(const TimeStepping *stepping, size_t d, double r, double w,
                        double approach) {
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
        damper->contact = stops_freeze(&damper->plan->stops[side], approach);
    }
    const double force = step_contact_force(state, d, sign * p, w).value;
    return state->plan->separation == SEPARATION_ZERO_FORCE && sign * force < 0 ? 0 : force;
}

static void rk4_slope(TimeStepping *stepping, const double *y, double ground,
                      double *restrict out) {
    const Rk4 *rk4 = stepping->method;
    const size_t n = stepping->state.mode_count, m = stepping->state.dampers;
    const double *r = y + 2 * n, *w = r + m, *approach = stepping->y + 2 * n + m;
    for (size_t d = 0; d < m; d++)
        rk4->force[d] =
            rk4_force(stepping, d, r[d], w[d], approach[d] < 0 ? -approach[d] : approach[d]);
    time_stepping_rate(stepping, y, ground, rk4->force, out);
    time_stepping_powers(stepping, y, ground, rk4->force, out + stepping->size);
}

// The step times the stages' weighted mean of slope i; `sixth` is a sixth of the step.
static double rk4_gain(const Rk4 *rk4, size_t i, double sixth) {
    const double *s = rk4->slopes + i;
    const size_t row = rk4->row;
    return sixth * (s[0] + 2 * (s[row] + s[2 * row]) + s[3 * row]);
}

static Status rk4_step(TimeStepping *stepping, double length) {
    static const double nodes[STAGES] = {0, 0.5, 0.5, 1};
    const Rk4 *rk4 = stepping->method;
    const size_t size = stepping->size, n = stepping->state.mode_count, m = stepping->state.dampers;
    for (size_t k = 0; k < STAGES; k++) {
        const double *last = rk4->slopes + (k > 0 ? k - 1 : 0) * rk4->row;
        const double part = nodes[k] * length;
        for (size_t i = 0; i < size; i++)
            rk4->stage[i] = k == 0 ? stepping->y[i] : stepping->y[i] + part * last[i];
        rk4_slope(stepping, rk4->stage, stepping->ground[(k + 1) / 2], rk4->slopes + k * rk4->row);
    }
    const double sixth = length / 6;
    stepping->input = rk4_gain(rk4, size + 2 * m, sixth);
    stepping->damping = rk4_gain(rk4, size + 2 * m + 1, sixth);
    for (size_t d = 0; d < m; d++) {
        stepping->contact.impulse[d] = rk4_gain(rk4, size + d, sixth);
        stepping->contact.work[d] = rk4_gain(rk4, size + m + d, sixth);
        const double w = stepping->y[2 * n + m + d], approach = w < 0 ? -w : w;
        // The step's end may be the first point inside a stop: this freezes the parameters there.
        (void)rk4_force(stepping, d, stepping->y[2 * n + d] + rk4_gain(rk4, 2 * n + d, sixth), w,
                        approach);
    }
    for (size_t i = 0; i < size; i++)
        stepping->y[i] += rk4_gain(rk4, i, sixth);
    return STATUS_OK;
}

static double rk4_step_cost(size_t modes, size_t dampers, bool is_coupled, double *setup) {
    const double n = (double)modes, m = (double)dampers;
    *setup = 0;
    return 4 + 0.15 * n * (1 + m) + (is_coupled ? 0.02 : 0.008) * n * n;
}

static const Stepper rk4_stepper = {.name = "rk4",
                                    .order = 4,
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
