// The job manager: validates, deduplicates, queues and runs submissions, and stores their results.
#ifndef SERVER_JOBS_JOBS_H
#define SERVER_JOBS_JOBS_H

#include "core/study/study.h"
#include "server/db/db.h"
#include "server/jobs/job.h"
#include "server/jobs/slurm.h"

typedef struct JobManager JobManager;

// Of one document or outcome; a value of SQLite has at most a billion.
enum { DOCUMENT_BYTES = 900000000 };

// Where studies of at least `seconds` of predicted CPU time are made: by Slurm, with the files of
// `shared`.
typedef struct ClusterSettings {
    const char *shared; // folder that all machines see; NULL: no cluster
    const char *data;   // this server's own folder, which tells it from others
    SlurmSettings slurm;
    double seconds;
    double poll_seconds; // between questions to Slurm, at least
    unsigned attempts;   // at a chunk, before its runs are failed; 1: at anything
} ClusterSettings;

typedef struct JobManagerSettings {
    size_t workers;       // threads, at least 1
    size_t queue_most;    // unfinished jobs at most
    size_t queue_bytes;   // of their scenes at most; 0: 256 MiB
    size_t cache_bytes;   // in memory, of finished outcomes
    size_t quota;         // unfinished jobs of one client by name; 0: as many as the queue takes
    double rate;          // jobs a minute of one client by name; 0: any number
    Callback deleted;     // called after results were deleted; `wake` may be NULL
    size_t store_bytes;   // of series in the database, those that cost more to compute than to read
    double study_seconds; // of CPU that a study may be predicted to take; 0: any
    uint64_t memory_bytes; // that running jobs may be predicted to take together, for which they
                           // wait; 0: any
    SimulationLimits limits;
    // A thread deletes what exceeds `keep`, and retries writes that failed for want of space.
    bool has_maintenance;
    KeepRules keep;
    ClusterSettings cluster;
} JobManagerSettings;

// Reads a scene's JSON, perhaps with a study, resolves its names, validates and completes it, all
// faults at once. `request` is cleared by study_request_clear in any case, `warnings` by
// warnings_clear.
Status jobs_prepare(Db *db, const char *text, size_t size, const SimulationLimits *limits,
                    StudyRequest *request, Warnings *warnings, Problem *problem);

// STATUS_INVALID if a completed study is predicted to take more than `max` seconds of CPU in all;
// NAN or 0: no limit. `option` sets it.
Status jobs_limit_study(const StudyRequest *request, const SimulationLimits *limits, double max,
                        const char *option, Problem *problem);
// The same for a client. Its study must be within study_seconds where there are limits, and only so
// many requests may plan large structures at once: STATUS_BUSY beyond.
Status jobs_prepare_request(JobManager *manager, const char *text, size_t size,
                            const SimulationLimits *limits, StudyRequest *request,
                            Warnings *warnings, Problem *problem);
// Of a run; the manager's.
const SimulationLimits *jobs_limits(const JobManager *manager);
// Counts one submission of `client` (NULL: a client without a token) against its jobs a minute:
// STATUS_QUOTA.
Status jobs_charge(JobManager *manager, const char *client, Problem *problem);

// study_run with as many threads as there are processors, in no queue. `watch` may be NULL and is
// called by one thread at a time.
Status jobs_run_study(const Variant *study, const Simulation *simulation,
                      const SimulationLimits *limits, const Progress *watch, Variant **answer,
                      Problem *problem);

// "r-" and 64 hexadecimal digits: SHA-256 of the canonical form and the engine's version.
// STATUS_NO_MEMORY: "".
Status jobs_result_id(const StudyRequest *request, char target[72], Problem *problem);

// Adds a line for each revision of a material, "sponge@1\n", unless has_materials is false, and
// each record, "record:elcentro\n", that the prepared scene or its sweep names.
void references_write(Bytes *lines, const StudyRequest *request, bool has_materials);
// One of those lines.
typedef struct ReferenceRow {
    char slug[128];
    unsigned long long revision; // 0: it is of no material
} ReferenceRow;
// Takes the next line off `*lines`; false at their end.
bool references_next(const char **lines, ReferenceRow *row);

// Opens the queue, resumes the unfinished jobs of the database, starts the workers. Borrows `db`.
Status jobs_open(Db *db, const JobManagerSettings *settings, JobManager **manager,
                 Problem *problem);
