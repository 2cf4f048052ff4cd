#include <cvode/cvode.h>
#include <math.h>
#include <nvector/nvector_serial.h>
#include <sunlinsol/sunlinsol_dense.h>
#include <sunmatrix/sunmatrix_dense.h>

#include "tests/bench/peers.h"

static int slopes(realtype t, N_Vector y, N_Vector out, void *of) {
    peer_slopes(of, t, N_VGetArrayPointer(y), N_VGetArrayPointer(out));
    return 0;
}

// Without stops the integrator runs past samples of the base: its interval follows the time.
static int slopes_anywhere(realtype t, N_Vector y, N_Vector out, void *of) {
    PeerSystem *system = of;
    if (system->scene->base == REFERENCE_RECORD)
        system->kink = t > 0 ? (size_t)(t / system->scene->interval) : 0;
    return slopes(t, y, out, of);
}

static int jacobian(realtype t, N_Vector y, N_Vector f, SUNMatrix J, void *of, N_Vector a,
                    N_Vector b, N_Vector c) {
    const PeerSystem *system = of;
    const double k = system->stop != 0 ? system->contact_omega2 : 0;
    const double d = system->stop != 0 ? system->contact_damping : 0;
    (void)t, (void)y, (void)f, (void)a, (void)b, (void)c;
    SUNMatZero(J);
    SM_ELEMENT_D(J, 0, 1) = SM_ELEMENT_D(J, 2, 3) = 1;
    SM_ELEMENT_D(J, 1, 0) = -system->omega2;
    SM_ELEMENT_D(J, 1, 1) = -system->damping;
    SM_ELEMENT_D(J, 1, 2) = system->share * k;
    SM_ELEMENT_D(J, 1, 3) = system->share * d;
    SM_ELEMENT_D(J, 3, 0) = system->omega2;
    SM_ELEMENT_D(J, 3, 1) = system->damping;
    SM_ELEMENT_D(J, 3, 2) = -k;
    SM_ELEMENT_D(J, 3, 3) = -d;
    return 0;
}

static int gaps(realtype t, N_Vector y, realtype *out, void *of) {
    const PeerSystem *system = of;
    const double *at = N_VGetArrayPointer(y);
    (void)t;
    out[0] = peer_gap(system, at, system->stop != 0 ? system->stop : 1);
    out[1] = system->stop != 0 ? 1 : peer_gap(system, at, -1);
    return 0;
}

bool peer_cvode(const ReferenceScene *scene, double tolerance, bool has_stops, PeerAnswer *answer) {
    PeerSystem system;
    peer_system(scene, &system);
    SUNContext context = NULL;
    SUNContext_Create(NULL, &context);
    N_Vector y = N_VNew_Serial(4, context), tolerances = N_VNew_Serial(4, context);
    SUNMatrix J = SUNDenseMatrix(4, 4, context);
    SUNLinearSolver solver = SUNLinSol_Dense(y, J, context);
    void *cvode = CVodeCreate(CV_BDF, context);
    double *at = N_VGetArrayPointer(y);
    at[0] = scene->displacement;
    at[1] = scene->velocity;
    at[2] = at[3] = 0;
    for (int i = 0; i < 4; i++)
        N_VGetArrayPointer(tolerances)[i] = tolerance * system.scale[i];
    bool is_good = CVodeInit(cvode, has_stops ? slopes : slopes_anywhere, 0, y) == CV_SUCCESS &&
                   CVodeSVtolerances(cvode, tolerance, tolerances) == CV_SUCCESS &&
                   CVodeSetUserData(cvode, &system) == CV_SUCCESS &&
                   CVodeSetLinearSolver(cvode, solver, J) == CV_SUCCESS &&
                   CVodeSetJacFn(cvode, jacobian) == CV_SUCCESS &&
                   CVodeRootInit(cvode, 2, gaps) == CV_SUCCESS &&
                   CVodeSetMaxNumSteps(cvode, 100000) == CV_SUCCESS;
    answer->impacts = 0;
    peer_at(&system, 0);
    peer_sample(&system, 0, at, answer, 0);
    double t = 0;
    for (size_t i = 1; i < answer->count && is_good; i++) {
        const double end = (double)i / scene->sample_rate;
        if (has_stops)
            CVodeSetStopTime(cvode, end);
        while (is_good) {
            const int flag = CVode(cvode, end, y, &t, CV_NORMAL);
            is_good = flag >= 0;
            if (flag != CV_ROOT_RETURN)
                break;
            int found[2];
            CVodeGetRootInfo(cvode, found);
            peer_switch(&system, t, found[1] != 0 ? -1 : 1, answer);
            is_good = CVodeReInit(cvode, t, y) == CV_SUCCESS;
            if (has_stops)
                CVodeSetStopTime(cvode, end);
        }
        peer_sample(&system, t, at, answer, i);
        if (has_stops)
            peer_at(&system, end);
    }
    CVodeFree(&cvode);
    SUNLinSolFree(solver);
    SUNMatDestroy(J);
    N_VDestroy(tolerances);
    N_VDestroy(y);
    SUNContext_Free(&context);
    return is_good;
}
