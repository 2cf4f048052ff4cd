// Without contact a free mass feels the base alone: z'' = -a_g in coordinates of the base. It stays
// clear of its stops where
//
//   max |z - middle| + max |x_j| < d / 2,
//
// because the first contact would end the motion without contact. z is two integrals of a_g. With
// any damping V = sqrt(q'q' + q W^2 q) of the structure grows by no more than |Gamma| |a_g| in unit
// time, so that
//
//   |x_j| <= sqrt(sum over k of (phi_jk / omega_k)^2) (V(0) + |Gamma| integral |a_g|).
#include "core/plan/plan.h"

#include <math.h>
#include <stdlib.h>

static const double MARGIN = 1e-6; // of the way to a stop, for roundings here and in the run

// The integral of |a_g| over the run at most [m/s].
static double reach_base_integral(const Base *base, double duration) {
    double integral = base->form == BASE_SINE ? fabs(base->amplitude) * duration : 0;
    for (size_t i = 0; i < base->count && base->form == BASE_SAMPLED &&
                       ((double)i - 1) * base->interval < duration;
         i++)
        integral += fabs(base->values[i]) * base->interval;
    for (size_t i = 0; i < base->piece_count && base->form == BASE_PIECES; i++) {
        const BasePiece *piece = &base->pieces[i];
        const double end = i + 1 < base->piece_count ? base->pieces[i + 1].time : duration;
        const double length = fmax(fmin(end, duration) - piece->time, 0);
        const double size =
            base->omega > 0 ? hypot(piece->value, piece->slope)
                            : fmax(fabs(piece->value), fabs(piece->value + piece->slope * length));
        integral += length > 0 ? size * length : 0;
    }
    return integral;
}

// |x| of a storey at most.
static double reach_of_storey(const Plan *plan, size_t storey, const Base *base) {
    const double base_integral = reach_base_integral(base, plan->duration);
    const Modes *modes = &plan->modes;
    const size_t n = plan->storeys, count = modes->count;
    if (count == 0) { // one storey that moves with the base
        const double omega = sqrt(plan->stiffness[0] / plan->mass[0]);
        const double q = plan->displacement[0], speed = fabs(plan->velocity[0]) + base_integral;
        return omega > 0 ? hypot(q, plan->velocity[0] / omega) + base_integral / omega
                         : fabs(q) + speed * plan->duration;
    }
    double squares = 0, shares = 0, compliance = 0, rigid = 0, start = 0;
    double *q = calloc(count, 2 * sizeof *q), *p = q + count;
    if (q == NULL)
        return INFINITY; // not known to be clear
    modes_coordinates(modes, n, plan->mass, plan->displacement, q);
    modes_coordinates(modes, n, plan->mass, plan->velocity, p);
    for (size_t k = 0; k < count; k++) {
        const double omega = modes->omega[k], share = modes->participation[k];
        const double shape = fabs(modes->shapes[storey * count + k]);
        squares += p[k] * p[k] + omega * q[k] * (omega * q[k]);
        shares += share * share;
        compliance += omega > 0 ? shape / omega * (shape / omega) : 0;
        rigid += omega > 0 ? 0 : shape;
        start += omega > 0 ? 0 : shape * fabs(q[k]);
    }
    free(q);
    const double speed = sqrt(squares) + sqrt(shares) * base_integral;
    return sqrt(compliance) * speed + start + rigid * plan->duration * speed;
}

// |z - middle| of a free mass at most; ends where a mass of a sampled base is known to be beyond
// `most`.
static double reach_of_mass(const Plan *plan, const PlanDamper *damper, const Base *base,
                            double most) {
    const double T = plan->duration, W = base->omega, h = base->interval;
    double z = plan->displacement[damper->storey] + damper->position;
    double speed = plan->velocity[damper->storey] + damper->velocity;
    if (base->form == BASE_SINE && W > 0) { // z + (speed - A / W) t + A / W^2 sin(W t)
        const double even = speed - base->amplitude / W;
        return fmax(fabs(z), fabs(z + even * T)) + fabs(base->amplitude) / W / W;
    }
    if (base->form != BASE_SAMPLED)
        return fmax(fabs(z), fabs(z + speed * T)) + reach_base_integral(base, T) * T;
    double furthest = fabs(z), bend = 0;
    size_t i = 0;
    for (; i + 1 < base->count && (double)i * h < T && furthest <= most; i++) {
        const double a = base->values[i], b = base->values[i + 1];
        z += h * speed - h * h * (a / 3 + b / 6);
        speed -= h * (a + b) / 2;
        furthest = fabs(z) > furthest ? fabs(z) : furthest;
        bend = fabs(a) > bend ? fabs(a) : bend;
        bend = fabs(b) > bend ? fabs(b) : bend;
    }
    // Between two samples it is within h^2 max|a_g| / 8 of their chord; after the last one it
    // moves on evenly.
    const double rest = fmax(T - (double)i * h, 0);
    return fmax(furthest, fabs(z + speed * rest)) + bend * h * h / 8;
}

static bool reach_starts_at_rest(const Plan *plan) {
    bool is_at_rest = true;
    for (size_t i = 0; i < plan->storeys; i++)
        is_at_rest = is_at_rest && plan->displacement[i] == 0 && plan->velocity[i] == 0;
    for (size_t d = 0; d < plan->damper_count; d++)
        is_at_rest = is_at_rest && plan->dampers[d].velocity == 0;
    return is_at_rest;
}

Regime regime_find(const Plan *plan, const Base *base) {
    Regime regime = {.is_unforced = base->form == BASE_STILL};
    for (size_t d = 0; d < plan->damper_count && regime.reach < INFINITY; d++) {
        const PlanDamper *damper = &plan->dampers[d];
        const double half = damper->clearance / 2;
        double reach = reach_of_mass(plan, damper, base, half) / half;
        if (reach < 1)
            reach += reach_of_storey(plan, damper->storey, base) / half;
        regime.reach = reach < 1 ? fmax(regime.reach, reach) : INFINITY; // also if no number
    }
    regime.is_clear = regime.reach < 1 - MARGIN;
    regime.is_at_rest = regime.is_clear && regime.is_unforced && reach_starts_at_rest(plan);
    return regime;
}
