// The samples of one stretch of the general engine's motion, one after the other, before they
// are written down. Not how they come about: flight.h fills whole stretches, event_engine.c the
// single samples behind contacts.
#ifndef CORE_SOLVE_FLIGHT_BUFFER_H
#define CORE_SOLVE_FLIGHT_BUFFER_H

#include "core/solve/modal_state.h"

enum { FLIGHT_BUFFER_MAX = 16, TRAIL_ROWS = FLIGHT_BUFFER_MAX + 1 };

// Row 0 is where the stretch begins, row k what is k samples on; all modes in each row.
typedef struct FlightBuffer {
    size_t padded; // values of a row
    double *q, *p;
    double *moved, *sped;   // what q and p have gained since row 0
    double *elastic;        // D p + W^2 q
    double *r;              // of the dampers, TRAIL_ROWS each, from the present origins
    double *z;              // likewise, their velocities relative to the base
    double *a, *b, *ground; // of each interval: a_g, as a Slice, and its integral
    double *block;
} FlightBuffer;

// Freed by flight_buffer_clear, also after a failure.
Status flight_buffer_make(FlightBuffer *trail, const ModalState *state, Problem *problem);
void flight_buffer_clear(FlightBuffer *trail);

// The elastic forces of rows 1 to `count`, the last of them being the present sample.
void flight_buffer_feel(FlightBuffer *trail, const ModalState *state, size_t count);

// Row 1 becomes the present state, after modal_state_forces.
void flight_buffer_take(FlightBuffer *trail, const ModalState *state, double ground);

#endif
