// GSL's Runge-Kutta method of order 8 (Prince and Dormand) at a tolerance of 1e-14. A watched
// function that falls to zero in a step is located by bisection, with a step of its own to each
// instant.
//
// State: x, v of the structure, r, w of the mass relative to it (r from the middle of the stops in
// flight before the first contact, else from the stop it was last at), and the contact's impulse.
#include "tests/truth/power_reference.h"

#include <gsl/gsl_errno.h>
#include <gsl/gsl_odeiv2.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "core/plan/plan.h"
#include "tests/support/base_at.h"

enum { X, V, R, W, J, SIZE };
enum {
    NO_ROOT = -1,
    LOW,
    HIGH,
    ROOTS
}; // in flight the left and right gap; in contact p, and dN/dt or the kink

enum { FLIGHT_PARTS = 16 }; // of a step, in which dips are looked for

typedef struct ImportContext {
    const Plan *plan;
    const Base *base;
    double t0; // of the integrator's own clock
    int side;  // -1: in flight
    int last;  // stop it was last at, -1: none
    ContactParameters contact;
    double turn;

    gsl_odeiv2_step *step;
    gsl_odeiv2_evolve *evolve;
    gsl_odeiv2_control *control;
    double next; // length of the next step [s]
} ImportContext;

static double sign_of(int side) {
    return side == SIDE_RIGHT ? 1 : -1;
}

static ContactForce force_of(const ImportContext *walk, const double *y) {
    const double sign = sign_of(walk->side);
    if (walk->side < 0)
        return (ContactForce){0};
    return walk->plan->law->force(&walk->contact, sign * y[R], sign * y[W]);
}

static int rate(double t, const double *y, double *out, void *context) {
    const ImportContext *walk = context;
    const Plan *plan = walk->plan;
    const double N = walk->side < 0 ? 0 : sign_of(walk->side) * force_of(walk, y).value;
    const double own = (plan->stiffness[0] * y[X] + plan->damping[0] * y[V]) / plan->mass[0];
    out[X] = y[V];
    out[V] = -own - base_at(walk->base, walk->t0 + t) + N / plan->mass[0];
    out[R] = y[W];
    out[W] = own - N / plan->mass[0] - N / plan->dampers[0].mass;
    out[J] = N;
    return GSL_SUCCESS;
}

