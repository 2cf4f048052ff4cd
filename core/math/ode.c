// ARKODE's explicit stepper one step at a time. Its continuous output is far coarser than its
// steps, so a root is only guessed there; then the step is taken anew to end at it, and once more
// where Newton's method says that it lies elsewhere. A function that dips below zero and comes back
// within a step is seen by its slope.
#include "core/math/ode.h"

#include <arkode/arkode_erkstep.h>
#include <math.h>
#include <nvector/nvector_serial.h>
#include <stdbool.h>
#include <stdlib.h>
#include <string.h>

static const double tolerance = 1e-13;

enum { ODE_HALVINGS = 60, ODE_RETAKES = 8 };

struct Ode {
    OdeSystem system;
    SUNContext context;
    void *stepper;
    N_Vector y, from, within, scale;
    double t, step;          // the step that the next one should take
    double *value, *slope;   // of the watched functions, at t
    double *ahead, *incline; // at the step's end
    double *probe, *rise;    // somewhere inside it
};

static double *data(N_Vector vector) {
    return N_VGetArrayPointer(vector);
}

static int rate(realtype t, N_Vector y, N_Vector out, void *user) {
    const OdeSystem *system = &((const Ode *)user)->system;
    system->rate(system->context, t, data(y), data(out));
    return 0;
}

static void hush(int code, const char *module, const char *function, char *message, void *user) {
    (void)code, (void)module, (void)function, (void)message, (void)user;
}

static bool is_made(Ode *ode) {
    const sunindextype size = (sunindextype)ode->system.size;
    if (SUNContext_Create(NULL, &ode->context) != 0)
        return false;
    N_Vector *const vectors[] = {&ode->y, &ode->from, &ode->within, &ode->scale};
    for (size_t i = 0; i < COUNT(vectors); i++) {
        *vectors[i] = N_VNew_Serial(size, ode->context);
        if (*vectors[i] == NULL)
            return false;
        N_VConst(0, *vectors[i]);
    }
    ode->value = calloc(6 * (ode->system.roots + 1), sizeof *ode->value);
    if (ode->value == NULL)
        return false;
    double **const arrays[] = {&ode->slope, &ode->ahead, &ode->incline, &ode->probe, &ode->rise};
    for (size_t i = 0; i < COUNT(arrays); i++)
        *arrays[i] = ode->value + (i + 1) * (ode->system.roots + 1);
    ode->stepper = ERKStepCreate(rate, 0, ode->y, ode->context);
    return ode->stepper != NULL && ERKStepSetErrHandlerFn(ode->stepper, hush, NULL) == 0 &&
           ERKStepSetUserData(ode->stepper, ode) == 0 &&
           ERKStepSetTableNum(ode->stepper, ARKODE_FEHLBERG_13_7_8) == 0 &&
           ERKStepSVtolerances(ode->stepper, tolerance, ode->scale) == 0;
}

Ode *ode_new(const OdeSystem *system) {
    Ode *ode = calloc(1, sizeof *ode);
    if (ode == NULL)
        return NULL;
    ode->system = *system;
    if (is_made(ode))
        return ode;
    ode_free(ode);
    return NULL;
}

void ode_free(Ode *ode) {
    if (ode == NULL)
        return;
    if (ode->stepper != NULL)
        ERKStepFree(&ode->stepper);
    N_Vector const vectors[] = {ode->y, ode->from, ode->within, ode->scale};
    for (size_t i = 0; i < COUNT(vectors); i++)
        if (vectors[i] != NULL)
            N_VDestroy(vectors[i]);
    free(ode->value);
    if (ode->context != NULL)
        SUNContext_Free(&ode->context);
    free(ode);
}

static Status failed(double t, Problem *problem) {
    return problem_set(
        problem, STATUS_UNSTABLE,
        "a contact could not be integrated to its end: it is too stiff or leaves what "
        "double precision can hold (%.6g s after its last sample or event)",
        t);
}

// From (t, y) anew, with a first step.
static bool place(Ode *ode, double t, N_Vector y, double step) {
    return ERKStepReset(ode->stepper, t, y) == 0 && ERKStepSetInitStep(ode->stepper, step) == 0;
}

Status ode_start(Ode *ode, const double *y, const double *scale, double step, Problem *problem) {
    const OdeSystem *system = &ode->system;
    memcpy(data(ode->y), y, system->size * sizeof *y);
    for (size_t i = 0; i < system->size; i++)
        data(ode->scale)[i] = tolerance * fmax(scale[i], 1e-290);
    ode->t = 0;
    system->watch(system->context, 0, data(ode->y), ode->value, ode->slope);
    // The stepper keeps a copy of the tolerances.
    return place(ode, 0, ode->y, step) &&
                   ERKStepSVtolerances(ode->stepper, tolerance, ode->scale) == 0
               ? STATUS_OK
               : failed(0, problem);
}

