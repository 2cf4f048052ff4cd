// State: x, v of the structure, r, w of the mass relative to it (r from the middle of the stops in
// flight before the first contact, else from the stop it was last at), and the contact's impulse.
#include "tests/truth/power_reference.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "core/math/ode.h"
#include "core/plan/plan.h"
#include "tests/support/base_at.h"

enum { X, V, R, W, J, SIZE };
enum { LOW, HIGH, ROOTS }; // in flight the left and right gap; in contact p, and dN/dt or the kink

typedef struct Walk {
    const Plan *plan;
    const Base *base;
    double t0; // of the integrator's own clock
    int side;  // -1: in flight
    int last;  // stop it was last at, -1: none
    ContactParameters contact;
    double turn;
} Walk;

static double sign_of(int side) {
    return side == SIDE_RIGHT ? 1 : -1;
}

static ContactForce force_of(const Walk *walk, const double *y) {
    const double sign = sign_of(walk->side);
    if (walk->side < 0)
        return (ContactForce){0};
    return walk->plan->law->force(&walk->contact, sign * y[R], sign * y[W]);
}

static void rate(const void *context, double t, const double *y, double *out) {
    const Walk *walk = context;
    const Plan *plan = walk->plan;
    const double N = walk->side < 0 ? 0 : sign_of(walk->side) * force_of(walk, y).value;
    const double own = (plan->stiffness[0] * y[X] + plan->damping[0] * y[V]) / plan->mass[0];
    out[X] = y[V];
    out[V] = -own - base_at(walk->base, walk->t0 + t) + N / plan->mass[0];
    out[R] = y[W];
    out[W] = own - N / plan->mass[0] - N / plan->dampers[0].mass;
    out[J] = N;
}

static void progress(const void *context, double t, const double *y, double *value, double *slope) {
    const Walk *walk = context;
    const double d = walk->plan->dampers[0].clearance;
    (void)t;
    if (walk->side >= 0) {
        const double sign = sign_of(walk->side);
        value[LOW] = sign * y[R];
        slope[LOW] = sign * y[W];
        value[HIGH] = walk->turn * force_of(walk, y).kink;
        slope[HIGH] = (double)NAN;
        return;
    }
    for (int side = 0; side < 2; side++) {
        const double room = walk->last < 0 ? d / 2 : walk->last == side ? 0 : d;
        value[side] = room - sign_of(side) * y[R];
        slope[side] = -sign_of(side) * y[W];
    }
}

// When the base's next kink comes after t.
static double next_kink(const Base *base, double t, double until) {
    if (base->form != BASE_SAMPLED)
        return until;
    const double kink = (floor(t / base->interval * (1 + 1e-12) + 1e-9) + 1) * base->interval;
    return fmin(kink, until);
}

static void begin(Walk *walk, PowerTruth *truth, int side, double t, double *y) {
    walk->side = walk->last = side;
    y[R] = y[J] = 0;
    walk->contact = stops_freeze(&walk->plan->dampers[0].stops[side], fabs(y[W]));
    truth->impacts[truth->count++] = (PowerImpact){.side = side,
                                                   .start = t,
                                                   .end = (double)NAN,
                                                   .approach = fabs(y[W]),
                                                   .separation = (double)NAN};
}

static void end(Walk *walk, PowerTruth *truth, double t, double *y) {
    PowerImpact *impact = &truth->impacts[truth->count - 1];
    impact->end = t;
    impact->separation = fabs(y[W]);
    impact->impulse = fabs(y[J]);
    walk->side = -1;
    y[R] = 0;
}

static bool start(const Walk *walk, Ode *ode, const double *y) {
    const PlanDamper *damper = &walk->plan->dampers[0];
    const double v = fabs(y[W]) + 1e-3 * fabs(y[V]) + 1e-6;
    const double p = walk->side < 0 ? damper->clearance
                                    : pow(walk->contact.mass * v * v / walk->contact.stiffness,
                                          1 / (walk->contact.exponent + 1));
    const double scale[SIZE] = {p, v, p, v, v * damper->mass};
    return ode_start(ode, y, scale, p / v / 100, NULL) == STATUS_OK;
}

void power_truth(const Plan *plan, const Base *base, size_t most, PowerTruth *truth) {
    Walk walk = {.plan = plan, .base = base, .side = -1, .last = -1};
    const OdeSystem system = {
        .context = &walk, .size = SIZE, .roots = ROOTS, .rate = rate, .progress = progress};
    Ode *ode = ode_new(&system);
    const PlanDamper *damper = &plan->dampers[0];
    double y[SIZE] = {plan->displacement[0], plan->velocity[0], damper->position, damper->velocity};
    *truth = (PowerTruth){.x = calloc(plan->count, sizeof *truth->x),
                          .impacts = calloc(most + 1, sizeof *truth->impacts),
                          .is_whole = true};
    if (ode == NULL || truth->x == NULL || truth->impacts == NULL)
        abort();
    truth->x[0] = y[X];
    double t = 0;
    bool is_turned = false;
    for (size_t sample = 1; sample < plan->count && truth->is_whole; sample++) {
        const double until = (double)sample / plan->sample_rate;
        bool is_new = true;
        while (t < until && truth->is_whole) {
            const double stop = next_kink(base, t, until);
            if (is_new) {
                walk.t0 = t;
                const double kink = walk.side < 0 ? 0 : force_of(&walk, y).kink;
                if (!is_turned)
                    walk.turn = kink < 0 ? -1 : 1;
                is_turned = false;
                is_new = !start(&walk, ode, y);
            }
            double at;
            int root;
            if (is_new || ode_step(ode, stop - walk.t0, &at, y, &root, NULL) != STATUS_OK) {
                truth->is_whole = false;
                break;
            }
            t = walk.t0 + at;
            if (walk.side >= 0) {
                PowerImpact *impact = &truth->impacts[truth->count - 1];
                impact->peak = fmax(impact->peak, force_of(&walk, y).value);
            }
            is_new = root != ODE_NO_ROOT || at >= stop - walk.t0;
            if (at >= stop - walk.t0)
                t = stop;
            if (root == ODE_NO_ROOT)
                continue;
            if (walk.side >= 0 && root == HIGH) { // rounding alone says on which side it is now
                walk.turn = -walk.turn;
                is_turned = true;
                continue;
            }
            if (walk.side >= 0)
                end(&walk, truth, t, y);
            else if (truth->count < most)
                begin(&walk, truth, root, t, y);
            else
                truth->is_whole = false;
        }
        truth->x[sample] = y[X];
    }
    ode_free(ode);
}

void power_truth_clear(PowerTruth *truth) {
    free(truth->x);
    free(truth->impacts);
    *truth = (PowerTruth){0};
}
