// Studies, made by several threads, and the rows of sweeps as they are written to the database.
#ifndef SERVER_JOBS_STUDY_H
#define SERVER_JOBS_STUDY_H

#include "server/jobs/jobs_private.h"
#include "server/jobs/sweep.h"

// The members of one study, folded in their order.
//
//     folded | window: made and waiting, being made, or not begun | not yet to be begun
//
// The window bounds the memory of the parts that wait.
typedef struct StudyEngine {
    StudyWork *work;
    const SimulationLimits *limits;
    Progress progress;      // fraction of the members that are made; called by many threads at once
    atomic_bool is_over;    // all that is wanted is there, or the study ends without it
    atomic_size_t expected; // members
    atomic_uint_fast64_t millionths; // of members, that are made
    // Under the lock:
    pthread_mutex_t lock;
    pthread_cond_t changed; // a part was folded, or the study is over
    StudyPart **parts;      // member i's at i % window
    size_t window, wanted;  // members
    size_t folded, begun;   // of them, the first ones
    bool is_folding;
} StudyEngine;

// `slots` threads make members; 0: the parts are not folded. Borrows all. Closed by
// study_engine_close, also after a failure.
Status study_engine_open(StudyEngine *engine, StudyWork *work, const SimulationLimits *limits,
                         const Progress *progress, size_t slots, Problem *problem);
void study_engine_close(StudyEngine *engine);
// Takes the next member to be made. False: the study is over or, unless `may_wait`, there is none
// before others are folded.
bool study_engine_next(StudyEngine *engine, bool may_wait, size_t *member);
bool study_engine_has_next(StudyEngine *engine);
// Folds the part and all that wait behind it, or keeps it until those before it are there. Takes
// the part.
Status study_engine_fold(StudyEngine *engine, size_t member, StudyPart *part, Problem *problem);
// So many more members were made; reports progress.
void study_engine_count(StudyEngine *engine, size_t members);

// A chunk that waits or is being made.
typedef struct SweepChunk {
    struct SweepChunk *next;
    size_t count, done; // rows
    bool is_loaded;     // its rows are allocated
    bool is_retry;      // rows that failed are made again, the others are there
    bool is_saved;
    SweepChunkRow row;
    Bytes reasons;
} SweepChunk;

// A study of the daemon: its scene has run, the workers make its members turn by turn, and the
// worker of the last turn ends its jobs.
typedef struct StudyRun {
    struct StudyRun *next; // in the manager's list
    JobManager *manager;
    Task *task;
    StudyWork *work;
    StudyEngine engine;
    RunResult run_result;
    // Of a sweep, whose parts are not folded: rows in the database, chunk by chunk.
    bool is_sweep;
    bool is_clustered; // a cluster makes the members, not the workers
    ClusterStudy *cluster;
    SweepRow sweep;
    atomic_size_t chunks_left;            // that are not saved
    atomic_size_t rows_made, rows_failed; // the failed ones are made too
    // Under the manager's lock:
    SweepChunk *chunks;    // that wait
    double member_seconds; // that a member takes, about
    bool is_pause_logged;
    bool is_failed; // run_result says how
    ClusterView view;
} StudyRun;

// What a worker does for a study in one turn: it begins with a member or a chunk of rows, or ends
// the study.
typedef struct StudyTurn {
    StudyRun *run;
    size_t member;
    SweepChunk *chunk; // NULL: the members are folded
    bool is_end;
} StudyTurn;

// Begins the study of a task whose scene has run, and takes task and run_result unless it fails.
// The caller has a turn of it then, which study_leave ends.
Status study_start(Worker *worker, Task *task, RunResult *run_result, Problem *problem);
void study_leave(Worker *worker, StudyRun *run, Problem *problem);
double study_cpu(void *unused); // seconds of CPU of this thread, for StudyTools
// Makes members or ends the study. Both may be freed afterwards.
void study_work(Worker *worker, const StudyTurn *turn, Problem *problem);
void study_run_free(StudyRun *run); // NULL is fine
// How many chunks its members are made in, by their predicted cost and what runs at once.
size_t study_count_chunks(const StudyRun *run, size_t slots);
// Ends the study as failed, once its turns are over.
void study_run_fail(StudyRun *run, Status status, Problem *problem);

// A chunk whose rows are made elsewhere: restart, put each of them, save.
Status sweep_chunk_restart(StudyRun *run, SweepChunk *chunk, Problem *problem);
void sweep_chunk_put(const StudyRun *run, SweepChunk *chunk, const StudyPart *part);
Status sweep_chunk_save(StudyRun *run, SweepChunk *chunk, Problem *problem);
void sweep_chunk_free(SweepChunk *chunk); // NULL is fine

// With the manager's lock held:
// Begins the turn that was taken from the queue. False: there is nothing to do in it.
bool study_take(StudyRun *run, StudyTurn *turn);

#endif