// No new jobs; running ones are interrupted and stay unfinished in the database for the next start.
// Calls all subscribers.
void jobs_stop(JobManager *manager);
// Stops it, where that was not done, and frees it. All jobs are unreferenced by then. NULL is
// accepted.
void jobs_close(JobManager *manager);

// Texts are the caller's.
typedef struct Submission {
    const char *text; // the scene's JSON, perhaps with a study
    size_t size;
    const char *client;          // its token's name; NULL: none
    const char *idempotency_key; // as it came, perhaps in quotes; NULL: none
    bool *is_replayed;           // set where the job is an earlier request's; may be NULL
    // Instead of a text the id of a finished job: those points of its sweep that failed are made
    // again. STATUS_CONFLICT where none did or it is not finished, STATUS_GONE for another engine.
    const char *retry_of;
} Submission;

// Accepts a scene as a job of its own. A client must not be given its id before it is durable
// (job_save). A cached result finishes it at once, a scene that is being computed shares that task,
// and a key that its client used before for the same body returns that job (STATUS_REUSED for
// another body). STATUS_BUSY when the queue is full, STATUS_QUOTA, STATUS_INVALID with the faults.
// *job is a reference. Waits for the database where the submission has a key, a study or names a
// record.
Status jobs_submit(JobManager *manager, const Submission *submission, Job **job, Problem *problem);

// Estimate of the seconds, from 1 to 3600, after which a submission of `client` that was refused as
// `status` may be accepted.
int jobs_retry_after(JobManager *manager, const char *client, Status status);

// The same without running: everything a dry run answers.
typedef struct DryRun {
    StudyRequest inquiry;
    Warnings warnings;
    PlanReport plan;
    Cost cost;
    char result[72];
    bool is_cached;
} DryRun;
Status jobs_dry_run(JobManager *manager, const char *text, size_t size, DryRun *dry_run,
                    Problem *problem);
void dry_run_clear(DryRun *dry_run);

// A job by its id, from memory or the database. STATUS_NOT_FOUND.
Status jobs_find(JobManager *manager, const char *id, Job **job, Problem *problem);

// Cancels the job; it is durable soon (job_subscribe). STATUS_CONFLICT if it is finished already.
Status jobs_cancel(JobManager *manager, const char *id, Job **job, Problem *problem);

// Sets the title and the labels of a job. NULL: as it is; "" and no labels: none. STATUS_NOT_FOUND.
Status jobs_annotate(JobManager *manager, const char *id, const char *title, const Texts *labels,
                     Problem *problem);

// Removes a finished job, and its result if that was the last job of it. STATUS_CONFLICT: it is not
// finished.
Status jobs_remove(JobManager *manager, const char *id, Problem *problem);

// The Outcome of a result with its series: from memory, from the database where they are stored
// (its plan, work and warnings are empty then), or computed again by a worker. *outcome is NULL and
// the return is STATUS_OK while it is being computed: `callback` is then called once, after which
// the caller asks again. STATUS_NOT_FOUND, STATUS_GONE for another engine version.
Status jobs_outcome(JobManager *manager, const char *result, const Callback *callback,
                    Outcome **outcome, Problem *problem);
// The same without waiting for the series, which may be missing; for any engine version.
Status jobs_outcome_stored(JobManager *manager, const char *result, Outcome **outcome,
                           Problem *problem);

// Deletes a result for good; its jobs stay and say so. STATUS_CONFLICT while it is being computed,
// STATUS_NOT_FOUND.
Status jobs_delete(JobManager *manager, const char *result, Problem *problem);

// One layer of the caches.
typedef struct CacheStats {
    uint64_t hits, misses, evictions;
    size_t count, bytes, most_bytes;
} CacheStats;

// The layers that have a result.
typedef struct CacheLayers {
    bool in_memory, in_database, series_in_memory, series_in_database;
} CacheLayers;
void jobs_layers(JobManager *manager, const char *result, CacheLayers *cache_layers);

typedef struct JobStats {
    size_t queued, running, workers, queue_most, cached_outcomes, cached_bytes;
    size_t unfinished; // jobs that count against queue_most
    size_t saving;     // computed tasks that are not in the database yet
    CacheStats heads;  // in memory, by result: plan, summary, work and notes
    CacheStats series; // in memory, by result; its bytes are those of both
    CacheStats rows;   // results in the database: those found there and not
    CacheStats stored; // series in the database
} JobStats;
void jobs_stats(JobManager *manager, JobStats *metrics);
// What was done since the start, in the Prometheus text format.
void jobs_write_metrics(const JobManager *manager, Bytes *bytes);

#endif
