// Work for one reader on a thread of its own, away from the queue of jobs: so much at once, and
// refused beyond. It stops when its reader has gone. Not a job: it leaves nothing behind. Used by
// api/contact_force.c.
#ifndef SERVER_JOBS_BACKGROUND_H
#define SERVER_JOBS_BACKGROUND_H

#include "core/base/progress.h"
#include "server/jobs/job.h"

typedef struct Asides Asides;
typedef struct Aside Aside;

Status asides_open(size_t most, Asides **asides, Problem *problem);
// Stops all that runs, waits for it and frees what is left; then nobody may hold an Aside.
void asides_close(Asides *asides);

typedef struct AsideWork {
    void *context; // freed by `release` once neither the thread nor the reader needs it
    void (*run)(void *context, const Progress *watch);
    void (*release)(void *context);
} AsideWork;

// Begins at once; `waker` is called when it is done. Takes work->context, also when it fails.
// STATUS_BUSY where there is no room. *aside is a hold.
Status aside_start(Asides *asides, const AsideWork *work, const Waker *waker, Aside **aside,
                   Problem *problem);
bool aside_is_done(Aside *aside);
void *aside_context(Aside *aside); // once it is done
void aside_drop(Aside *aside);     // stops it if it is not done

#endif