// The functions at t, inside the step just taken.
static bool look(Ode *ode, double t) {
    const OdeSystem *system = &ode->system;
    if (ERKStepGetDky(ode->stepper, t, 0, ode->within) != 0)
        return false;
    system->watch(system->context, t, data(ode->within), ode->probe, ode->rise);
    return true;
}

// Halves [*low, *high] towards where `at`[i] (the probe or its slope) changes sign; it is positive
// times `sign` at *low.
static bool halve(Ode *ode, const double *at, size_t i, double sign, double *low, double *high) {
    for (int step = 0; step < ODE_HALVINGS; step++) {
        const double middle = *low + (*high - *low) / 2;
        if (middle <= *low || middle >= *high)
            break;
        if (!look(ode, middle))
            return false;
        *(sign * at[i] > 0 ? low : high) = middle;
    }
    return true;
}

// Whether function i falls to zero in the step from `t0`; then *t says about where.
static bool falls(Ode *ode, size_t i, double t0, double t1, double *t) {
    const bool is_above = ode->value[i] > 0 || (ode->value[i] == 0 && ode->slope[i] > 0);
    double low = t0, high = t1;
    if (!is_above)
        return false;
    if (ode->ahead[i] > 0) {
        if (!(ode->slope[i] < 0 && ode->incline[i] > 0) ||
            !halve(ode, ode->rise, i, -1, &low, &high) || !look(ode, high) || ode->probe[i] > 0)
            return false;
        low = t0;
    }
    if (!halve(ode, ode->probe, i, 1, &low, &high))
        return false;
    *t = high;
    return true;
}

// Takes the step from `t0` anew, to end where function i is zero.
static bool settle(Ode *ode, size_t i, double t0, double t1, double guess) {
    const OdeSystem *system = &ode->system;
    double t = guess;
    for (int retake = 0; retake < ODE_RETAKES; retake++) {
        double reached = t0;
        memcpy(data(ode->y), data(ode->from), system->size * sizeof(double));
        if (t > t0) {
            if (!place(ode, t0, ode->from, t - t0) || ERKStepSetStopTime(ode->stepper, t) != 0 ||
                ERKStepEvolve(ode->stepper, t, ode->y, &reached, ARK_NORMAL) < 0)
                return false;
        }
        ode->t = t;
        system->watch(system->context, t, data(ode->y), ode->value, ode->slope);
        const double off = ode->value[i] / ode->slope[i];
        if (!isfinite(off) || fabs(off) <= 1e-9 * (t1 - t0)) {
            // What is left is its own square's rounding.
            if (isfinite(off)) {
                system->rate(system->context, t, data(ode->y), data(ode->within));
                N_VLinearSum(1, ode->y, -off, ode->within, ode->y);
                ode->t = t - off;
            }
            break;
        }
        t = fmin(fmax(t - off, t0), t1);
    }
    return true;
}

Status ode_step(Ode *ode, double until, double *t, double *y, int *root, Problem *problem) {
    const OdeSystem *system = &ode->system;
    const double t0 = ode->t;
    double t1, first = 0;
    *root = ODE_NO_ROOT;
    memcpy(data(ode->from), data(ode->y), system->size * sizeof(double));
    if (ERKStepSetStopTime(ode->stepper, until) != 0 ||
        ERKStepEvolve(ode->stepper, until, ode->y, &t1, ARK_ONE_STEP) < 0 || !(t1 > t0))
        return failed(t0, problem);
    system->watch(system->context, t1, data(ode->y), ode->ahead, ode->incline);
    for (size_t i = 0; i < system->roots; i++) {
        double at;
        if (falls(ode, i, t0, t1, &at) && (*root == ODE_NO_ROOT || at < first)) {
            *root = (int)i;
            first = at;
        }
    }
    if (*root == ODE_NO_ROOT) {
        ode->t = t1;
        memcpy(ode->value, ode->ahead, system->roots * sizeof(double));
        memcpy(ode->slope, ode->incline, system->roots * sizeof(double));
    } else {
        if (!settle(ode, (size_t)*root, t0, t1, first))
            return failed(first, problem);
        system->watch(system->context, ode->t, data(ode->y), ode->value, ode->slope);
        if (!place(ode, ode->t, ode->y, t1 - t0))
            return failed(first, problem);
    }
    *t = ode->t;
    memcpy(y, data(ode->y), system->size * sizeof(double));
    return STATUS_OK;
}
