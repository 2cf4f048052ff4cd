// What the jobs room knows, under one lock: jobs, the computations they share, the queue, the
// cache. Not the door (intake.h). Used by intake.c, job.c and worker.c.
#ifndef SERVER_JOBS_JOBS_PRIVATE_H
#define SERVER_JOBS_JOBS_PRIVATE_H

#include <pthread.h>
#include <stdatomic.h>

#include "server/jobs/cache.h"
#include "server/jobs/job_metrics.h"
#include "server/jobs/jobs.h"
#include "server/jobs/naming.h"
#include "server/jobs/queue.h"
#include "server/jobs/result_summary.h"
#include "server/util/hashmap.h"

enum { OUTCOME_FAILURES = 64 };

struct StudyRun;

typedef struct Subscribers {
    Callback *at;
    size_t count;
} Subscribers;

// One computation of one scene, for all jobs and readers who want it.
typedef struct Task {
    HashMapEntry indexed; // in flight, by result; not once it was stopped
    char result[72];
    StudyRequest inquiry;
    char *scene, *warnings; // documents
    QueueEntry queued;      // also for the next turn of a study
    bool is_running;
    int64_t began_ns;
    bool recompute_only;        // only its series is wanted: the result is saved already
    Job *jobs;                  // those who wait for it, by next_shared
    Subscribers result_waiters; // readers of the outcome
    atomic_bool is_stopped;
    atomic_uint progress;   // in 1/10,000
    struct StudyRun *study; // that is under way, under the lock
    struct Task *next_stalled;
} Task;

// A job goes to the store twice: when it is accepted and when it is final. Both are posted; where
// the second comes before the first was begun, the first is withdrawn. `row` is what others see.
struct Job {
    HashMapEntry indexed; // live, by id
    atomic_size_t refcount;
    JobManager *manager; // held, for its lock; NULL: read from the store, never changes
    JobRow row;
    JobRow insert_row, final_row; // as posted; both borrow row's texts, but for closing.problem
    PendingWrite *ticket;         // of `opening`, until the store has answered or it was withdrawn
    bool is_closing;              // its last state is on the way to the store
    bool is_kept;                 // the store has it as `row` shows it
    Status refusal;               // why not
    char refused[256];
    size_t scene_size;     // in bytes, counted while it is live
    bool is_live;          // in the index, which holds it
    bool is_counted;       // takes a place in the queue
    ResultSummary *head;   // of the result
    Task *task;            // NULL: not yet or no more
    QueueClient *client;   // NULL while it was not admitted
    Job *next_keyed;       // in intake->keyed
    Job *next_undismissed; // in intake->undismissed
    Job *next_shared;
    int64_t submitted_ns, started_ns;
    Subscribers subscribers, save_waiters; // for when it is finished; for when it is kept
};

typedef struct Failure {
    char result[72];
    Status status;
    char detail[256];
} Failure;

typedef struct Worker {
    JobManager *manager;
    pthread_t thread;
    Task *running;          // or NULL
    struct StudyRun *study; // of which it has a turn, or NULL
    bool is_spare;       // beyond the number asked for: takes quick work while all others are slow
    Workspace workspace; // of its thread alone
} Worker;

