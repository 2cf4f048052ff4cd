// The door for work: names to numbers, check, digest, known or new, queue. Both the daemon's POST
// and the tests come through here; `impactd run` uses intake_prepare alone. Not HTTP and not JSON
// replies.
#ifndef SERVER_JOBS_INTAKE_H
#define SERVER_JOBS_INTAKE_H

#include "core/study/inquiry.h"
#include "server/jobs/job.h"
#include "server/store/store.h"

typedef struct Intake Intake;

typedef struct IntakeSettings {
    size_t workers;     // threads, at least 1
    size_t queue_most;  // unfinished jobs at most
    size_t queue_bytes; // of their scenes at most; 0: 256 MiB
    size_t cache_bytes; // of finished outcomes in memory
    SimulationLimits limits;
} IntakeSettings;

// Reads a scene's JSON, perhaps with a study, resolves its materials, judges and completes it, all
// faults at once. `inquiry` is cleared by inquiry_clear in any case, `warnings` by warnings_clear.
Status intake_prepare(Store *store, const char *text, size_t size, const SimulationLimits *limits,
                      Inquiry *inquiry, Warnings *warnings, Problem *problem);

// "r-" and 64 hexadecimal digits: SHA-256 of the canonical form and the engine's version.
void intake_result_id(const Inquiry *inquiry, char target[72]);

// Opens the queue, takes up unfinished jobs of the store, starts the workers. Borrows `store`.
Status intake_open(Store *store, const IntakeSettings *settings, Intake **intake, Problem *problem);
// Stops: no new jobs, running ones are interrupted and stay unfinished in the store for the next
// start.
void intake_close(Intake *intake);

// What is asked, and by whom. Texts are the caller's.
typedef struct Submission {
    const char *text; // the scene's JSON, perhaps with a study
    size_t size;
    const char *client; // its token's name; NULL: nobody in particular
    bool is_retry;      // also where its result is known: a sweep's open chunks are made again
} Submission;

// Accepts a scene: a job of its own, durable when this returns. Known results finish it at once
// (cached), a scene in flight shares that computation. STATUS_BUSY when the queue is full,
// STATUS_INVALID with the faults. The Job is a hold of the caller's.
Status intake_submit(Intake *intake, const Submission *submission, Job **job, Problem *problem);

// Has those points of a finished job's sweep that failed made again, by a job of its own.
// STATUS_CONFLICT where none failed or it is not finished, STATUS_GONE for another engine version.
Status intake_retry(Intake *intake, const char *id, const char *client, Job **job,
                    Problem *problem);

// The same without running: everything a dry run answers.
typedef struct DryRun {
    Inquiry inquiry;
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

// Dismisses; STATUS_CONFLICT if it is finished already.
Status intake_dismiss(Intake *intake, const char *id, Job **job, Problem *problem);

// The series-bearing Outcome of a result: from memory, or computed anew by a worker. *outcome is
// NULL and the return is STATUS_OK while it is being computed: `waker` is then called once when it
// is worth asking again. STATUS_NOT_FOUND, STATUS_GONE for another engine version.
Status intake_outcome(Intake *intake, const char *result, const Waker *waker, Outcome **outcome,
                      Problem *problem);

typedef struct IntakeTally {
    size_t queued, running, workers, queue_most, cached_outcomes, cached_bytes;
} IntakeTally;
void intake_tally(Intake *intake, IntakeTally *tally);
// What was done since the start; counted on.
struct Totals;
const struct Totals *intake_totals(const Intake *intake);

#endif
