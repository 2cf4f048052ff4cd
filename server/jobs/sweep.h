// The rows of a sweep in the database: made chunk by chunk, and read back, also while they are
// made. Chunk i has the points i, i + chunks, i + 2 chunks ...: cost varies along an axis, so that
// chunks cost about the same.
#ifndef SERVER_JOBS_SWEEP_H
#define SERVER_JOBS_SWEEP_H

#include "core/study/study.h"
#include "core/study/sweep.h"
#include "server/db/db.h"
#include "server/util/bytes.h"

// A row is a byte of status and then its metrics, in the order of the machine, which is
// little-endian.
size_t sweep_rows_of(const SweepRow *row, size_t chunk);
size_t sweep_row_size(const SweepRow *row);
// Status and metrics of the row at `place`; SWEEP_PENDING and NAN if it is not there.
SweepStatus sweep_row_get(const SweepRow *row, const SweepChunkRow *chunk, size_t place,
                          double *values);
void sweep_row_put(const SweepRow *row, SweepChunkRow *chunk, size_t place, SweepStatus status,
                   const double *values);

// A sweep read back. All zero is empty.
typedef struct SweepView {
    SweepRow row;
    StudyRequest inquiry; // with its study
    Sweep *sweep;         // the answer; of its table the failures, if they were requested
    Db *db;
    SweepChunkRows chunks; // that are there, without their rows
    size_t rows;           // of those
    bool is_complete;      // every chunk is there and none is open
    // What was read last: of each chunk the rows at `places` places from `place` on.
    unsigned char *window;
    size_t place, places;
    bool is_loaded;
} SweepView;

// By its result, or (`is_job`) by a job that makes it or did. Cleared by sweep_view_clear in any
// case. STATUS_BUSY: its rows were deleted meanwhile.
Status sweep_view_load(Db *db, const char *id, bool is_job, bool has_failures, SweepView *view,
                       Problem *problem);
void sweep_view_clear(SweepView *view);

// Cell `cell` (0 the point, 1 its status, 2 ... the metrics) of rows first ... first + count - 1,
// in the order of their points; `view` is a SweepView. Memory is one window, whatever their number.
// False: the rows have changed since it was loaded, or cannot be read.
bool sweep_view_read(void *view, size_t cell, size_t first, size_t count, double *target);

extern const char sweep_rows_changed[]; // the sentence of STATUS_BUSY

// One point of it.
typedef struct SweepPoint {
    SweepStatus status;
    char why[200]; // "" unless it failed
    double values[SWEEP_METRICS];
    StudyRequest scene; // completed, as it can be submitted
} SweepPoint;
// STATUS_NOT_FOUND beyond the last. Cleared by study_request_clear(&point->scene) in any case.
Status sweep_point_load(const SweepView *view, uint64_t index, SweepPoint *point, Problem *problem);

#endif
