// What the files of jobs/ share, under one lock: jobs, the tasks that compute for them, the queue.
#ifndef SERVER_JOBS_JOBS_PRIVATE_H
#define SERVER_JOBS_JOBS_PRIVATE_H

#include <pthread.h>
#include <stdatomic.h>

#include "server/jobs/jobs.h"
#include "server/jobs/queue.h"
#include "server/util/hashmap.h"
#include "server/util/metrics.h"

enum { OUTCOME_FAILURES = 64 };
#define STUDY_OWN 0.05 // of the progress, the scene's own run where a study follows

// Plan, summary, work and notes of a result as JSON, shared by all of its jobs.
typedef struct ResultSummary {
    atomic_size_t refcount;
    const char *plan, *summary, *work, *notes; // NULL: unknown
    size_t bytes;
} ResultSummary;
// Copies them out of `row`. One reference; NULL without memory.
ResultSummary *result_summary_new(const ResultRow *row);
// Of a stored result; NULL also without memory. STATUS_NOT_FOUND.
Status result_summary_load(Db *db, const char *result, ResultSummary **summary, Problem *problem);
ResultSummary *result_summary_ref(ResultSummary *summary); // NULL is accepted here and below
void result_summary_unref(ResultSummary *summary);

enum { METRICS_SOLVERS = 16, METRICS_WORK = 32, METRICS_STATES = JOB_DISMISSED + 1 };

typedef struct SolverMetrics {
    Counter runs, cpu_ns;
    Counter work[METRICS_WORK]; // by row of work_counters_fields
} SolverMetrics;

// What was done since the start.
typedef struct JobMetrics {
    Counter ended[METRICS_STATES];          // by final JobState
    Counter cached;                         // of those, answered without computing
    Histogram waited;                       // in the queue, of jobs that were computed
    SolverMetrics solvers[METRICS_SOLVERS]; // in the order of `solvers`
    Counter study_runs, study_cpu_ns;       // the scenes' studies, with all that ran in them
} JobMetrics;
void job_metrics_ended(JobMetrics *metrics, int state, bool is_cached);
void job_metrics_run(JobMetrics *metrics, const Outcome *outcome, int64_t cpu_ns);
void job_metrics_study(JobMetrics *metrics, bool is_begun, int64_t cpu_ns);

struct StudyRun;

typedef struct Subscribers {
    Callback *at;
    size_t count;
} Subscribers;

// What a run ends with.
typedef struct RunResult {
    Status status;
    Outcome *outcome;   // NULL unless STATUS_OK
    StudyAnswer answer; // its study is NULL where none was asked for
    ResultRow result;
    char *problem; // problem+json of a failed run
    char detail[256];
    int64_t began_ns, ended_ns;
    double seconds; // of CPU, of the scene's own run
} RunResult;

// The computation of one scene, for all jobs and readers that want it. It belongs to the queue,
// then to the worker that runs it, then to the commit of its result.
typedef struct Task {
    HashMapEntry indexed; // in manager->tasks, by result; not after it was stopped
    JobManager *manager;
    char result[72];
    StudyRequest inquiry;
    char *scene, *warnings;            // documents
    QueueEntry queued;                 // also for the next chunk of a study
    uint64_t bytes;                    // of memory that it takes while it runs, as estimated
    bool has_memory;                   // these are counted in manager->memory
    bool is_waiting, waits_for_memory; // in manager->waiting
    bool is_running;                   // a worker began it
    bool is_saving;                    // it has run
    size_t workers;                    // that have a part of it now
    struct Task *next;                 // in manager->waiting
    int64_t began_ns;
    bool recompute_only;        // only its series is wanted: the result is saved already
    Job *jobs;                  // that wait for it, by next_shared; holds a reference to each
    Subscribers result_waiters; // readers of the outcome
    atomic_bool is_stopped;
    atomic_uint progress;       // in 1/10,000
    double cpu_seconds;         // allowed; 0: any. It is stopped at SIMULATION_PATIENCE times this
    const char *shorten;        // what makes it shorter
    atomic_int_fast64_t cpu_ns; // used by all workers
    atomic_bool is_too_long;    // it was stopped for that
    struct StudyRun *study;     // while it runs, under the lock
    RunResult run_result;       // once is_saving
    ResultSummary *summary;
    size_t saving_bytes;
    Job *committing; // of its jobs, those whose last state is being written
    ResultCommit commit;
    PendingWrite write;       // of `commit`
    bool is_saved, is_logged; // the result is in the database; it was logged that it could not be
} Task;

