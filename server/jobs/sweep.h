// A sweep under way: its chunks go to an executor, their rows come back and are stored chunk by
// chunk, and the last one ends its jobs. Not how chunks are run (executor.h, threads.c) and not the
// points (core/study/sweep_plan.h). Used by worker.c, intake.c and threads.c, with the intake's
// lock where it says so.
#ifndef SERVER_JOBS_SWEEP_H
#define SERVER_JOBS_SWEEP_H

#include "core/study/sweep_run.h"
#include "server/base/bytes.h"
#include "server/jobs/executor.h"
#include "server/jobs/worker.h"

// A chunk that a thread makes, or will.
typedef struct SweepPart {
    struct SweepPart *next;
    size_t chunk;
    size_t place;  // row that comes next
    bool is_again; // its rows were loaded: those that came to nothing are made anew
    bool is_computed;
    SweepChunkRow row; // as it goes to the store
    Bytes reasons;
} SweepPart;

struct SweepRun {
    SweepRun *next; // in the intake's list
    Intake *intake;
    Computation *computation;
    const Executor *executor;
    SweepPlan *plan;
    SweepRow row;
    Findings findings;
    atomic_size_t done, failed; // points; the failed ones are done too
    // Under the intake's lock:
    SweepPart *first, *last; // that wait
    size_t in_hand;          // parts that threads have
    size_t left;             // chunks that the store has not
    double turn;             // [s] that a turn takes, about
    bool is_paused;          // until there is room in the store
    bool is_told;            // that it is
    bool is_failed;          // findings say how
};

// Judges every point, makes the plan of chunks durable or finds it, and what is done of it. Fills
// findings->answer and computation->sweep. Stops when `watch` says so.
Status sweep_open(Worker *worker, Computation *computation, Findings *findings, const Watch *watch,
                  Problem *problem);
// Hands what is left to the executor; takes the computation and the findings. From here on
// whoever takes its last part ends it.
void sweep_launch(Intake *intake, Computation *computation, Findings *findings, Problem *problem);
void sweep_free(SweepRun *run); // NULL is fine

// With the lock held, by whoever took its turn from the queue: a part to work on. NULL: there is
// nothing to do but to end it, where *is_ended says so.
SweepPart *sweep_take(SweepRun *run, bool *is_ended);
// Without it: works on the part until it is done, or others are to have their turn. Then the run
// may be no more.
void sweep_work(Worker *worker, SweepRun *run, SweepPart *part, Problem *problem);
// Ends it: successful, failed or abandoned. Frees it with its computation.
void sweep_end(Intake *intake, SweepRun *run);
// With the lock held: nobody wants it any more.
void sweep_stop(SweepRun *run);
// With the lock held: those that wait for room in the store try again.
void sweeps_resume(Intake *intake);

// With the lock held, by executors: a part waits for a thread.
void sweep_wait(SweepRun *run, SweepPart *part, bool is_first);
void sweep_part_free(SweepPart *part);

// Without it: makes the part's rows. STATUS_BUSY: others are to have their turn, the rest comes
// later.
enum { SWEEP_TURN_MS = 10 }; // that is not interrupted for others
Status sweep_part_make(Worker *worker, SweepRun *run, SweepPart *part, Problem *problem);
// A Watch's advance: whether the sweep, a SweepRun, is still wanted.
bool sweep_goes_on(void *run, double fraction);

// How a chunk's rows lie in its bytes.
size_t sweep_rows_of(const SweepRow *row, size_t chunk);
size_t sweep_row_size(const SweepRow *row);
double sweep_row_cell(const unsigned char *row, size_t cell); // 0 its status, 1 ... its metrics
SweepStatus sweep_row_status(const SweepRow *row, const SweepChunkRow *chunk, size_t place);
void sweep_row_values(const SweepRow *row, const SweepChunkRow *chunk, size_t place,
                      double *values);
void sweep_row_put(const SweepRow *row, SweepChunkRow *chunk, size_t place, SweepStatus status,
                   const double *values);
// Why the row at `place` failed, into `why`; "" where it is not told.
void sweep_row_reason(const SweepChunkRow *chunk, size_t place, char *why, size_t size);

#endif
