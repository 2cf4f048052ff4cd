// A sweep's rows as they are in the store, finished or under way: its table, and one of its points.
// Not making them (sweep.h) and not JSON. Used by api/sweeps.c.
#ifndef SERVER_JOBS_SWEEP_ROWS_H
#define SERVER_JOBS_SWEEP_ROWS_H

#include "core/study/inquiry.h"
#include "core/study/sweep.h"
#include "server/store/store.h"

// A sweep read back. All zero is empty.
typedef struct SweepShow {
    SweepRow row;
    Inquiry inquiry; // with its study
    Sweep *sweep;    // the answer, its table filled where it was asked for
    uint64_t chunks_done;
    bool is_complete; // every chunk is there and none is open
} SweepShow;

// By its result, or (`is_job`) by a job that makes it or did. `has_rows`: the table too. Cleared by
// sweep_show_clear in any case.
Status sweep_show_load(Store *store, const char *id, bool is_job, bool has_rows, SweepShow *show,
                       Problem *problem);
void sweep_show_clear(SweepShow *show);

// One point of it.
typedef struct SweepPointShow {
    SweepStatus status;
    char why[200];  // "" unless it failed
    double *values; // of the metrics; freed by the caller
    Inquiry scene;  // completed, as it can be submitted; by inquiry_clear
} SweepPointShow;
// STATUS_NOT_FOUND beyond the last. Cleared by the caller in any case.
Status sweep_point_load(Store *store, const SweepShow *show, uint64_t point, SweepPointShow *target,
                        Problem *problem);

#endif
