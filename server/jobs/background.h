// Work for one reader on a thread of its own, away from the queue of jobs: a limited number at
// once, and refused beyond. It stops when its reader has gone. It is no job: it leaves nothing
// behind.
#ifndef SERVER_JOBS_BACKGROUND_H
#define SERVER_JOBS_BACKGROUND_H

#include "core/base/progress.h"
#include "server/jobs/job.h"

typedef struct BackgroundTasks BackgroundTasks;
typedef struct BackgroundTask BackgroundTask;

Status background_open(size_t max_tasks, BackgroundTasks **tasks, Problem *problem);
// Stops all that runs, waits for it and frees what is left; the reader of no task may be left. NULL
// is accepted.
void background_close(BackgroundTasks *tasks);

typedef struct BackgroundWork {
    void *context; // freed by `release` once neither the thread nor the reader needs it
    void (*run)(void *context, const Progress *watch);
    void (*release)(void *context);
} BackgroundWork;

// Begins soon; `callback` is called when it is done. Takes ownership of work->context, also when it
// fails. STATUS_BUSY where there is no room. *task is the reader's reference.
Status background_start(BackgroundTasks *tasks, const BackgroundWork *work,
                        const Callback *callback, BackgroundTask **task, Problem *problem);
bool background_is_done(BackgroundTask *task);
void *background_context(BackgroundTask *task); // once it is done
void background_unref(BackgroundTask *task);    // stops it if it is not done

#endif