// `row` is what others see. A job is inserted when a client must be given its id, or with its
// result.
struct Job {
    HashMapEntry indexed; // in manager->jobs, by id
    atomic_size_t refcount;
    JobManager *manager; // for its lock; NULL: read from the database, never changes
    JobRow row;
    JobRow written;         // as it is being written; borrows the texts of `row`
    PendingWrite write;     // its insertion or cancellation
    bool is_inserting;      // on the way to the database, as accepted
    bool is_ending;         // on the way to the database, in its last state
    bool is_durable;        // the database has it as `row` shows it
    Status refusal;         // why it could not be saved
    char refused[256];      // likewise
    size_t scene_size;      // in bytes, counted while it is live
    bool is_live;           // in manager->jobs, which holds a reference
    bool is_counted;        // takes a place in the queue
    ResultSummary *summary; // of the result
    Task *task;             // NULL: not yet or no more
    QueueClient *client;    // NULL while it was not admitted
    Job *next_shared, *next_retry;
    int64_t submitted_ns, started_ns;
    Subscribers subscribers; // called when it is durable and when it is finished
};

// Of a task for readers; reported once.
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
    bool is_spare; // beyond the number asked for: takes quick work while all others are slow
    Workspace workspace;
} Worker;

// Slurm, which makes the members of long studies, and one of these.
typedef struct Cluster Cluster;
typedef struct ClusterStudy ClusterStudy;

// What makes the members of studies elsewhere, for study.c, which cluster.c is above.
typedef struct StudyExecutor {
    // How many members of a study of this kind and predicted CPU time it makes at once, perhaps a
    // guess; 0: the workers make them.
    size_t (*slots)(Cluster *cluster, const StudyKind *kind, double seconds);
    // Prepares a begun study, of a sweep with its chunks. STATUS_FULL, STATUS_IO: not now.
    Status (*prepare)(struct StudyRun *run, size_t slots, Problem *problem);
    // With the manager's lock held: takes a prepared study, with a turn of it, to its end.
    void (*take)(struct StudyRun *run);
    void (*free)(ClusterStudy *study); // NULL is fine
} StudyExecutor;

struct JobManager {
    Db *db;
    const StudyExecutor *executor; // NULL: the workers make all
    Cluster *cluster;
    JobManagerSettings settings;
    pthread_mutex_t lock;
    pthread_cond_t work;       // for a worker, or space for its result
    pthread_cond_t spare_work; // for the spare worker alone
    pthread_cond_t settled;    // no write is under way
    pthread_cond_t stopping;   // is_closing was set
    pthread_t maintenance;
    bool is_maintained;      // by that thread
    pthread_mutex_t retries; // retries of sweeps come one by one; taken before `lock`
    Worker *workers;         // settings.workers of them, and the spare one
    size_t worker_count;     // started
    size_t slow_running;
    bool is_closing;
    HashMap *jobs;   // not yet finished
    HashMap *tasks;  // by result
    Queue *queue;    // of tasks
    uint64_t memory; // in bytes, of running tasks, as estimated, where it is counted
    size_t memory_waiters;
    Task *waiting, **waiting_last;      // for memory, or until the database takes a write
    struct StudyRun *studies;           // under way
    size_t live;                        // jobs not yet finished
    size_t scene_bytes;                 // of them all
    size_t writes;                      // under way
    size_t saving, saving_bytes;        // tasks that have run and are not yet saved
    Job *retry_cancels;                 // referenced: cancelled, but it could not be written
    uint64_t deletions;                 // of results
    Lru *cache;                         // of results by id: summaries and, where kept, series
    CacheStats series, summaries;       // there, which share the budget
    CacheStats rows, stored;            // results and series found in the database
    size_t keeping_bytes;               // of series on the way there
    atomic_int large_plans;             // requests that plan large structures
    Failure failures[OUTCOME_FAILURES]; // of tasks for readers
    size_t next_failure;
    JobMetrics metrics;
};

// --- task.c ---

// Without the lock:

Task *task_new(JobManager *manager, const char *result);
// Estimates what its inquiry will take, which may take seconds, before it is put into the queue.
void task_estimate(Task *task);
void task_free(Task *task); // the caller has freed task->study before
void run_result_clear(RunResult *run_result);
Job *job_new(JobManager *manager); // one reference; NULL without memory
// The manager's lock; a job that was loaded from the database has none.
void job_lock(Job *job);
void job_unlock(Job *job);
bool task_is_shared(const Task *task); // its study has members, which all workers make
Task *task_of(QueueEntry *entry);
// A Progress's advance: sets a task's progress. False once it was stopped, or has used too much CPU
// time.
bool task_advance(void *task, double fraction);
bool task_is_wanted(void *task, double fraction); // does not set it
// From here on this thread's CPU time counts for the task that it reports progress of.
void task_count_cpu(void);
// What a task is allowed from its start on, as a run or with its study.
void task_allow_run(Task *task);
void task_allow_study(Task *task);
// STATUS_LIMIT in place of the STATUS_CANCELLED of a task that used too much CPU time.
Status task_result(const Task *task, Status status, Problem *problem);

// With the lock held:

