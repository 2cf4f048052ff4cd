// What a computation came to on a worker, and how it ends: for those computations that more than
// one worker shares. Not the queue (intake_state.h). Used by worker.c and sweep.c.
#ifndef SERVER_JOBS_WORKER_H
#define SERVER_JOBS_WORKER_H

#include "server/jobs/intake_state.h"

// What a computation came to, as documents.
typedef struct Findings {
    Status status;
    Outcome *outcome;   // NULL unless STATUS_OK
    StudyAnswer answer; // its study NULL where none was asked for
    ResultRow result;
    char *problem; // of failed jobs
    char detail[256];
    int64_t began_ns, ended_ns;
} Findings;

void findings_clear(Findings *findings);
void findings_fail(Findings *findings, Status status, const Problem *problem);

// Saves result and jobs, tells everyone, and takes the computation out of flight. `problem` is
// scratch.
void computation_finish(Intake *intake, Computation *computation, const Findings *findings,
                        Problem *problem);

// With the lock held: nobody waits for it any more, or the daemon ends and its jobs stay unfinished
// in the store.
void computation_abandon(Intake *intake, Computation *computation);

// Whether what failed is worth another try: a full disk and the like pass.
bool status_is_passing(Status status);

#endif
