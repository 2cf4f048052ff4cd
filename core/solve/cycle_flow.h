// The exact motion over whole cycles of a sine base, from any state, and the linearised motion
// beside it: the return map of a section at the upward zero crossing of the sine; and its fixed
// points by shooting: periodic orbits, with their stability.
#ifndef CORE_SOLVE_CYCLE_FLOW_H
#define CORE_SOLVE_CYCLE_FLOW_H

#include "core/solve/exact.h"

enum { CYCLE_FLOW_PERIOD = 64 }; // longest of an orbit that is searched for [cycles]

typedef struct CycleFlow CycleFlow;

// A flow of `plan` over cycles of `period` [s]. Of `run` it uses the base, a sine or still, the
// settings of the exact solver or NULL, the limit of steps and the progress.
// Starts from the plan's initial state or, if `from` is not NULL, from the present state of a flow
// of as many storeys and dampers.
// Takes ownership of `plan`, also after a failure. Copies `*run` and its base; borrows its
// settings, progress and `problem`, also for the functions below. Freed by cycle_flow_free; NULL
// after a failure.
Status cycle_flow_new(Plan *plan, const Run *run, double period, const CycleFlow *from,
                      CycleFlow **flow, Problem *problem);
void cycle_flow_free(CycleFlow *flow); // NULL is fine

// An orbit of the flow, or a state from which one is searched for. The state y = (q, p, u, w) has
// the modes, then displacements of the dampers from the middle of their stops and their speeds,
// both relative to their storeys.
typedef struct Orbit {
    size_t size, period;      // of y; cycles, or 0: none was found
    double *scales;           // magnitudes of y and of its motion, above 0
    double *y, *end;          // at the section, and a period later
    double *matrix;           // of the return map at y, scaled
    double *real, *imaginary; // its eigenvalues: the Floquet multipliers, the largest first
    bool is_settled;          // nothing known suggests that the motion is still a transient
} Orbit;

// Borrowed. A flow from another one of the same size begins with its scales.
Orbit *cycle_flow_orbit(CycleFlow *flow);
// The magnitude of the largest multiplier; NAN: it was not found.
double cycle_flow_radius(const CycleFlow *flow);

// Writes the present y, orbit->size numbers: modes, [m], [m/s]; not scaled.
void cycle_flow_get(const CycleFlow *flow, double *y);
// Keeps the present state with its contacts, and returns to it; `y` replaces it but for contacts
// (NULL: nothing).
void cycle_flow_keep(CycleFlow *flow);
void cycle_flow_restore(CycleFlow *flow, const double *y);

typedef struct CycleMotion {
    double peak_displacement, rms_displacement; // the largest of all storeys, events included [m]
    uint64_t impacts;
} CycleMotion;

// Moves over `cycles`. `columns`, `count` small changes of the state, one after the other, become
// those of the end (NULL: none). `columns`: count x size, count at most size. `motion` may be NULL.
// Errors are those of Solver.run.
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

double cycle_flow_steps(const CycleFlow *flow); // solver steps so far

// The scaled return map over `period` cycles from orbit->y, with the contact states that the flow
// keeps: the end, and its matrix where `has_matrix`. Returns the largest change by the map; NAN: it
// failed. `status` is that of the run.
double cycle_flow_map(CycleFlow *flow, size_t period, bool has_matrix, Status *status);

// The multipliers of the matrix. STATUS_OK or STATUS_NO_MEMORY.
Status cycle_flow_multiply(CycleFlow *flow);

// Newton's method from the present state. The flow moves onto the orbit, of which the multipliers
// are found too, or returns if there is none.
Status cycle_flow_shoot(CycleFlow *flow, size_t period);

// Moves over at most `cycles` until a periodic motion of at most max_period cycles attracts the
// flow, and onto that. Near an unstable orbit it goes on for as long as leaving that takes, up to
// twice as many more.
Status cycle_flow_settle(CycleFlow *flow, size_t cycles, size_t max_period);

// Moves over `cycles` and returns the largest Lyapunov exponent [1/s]; NAN: unknown. The
// displacement and velocity of the top storey after each of the first `points` cycles are written
// to `section`.
Status cycle_flow_run_aperiodic(CycleFlow *flow, size_t cycles, double *exponent, size_t points,
                                double (*section)[2], CycleMotion *motion);

#endif
