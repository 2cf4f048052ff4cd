// The door for work: names to numbers, check, digest, known or new, queue. Both the daemon's POST
// and the tests come through here; `impactd run` uses intake_prepare alone. Not HTTP and not JSON
// replies.
#ifndef SERVER_JOBS_JOBS_H
#define SERVER_JOBS_JOBS_H

#include "core/study/study.h"
#include "server/db/db.h"
#include "server/jobs/job.h"

typedef struct Intake Intake;

enum { DOCUMENT_BYTES = 900000000 }; // of one document; the database takes a billion

typedef struct IntakeSettings {
    size_t workers;     // threads, at least 1
    size_t queue_most;  // unfinished jobs at most
    size_t queue_bytes; // of their scenes at most; 0: 256 MiB
    size_t cache_bytes; // in memory, of finished outcomes
    size_t quota;       // unfinished jobs of one client by name; 0: as many as the queue takes
    double rate;        // jobs a minute of one client by name; 0: any number
    Waker deleted;      // called after results were deleted; `wake` may be NULL
    size_t store_bytes; // of series in the database, those that are dearer to compute than to read
    double study_seconds; // of CPU that a study may be predicted to take; 0: any
    SimulationLimits limits;
} IntakeSettings;

// Reads a scene's JSON, perhaps with a study, resolves its materials, judges and completes it, all
// faults at once. `inquiry` is cleared by study_request_clear in any case, `warnings` by
// warnings_clear.
Status intake_prepare(Store *store, const char *text, size_t size, const SimulationLimits *limits,
                      StudyRequest *inquiry, Warnings *warnings, Problem *problem);

// The same for a request. Its study must be within study_seconds where there are limits, and only
// so many requests may plan large structures at once: STATUS_BUSY beyond. *has_place is for
// intake_leave_place, once the request plans no more; also on failure.
Status intake_prepare_request(Intake *intake, const char *text, size_t size,
                              const SimulationLimits *limits, bool *has_place,
                              StudyRequest *inquiry, Warnings *warnings, Problem *problem);
void intake_leave_place(Intake *intake, bool has_place);
// Counts one submission of `client` (NULL: a client without a token) against its jobs a minute:
// STATUS_QUOTA.
Status intake_charge(Intake *intake, const char *client, Problem *problem);

// "r-" and 64 hexadecimal digits: SHA-256 of the canonical form and the engine's version.
void intake_result_id(const StudyRequest *inquiry, char target[72]);

// Opens the queue, takes up unfinished jobs of the store, starts the workers. Borrows `store`.
Status intake_open(Store *store, const IntakeSettings *settings, Intake **intake, Problem *problem);
// Stops: no new jobs, running ones are interrupted and stay unfinished in the store for the next
// start.
void intake_close(Intake *intake);

// What is asked, and by whom. Texts are the caller's.
typedef struct Submission {
    const char *text; // the scene's JSON, perhaps with a study
    size_t size;
    const char *client;          // its token's name; NULL: nobody in particular
    const char *idempotency_key; // as it came, perhaps in quotes; NULL: none
    bool *is_replayed;           // set where the job is an earlier request's; NULL: not told
    // Instead of a text the id of a finished job: those points of its sweep that failed are made
    // again. STATUS_CONFLICT where none did or it is not finished, STATUS_GONE for another engine.
    const char *retry_of;
} Submission;

// Accepts a scene: a job of its own, on its way to the store when this returns; nobody may be told
// of it until it is kept (job_kept). Known results finish it at once (cached), a scene in flight
// shares that computation, and a key that its client used before for the same body answers with
// that job (STATUS_REUSED for another body). STATUS_BUSY when the queue is full, STATUS_QUOTA,
// STATUS_INVALID with the faults. The Job is a hold of the caller's.
Status intake_submit(Intake *intake, const Submission *submission, Job **job, Problem *problem);

// Seconds from 1 to 3600 after which a submission of `client` that was refused as `status` is worth
// another try, as far as can be told.
int intake_retry_after(Intake *intake, const char *client, Status status);

// The same without running: everything a dry run answers.
typedef struct DryRun {
    StudyRequest inquiry;
    Warnings warnings;
    PlanReport plan;
    Cost cost;
    char result[72];
    bool is_cached;
} DryRun;
Status intake_dry_run(Intake *intake, const char *text, size_t size, DryRun *dry_run,
                      Problem *problem);
void dry_run_clear(DryRun *dry_run);

// A job by its id, from memory or the store. STATUS_NOT_FOUND.
Status intake_find(Intake *intake, const char *id, Job **job, Problem *problem);

// Dismisses, for all at once and kept soon (job_kept); STATUS_CONFLICT if it is finished already.
Status intake_dismiss(Intake *intake, const char *id, Job **job, Problem *problem);

// The series-bearing Outcome of a result: from memory, from the database where it is kept (its
// plan, summary and warnings are empty then), or computed anew by a worker. *outcome is NULL and
// the return is STATUS_OK while it is being computed: `waker` is then called once when it is worth
// asking again. STATUS_NOT_FOUND, STATUS_GONE for another engine version.
Status intake_outcome(Intake *intake, const char *result, const Waker *waker, Outcome **outcome,
                      Problem *problem);

// Tries again to store what could not be stored for want of room; to be called now and then.
void intake_retry(Intake *intake);

// Deletes a ground-motion record that no result was made with and no unfinished job names, also
// none that is being accepted just now. STATUS_CONFLICT, STATUS_NOT_FOUND.
Status intake_record_delete(Intake *intake, const char *name, Problem *problem);

// Deletes a result for good; its jobs stay and say so. STATUS_CONFLICT while it is being computed,
// STATUS_NOT_FOUND.
Status intake_delete(Intake *intake, const char *result, Problem *problem);
// A result was deleted: nothing is answered from it any more.
void intake_forget(Intake *intake, const char *result);

// One layer of what is known.
typedef struct LayerTally {
    uint64_t hits, misses, evictions;
    size_t count, bytes, most_bytes;
} LayerTally;

// Where a result is known.
typedef struct IntakeLayers {
    bool in_memory, in_database, series_in_memory, series_in_database;
} IntakeLayers;
void intake_layers(Intake *intake, const char *result, IntakeLayers *layers);

typedef struct IntakeTally {
    size_t queued, running, workers, queue_most, cached_outcomes, cached_bytes;
    size_t saving;     // computations that have run and are not yet in the store
    LayerTally heads;  // in memory, by result: plan, summary, work and notes
    LayerTally series; // in memory, by result; its bytes are those of both
    LayerTally rows;   // results in the database: those found there and not
    LayerTally stored; // series in the database
} IntakeTally;
void intake_tally(Intake *intake, IntakeTally *tally);
// What was done since the start; counted on.
struct Totals;
const struct Totals *intake_totals(const Intake *intake);

#endif
