// One requested run: state, progress, cancel. Reference counted and locked; read through job_view.
#ifndef SERVER_JOBS_JOB_H
#define SERVER_JOBS_JOB_H

#include <stdbool.h>
#include <stdint.h>

#include "core/base/status.h"
#include "server/db/db.h"

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

enum { JOB_ID_LENGTH = 32 };
// An id: "j-", 14 hexadecimal digits of microseconds since 1970, so that the database appends it to
// its index, and 16 random ones. False without random numbers.
bool job_id_make(char id[40]);
// When the job of this id was submitted; -1 where it is no job's id.
int64_t job_id_unix_ms(const char *id);

// Called once, from any thread, when the event that a waiter waits for has happened. Must be quick.
typedef struct Callback {
    void *context;
    void (*wake)(void *context);
} Callback;

// Chunks of a study that a cluster makes.
typedef struct ClusterView {
    uint64_t chunks, done, queued, running; // chunks 0: no cluster makes it
    char reason[240];                       // why nothing runs; "": something does
} ClusterView;

// A copy of the present state of a job. It owns the row's texts (job_view_clear).
typedef struct JobView {
    JobRow row;                        // without what only the database and the queue need
    double progress;                   // percent
    const char *plan, *summary, *work; // JSON; NULL while unknown
    const char *notes;                 // JSON array, of the run; NULL: none
    struct ResultSummary *head;        // owns these four; NULL: the caller does
    uint64_t points, points_done, points_failed; // of a sweep that is under way; 0: none is
    ClusterView cluster;
} JobView;

Job *job_ref(Job *job);
void job_unref(Job *job);
bool job_is_finished(Job *job);
// Its sender, as in JobView; lives as long as the job.
const char *job_client(const Job *job);
Status job_view(Job *job, JobView *view);
void job_view_clear(JobView *view);
// Its state and, in *progress, percent: cheap enough to be called often.
JobState job_peek(Job *job, double *progress);

// Whether the database has the job as it is now; a client must not learn of it before. Otherwise
// the error for which it could not be saved: a job that could not be accepted does not exist.
Status job_is_durable(Job *job, bool *is_durable, Problem *problem);
// Inserts it where that was not begun, without waiting.
void job_save(Job *job);

// Has `callback` called when the job is saved, or could not be, or finishes; at once if the event
// was before. False without memory.
typedef enum JobEvent { JOB_IS_DURABLE, JOB_IS_FINISHED } JobEvent;
bool job_subscribe(Job *job, JobEvent event, const Callback *callback);
// After this returns, it will not be called.
void job_unsubscribe(Job *job, const Callback *callback);

#endif
