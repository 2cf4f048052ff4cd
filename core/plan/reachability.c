// A free mass that meets no stop feels the base alone: in coordinates of the base z'' = -a_g. Its
// place between its stops is z - x_j less their middle, so it stays clear of them as long as
//
//   max |z - middle| + max |x_j| < d / 2,
//
// which is enough to be shown for the motion without any contact: the first contact would be part
// of it. z is known: two integrals of a_g. Of the structure, mode by mode,
//
//   |x_j| <= sum over k of |phi_jk| (free_k + forced_k),    free_k = sqrt(q^2 + (q'/omega)^2) at 0,
//   forced_k = |Gamma_k| min(max|a_g| integral |h_k|, max|h_k| integral |a_g|),
//
// and under a sine the steady oscillation and what it takes to begin as the scene does, where that
// is less. h is the response to a unit impulse: |h| <= min(t, 1/omega, 1/D), and its integral is at
// most 1/omega^2 for a mode that does not swing, coth(pi xi / (2 sqrt(1 - xi^2))) / omega^2 for one
// that does. Where damping couples the modes V = sqrt(q'q' + q W^2 q) grows by no more than
// |Gamma| |a_g| in unit time.
#include "core/plan/reachability.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#define PI 3.14159265358979323846264338328

// Of the way to a stop: what roundings, here and in the run, may not come to.
static const double MARGIN = 1e-6;

// What the base comes to over the run.
typedef struct Shaking {
    double most;     // |a_g| is not larger [m/s^2]
    double integral; // of |a_g|, at most [m/s]
    double omega;    // of a sine that lasts for all of the run, else 0 [rad/s]
} Shaking;

// One mode, or the structure of one storey.
typedef struct Mode {
    double omega, damping, share; // [rad/s], [1/s], Gamma
    double q, p;                  // at the start
} Mode;

static double larger(double a, double b) {
    return a > b ? a : b;
}

static Shaking sampled(const Base *base, double duration) {
    const double last = duration / base->interval;
    const size_t count = last + 2 < (double)base->count ? (size_t)last + 2 : base->count;
    double most[4] = {0}, sum[4] = {0};
    size_t i = 0;
    for (; i + 4 <= count; i += 4)
        for (size_t j = 0; j < 4; j++) {
            const double size = fabs(base->values[i + j]);
            most[j] = larger(size, most[j]);
            sum[j] += size;
        }
    for (; i < count; i++) {
        most[0] = larger(fabs(base->values[i]), most[0]);
        sum[0] += fabs(base->values[i]);
    }
    const double all = (sum[0] + sum[1]) + (sum[2] + sum[3]);
    return (Shaking){.most = larger(larger(most[0], most[1]), larger(most[2], most[3])),
                     .integral = all * base->interval};
}

static Shaking in_pieces(const Base *base, double duration) {
    Shaking shaking = {0};
    for (size_t i = 0; i < base->piece_count; i++) {
        const BasePiece *piece = &base->pieces[i];
        const double end = i + 1 < base->piece_count ? base->pieces[i + 1].time : duration;
        const double length = larger(fmin(end, duration) - piece->time, 0);
        const double size = base->omega > 0 ? fabs(piece->value) + fabs(piece->slope)
                                            : larger(fabs(piece->value),
                                                     fabs(piece->value + piece->slope * length));
        if (length == 0)
            continue;
        shaking.most = larger(shaking.most, size);
        shaking.integral += size * length;
    }
    return shaking;
}

static Shaking shake(const Base *base, double duration) {
    switch (base->form) {
    case BASE_STILL:
        break;
    case BASE_SAMPLED:
        return sampled(base, duration);
    case BASE_SINE:
        return (Shaking){fabs(base->amplitude), fabs(base->amplitude) * duration,
                         base->amplitude != 0 ? base->omega : 0};
    case BASE_PIECES:
        return in_pieces(base, duration);
    }
    return (Shaking){0};
}

// |h| is not larger.
static double highest(const Mode *mode, double duration) {
    double most = duration;
    if (mode->omega > 0)
        most = fmin(most, 1 / mode->omega);
    return mode->damping > 0 ? fmin(most, 1 / mode->damping) : most;
}

// |q| is not larger as it swings out from here.
static double swing(const Mode *mode, double q, double p, double duration) {
    const double simply = fabs(q) + fabs(p) * highest(mode, duration);
    return mode->omega > 0 ? fmin(hypot(q, p / mode->omega), simply) : simply;
}

