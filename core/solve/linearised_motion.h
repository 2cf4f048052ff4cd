// The linearised motion beside a run of the event engine: the course of small changes of a state,
// through steps and events; and peaks and squares of the displacement between events.
#ifndef CORE_SOLVE_LINEARISED_MOTION_H
#define CORE_SOLVE_LINEARISED_MOTION_H

#include "core/solve/engine.h"

// All zero follows nothing.
typedef struct LinearisedMotion {
    size_t size;     // of a column: (q, p, r, w), modes and dampers
    size_t count;    // columns in progress
    double *columns; // borrowed, one after the other
    double *late;    // of each column: delay of the last event [s]; `size` of them
    bool is_measured;
    double peak;     // largest displacement of any storey so far [m]
    double *squares; // of each storey, integral of the square of its displacement [m^2 s]

    double *before, *after;       // derivatives of the state on the two sides of an event
    ContactPhase *phases;         // of the dampers before it
    double *q, *p, *r, *w, *work; // the run's own state meanwhile, and scratch
    double base_acceleration;
    TaylorStep arc;
    double *block;
} LinearisedMotion;

// Freed by linearised_motion_clear, also after a failure.
Status linearised_motion_make(LinearisedMotion *motion, const ModalState *state, Problem *problem);
void linearised_motion_clear(LinearisedMotion *motion);

// The run is at the start of a Taylor step that it makes as a whole.
void linearised_motion_step(LinearisedMotion *motion, ModalState *state, const TaylorStep *arc);
// Before and after a step of contact under a power law, which is only measured.
void linearised_motion_begin_step(LinearisedMotion *motion, const ModalState *state);
void linearised_motion_end_step(LinearisedMotion *motion, const ModalState *state, double length);

// Before and after an event is applied.
void linearised_motion_begin_event(LinearisedMotion *motion, ModalState *state,
                                   const ContactEvent *event);
void linearised_motion_end_event(LinearisedMotion *motion, ModalState *state,
                                 const ContactEvent *event);

#endif