struct JobManager {
    atomic_size_t refcount; // the owner's and one of each Job: a job may be looked at after the
                            // intake has closed
    Db *db;
    JobManagerSettings settings;
    pthread_mutex_t lock;
    pthread_cond_t work;       // for a worker, or room for what it makes
    pthread_cond_t spare_work; // for the spare worker alone
    pthread_cond_t settled;    // nothing is posted any more
    pthread_cond_t keys_free;  // a IdempotencyHold was given up
    pthread_mutex_t retries;   // retries of sweeps come one by one; taken before `lock`
    Naming naming;             // taken before `lock`
    struct IdempotencyHold *keys;
    Job *keyed;          // held, by next_keyed: came with a key, and the store may not have them
    Worker *workers;     // settings.workers of them, and the spare one
    size_t worker_count; // started
    size_t slow_running;
    double pace; // run time over what was foretold, of late
    bool is_closing;
    HashMap *jobs;                   // not yet finished
    HashMap *in_flight;              // computations
    Queue *queue;                    // of computations
    struct StudyRun *studies;        // under way
    size_t study_count, study_bytes; // of them, and that they hold
    Task *waiting_for_memory;        // studies that could not begin for want of room
    size_t live;                     // jobs not yet finished
    size_t scene_bytes;              // of them all
    size_t posted;                   // writes that the store has yet to answer
    size_t saving, saving_bytes;     // computations that have run and are not yet saved
    struct Saving *retry_commits;    // of these, what waits for room in the store
    Job *retry_cancels;              // held: dismissed, but the store could not be told
    Cache *cache;
    CacheStats rows, stored;            // results and series found in the database
    size_t keeping_bytes;               // of series on the way there
    atomic_int large_plans;             // requests that plan large structures
    Failure failures[OUTCOME_FAILURES]; // of computations for readers, told once
    size_t next_failure;
    JobMetrics totals;
};

bool subscribers_add(Subscribers *subscribers, const Callback *callback); // false without memory
void subscribers_remove(Subscribers *subscribers, const Callback *callback);
void subscribers_call(Subscribers *subscribers); // calls and forgets all

Job *job_new(JobManager *manager); // one hold; NULL without memory

Task *task_new(const char *result);
void task_free(Task *task);

void jobs_drop(JobManager *manager); // frees what is left with the last hold

// Held for the caller; NULL if no such job is in memory.
Job *jobs_find_live(JobManager *manager, const char *id);

// With the lock held: what jobs_retry_sweep does for jobs that were dismissed.
void jobs_retry_dismissed(JobManager *manager);
// Nobody else is there any more: what waits for room stays unfinished in the store.
void jobs_abandon_delayed(JobManager *manager);

// With the lock held.
// Gives back its place in the queue; it can still be found.
void jobs_release(Job *job);
void jobs_retire(Job *job); // it is live no more; drops the index's hold
// `client` NULL: ahead of all.
void jobs_enqueue(JobManager *manager, Task *task, QueueClient *client);
void jobs_call_worker(JobManager *manager); // something was put into the queue
Task *task_of(QueueEntry *entry);
void jobs_admit(JobManager *manager, Job *job); // it is live, held by the index
void jobs_attach(Job *job, Task *task);
void jobs_detach(Job *job); // from its computation, which stops when nobody is left
// The store has answered one of the posted writes.
void jobs_settle(JobManager *manager);
// It could not be kept: whoever waits is told, and it is live no more.
void jobs_refuse(Job *job, Status status, const char *detail);
// What was posted first need not be written if it was not begun.
void jobs_withdraw(Job *job);

// An unfinished job of the store, from an earlier life. Takes the row. Only what concerns the whole
// program is an error.
Status jobs_take_up(JobManager *manager, JobRow *row, Problem *problem);

// What a computation came to, as documents.
typedef struct RunResult {
    Status status;
    Outcome *outcome;   // NULL unless STATUS_OK
    StudyAnswer answer; // its study NULL where none was asked for
    ResultRow result;
    char *problem; // of failed jobs
    char detail[256];
    int64_t began_ns, ended_ns;
    double seconds; // of CPU, of the scene's own run
} RunResult;
void run_result_clear(RunResult *run_result);

// Without the lock. Takes the computation, which has run, and what is in `findings`: saves them
// with the jobs that wait for them, and says that these are finished once that is durable.
void jobs_save(JobManager *manager, Task *task, RunResult *run_result);
// Whether what failed is worth another try: a full disk and the like pass.
bool status_is_transient(Status status);
// With the lock held: whether a worker should wait before it makes more to be saved.
bool jobs_is_behind(const JobManager *manager);

// Without the lock: has the series kept by the store if it is dearer to compute than to read.
void jobs_keep_series(JobManager *manager, const char *result, const Outcome *outcome,
                      double seconds);

void *worker_main(void *worker);

#endif