// The integral of |h| over the run, at most.
static double response(const Mode *mode, double duration) {
    const double w = mode->omega, xi = w > 0 ? mode->damping / (2 * w) : 0;
    double all = INFINITY;
    if (w > 0 && xi >= 1)
        all = 1 / (w * w);
    else if (w > 0 && xi > 0)
        all = 1 / (w * w * tanh(PI * xi / (2 * sqrt(1 - xi * xi))));
    return fmin(all, fmin(duration * duration / 2, duration * highest(mode, duration)));
}

// Under a sine, whichever sign its amplitude has: a_g = A sin(W t) holds q at Q sin(W t) + R cos(W
// t).
static double sine_reach(const Mode *mode, const Shaking *shaking, double duration) {
    const double w = mode->omega, W = shaking->omega;
    const double stiff = w * w - W * W, loss = mode->damping * W, size = hypot(stiff, loss);
    if (!(W > 0) || !(size > 0))
        return INFINITY;
    const double steady = fabs(mode->share) * shaking->most / size;
    const double Q = -steady * stiff / size, R = steady * loss / size;
    return steady + larger(swing(mode, mode->q - R, mode->p - W * Q, duration),
                           swing(mode, mode->q + R, mode->p + W * Q, duration));
}

static double mode_reach(const Mode *mode, const Shaking *shaking, double duration) {
    const double free = swing(mode, mode->q, mode->p, duration);
    if (mode->share == 0 || shaking->most == 0)
        return free;
    const double forced =
        fmin(shaking->most * response(mode, duration), shaking->integral * highest(mode, duration));
    return fmin(free + fabs(mode->share) * forced, sine_reach(mode, shaking, duration));
}

static size_t mode_count(const Plan *plan) {
    return plan->modes.count > 0 ? plan->modes.count : 1;
}

static double shape_at(const Plan *plan, size_t storey, size_t k) {
    return plan->modes.count == 0 ? 1 : fabs(plan->modes.shapes[storey * plan->modes.count + k]);
}

static void move(const double *matrix, const double *x, size_t n, double *out) {
    for (size_t i = 0; i < n; i++) {
        out[i] = 0;
        for (size_t j = 0; j < n; j++)
            out[i] += matrix[i * n + j] * x[j];
    }
}

// Each mode with its start; `moved` has room for M x and M v.
static void make_modes(const Plan *plan, double *moved, Mode *at) {
    const Modes *modes = &plan->modes;
    const size_t n = plan->storeys;
    if (modes->count == 0) { // one storey that moves with the base
        at[0] = (Mode){sqrt(plan->stiffness[0] / plan->mass[0]), plan->damping[0] / plan->mass[0],
                       plan->influence[0], plan->displacement[0], plan->velocity[0]};
        return;
    }
    move(plan->mass, plan->displacement, n, moved);
    move(plan->mass, plan->velocity, n, moved + n);
    for (size_t k = 0; k < modes->count; k++) {
        at[k] = (Mode){modes->omega[k], modes->damping[k * modes->count + k],
                       modes->participation[k], 0, 0};
        for (size_t i = 0; i < n; i++) {
            at[k].q += modes->shapes[i * modes->count + k] * moved[i];
            at[k].p += modes->shapes[i * modes->count + k] * moved[n + i];
        }
    }
}

// Of each storey, |x| at most.
static void reach_by_modes(const Plan *plan, const Mode *modes, const Shaking *shaking,
                           double *reach) {
    for (size_t k = 0; k < mode_count(plan); k++) {
        const double most = mode_reach(&modes[k], shaking, plan->duration);
        for (size_t j = 0; j < plan->storeys; j++)
            reach[j] += shape_at(plan, j, k) * most;
    }
}

// The same where damping couples the modes.
static void reach_by_energy(const Plan *plan, const Mode *modes, const Shaking *shaking,
                            double *reach) {
    double squares = 0, shares = 0;
    for (size_t k = 0; k < mode_count(plan); k++) {
        const double strain = modes[k].omega * modes[k].q;
        squares += modes[k].p * modes[k].p + strain * strain;
        shares += modes[k].share * modes[k].share;
    }
    const double most = sqrt(squares) + sqrt(shares) * shaking->integral;
    for (size_t j = 0; j < plan->storeys; j++) {
        double yields = 0, loose = 0;
        for (size_t k = 0; k < mode_count(plan); k++) {
            const double shape = shape_at(plan, j, k), w = modes[k].omega;
            if (w > 0)
                yields += shape / w * (shape / w);
            else
                loose += shape * (fabs(modes[k].q) + plan->duration * most);
        }
        reach[j] = sqrt(yields) * most + loose;
    }
}

