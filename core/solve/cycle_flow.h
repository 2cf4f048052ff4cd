// The exact motion over whole cycles of a sine base, from any state, and the linearised motion
// beside it: the return map of a section at the upward zero crossing of the sine; and its fixed
// points by shooting: periodic orbits, with their stability.
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

// --- periodic orbits ---

// Scratch memory for motions of one size, and what the last search found. Numbers of the state are
// scaled by cycle_flow_scales.
typedef struct OrbitSearch {
    size_t size, max_period;
    double *scales, *y, *end; // y: the orbit's state at the section
    double *matrix;           // of the return map at y
    double *real, *imaginary; // its eigenvalues: the Floquet multipliers, the largest first
    double *step, *columns, *left, *history, *first;
    double *block;
} OrbitSearch;

// STATUS_NO_MEMORY. Freed by orbit_search_clear.
Status orbit_search_make(OrbitSearch *search, size_t size, size_t max_period);
void orbit_search_clear(OrbitSearch *search);

// The scaled return map over `period` cycles from search->y, with the contact states that the flow
// keeps: the end, and its matrix where `has_matrix`. Returns the largest change by the map; NAN: it
// failed. `status` is that of the run.
double orbit_search_map(OrbitSearch *search, CycleFlow *flow, size_t period, bool has_matrix,
                        Status *status);

// The multipliers of `matrix`. STATUS_OK or STATUS_NO_MEMORY; NAN where they were not found.
Status orbit_search_multiply(OrbitSearch *search);
// The magnitude of the largest one.
double orbit_search_radius(const OrbitSearch *search);

// Newton's method from the present state. The flow moves onto the orbit, of which the multipliers
// are found too, or returns if there is none.
Status orbit_search_shoot(OrbitSearch *search, CycleFlow *flow, size_t period, bool *is_found,
                          Problem *problem);

// Moves the flow over at most `cycles` until a periodic motion attracts it, and onto that. `period`
// is its number of cycles, or 0: none of at most max_period cycles was found.
Status orbit_search_settle(OrbitSearch *search, CycleFlow *flow, size_t cycles, size_t *period,
                           Problem *problem);

// Moves over `cycles` and returns the largest Lyapunov exponent per cycle; NAN: unknown. The
// displacement and velocity of the top storey after each of the first `points` cycles are written
// to `section`.
Status orbit_search_wander(OrbitSearch *search, CycleFlow *flow, size_t cycles, double *exponent,
                           size_t points, double (*section)[2], CycleMotion *motion);

// Whether a failure ends only the search, of which the problem is then cleared.
static inline bool orbit_search_is_lost(Status status, Problem *problem) {
    const bool is_lost = status == STATUS_UNSTABLE || status == STATUS_LIMIT;
    if (is_lost)
        problem_clear(problem);
    return is_lost;
}

#endif
