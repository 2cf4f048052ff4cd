// Without contact a free mass feels the base alone: z'' = -a_g in coordinates of the base. It stays
// clear of its stops where
//
//   max |z - middle| + max |x_j| < d / 2,
//
// because the first contact would end the motion without contact. z is two integrals of a_g. Of the
// structure without coupled damping
//
//   |x_j| <= sum over k of |phi_jk| (sqrt(q^2 + (q'/omega)^2) at 0 + |Gamma_k| forced_k),
//   forced_k = min(max|a_g| integral |h_k|, max|h_k| integral |a_g|),
//
// h being the response to a unit impulse: |h| <= min(T, 1/omega, 1/D), and its integral is at most
// coth(pi xi / (2 sqrt(1 - xi^2))) / omega^2, 1 / omega^2 from xi = 1 on. With coupled damping
// V = sqrt(q'q' + q W^2 q) grows by no more than |Gamma| |a_g| in unit time.
#include "core/plan/reachability.h"

#include <math.h>
#include <stdlib.h>

static const double PI = 3.14159265358979323846;
static const double MARGIN = 1e-6; // of the way to a stop, for roundings here and in the run

// Of the base over the run: |a_g| at most [m/s^2]; integral of |a_g| at most [m/s].
typedef struct BaseBounds {
    double max, integral;
} BaseBounds;

static BaseBounds reach_base_bounds(const Base *base, double duration) {
    BaseBounds bounds = {0};
    if (base->form == BASE_SINE)
        bounds = (BaseBounds){fabs(base->amplitude), fabs(base->amplitude) * duration};
    for (size_t i = 0; i < base->count && base->form == BASE_SAMPLED &&
                       ((double)i - 1) * base->interval < duration;
         i++) {
        const double size = fabs(base->values[i]);
        bounds.max = size > bounds.max ? size : bounds.max;
        bounds.integral += size * base->interval;
    }
    for (size_t i = 0; i < base->piece_count && base->form == BASE_PIECES; i++) {
        const BasePiece *piece = &base->pieces[i];
        const double end = i + 1 < base->piece_count ? base->pieces[i + 1].time : duration;
        const double length = fmax(fmin(end, duration) - piece->time, 0);
        const double size =
            base->omega > 0 ? hypot(piece->value, piece->slope)
                            : fmax(fabs(piece->value), fabs(piece->value + piece->slope * length));
        bounds.max = fmax(bounds.max, length > 0 ? size : 0);
        bounds.integral += length > 0 ? size * length : 0;
    }
    return bounds;
}

// |q| at most, of a mode with this start and participation.
static double reach_of_mode(double omega, double damping, double share, double q, double p,
                            const BaseBounds *base, double duration) {
    const double xi = damping / (2 * omega); // NAN or infinite for a rigid-body motion
    const double highest = fmin(duration, fmin(1 / omega, damping > 0 ? 1 / damping : INFINITY));
    double area = duration * fmin(duration / 2, highest);
    if (omega > 0 && xi > 0)
        area = fmin(area,
                    1 / (omega * omega * (xi < 1 ? tanh(PI * xi / (2 * sqrt(1 - xi * xi))) : 1)));
    const double free =
        fmin(fabs(q) + fabs(p) * highest, omega > 0 ? hypot(q, p / omega) : INFINITY);
    const double forced = fmin(base->max * area, base->integral * highest);
    return free + (share != 0 && base->max > 0 ? fabs(share) * forced : 0);
}

// |x| of a storey at most.
static double reach_of_storey(const Plan *plan, size_t storey, const BaseBounds *base) {
    const Modes *modes = &plan->modes;
    const size_t n = plan->storeys, count = modes->count;
    const double duration = plan->duration;
    if (count == 0) // one storey that moves with the base
        return reach_of_mode(sqrt(plan->stiffness[0] / plan->mass[0]),
                             plan->damping[0] / plan->mass[0], plan->influence[0],
                             plan->displacement[0], plan->velocity[0], base, duration);
    double reach = 0, squares = 0, shares = 0, compliance = 0, rigid = 0, start = 0;
    for (size_t k = 0; k < count; k++) {
        const double omega = modes->omega[k], share = modes->participation[k];
        const double shape = fabs(modes->shapes[storey * count + k]);
        double q = 0, p = 0;
        for (size_t j = 0; j < n; j++)
            for (size_t i = 0; i < n && (plan->displacement[j] != 0 || plan->velocity[j] != 0);
                 i++) {
                const double moved = modes->shapes[i * count + k] * plan->mass[i * n + j];
                q += moved * plan->displacement[j];
                p += moved * plan->velocity[j];
            }
        reach += shape *
                 reach_of_mode(omega, modes->damping[k * count + k], share, q, p, base, duration);
        squares += p * p + omega * q * (omega * q);
        shares += share * share;
        compliance += omega > 0 ? shape / omega * (shape / omega) : 0;
        rigid += omega > 0 ? 0 : shape;
        start += omega > 0 ? 0 : shape * fabs(q);
    }
    const double speed = sqrt(squares) + sqrt(shares) * base->integral;
    return modes->is_classical ? reach
                               : sqrt(compliance) * speed + start + rigid * duration * speed;
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
    if (base->form != BASE_SAMPLED) {
        const BaseBounds bounds = reach_base_bounds(base, T);
        return fmax(fabs(z), fabs(z + speed * T)) +
               fmin(bounds.max * T * T / 2, bounds.integral * T);
    }
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

// The largest way of a mass, as a part of the way to its stops; INFINITY: 1 or more, or unknown.
static double reach_of_plan(const Plan *plan, const Base *base) {
    double reach = 0;
    for (size_t d = 0; d < plan->damper_count; d++) {
        const PlanDamper *damper = &plan->dampers[d];
        const double half = damper->clearance / 2;
        const double mass = reach_of_mass(plan, damper, base, half);
        if (!(mass < half)) // also where it is no number
            return INFINITY;
        const BaseBounds bounds = reach_base_bounds(base, plan->duration);
        const double own = (mass + reach_of_storey(plan, damper->storey, &bounds)) / half;
        if (!(own < 1))
            return INFINITY;
        reach = fmax(reach, own);
    }
    return reach;
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
    Regime regime = {.is_unforced = base->form == BASE_STILL, .reach = reach_of_plan(plan, base)};
    regime.is_clear = regime.reach < 1 - MARGIN;
    regime.is_at_rest = regime.is_clear && regime.is_unforced && reach_starts_at_rest(plan);
    return regime;
}