// How far |z - from| surely comes at most, z being `place` with `speed` at 0, under a base in
// closed form.
static double drift(const Base *base, const Shaking *shaking, double place, double speed,
                    double duration) {
    const double T = duration;
    const double pulled = fmin(shaking->most * T * T / 2, shaking->integral * T);
    const double simply = larger(fabs(place), fabs(place + speed * T)) + pulled;
    if (base->form != BASE_SINE || !(base->omega > 0))
        return simply;
    // z = place + (speed - A / W) t + A / W^2 sin(W t)
    const double W = base->omega, even = speed - base->amplitude / W;
    return fmin(simply,
                larger(fabs(place), fabs(place + even * T)) + fabs(base->amplitude) / W / W);
}

// The same under a base known by samples, step by step; ends as soon as it is more than `most`.
static double walk(const Base *base, double place, double speed, double duration, double most) {
    const double h = base->interval;
    double furthest = fabs(place), bend = 0;
    size_t i = 0;
    for (; i + 1 < base->count && (double)i * h < duration && furthest <= most; i++) {
        const double a = base->values[i], b = base->values[i + 1];
        place += h * speed - h * h * (a / 3 + b / 6);
        speed -= h * (a + b) / 2;
        furthest = larger(furthest, fabs(place));
        bend = larger(bend, larger(fabs(a), fabs(b)));
    }
    // And on evenly; between two samples it lies within h^2 max|a_g| / 8 of their chord.
    const double rest = duration - (double)i * h;
    if (rest > 0)
        furthest = larger(furthest, fabs(place + speed * rest));
    return furthest + bend * h * h / 8;
}

static bool starts_still(const Plan *plan) {
    bool is_still = true;
    for (size_t i = 0; i < plan->storeys; i++)
        is_still = is_still && plan->displacement[i] == 0 && plan->velocity[i] == 0;
    for (size_t d = 0; d < plan->damper_count; d++)
        is_still = is_still && plan->dampers[d].velocity == 0;
    return is_still;
}

// Of a mass counted from the middle of its stops.
static double mass_reach(const Plan *plan, const PlanDamper *damper, const Base *base,
                         const Shaking *shaking, const double *reach) {
    const size_t j = damper->storey;
    const double half = damper->clearance / 2;
    const double place = plan->displacement[j] + damper->position;
    const double speed = plan->velocity[j] + damper->velocity;
    const double structure = reach[j];
    if (!(structure < half)) // also where it is no number
        return INFINITY;
    const double mass = base->form == BASE_SAMPLED
                            ? walk(base, place, speed, plan->duration, half - structure)
                            : drift(base, shaking, place, speed, plan->duration);
    return (mass + structure) / half;
}

// A mass's own flight leaves its stops in most scenes before the structure has to be looked at.
static bool leaves_soon(const Plan *plan, const Base *base) {
    enum { LOOK = 4096 };
    for (size_t d = 0; d < plan->damper_count && base->form == BASE_SAMPLED; d++) {
        const PlanDamper *damper = &plan->dampers[d];
        const double place = plan->displacement[damper->storey] + damper->position;
        const double speed = plan->velocity[damper->storey] + damper->velocity;
        const double half = damper->clearance / 2;
        const double until = fmin(plan->duration, LOOK * base->interval);
        if (walk(base, place, speed, until, half) > half)
            return true;
    }
    return false;
}

// How near the masses come to their stops.
static double find_reach(const Plan *plan, const Base *base, const Shaking *shaking) {
    const size_t n = plan->storeys;
    double *block = calloc(3 * n, sizeof *block), most = 0;
    Mode *modes = calloc(mode_count(plan), sizeof *modes);
    if (block == NULL || modes == NULL) {
        most = INFINITY;
    } else {
        make_modes(plan, block + n, modes);
        if (n == 1 || plan->modes.is_classical)
            reach_by_modes(plan, modes, shaking, block);
        else
            reach_by_energy(plan, modes, shaking, block);
        for (size_t d = 0; d < plan->damper_count && most < 1; d++)
            most = larger(most, mass_reach(plan, &plan->dampers[d], base, shaking, block));
    }
    free(block);
    free(modes);
    return isnan(most) ? (double)INFINITY : most;
}

Regime regime_find(const Plan *plan, const Base *base) {
    Regime regime = {.is_unforced = base->form == BASE_STILL,
                     .is_clear = plan->damper_count == 0,
                     .reach = plan->damper_count == 0 ? 0 : (double)INFINITY};
    if (plan->damper_count > 0 && !leaves_soon(plan, base)) {
        const Shaking shaking = shake(base, plan->duration);
        regime.reach = find_reach(plan, base, &shaking);
        regime.is_clear = regime.reach < 1 - MARGIN;
    }
    regime.is_at_rest = regime.is_clear && regime.is_unforced && starts_still(plan);
    return regime;
}