bool subscribers_add(Subscribers *subscribers, const Callback *callback); // false without memory
void subscribers_call(Subscribers *subscribers);                          // calls and removes all
// Puts it into the queue; `client` NULL: ahead of all.
void task_enqueue(Task *task, QueueClient *client);
void jobs_call_worker(JobManager *manager); // something was put into the queue
// Counts its memory. False: it waits, in manager->waiting, until task_end puts it into the queue.
bool task_begin(Task *task);
void task_wait(Task *task);
void task_unwait(Task *task); // nothing if it does not wait
void task_attach(Task *task, Job *job);
// From its task, which stops when no job and no reader is left.
void job_detach(Job *job);
void job_admit(Job *job); // it is live
// Returns its place in the queue; it can still be found.
void job_release(Job *job);
void job_retire(Job *job); // it is live no more
// It could not be saved: it is live no more. Not of a task.
void job_refuse(Job *job, Status status, const char *detail);
// Releases all of its jobs, which stay unfinished in the database, and its readers. The caller
// frees it.
void task_release(Task *task);

// commit.c. Whether the cause may pass, as that of a full disk does.
bool status_is_transient(Status status);
char *problem_document(const Problem *problem); // NULL without memory
void run_result_fail(RunResult *run_result, Status status, Problem *problem);
// The document of the study's answer, once it is complete.
Status run_result_add_to_study(RunResult *run_result, Problem *problem);
// Without the lock. Takes both: saves the result with the jobs, also its series where that pays.
void task_finish(JobManager *manager, Task *task, RunResult *run_result);
// Without the lock. Takes the task: no job waits for it any more, or the daemon ends.
void task_abandon(JobManager *manager, Task *task);
// With the lock held: so much waits to be saved that workers should not make more.
bool jobs_is_behind(const JobManager *manager);
void jobs_end_write(JobManager *manager); // likewise; one less is under way
// With the lock held: inserts it as it is, without waiting.
void job_insert_later(Job *job);
// Without the lock. The same, and waits for it. STATUS_CONFLICT: another job has its key, or a
// record that it names does not exist.
Status job_insert_now(Job *job, Problem *problem);
// With the lock held, of a task that has run: writes the end of its jobs, if nothing of it is being
// written. Where none is left it has ended, and is freed.
void commit_continue(Task *task);
// With the lock held: cancels that could not be written are tried again.
void commit_retry_cancels(JobManager *manager);

// study.c. With the lock held:

// Its memory is free for others.
void task_end(Task *task);
void jobs_call_waiting(JobManager *manager); // all that wait try again

// cluster.c. What runs there when the manager is closed continues, and is taken up after the next
// start. Closed by cluster_close also after a failure.
Status cluster_open(JobManager *manager, Problem *problem);
void cluster_close(Cluster *cluster); // NULL is fine

// resolve.c. Of a prepared request: drops the samples of its records for as long as it waits, and
// loads them again, with a fault for each that is no longer there.
void request_drop_records(StudyRequest *request);
Status request_load_records(Db *db, StudyRequest *request, Problem *problem);
// A stored scene read again, without limits; *is_same: this engine gives it the id `result`.
Status jobs_prepare_stored(Db *db, const char *scene, const char *result, StudyRequest *request,
                           bool *is_same, Problem *problem);

// manager.c. Retries writes that failed for want of space.
void jobs_retry_writes(JobManager *manager);

// outcome_blob.c. Binary form of an Outcome for the database: spectra, impacts, energies and
// summary in one blob, the series in another. Plan, work and warnings are JSON documents of the
// result.
void outcome_blob_write(Bytes *bytes, const Outcome *outcome);
// An outcome without series, with one reference. NULL for anything that outcome_blob_write did not
// write, and without memory.
Outcome *outcome_blob_read(const void *blob, size_t size);

void series_blob_write(Bytes *bytes, const Columns *series);
// `series` is cleared by columns_clear; false, and empty, as above.
bool series_blob_read(const void *blob, size_t size, Columns *series);

// A part of a study; of what its kind adds to it there is nothing.
void part_blob_write(Bytes *bytes, const StudyPart *part);
// Freed by study_part_free. NULL as above.
StudyPart *part_blob_read(const StudyWork *work, const void *blob, size_t size);

// cache.c. With the lock held. Takes references of its own; NULL for `outcome` or `summary` keeps
// what is cached of it. The newest result is kept even if it is larger than the budget. Without
// memory nothing is cached.
void cache_put(JobManager *manager, const char *id, Outcome *outcome, ResultSummary *summary);
ResultSummary *cache_head(JobManager *manager, const char *id); // a reference, or NULL
// The number of results deleted so far. What was read from the database is cached only if it has
// not changed since before the reading. Without the lock.
uint64_t cache_deletions(JobManager *manager);
bool cache_has(const JobManager *manager, const char *id, bool with_series); // not a use
void cache_release(LruEntry *entry, void *manager, bool is_evicted);
// Without the lock: saves the series if it is more expensive to compute than to read.
void jobs_keep_series(JobManager *manager, const char *result, const Outcome *outcome,
                      double seconds);

// worker.c
void *worker_main(void *worker);

// submit.c. Resumes an unfinished job of the database. Faults of the job, also a damaged row, make
// it a failed one and are no error.
Status jobs_resume(JobManager *manager, const char *id, Problem *problem);

#endif
