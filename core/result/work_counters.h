// Counters of the work done in a run; equal on every machine. The engines update them once per
// block, not per sample. Work that was not needed counts 0.
#ifndef CORE_RESULT_WORK_COUNTERS_H
#define CORE_RESULT_WORK_COUNTERS_H

#include "core/base/field.h"

typedef struct WorkCounters {
    uint64_t base_samples;      // samples of base motion generated
    uint64_t flight_samples;    // samples of flight in whole intervals, base moving
    uint64_t unforced_samples;  // samples of flight in closed form, base at rest
    uint64_t mode_samples;      // modes times samples
    uint64_t arcs;              // Taylor series steps
    uint64_t steps;             // steps of a time-stepping solver and of power-law contacts
    uint64_t stop_searches;     // searches for a stop within a block of flight
    uint64_t contacts;          // contacts of finite duration
    uint64_t bounces;           // instantaneous impacts
    uint64_t rests;             // intervals of a mass at rest on its stop
    uint64_t neighbour_samples; // samples of the companion run that estimates the error
    uint64_t ledger_rows;       // impacts listed
    uint64_t channel_values;    // values written to channels
    uint64_t spectrum_segments; // segments transformed
} WorkCounters;

extern const Field work_counters_fields[];

// Adds the counters of `other` to `work`.
void work_counters_add(WorkCounters *work, const WorkCounters *other);

#endif
