// The classical Runge-Kutta method of order 4. The contact force is looked up wherever a range
// lies, so that it serves every law that has one; where a contact begins or ends inside a step the
// force jumps or bends between the stages, and the order is the first.
#include <stdlib.h>

#include "core/plan/plan.h"
#include "core/solve/steps_run.h"

enum { STAGES = 4, TOTALS = 2 };

typedef struct Rk4 {
    double *at;     // a range's state
    double *slopes; // of all stages, each with its powers behind it
    double *force;
    size_t row; // from one range's slopes to the next
} Rk4;

static Status rk4_make(Steps *steps) {
    const size_t size = steps->size, m = steps->state.dampers;
    Rk4 *own = malloc(sizeof *own);
    steps->own = own;
    if (own == NULL)
        return problem_set(steps->state.problem, STATUS_NO_MEMORY, "no memory for a run");
    own->row = size + TOTALS + 2 * m;
    own->at = calloc(size + STAGES * own->row + m, sizeof *own->at);
    if (own->at == NULL)
        return problem_set(steps->state.problem, STATUS_NO_MEMORY, "no memory for a run");
    own->slopes = own->at + size;
    own->force = own->slopes + STAGES * own->row;
    return STATUS_OK;
}

static void rk4_clear(Steps *steps) {
    Rk4 *own = steps->own;
    if (own != NULL)
        free(own->at);
    free(own);
    steps->own = NULL;
}

// N at r and r'. A mass that flies when the step begins meets its stop with the speed `approach`.
static double feel(const Steps *steps, size_t d, double r, double w, double approach) {
    const ModalState *state = &steps->state;
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
            return 0; // through all the clearance: the next step sees to it
        damper->side = side;
        damper->contact = stops_freeze(&damper->plan->stops[side], approach);
    }
    const double force = steps_contact(state, d, sign * p, w).value;
    return state->plan->separation == SEPARATION_ZERO_FORCE && sign * force < 0 ? 0 : force;
}

static void slope(Steps *steps, const double *y, double ground, double *restrict out) {
    const Rk4 *own = steps->own;
    const ModalState *state = &steps->state;
    const size_t n = state->mode_count, m = state->dampers;
    const double *p = y + n, *r = y + 2 * n, *w = r + m, *approach = steps->y + 2 * n + m;
    double *totals = out + steps->size, momentum = modal_state_dot(state->momentum_weights, p, n),
           loss = 0;
    for (size_t d = 0; d < m; d++) {
        own->force[d] = feel(steps, d, r[d], w[d], approach[d] < 0 ? -approach[d] : approach[d]);
        momentum += state->damper[d].plan->mass * w[d];
        totals[TOTALS + d] = own->force[d];
        totals[TOTALS + m + d] = own->force[d] * w[d];
    }
    steps_rate(steps, y, ground, own->force, out);
    for (size_t i = 0; i < n; i++)
        loss += (steps->elastic[i] - state->omega2[i] * y[i]) * p[i];
    totals[0] = -ground * momentum;
    totals[1] = loss;
}

static Status rk4_step(Steps *steps, double length) {
    static const double nodes[STAGES] = {0, 0.5, 0.5, 1};
    const Rk4 *own = steps->own;
    const size_t size = steps->size, row = own->row, n = steps->state.mode_count,
                 m = steps->state.dampers;
    for (size_t k = 0; k < STAGES; k++) {
        const double *last = own->slopes + (k - 1) * row, part = nodes[k] * length;
        for (size_t i = 0; i < size; i++)
            own->at[i] = k == 0 ? steps->y[i] : steps->y[i] + part * last[i];
        slope(steps, own->at, steps->ground[(k + 1) / 2], own->slopes + k * row);
    }
    const double *const s = own->slopes, sixth = length / 6;
    const double *const totals = s + size;
#define MEAN(a, i)                                                                                 \
    (sixth * ((a)[i] + 2 * ((a)[row + (i)] + (a)[2 * row + (i)]) + (a)[3 * row + (i)]))
    steps->sums.input = MEAN(totals, 0);
    steps->sums.damping = MEAN(totals, 1);
    for (size_t d = 0; d < m; d++) {
        steps->sums.impulse[d] = MEAN(totals, TOTALS + d);
        steps->sums.work[d] = MEAN(totals, TOTALS + m + d);
        const double w = steps->y[2 * n + m + d], approach = w < 0 ? -w : w;
        // Where the step ends may be deeper than any range.
        (void)feel(steps, d, steps->y[2 * n + d] + MEAN(s, 2 * n + d), w, approach);
    }
    for (size_t i = 0; i < size; i++)
        steps->y[i] += MEAN(s, i);
#undef MEAN
    return STATUS_OK;
}

static double rk4_cost(size_t modes, size_t dampers, bool is_coupled, double *making) {
    const double n = (double)modes, m = (double)dampers;
    *making = 0;
    return 4 + 0.15 * n * (1 + m) + (is_coupled ? 0.02 : 0.008) * n * n;
}

static const Stepper stepper = {.name = "rk4",
                                .between = "it is of order 4",
                                .order = 4,
                                .is_by_place = true,
                                .stability_limit = 2.785,
                                .make = rk4_make,
                                .step = rk4_step,
                                .clear = rk4_clear,
                                .cost = rk4_cost};

static Status run_all(Run *run, Response *response, Problem *problem) {
    return steps_run(run, &stepper, response, problem);
}

static Status decide(const Accuracy *accuracy, double base_interval, Plan *plan, Problem *problem) {
    return steps_decide(accuracy, &stepper, base_interval, plan, problem);
}

static double cost(const Accuracy *accuracy, double base_interval, const Plan *plan) {
    return steps_cost(accuracy, &stepper, base_interval, plan);
}

const Solver solver_rk4 = {
    .kind = {"rk4", "the classical Runge-Kutta method of order 4, contacts switched at step ends",
             accuracy_step_fields, sizeof(AccuracyStep)},
    .run = run_all,
    .decide = decide,
    .cost = cost,
};
