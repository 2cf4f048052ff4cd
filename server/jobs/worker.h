// What a worker does with a computation besides running it: for those that go on after that, part
// by part. Not the queue (intake_state.h) and not how it is saved (saving.c). Used by worker.c and
// study.c.
#ifndef SERVER_JOBS_WORKER_H
#define SERVER_JOBS_WORKER_H

#include "server/jobs/jobs_private.h"

#define STUDY_OWN 0.05 // of the progress, the scene's own run where a study follows

void findings_fail(Findings *findings, Status status, const Problem *problem);
// The answer's document, once it is whole.
Status findings_tell_study(Findings *findings, Problem *problem);

// Without the lock. Takes both: saves what it came to, also its series where that pays.
void computation_finish(Intake *intake, Computation *computation, Findings *findings);

// A Progress's advance that tells no progress: false once a computation was stopped.
bool computation_is_wanted(void *computation, double fraction);
// Without the lock. Takes the computation: nobody waits for it any more, or the daemon ends and its
// jobs stay unfinished in the store.
void computation_abandon(Intake *intake, Computation *computation);

#endif
