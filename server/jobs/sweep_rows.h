// A sweep's rows as they are in the store, finished or under way: its table, and one of its points.
// Not making them (sweep.h) and not JSON. Used by api/sweeps.c.
#ifndef SERVER_JOBS_SWEEP_ROWS_H
#define SERVER_JOBS_SWEEP_ROWS_H

#include "core/study/study.h"
#include "core/study/sweep.h"
#include "server/db/db.h"

// A sweep read back. All zero is empty.
typedef struct SweepView {
    SweepRow row;
    StudyRequest inquiry; // with its study
    Sweep *sweep;         // the answer; of its table what failed, where it was asked for
    Db *db;
    SweepChunkRows chunks; // that are there, without their rows
    size_t rows;           // of those
    bool is_complete;      // every chunk is there and none is open
    // What was read last: of each chunk the rows at `places` places from `place` on.
    unsigned char *window;
    size_t place, places;
    bool is_loaded;
} SweepView;

// By its result, or (`is_job`) by a job that makes it or did. `has_rows`: what failed too. Cleared
// by sweep_view_clear in any case.
Status sweep_view_load(Db *db, const char *id, bool is_job, bool has_rows, SweepView *show,
                       Problem *problem);
void sweep_view_clear(SweepView *show);

// Cell `cell` (0 the point, 1 its status, 2 ... the metrics) of rows first ... first + count - 1,
// which stand in the order of their points; `show` is a SweepView. Memory is one window, whatever
// their number. False: the rows are no longer what they were when it was loaded, or cannot be read.
bool sweep_view_read(void *show, size_t cell, size_t first, size_t count, double *target);

// One point of it.
typedef struct SweepPointView {
    SweepStatus status;
    char why[200];      // "" unless it failed
    double *values;     // of the metrics; freed by the caller
    StudyRequest scene; // completed, as it can be submitted; by study_request_clear
} SweepPointView;
// STATUS_NOT_FOUND beyond the last. Cleared by the caller in any case.
Status sweep_point_load(Db *db, const SweepView *show, uint64_t point, SweepPointView *target,
                        Problem *problem);

#endif
