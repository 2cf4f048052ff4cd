// The exact motion over whole cycles of a sine base, from any state, and the linearised motion
// beside it: the return map of a section at the upward zero crossing of the sine.
#ifndef CORE_SOLVE_CYCLE_FLOW_H
#define CORE_SOLVE_CYCLE_FLOW_H

#include "core/solve/exact.h"

typedef struct CycleFlow CycleFlow;

// What a flow runs, and how.
typedef struct CycleFlowInputs {
    Plan *plan;               // taken, also after a failure
    Base base;                // borrowed: a sine, or still
    double period;            // of the sine [s]
    const Accuracy *accuracy; // of the exact solver, or NULL
    double steps_max;         // solver steps in all; 0: no limit
    const Progress *progress; // may be NULL
} CycleFlowInputs;

// Starts from the plan's initial state or, if `from` is not NULL, from the present state of a flow
// of as many storeys and dampers. Freed by cycle_flow_free; NULL after a failure. The flow borrows
// `problem`.
Status cycle_flow_new(const CycleFlowInputs *inputs, const CycleFlow *from, CycleFlow **flow,
                      Problem *problem);
void cycle_flow_free(CycleFlow *flow); // NULL is fine

// The state y = (q, p, u, w): modes, then displacements of the dampers from the middle of their
// stops and their speeds, both relative to their storeys.
size_t cycle_flow_size(const CycleFlow *flow);
void cycle_flow_get(const CycleFlow *flow, double *y);
void cycle_flow_set(CycleFlow *flow, const double *y); // the contact states remain
// Magnitudes of the components of the present state and of its motion, above 0.
void cycle_flow_scales(const CycleFlow *flow, double *scales);

// Keeps the present state with its contacts, and returns to it.
void cycle_flow_keep(CycleFlow *flow);
void cycle_flow_restore(CycleFlow *flow);

typedef struct CycleMotion {
    double peak_displacement, rms_displacement; // the largest of all storeys, events included [m]
    uint64_t impacts;
} CycleMotion;

// Moves over `cycles`. `columns`, `count` small changes of the state, one after the other, become
// those of the end (NULL: none). `motion` may be NULL. Errors are those of Solver.run.
Status cycle_flow_run(CycleFlow *flow, size_t cycles, double *columns, size_t count,
                      CycleMotion *motion);

// Whether the columns of cycle_flow_run are valid: contact parameters do not depend on the approach
// speed.
bool cycle_flow_is_linearised(const CycleFlow *flow);

// Whether all masses are in flight now.
bool cycle_flow_is_flying(const CycleFlow *flow);

// Moves on to another section in the cycle: where all masses are in flight, if there is one within
// a cycle, or, if `is_home`, the zero crossing.
Status cycle_flow_shift(CycleFlow *flow, bool is_home);

// Displacement and velocity of the top storey [m], [m/s].
void cycle_flow_top(const CycleFlow *flow, double *displacement, double *velocity);

// Largest displacement of any storey in the steady state without dampers; NAN: there is none [m].
double cycle_flow_undamped_peak(const CycleFlow *flow);

double cycle_flow_period(const CycleFlow *flow); // of the sine [s]

#endif