// The watched functions and their slopes; NAN: unknown.
static void watch(const ImportContext *walk, const double *y, double *value, double *slope) {
    const double d = walk->plan->dampers[0].clearance;
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

static void begin(ImportContext *walk, PowerTruth *truth, int side, double t, double *y) {
    walk->side = walk->last = side;
    y[R] = y[J] = 0;
    walk->contact = stops_freeze(&walk->plan->dampers[0].stops[side], fabs(y[W]));
    truth->impacts[truth->count++] = (PowerImpact){.side = side,
                                                   .start = t,
                                                   .end = (double)NAN,
                                                   .approach = fabs(y[W]),
                                                   .separation = (double)NAN};
}

static void end(ImportContext *walk, PowerTruth *truth, double t, double *y) {
    PowerImpact *impact = &truth->impacts[truth->count - 1];
    impact->end = t;
    impact->separation = fabs(y[W]);
    impact->impulse = fabs(y[J]);
    walk->side = -1;
    y[R] = 0;
}

static void stop_integrator(ImportContext *walk) {
    if (walk->evolve != NULL)
        gsl_odeiv2_evolve_free(walk->evolve);
    if (walk->control != NULL)
        gsl_odeiv2_control_free(walk->control);
    if (walk->step != NULL)
        gsl_odeiv2_step_free(walk->step);
    walk->evolve = NULL;
    walk->control = NULL;
    walk->step = NULL;
}

static void start_integrator(ImportContext *walk, const double *y) {
    const PlanDamper *damper = &walk->plan->dampers[0];
    const double v = fabs(y[W]) + 1e-3 * fabs(y[V]) + 1e-6;
    const double p = walk->side < 0 ? damper->clearance
                                    : pow(walk->contact.mass * v * v / walk->contact.stiffness,
                                          1 / (walk->contact.exponent + 1));
    const double scale[SIZE] = {p, v, p, v, v * damper->mass};
    stop_integrator(walk);
    walk->step = gsl_odeiv2_step_alloc(gsl_odeiv2_step_rk8pd, SIZE);
    walk->evolve = gsl_odeiv2_evolve_alloc(SIZE);
    walk->control = gsl_odeiv2_control_scaled_new(1e-14, 1e-14, 1, 0, scale, SIZE);
    if (walk->step == NULL || walk->evolve == NULL || walk->control == NULL)
        abort();
    walk->next = p / v / 100;
}

// The watched functions after a step of h from (t0, y0).
static void look(ImportContext *walk, const gsl_odeiv2_system *system, double t0, const double *y0,
                 double h, double *y, double *value, double *slope) {
    double error[SIZE];
    memcpy(y, y0, SIZE * sizeof *y);
    if (h > 0)
        gsl_odeiv2_step_apply(walk->step, t0, h, y, error, NULL, NULL, system);
    watch(walk, y, value, slope);
}

// One step from *t, at most to `until`, cut short where a watched function falls to zero.
static bool advance(ImportContext *walk, double until, double *t, double *y, int *root) {
    const gsl_odeiv2_system system = {.function = rate, .dimension = SIZE, .params = walk};
    const double t0 = *t;
    double y0[SIZE], at[SIZE], from[ROOTS], from_slope[ROOTS], value[ROOTS], slope[ROOTS];
    memcpy(y0, y, sizeof y0);
    *root = NO_ROOT;
    watch(walk, y0, from, from_slope);
    if (gsl_odeiv2_evolve_apply(walk->evolve, walk->control, walk->step, &system, t, until,
                                &walk->next, y) != GSL_SUCCESS)
        return false;
    double first = *t - t0;
    for (int i = 0; i < ROOTS; i++) {
        if (!(from[i] > 0 || (from[i] == 0 && from_slope[i] > 0)))
            continue;
        // In flight a mass may leave a stop and come back to it within a step.
        const int parts = walk->side < 0 ? FLIGHT_PARTS : 1;
        double begin = 0, slope_before = from_slope[i];
        for (int part = 1; part <= parts && *root != i; part++) {
            double low = begin, high = first * part / parts;
            look(walk, &system, t0, y0, high, at, value, slope);
            begin = high;
            // A dip below zero within the part: its lowest point is where the slope changes sign.
            const bool is_dip = value[i] > 0 && slope_before < 0 && slope[i] > 0;
            slope_before = slope[i];
            const double left = low;
            for (double middle = low + (high - low) / 2; is_dip && low < middle && middle < high;
                 middle = low + (high - low) / 2) {
                look(walk, &system, t0, y0, middle, at, value, slope);
                *(slope[i] < 0 ? &low : &high) = middle;
            }
            if (is_dip)
                look(walk, &system, t0, y0, high, at, value, slope);
            if (value[i] > 0)
                continue;
            low = left;
            for (double middle = low + (high - low) / 2; low < middle && middle < high;
                 middle = low + (high - low) / 2) {
                look(walk, &system, t0, y0, middle, at, value, slope);
                *(value[i] > 0 ? &low : &high) = middle;
            }
            *root = i;
            first = high;
        }
    }
    if (*root != NO_ROOT) {
        look(walk, &system, t0, y0, first, y, value, slope);
        *t = t0 + first;
    }
    return true;
}

void power_truth(const Plan *plan, const Base *base, size_t most, PowerTruth *truth) {
    ImportContext walk = {.plan = plan, .base = base, .side = -1, .last = -1};
    const PlanDamper *damper = &plan->dampers[0];
    double y[SIZE] = {plan->displacement[0], plan->velocity[0], damper->position, damper->velocity};
    *truth = (PowerTruth){.x = calloc(plan->count, sizeof *truth->x),
                          .impacts = calloc(most + 1, sizeof *truth->impacts),
                          .is_whole = true};
    if (truth->x == NULL || truth->impacts == NULL)
        abort();
    truth->x[0] = y[X];
    gsl_set_error_handler_off();
    double t = 0, at = 0; // `at` counts from walk.t0
    bool is_turned = false;
    for (size_t sample = 1; sample < plan->count && truth->is_whole; sample++) {
        const double until = (double)sample / plan->sample_rate;
        bool is_new = true;
        while (t < until && truth->is_whole) {
            const double stop = next_kink(base, t, until);
            if (is_new) {
                walk.t0 = t;
                at = 0;
                const double kink = walk.side < 0 ? 0 : force_of(&walk, y).kink;
                if (!is_turned)
                    walk.turn = kink < 0 ? -1 : 1;
                is_turned = false;
                start_integrator(&walk, y);
            }
            int root;
            if (!advance(&walk, stop - walk.t0, &at, y, &root)) {
                truth->is_whole = false;
                break;
            }
            t = walk.t0 + at;
            if (walk.side >= 0) {
                PowerImpact *impact = &truth->impacts[truth->count - 1];
                impact->peak = fmax(impact->peak, force_of(&walk, y).value);
            }
            is_new = root != NO_ROOT || at >= stop - walk.t0;
            if (at >= stop - walk.t0)
                t = stop;
            if (root == NO_ROOT)
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
    stop_integrator(&walk);
}

void power_truth_clear(PowerTruth *truth) {
    free(truth->x);
    free(truth->impacts);
    *truth = (PowerTruth){0};
}
