// Periodic motions under a sine: fixed points of the return map by shooting, and their stability.
#ifndef CORE_STUDY_PERIODIC_ORBIT_H
#define CORE_STUDY_PERIODIC_ORBIT_H

#include "core/solve/cycle_flow.h"

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
