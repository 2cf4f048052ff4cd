// A run by steps of one length: the state of all modes and masses, what a step adds to the ledgers,
// and contacts that begin and end at step ends only. Not a method: that is a Stepper (rk4.c,
// newmark.c, precise.c). Not the exact engine, which finds the instants. Used by those and
// steps_run.c.
#ifndef CORE_SOLVE_TIME_STEPPING_H
#define CORE_SOLVE_TIME_STEPPING_H

#include "core/solve/modal_state.h"
#include "core/solve/recorder.h"

typedef struct Steps Steps;

// What ONE method of steps is.
typedef struct Stepper {
    const char *name;    // of its solver
    int order;           // of its error while no contact begins or ends
    const char *between; // what people are told of that error
    // The contact force follows from where the masses are, whether or not a contact has begun, and
    // the method freezes its parameters; otherwise the contacts of a step are those of its start.
    bool is_by_place;
    bool is_linear_only;    // serves no power law
    double stability_limit; // unstable where an eigenvalue times the step is larger; 0: never
    Status (*make)(Steps *steps);
    // From steps->y over `length` seconds: changes y and the sums of the step.
    Status (*step)(Steps *steps, double length);
    // In place of steps of one length: over a whole interval, from the last sample on.
    Status (*cross)(Steps *steps, double length);
    void (*clear)(Steps *steps);
    // How much a step costs, in steps of the single engine, and the making of its tables.
    double (*cost)(size_t modes, size_t dampers, bool is_coupled, double *making);
} Stepper;

// What a step adds up to.
typedef struct StepSums {
    double input, damping; // the base's work, and that lost in the structure [J]
    double *impulse;       // of the dampers: integral of N [N s]
    double *work;          // of N r' [J]
} StepSums;

struct Steps {
    ModalState state;
    FlightBuffer trail; // of one sample
    Recorder record;
    const Stepper *stepper;
    void *own;        // the stepper's
    size_t share;     // steps in a sample interval
    double length;    // of one [s]
    double tolerance; // of a method whose steps have no fixed length
    double watched;   // work since the progress was asked

    size_t size;      // of y
    double *y;        // the state: q, p, r, w
    double ground[3]; // a_g at the step's start, in its middle and at its end [m/s^2]
    // Of the base's speed what the steps have not seen of a pulse that begins or ends within one:
    // now, and the most so far [m/s]; and since when [s].
    double unseen, most_unseen, unseen_since;
    StepSums sums;
    double *force;     // scratch: N of the dampers [N]
    double *elastic;   // scratch
    double *before;    // of the dampers: energy in their buffers before the step [J]
    double largest_in; // largest energy that start and base account for [J]
    double *block;
};

// `is_shadow`: only the motion is wanted. Cleared by steps_clear, also after a failure.
Status steps_make(Steps *steps, const Stepper *stepper, Run *run, size_t share, double tolerance,
                  bool is_shadow, Response *response, Problem *problem);
void steps_clear(Steps *steps);

// To the next sample, and takes it.
Status steps_interval(Steps *steps);
void steps_take_sample(Steps *steps);
// To the end of a run that ends `length` seconds after its last sample.
Status steps_finish(Steps *steps, double length);

// out = D p + W^2 q.
void steps_elastic(const ModalState *state, const double *q, const double *p, double *restrict out);
// y' under forces N on the dampers' storeys; elastic becomes that of y.
void steps_rate(Steps *steps, const double *y, double ground, const double *force,
                double *restrict out);
// N of a damper that is in contact, at these r and r', and its derivatives.
ContactForce steps_contact(const ModalState *state, size_t damper, double r, double w);
// Adds to the sums what the two ends of a step say: by the trapezoidal rule, or corrected by the
// derivatives there, which makes it one of order 4.
void steps_sum(Steps *steps, const double *from, const double *to, double length,
               bool is_corrected);

// After each stretch of a run: takes peaks and the energy balance, counts what it cost, asks the
// progress.
Status steps_note(Steps *steps, double cost);
// Whether the limits are kept and the progress lets the run go on.
Status steps_check(Steps *steps);

// Contacts begin and end, masses bounce: steps_contact.c.
void steps_turn(Steps *steps, double length);

#endif
