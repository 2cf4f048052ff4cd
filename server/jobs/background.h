// Work for one reader on a thread of its own, away from the queue of jobs: so much at once, and
// refused beyond. It stops when its reader has gone. Not a job: it leaves nothing behind. Used by
// api/contact_force.c.
#ifndef SERVER_JOBS_BACKGROUND_H
#define SERVER_JOBS_BACKGROUND_H

#include "core/base/progress.h"
#include "server/jobs/job.h"

typedef struct BackgroundTasks BackgroundTasks;
typedef struct BackgroundTask BackgroundTask;

Status background_open(size_t most, BackgroundTasks **background_tasks, Problem *problem);
// Stops all that runs, waits for it and frees what is left; no BackgroundTask may be referenced any
// more.
void background_close(BackgroundTasks *background_tasks);

typedef struct BackgroundWork {
    void *context; // freed by `release` once neither the thread nor the reader needs it
    void (*run)(void *context, const Progress *watch);
    void (*release)(void *context);
} BackgroundWork;

// Begins at once; `waker` is called when it is done. Takes work->context, also when it fails.
// STATUS_BUSY where there is no room. *aside is a hold.
Status background_start(BackgroundTasks *background_tasks, const BackgroundWork *work,
                        const Callback *callback, BackgroundTask **background, Problem *problem);
bool background_is_done(BackgroundTask *background);
void *background_context(BackgroundTask *background); // once it is done
void background_unref(BackgroundTask *background);    // stops it if it is not done

#endif
