// One run asked for: state, progress, cancel. Counted and locked; read it through job_view.
#ifndef SERVER_JOBS_JOB_H
#define SERVER_JOBS_JOB_H

#include <stdbool.h>
#include <stdint.h>

#include "core/base/status.h"

typedef struct Job Job;

typedef enum JobState {
    JOB_ACCEPTED,
    JOB_RUNNING,
    JOB_SUCCESSFUL,
    JOB_FAILED,
    JOB_DISMISSED,
} JobState;
extern const char *const job_state_names[];
bool job_state_is_final(int state); // nothing changes it any more

// Called once, from any thread, when something a waiter waits for has happened. Must be quick.
typedef struct Callback {
    void *context;
    void (*wake)(void *context);
} Callback;

// A copy of what a job is now. Texts are owned by the show (job_view_clear).
typedef struct JobView {
    char id[40];
    JobState state;
    double progress; // percent
    bool is_cached;
    char result[72];                                            // "" while there is none
    int64_t created_unix_ms, started_unix_ms, finished_unix_ms; // 0: not yet
    double queued, run, total;                                  // [s]
    char *problem;              // problem+json of a failed job; NULL
    const char *plan;           // JSON; NULL while unknown
    const char *summary;        // JSON; NULL while unknown
    const char *work;           // JSON; NULL while unknown
    char *warnings;             // JSON array, of the scene
    const char *notes;          // JSON array, of the run; NULL: none
    char *title;                // NULL if none
    struct ResultSummary *head; // holds plan, summary, work and notes; NULL: they are the maker's
    char *labels;               // JSON array; NULL: none
    char *study;                // the kind of its study; NULL: none
    char *client;               // who sent it: a token's name; NULL: none
    bool is_result_deleted;
    uint64_t points, points_done, points_failed; // of a sweep that is under way; 0: none is
} JobView;

Job *job_ref(Job *job);
void job_unref(Job *job);
bool job_is_finished(Job *job);
// Who sent it, as JobView has it; lives as long as the job.
const char *job_client(const Job *job);
Status job_view(Job *job, JobView *show);
void job_view_clear(JobView *show);
// Its state and, in *progress, percent: what may be looked at often.
JobState job_peek(Job *job, double *progress);

// Whether the database has the job as it is now; a client must not be told of it before. Otherwise
// the error for which it could not be saved: a job that could not be accepted never was.
Status job_is_durable(Job *job, bool *is_durable, Problem *problem);
// Inserts it where that was not begun, without waiting.
void job_save(Job *job);

// Has `callback` called when the job is saved, or could not be, or finishes; at once if the event
// was before. False without memory.
typedef enum JobEvent { JOB_IS_DURABLE, JOB_IS_FINISHED } JobEvent;
bool job_subscribe(Job *job, JobEvent event, const Callback *callback);
// Takes it back; after this returns it will not be called.
void job_unsubscribe(Job *job, const Callback *callback);

#endif
