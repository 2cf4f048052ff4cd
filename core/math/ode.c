// ARKODE's explicit stepper one step at a time. Its continuous output is far coarser than its
// steps, so a root is only guessed there; then the step is taken anew to end at it, and once more
// where Newton's method says that it lies elsewhere. A function that dips below zero and comes back
// within a step is seen by its slope.
#include "core/math/ode.h"

#include <arkode/arkode_erkstep.h>
#include <float.h>
#include <math.h>
#include <nvector/nvector_serial.h>
#include <stdbool.h>
#include <stdlib.h>
#include <string.h>

enum { ODE_HALVINGS = 60, ODE_RETAKES = 8, ODE_FAILURES = 60 };

struct Ode {
    OdeSystem system;
    SUNContext context;
    void *stepper;
    N_Vector y, from, within, scale;
    double t, step;          // the last step, a guess of the next
    double *value, *slope;   // of the watched functions, at t
    double *ahead, *incline; // at the step's end
    double *probe, *rise;    // somewhere inside it
};

// Prince and Dormand, J. Comp. Appl. Math. 7 (1981) 67-75, RK8(7)13M. Of ARKODE's own tables the
// one of order 8 has an error estimate that is blind to y' = f(t), and with it to a contact's
// touch.
enum { STAGES = 13, ORDER = 8, EMBEDDED = 7 };

// clang-format off
static const double nodes[STAGES] = {
    0, 1.0 / 18, 1.0 / 12, 1.0 / 8, 5.0 / 16, 3.0 / 8, 59.0 / 400, 93.0 / 200,
    5490023248.0 / 9719169821.0, 13.0 / 20, 1201146811.0 / 1299019798.0, 1, 1};
static const double stages[STAGES][STAGES] = {
    {0},
    {1.0 / 18},
    {1.0 / 48, 1.0 / 16},
    {1.0 / 32, 0, 3.0 / 32},
    {5.0 / 16, 0, -75.0 / 64, 75.0 / 64},
    {3.0 / 80, 0, 0, 3.0 / 16, 3.0 / 20},
    {29443841.0 / 614563906.0, 0, 0, 77736538.0 / 692538347.0, -28693883.0 / 1125000000.0,
     23124283.0 / 1800000000.0},
    {16016141.0 / 946692911.0, 0, 0, 61564180.0 / 158732637.0, 22789713.0 / 633445777.0,
     545815736.0 / 2771057229.0, -180193667.0 / 1043307555.0},
    {39632708.0 / 573591083.0, 0, 0, -433636366.0 / 683701615.0, -421739975.0 / 2616292301.0,
     100302831.0 / 723423059.0, 790204164.0 / 839813087.0, 800635310.0 / 3783071287.0},
    {246121993.0 / 1340847787.0, 0, 0, -37695042795.0 / 15268766246.0,
     -309121744.0 / 1061227803.0, -12992083.0 / 490766935.0, 6005943493.0 / 2108947869.0,
     393006217.0 / 1396673457.0, 123872331.0 / 1001029789.0},
    {-1028468189.0 / 846180014.0, 0, 0, 8478235783.0 / 508512852.0, 1311729495.0 / 1432422823.0,
     -10304129995.0 / 1701304382.0, -48777925059.0 / 3047939560.0, 15336726248.0 / 1032824649.0,
     -45442868181.0 / 3398467696.0, 3065993473.0 / 597172653.0},
    {185892177.0 / 718116043.0, 0, 0, -3185094517.0 / 667107341.0, -477755414.0 / 1098053517.0,
     -703635378.0 / 230739211.0, 5731566787.0 / 1027545527.0, 5232866602.0 / 850066563.0,
     -4093664535.0 / 808688257.0, 3962137247.0 / 1805957418.0, 65686358.0 / 487910083.0},
    {403863854.0 / 491063109.0, 0, 0, -5068492393.0 / 434740067.0, -411421997.0 / 543043805.0,
     652783627.0 / 914296604.0, 11173962825.0 / 925320556.0, -13158990841.0 / 6184727034.0,
     3936647629.0 / 1978049680.0, -160528059.0 / 685178525.0, 248638103.0 / 1413531060.0}};
static const double weights[STAGES] = {
    14005451.0 / 335480064.0, 0, 0, 0, 0, -59238493.0 / 1068277825.0, 181606767.0 / 758867731.0,
    561292985.0 / 797845732.0, -1041891430.0 / 1371343529.0, 760417239.0 / 1151165299.0,
    118820643.0 / 751138087.0, -528747749.0 / 2220607170.0, 1.0 / 4};
static const double embedded[STAGES] = {
    13451932.0 / 455176623.0, 0, 0, 0, 0, -808719846.0 / 976000145.0,
    1757004468.0 / 5645159321.0, 656045339.0 / 265891186.0, -3867574721.0 / 1518517206.0,
    465885868.0 / 322736535.0, 53011238.0 / 667516719.0, 2.0 / 45, 0};
// clang-format on

