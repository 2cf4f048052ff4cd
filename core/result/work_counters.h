// What a run really did, counted: the same scene counts the same on any machine. Filled by the
// engines, stretch by stretch and never sample by sample in a long loop; what was left out stays 0.
// Not a time and not a foretold cost (simulation.h). Used by solve/, simulation/ and the documents.
#ifndef CORE_RESULT_WORK_COUNTERS_H
#define CORE_RESULT_WORK_COUNTERS_H

#include "core/base/field.h"

typedef struct Work {
    uint64_t base_samples;      // of the base's motion, made
    uint64_t flight_samples;    // passed in flight by whole intervals, under a moving base
    uint64_t unforced_samples;  // the same in closed form, where the base is still
    uint64_t mode_samples;      // modes times samples
    uint64_t arcs;              // stretches followed by their series
    uint64_t steps;             // of a solver that steps, and of contacts under a power law
    uint64_t stop_searches;     // stretches of flight that were searched for a stop
    uint64_t contacts;          // that have a length
    uint64_t bounces;           // that have none
    uint64_t rests;             // of a mass at its stop
    uint64_t neighbour_samples; // of the run beside this one that tells its error
    uint64_t ledger_rows;       // kept
    uint64_t channel_values;    // written
    uint64_t spectrum_segments; // transformed
} Work;

extern const Field work_fields[];

// Adds what another run did.
void work_add(Work *work, const Work *other);

#endif
