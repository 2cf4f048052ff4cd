// The study "sweep": one scene at many points, each with some members changed, a grid or a list of
// them.
#ifndef CORE_STUDY_SWEEP_H
#define CORE_STUDY_SWEEP_H

#include "core/study/axis.h"

enum {
    SWEEP_METRICS = 16,
    SWEEP_POINTS = 1000000, // where the limits say nothing
};

typedef enum SweepMode { SWEEP_GRID, SWEEP_LIST } SweepMode;
extern const char *const sweep_mode_names[];

// The request.
typedef struct SweepStudy {
    Variant variant;
    StudyAxes axes; // of a grid the last one varies fastest
    int mode;       // SweepMode
    Texts metrics;
    StudyNames names;
} SweepStudy;

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
    Texts pointers; // tied members; none: the one
    Texts values;
} SweepAxisValues;

typedef struct SweepAxesValues {
    SweepAxisValues *at;
    size_t count;
} SweepAxesValues;

extern const Field sweep_axis_values_fields[], sweep_failure_fields[]; // of a StudyFailure

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

// An axis of a grid.
typedef struct SweepValues {
    const StudyAxis *axis;
    size_t count, stride; // point p has value (p / stride) % count
    const Field *field;   // NULL: the pointer is faulty, the axis changes nothing
    bool is_tag;
} SweepValues;

// Immutable, shared by threads.
typedef struct SweepGrid {
    const SweepStudy *study;
    const Simulation *simulation;
    size_t points, axis_count;
    SweepValues axes[];
} SweepGrid;

// Borrows study and simulation, both completed (the study by its rows at least). Adds all faults of
// axes below "/study/axes"; `limits` NULL: without a limit on the points. *grid is freed by
// sweep_grid_free also after STATUS_INVALID, where it may be there: then only pointers are faulty.
Status sweep_grid_new(const SweepStudy *study, const Simulation *simulation,
                      const SimulationLimits *limits, SweepGrid **grid, Problem *problem);
void sweep_grid_free(SweepGrid *grid);

// The completed scene of a point: the sweep's own with this point's values. `is_bare`: without
// output, as a row needs it. Cleared by simulation_clear in any case. Faults have the pointers of
// that scene.
Status sweep_grid_scene(const SweepGrid *grid, size_t point, bool is_bare,
                        const SimulationLimits *limits, Simulation *target, Problem *problem);

// Validates every point if that is no more work than `scenes` small scenes, else about as many as
// that: points where one axis alone leaves its first value, of long axes a sample, and the last
// one. Each fault has the pointer of the value that causes it, and the number of its point.
// `progress`, asked before each point, may stop it.
Status sweep_grid_validate(const SweepGrid *grid, size_t scenes, const SimulationLimits *limits,
                           const Progress *progress, Problem *problem);

#endif
