// A study under way: its members go to an executor chunk by chunk, what they come to is gathered,
// and the last one ends its jobs. Not how chunks are run (executor.h, threads.c), not what becomes
// of their members (gather.h) and not the members (core/study/study.h). Used by worker.c, intake.c
// and threads.c, with the intake's lock where it says so.
#ifndef SERVER_JOBS_STUDY_H
#define SERVER_JOBS_STUDY_H

#include "server/jobs/executor.h"
#include "server/jobs/worker.h"
#include "server/util/bytes.h"

// A chunk that a thread makes, or will.
typedef struct ChunkRun {
    struct ChunkRun *next;
    Chunk chunk;
    size_t done;         // of its members, the first ones
    bool is_begun;       // gather->begin was called
    bool is_made;        // all of them
    bool recompute_only; // rows were loaded: those that came to nothing are made anew
    SweepChunkRow row;   // of a sweep, as it goes to the store
    Bytes reasons;
} ChunkRun;

struct StudyRun {
    StudyRun *next; // in the intake's list
    JobManager *manager;
    Task *task;
    const Executor *executor;
    const struct StudySink *gather;
    StudyWork *work;
    struct Fold *fold;                    // of what is folded in memory
    size_t bytes;                         // that it holds, about
    SweepRow row;                         // of a sweep
    atomic_size_t rows_done, rows_failed; // of a sweep; the failed ones are done too
    RunResult run_result;
    atomic_size_t expected;          // members
    atomic_uint_fast64_t millionths; // of members, that are done
    atomic_bool is_over;             // all that is wanted is there, or it has failed
    // Under the intake's lock:
    ChunkRun *first, *last; // that wait
    size_t in_hand;         // shifts that threads have
    size_t left;            // of a sweep, chunks that the store has not
    double turn;            // [s] that a turn takes, about
    bool is_paused;         // until there is room in the store
    bool is_told;           // that it is
    bool is_failed;         // findings say how
};

// Whether its study has members, which are shared out.
bool study_is_shared(const Task *task);
// What it will take and what of that its client is charged for when it begins, for the queue: the
// members of a study have turns of their own.
void study_estimate(Task *task, const SimulationLimits *limits);

// Makes ready: a worker's part of the way, until there are members to be shared out. Fills
// findings->answer and computation->study. Stops when `watch` says so.
Status study_open(Worker *worker, Task *task, RunResult *run_result, const Progress *watch,
                  Problem *problem);
// Hands the members to the executor; takes the computation and the findings. From here on whoever
// takes its last chunk ends it.
void study_start(Worker *worker, Task *task, RunResult *run_result, Problem *problem);
void study_run_free(StudyRun *run); // NULL is fine

// With the lock held, by whoever took its turn from the queue: a chunk to work on. NULL: there is
// nothing to do but to end it, where *is_ended says so.
ChunkRun *study_take(StudyRun *run, bool *is_ended);
// Without it: works on the chunk until it is done, or others are to have their turn. Then the run
// may be no more.
void study_work(Worker *worker, StudyRun *run, ChunkRun *chunk_run, Problem *problem);
// Ends it: successful, failed or abandoned. Frees it with its computation.
void study_finish(Worker *worker, StudyRun *run, Problem *problem);
// With the lock held: nobody wants it any more.
void study_stop(StudyRun *run);
// With the lock held: whether those that are under way hold so much that this one is to wait.
bool study_must_wait(const JobManager *manager, const Task *task);
// With the lock held: those that wait for room try again.
void studies_resume(JobManager *manager);

// With the lock held, by executors: a chunk waits for a thread.
void study_wait(StudyRun *run, ChunkRun *chunk_run, bool is_first);
void chunk_run_free(StudyRun *run, ChunkRun *chunk_run); // NULL is fine

// Without it: makes the chunk's members. STATUS_BUSY: others are to have their turn, the rest comes
// later.
enum { STUDY_TURN_MS = 10 }; // that is not interrupted for others
Status study_chunk_make(Worker *worker, StudyRun *run, ChunkRun *chunk_run, Problem *problem);
// A Progress's advance: whether the study, a StudyRun, goes on.
bool study_continues(void *run, double fraction);
// Members were there before.
void study_count(StudyRun *run, size_t members);

#endif
