// The study "sweep": one scene at many points, each with some members changed, a grid or a list of
// them.
#ifndef CORE_STUDY_SWEEP_H
#define CORE_STUDY_SWEEP_H

#include "core/study/study.h"
#include "core/study/sweep_grid.h"

extern const char *const sweep_spacing_names[], *const sweep_mode_names[];
extern const Field pinned_record_fields[];

// The metrics of a point: the summary's numbers in their order, then the solver's steps.
extern const char *const sweep_metric_names[]; // NULL-terminated
const char *sweep_metric_unit(const char *name);

// Result of a point. The numbers are stored: never change them.
typedef enum SweepStatus {
    SWEEP_MADE = 0,
    SWEEP_INVALID = 1, // not run: its scene is invalid
    SWEEP_UNSTABLE = 2,
    SWEEP_LIMIT = 3,
    SWEEP_FAILED = 4,  // for another reason
    SWEEP_PENDING = 5, // not yet made; never stored
    SWEEP_STATUSES
} SweepStatus;
extern const char *const sweep_status_names[];

// An axis of the answer: all its values.
typedef struct SweepAxisValues {
    char *pointer, *unit;
    Texts values;
} SweepAxisValues;

typedef struct SweepAxesValues {
    SweepAxisValues *at;
    size_t count;
} SweepAxesValues;

// Rows by position, as far as they are made.
typedef struct SweepTable {
    uint64_t failed;
    Reals points;           // their numbers, from 0, rising
    Reals statuses;         // SweepStatus of each
    Reals values;           // row by row, one number for each metric; NAN: unknown
    StudyFailures failures; // by SweepStatus
} SweepTable;

// The answer.
typedef struct Sweep {
    Variant variant;
    uint64_t points; // requested
    int mode;        // SweepMode
    SweepAxesValues axes;
    Texts metrics;
    SweepTable table; // all absent in a result whose rows are stored beside it
} Sweep;

// Fills all but the table.
Status sweep_describe(const SweepStudy *study, const Simulation *simulation, Sweep *sweep,
                      Problem *problem);

// Index of a point's value on an axis.
size_t sweep_value_index(const Sweep *sweep, size_t axis, size_t point);

SweepStatus sweep_status(Status status); // of a run
// The metrics of a run; NAN where unknown.
void sweep_values(const Texts *metrics, const RunRecord *run, double *values);

#endif
