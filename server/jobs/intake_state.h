// What the jobs room knows, under one lock: jobs, the computations they share, the queue, the
// cache. Not the door (intake.h). Used by intake.c, job.c and worker.c.
#ifndef SERVER_JOBS_INTAKE_STATE_H
#define SERVER_JOBS_INTAKE_STATE_H

#include <pthread.h>
#include <stdatomic.h>

#include "server/jobs/cache.h"
#include "server/jobs/index.h"
#include "server/jobs/intake.h"
#include "server/jobs/totals.h"

enum { OUTCOME_FAILURES = 64 };

struct SweepRun;

typedef struct Wakers {
    Waker *at;
    size_t count;
} Wakers;

// One computation of one scene, for all jobs and readers who want it.
typedef struct Computation {
    IndexEntry indexed; // in flight, by result; not once it was stopped
    char result[72];
    Inquiry inquiry;
    char *scene, *warnings;   // documents
    struct Computation *next; // in the queue
    bool is_running;
    bool is_again; // only its series is wanted: the result is saved already
    Job *jobs;     // those who wait for it, by next_shared
    Wakers askers; // readers of the outcome
    atomic_bool is_stopped;
    atomic_uint progress;   // in 1/10,000
    struct SweepRun *sweep; // of a sweep that is under way, under the lock
} Computation;

struct Job {
    IndexEntry indexed; // live, by id
    atomic_size_t holds;
    Intake *intake; // held, for its lock; NULL: read from the store, never changes
    JobRow row;     // `state` and all else as seen by others
    JobRow closing; // as it will be once the store has it; borrows row's texts, owns `problem`
    bool is_closing;
    size_t scene_size;                   // in bytes, counted while it is live
    bool is_counted;                     // takes a place in the queue
    char *plan, *summary, *work, *notes; // of the result
    Computation *computation;            // NULL: not yet or no more
    Job *next_shared;
    int64_t submitted_ns, started_ns;
    Wakers wakers;
};

typedef struct Failure {
    char result[72];
    Status status;
    char detail[256];
} Failure;

typedef struct Worker {
    Intake *intake;
    pthread_t thread;
    Computation *running;   // or NULL
    struct SweepRun *sweep; // of which it has a chunk in hand, or NULL
    size_t chunk;
    int64_t served_ns;   // to ordinary jobs since its last turn on a sweep
    Workspace workspace; // of its thread alone
} Worker;

struct Intake {
    atomic_size_t holds; // the owner's and one of each Job: a job may be looked at after the intake
                         // has closed
    Store *store;
    IntakeSettings settings;
    pthread_mutex_t lock;
    pthread_cond_t work;
    Worker *workers;     // settings.workers of them
    size_t worker_count; // started
    bool is_closing;
    Index *jobs;      // not yet finished
    Index *in_flight; // computations
    Computation *first, *last;
    struct SweepRun *sweeps; // under way; whose turn is next stands first
    size_t queued, live;     // computations in the queue; jobs not yet finished
    size_t scene_bytes;      // of all live jobs
    Cache *cache;
    Failure failures[OUTCOME_FAILURES]; // of computations for readers, told once
    size_t next_failure;
    Totals totals;
};

bool wakers_add(Wakers *wakers, const Waker *waker); // false without memory
void wakers_remove(Wakers *wakers, const Waker *waker);
void wakers_call(Wakers *wakers); // calls and forgets all

Job *job_new(Intake *intake); // one hold; NULL without memory

Computation *computation_new(const char *result);
void computation_free(Computation *computation);

void intake_drop(Intake *intake); // frees what is left with the last hold

// With the lock held.
// Gives back its place in the queue; it can still be found.
void intake_release(Job *job);
void intake_retire(Job *job); // it is live no more; drops the index's hold
void intake_enqueue(Intake *intake, Computation *computation, bool is_urgent);
void intake_admit(Intake *intake, Job *job); // it is live, held by the index
void intake_attach(Job *job, Computation *computation);
void intake_detach(Job *job); // from its computation, which stops when nobody is left

// An unfinished job of the store, from an earlier life. Takes the row. Only what concerns the whole
// program is an error.
Status intake_take_up(Intake *intake, JobRow *row, Problem *problem);

void *worker_main(void *worker);

#endif
