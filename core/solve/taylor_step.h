// A Taylor step: the motion of all modes and dampers over a time in which no contact state changes
// and the base is linear or a sine, as polynomials that are exact to rounding. Whole intervals of
// flight: flight.h.
#ifndef CORE_SOLVE_TAYLOR_STEP_H
#define CORE_SOLVE_TAYLOR_STEP_H

#include "core/solve/modal_state.h"

// Coefficients in s = t / length, 0 <= s <= 1.
typedef struct TaylorStep {
    double length;                          // [s]
    double rho;                             // length * rate, the base's included, at most 1
    size_t degree;                          // of q and r; forces have one less
    double base[POLYNOMIAL_DEGREE_MAX + 1]; // a_g
    size_t base_degree;                     // no coefficient of a_g beyond it
    double *q;                              // order after order, `padded` values each
    double *r, *force; // damper after damper, POLYNOMIAL_DEGREE_MAX + 1 each; force is N
    double *work;      // modes x nodes of a quadrature
    double *push;      // scratch, one per damper
    double *slopes;    // of s^k at the nodes of all rules
    double *block;
} TaylorStep;

// Allocates the steps of one run. Freed by taylor_step_clear, also after a failure.
Status taylor_step_allocate(TaylorStep *arc, const ModalState *state, Problem *problem);
void taylor_step_clear(TaylorStep *arc);

// From the present state; length * modal_state_rate() and length * slice->omega must be at most 1.
void taylor_step_make(TaylorStep *arc, const ModalState *state, const Slice *slice, double length);

// Reduces the step to 0 to s, and scales the series so that s = 1 is its end again.
void taylor_step_cut(TaylorStep *arc, const ModalState *state, double s);

// Sets q and p, and r and w of the dampers that do not rest, to the state at s (0 to 1).
void taylor_step_state(const TaylorStep *arc, ModalState *state, double s);

// Integrals over a step.
typedef struct StepWork {
    double input;   // work of the base [J]
    double damping; // lost in the structure [J]
    double ground;  // integral of a_g [m/s]
} StepWork;
StepWork taylor_step_work(const TaylorStep *arc, const ModalState *state);

// Of one damper: the integral of N [N s] and the energy lost in its contact [J].
void taylor_step_contact(const TaylorStep *arc, const ModalState *state, size_t damper,
                         double *impulse, double *lost);

static inline const double *taylor_step_r(const TaylorStep *arc, size_t damper) {
    return arc->r + damper * (POLYNOMIAL_DEGREE_MAX + 1);
}
static inline const double *taylor_step_force(const TaylorStep *arc, size_t damper) {
    return arc->force + damper * (POLYNOMIAL_DEGREE_MAX + 1);
}

#endif
