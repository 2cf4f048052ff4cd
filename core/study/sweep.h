// The study "sweep": one scene at many points, each with some members changed, a grid or a list of
// them. What is asked, and the table that answers. Not how: sweep_plan.h makes the points' scenes,
// sweep_run.h runs one, server/jobs runs all. Used by whoever shows a table or a chart.
#ifndef CORE_STUDY_SWEEP_H
#define CORE_STUDY_SWEEP_H

#include "core/study/study.h"

enum {
    SWEEP_AXES = 64,
    SWEEP_AXIS_VALUES = 1 << 20,
    SWEEP_METRICS = 16,
    SWEEP_POINTS = 1000000, // where the limits say nothing
};

typedef enum SweepSpacing { SWEEP_LINEAR, SWEEP_LOGARITHMIC } SweepSpacing;
typedef enum SweepMode { SWEEP_GRID, SWEEP_LIST } SweepMode;
extern const char *const sweep_spacing_names[], *const sweep_mode_names[];

// What is asked of one axis: values, or a range.
typedef struct SweepAxis {
    char *pointer; // into the completed scene
    Texts values;  // scalars as JSON text
    double from, to;
    uint64_t count;
    int spacing; // SweepSpacing; CHOICE_ABSENT beside values
} SweepAxis;

typedef struct SweepAxes {
    SweepAxis *at;
    size_t count;
} SweepAxes;

typedef struct Buffers {
    Buffer *at;
    size_t count;
} Buffers;

// A record that an axis names, as it was when the sweep was submitted.
typedef struct PinnedRecord {
    char *name, *digest;
    Shared *named; // a NamedRecord; NULL: not found yet
} PinnedRecord;

typedef struct PinnedRecords {
    PinnedRecord *at;
    size_t count;
} PinnedRecords;
extern const Field pinned_record_fields[];

// What is asked.
typedef struct SweepStudy {
    Study study;
    SweepAxes axes; // of a grid the last one varies fastest
    int mode;       // SweepMode
    Texts metrics;
    Buffers materials;     // the numbers of every material that the scene or an axis names
    PinnedRecords records; // the ground motions that an axis names
} SweepStudy;

// What a point can be measured by: the summary's numbers in their order, then the solver's steps.
extern const char *const sweep_metric_names[]; // NULL-terminated
const char *sweep_metric_unit(const char *name);

// What became of a point. The numbers are kept: never change them.
typedef enum SweepStatus {
    SWEEP_MADE = 0,
    SWEEP_INVALID = 1, // judged impossible: not begun
    SWEEP_UNSTABLE = 2,
    SWEEP_LIMIT = 3,
    SWEEP_FAILED = 4,  // for another reason
    SWEEP_PENDING = 5, // not yet there; never kept
    SWEEP_STATUSES
} SweepStatus;
extern const char *const sweep_status_names[];

// An axis as it is told: all its values.
typedef struct SweepAxisValues {
    char *pointer, *unit;
    Texts values;
} SweepAxisValues;

typedef struct SweepAxesValues {
    SweepAxisValues *at;
    size_t count;
} SweepAxesValues;

// Points that failed in one way.
typedef struct SweepFailure {
    int status; // SweepStatus
    uint64_t count, first_point;
    char *detail; // of the first
} SweepFailure;

typedef struct SweepFailures {
    SweepFailure *at;
    size_t count;
} SweepFailures;

// Rows by position, as far as they are there.
typedef struct SweepTable {
    uint64_t failed;
    Reals points;   // their numbers, from 0, rising
    Reals statuses; // SweepStatus of each
    Reals values;   // row by row, one number for each metric; NAN: unknown
    SweepFailures failures;
} SweepTable;

// The answer.
typedef struct Sweep {
    Variant variant;
    uint64_t points; // asked for
    int mode;        // SweepMode
    SweepAxesValues axes;
    Texts metrics;
    SweepTable table; // all absent in a result: its rows are kept beside it
} Sweep;

// Which of an axis's values point `point` has.
size_t sweep_value_index(const Sweep *sweep, size_t axis, size_t point);

// Points that are asked for; SIZE_MAX where they are more than can be counted.
size_t sweep_points(const SweepStudy *study);

// Fills all but the table.
Status sweep_describe(const SweepStudy *study, const Simulation *simulation, Sweep *sweep,
                      Problem *problem);

// Adds a point that failed to those that failed in the same way. STATUS_NO_MEMORY.
Status sweep_add_failure(SweepFailures *failures, SweepStatus status, uint64_t point,
                         const char *detail);

// Result of a point, a part of the study's members: freed with it.
typedef struct SweepPart {
    SweepStatus status;
    char *why; // NULL where it was made
    double values[];
} SweepPart;

extern const StudyMembers sweep_members;

#endif
