// Impulses between masses and their stops, and what they do to all speeds. contact_events.c decides
// when they happen and what follows.
#ifndef CORE_SOLVE_COLLISION_H
#define CORE_SOLVE_COLLISION_H

#include "core/solve/modal_state.h"

// Finds the impulses of all dampers with in_collision, each at its `side`, from their
// approach_speed and separation_speed, and changes all speeds, p and w.
void collision_resolve(ModalState *state);

// Changes all speeds by one impulse per damper [N s].
void collision_push(ModalState *state, const double *impulses);

#endif
