// Flight of all masses over whole sample intervals, one step each, with tables made once per run.
// Exact for a still base, one that is linear over the interval, and a sine. A bound on the
// curvature of each gap proves that no stop is reached. Contacts and parts of intervals:
// taylor_step.h.
#ifndef CORE_SOLVE_FLIGHT_H
#define CORE_SOLVE_FLIGHT_H

#include "core/solve/modal_state.h"
#include "core/solve/taylor_step.h"
#include "core/solve/transition.h"

enum { FLIGHT_BUFFER_MAX = 16, FLIGHT_BUFFER_ROWS = FLIGHT_BUFFER_MAX + 1 };

// The last samples of the motion, before they are recorded: those of whole intervals of flight, or
// one. Row 0 is the state before, row k that k samples later; each row of `padded` values has all
// modes. (recorder.h)
typedef struct FlightBuffer {
    double *q, *p;
    double *moved, *sped;   // increments of q and p since row 0
    double *elastic;        // D p + W^2 q
    double *r;              // of the dampers, FLIGHT_BUFFER_ROWS each, from the present origins
    double *z;              // likewise, their velocities relative to the base
    double *a, *b, *ground; // of each interval: value and slope of a_g, and its integral
} FlightBuffer;

typedef struct Flight {
    double length;         // of the interval [s]; 0: there are no such steps
    Transition transition; // in place of gains, loss and input where damping couples the modes
    FlightGains gains;
    // Work, mode after mode: loss over FLIGHT_SUMS, input over the last four of these.
    double *loss[FLIGHT_SUMS], *input[4];
    double loss_base[3], input_base[3]; // over (value^2, value slope, slope^2), all modes
    double ground[2], fall[2];          // integral of a_g over (value, slope), and its integral
    double *sums;                       // scratch, as are the next
    double *start, *gained;             // FLIGHT_ROWS times (q, p, value, slope), and their gains
    double *block;
} Flight;

// Freed by flight_clear, also after a failure.
Status flight_make(Flight *flight, const ModalState *state, Problem *problem);
void flight_clear(Flight *flight);

// Moves the state over the first of `count` intervals, at most FLIGHT_BUFFER_MAX, in which no stop
// can be reached, and returns their number. Their samples are in the buffer, their integrals in
// *work if that is not NULL. 0: nothing has changed.
size_t flight_run(Flight *flight, FlightBuffer *buffer, ModalState *state, const Slice *slices,
                  size_t count, StepWork *work);

// Whether r stays between the stops from one value to the other if |r''| is at most `bend` [m/s^2].
bool flight_is_clear(const DamperState *damper, double from, double to, double bend, double length);
// Over (value, slope): the integral of a_g over `length`, and its integral; `omega` is the base's
// (0: linear).
void flight_ground(double omega, double length, double ground[2], double fall[2]);
// An upper bound of |a_g| over `length` [m/s^2].
double flight_max_ground(const Slice *slice, double length);

#endif
