// What a worker does with a computation besides running it: for those that go on after that, part
// by part. Not the queue (jobs_state.h) and not how it is saved (saving.c). Used by worker.c and
// study.c.
#ifndef SERVER_JOBS_WORKER_H
#define SERVER_JOBS_WORKER_H

#include "server/jobs/jobs_private.h"

#define STUDY_OWN 0.05 // of the progress, the scene's own run where a study follows

void run_result_fail(RunResult *run_result, Status status, const Problem *problem);
// The answer's document, once it is whole.
Status run_result_add_to_study(RunResult *run_result, Problem *problem);

// Without the lock. Takes both: saves what it came to, also its series where that pays.
void task_finish(JobManager *manager, Task *task, RunResult *run_result);

// A Progress's advance: sets a task's progress. False once it was stopped.
bool task_advance(void *task, double fraction);
// The same without setting it.
bool task_is_wanted(void *task, double fraction);
// Without the lock. Takes the computation: nobody waits for it any more, or the daemon ends and its
// jobs stay unfinished in the store.
void task_abandon(JobManager *manager, Task *task);

#endif
