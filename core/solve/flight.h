// Whole sample intervals of flight of all masses by one step each, made once per run: exact for
// a still base, one linear over the interval, and a sine; with a bound on how far each gap can
// bend meanwhile. Not for contacts and not for parts of an interval: those are arcs.
#ifndef CORE_SOLVE_FLIGHT_H
#define CORE_SOLVE_FLIGHT_H

#include "core/solve/flight_buffer.h"
#include "core/solve/modal_state.h"
#include "core/solve/taylor_step.h"
#include "core/solve/transition.h"

typedef struct Flight {
    double length;    // of the interval [s]; 0: there are no such steps
    Transition dense; // in place of gains, loss and input where damping couples the modes
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

// Moves the state over so many of `count` intervals, at most FLIGHT_BUFFER_MAX, as no stop can be
// reached in, returns how many, leaves their samples in the trail, and says what they add up to, if
// `work` is not NULL. 0: it must go by arcs, and nothing has changed.
size_t flight_run(Flight *flight, FlightBuffer *trail, ModalState *state, const Slice *slices,
                  size_t count, StepWork *work);

// Whether r stays between the stops on its way, bent by no more than `bend` [m/s^2].
bool flight_is_clear(const DamperState *damper, double from, double to, double bend, double length);
// Over (value, slope): the integral of a_g over `length`, and its integral; `omega` is the base's
// (0: linear).
void flight_ground(double omega, double length, double ground[2], double fall[2]);
// |a_g| is not larger [m/s^2].
double flight_shaken(const Slice *slice, double length);

#endif
