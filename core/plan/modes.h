// Undamped modes of a structure, K phi = omega^2 M phi with phi' M phi = 1, with the damping matrix
// and the participation factors in modal coordinates.
#ifndef CORE_PLAN_MODES_H
#define CORE_PLAN_MODES_H

#include <stdbool.h>
#include <stddef.h>

#include "core/base/status.h"

// In modal coordinates, x = shapes q:  q'' + damping q' + omega^2 q = -participation a_g + shapes'
// N. All zero is empty.
typedef struct Modes {
    size_t count;          // as many as storeys, or fewer after modes_keep
    double *omega;         // rising; 0 for a rigid-body motion [rad/s]
    double *shapes;        // storeys x count, row after row [1/sqrt(kg)]
    double *damping;       // shapes' C shapes, count x count, row after row [1/s]
    double *participation; // shapes' M r [sqrt(kg)]
    bool is_classical;     // damping is diagonal but for rounding
} Modes;

// From M (symmetric, positive definite), K (symmetric, positive semi-definite) and C of `storeys`
// rows, and the influence vector r. Cleared by modes_clear, also after a failure.
Status modes_make(Modes *modes, size_t storeys, const double *mass, const double *stiffness,
                  const double *damping, const double *influence, Problem *problem);
void modes_clear(Modes *modes);

// The modal coordinates of the storeys' displacements or velocities, shapes' M v, one per mode.
void modes_coordinates(const Modes *modes, size_t storeys, const double *mass, const double *v,
                       double *coordinates);

// Keeps the `count` modes listed by rising index and removes the others.
void modes_keep(Modes *modes, size_t storeys, const size_t *list, size_t count);

#endif