static bool set_method(void *stepper) {
    double rows[STAGES * STAGES], at[STAGES], sums[STAGES], second[STAGES];
    memcpy(rows, stages, sizeof rows);
    memcpy(at, nodes, sizeof at);
    memcpy(sums, weights, sizeof sums);
    memcpy(second, embedded, sizeof second);
    ARKodeButcherTable table =
        ARKodeButcherTable_Create(STAGES, ORDER, EMBEDDED, at, rows, sums, second);
    const bool is_set = table != NULL && ERKStepSetTable(stepper, table) == 0;
    ARKodeButcherTable_Free(table);
    return is_set;
}

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
           ERKStepSetUserData(ode->stepper, ode) == 0 && set_method(ode->stepper) &&
           ERKStepSetMaxErrTestFails(ode->stepper, ODE_FAILURES) == 0 &&
           ERKStepSVtolerances(ode->stepper, ode->system.tolerance, ode->scale) == 0;
}

Ode *ode_new(const OdeSystem *system) {
    Ode *ode = calloc(1, sizeof *ode);
    if (ode == NULL)
        return NULL;
    ode->system = *system;
    if (!(system->tolerance > 0))
        ode->system.tolerance = ODE_TOLERANCE;
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
        data(ode->scale)[i] = system->tolerance * fmax(scale[i], 1e-290);
    ode->t = 0;
    ode->step = step;
    system->progress(system->context, 0, data(ode->y), ode->value, ode->slope);
    // The stepper keeps a copy of the tolerances.
    return place(ode, 0, ode->y, step) &&
                   ERKStepSVtolerances(ode->stepper, ode->system.tolerance, ode->scale) == 0
               ? STATUS_OK
               : failed(0, problem);
}

// The functions at t, inside the step just taken.
static bool look(Ode *ode, double t) {
    const OdeSystem *system = &ode->system;
    if (ERKStepGetDky(ode->stepper, t, 0, ode->within) != 0)
        return false;
    system->progress(system->context, t, data(ode->within), ode->probe, ode->rise);
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

// Takes the step from `t0` anew, to end where function i is zero: by Newton's method, or where no
// slope is known by secants.
static bool settle(Ode *ode, size_t i, double t0, double t1, double guess) {
    const OdeSystem *system = &ode->system;
    double t = guess, other = t1, value = ode->ahead[i];
    for (int retake = 0; retake < ODE_RETAKES; retake++) {
        double reached = t0;
        memcpy(data(ode->y), data(ode->from), system->size * sizeof(double));
        if (t > t0 &&
            (!place(ode, t0, ode->from, t - t0) || ERKStepSetStopTime(ode->stepper, t) != 0 ||
             ERKStepEvolve(ode->stepper, t, ode->y, &reached, ARK_NORMAL) < 0))
            return false;
        ode->t = t;
        system->progress(system->context, t, data(ode->y), ode->value, ode->slope);
        const double slope =
            isnan(ode->slope[i]) ? (ode->value[i] - value) / (t - other) : ode->slope[i];
        const double off = ode->value[i] / slope;
        if (!isfinite(off))
            break;
        if (fabs(off) <= 1e-9 * (t1 - t0)) { // what is left is its own square's rounding
            system->rate(system->context, t, data(ode->y), data(ode->within));
            N_VLinearSum(1, ode->y, -off, ode->within, ode->y);
            ode->t = t - off;
            break;
        }
        other = t;
        value = ode->value[i];
        t = fmin(fmax(t - off, t0), t1);
    }
    return true;
}

// Less time than the stepper's clock can tell from none.
static void creep(Ode *ode, double until) {
    const OdeSystem *system = &ode->system;
    system->rate(system->context, ode->t, data(ode->y), data(ode->within));
    N_VLinearSum(1, ode->y, until - ode->t, ode->within, ode->y);
    ode->t = until;
}

Status ode_step(Ode *ode, double until, double *t, double *y, int *root, Problem *problem) {
    const OdeSystem *system = &ode->system;
    const double t0 = ode->t;
    double t1, first = 0;
    *root = ODE_NO_ROOT;
    memcpy(data(ode->from), data(ode->y), system->size * sizeof(double));
    if (until - t0 <= 16 * DBL_EPSILON * fabs(t0)) {
        creep(ode, until);
        if (!place(ode, until, ode->y, ode->step))
            return failed(t0, problem);
        *t = until;
        memcpy(y, data(ode->y), system->size * sizeof(double));
        return STATUS_OK;
    }
    if (ERKStepSetStopTime(ode->stepper, until) != 0 ||
        ERKStepEvolve(ode->stepper, until, ode->y, &t1, ARK_ONE_STEP) < 0 || !(t1 > t0))
        return failed(t0, problem);
    system->progress(system->context, t1, data(ode->y), ode->ahead, ode->incline);
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
        system->progress(system->context, ode->t, data(ode->y), ode->value, ode->slope);
        // It has fallen, whichever side of zero rounding left it on.
        ode->value[*root] = fmin(ode->value[*root], 0);
        if (!place(ode, ode->t, ode->y, t1 - t0))
            return failed(first, problem);
    }
    ode->step = t1 - t0;
    *t = ode->t;
    memcpy(y, data(ode->y), system->size * sizeof(double));
    return STATUS_OK;
}
