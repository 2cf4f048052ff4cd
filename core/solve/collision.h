// Impulses between masses that stops keep apart: what collisions do to all speeds at once. Not
// when they happen nor what follows (contact_events.c).
#ifndef CORE_SOLVE_COLLISION_H
#define CORE_SOLVE_COLLISION_H

#include "core/solve/modal_state.h"

// Of all dampers with is_met, each at its `side`: finds `pressed` and changes all speeds, p and w.
void collision_resolve(ModalState *state);

// N's impulses [N s], one per damper, change all speeds.
void modal_state_push(ModalState *state, const double *impulses);

#endif
