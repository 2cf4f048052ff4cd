// What the jobs room knows, under one lock: jobs, the computations they share, the queue, the
// cache. Not the door (intake.h). Used by intake.c, job.c and worker.c.
#ifndef SERVER_JOBS_INTAKE_STATE_H
#define SERVER_JOBS_INTAKE_STATE_H

#include <pthread.h>
#include <stdatomic.h>

#include "server/jobs/cache.h"
#include "server/jobs/index.h"
#include "server/jobs/intake.h"
#include "server/jobs/queue.h"

enum { OUTCOME_FAILURES = 64 };

typedef struct Wakers {
    Waker *at;
    size_t count;
} Wakers;

// One computation of one scene, for all jobs and readers who want it.
typedef struct Computation {
    IndexEntry indexed; // in flight, by result; not once it was stopped
    char result[72];
    Inquiry inquiry;
    char *scene, *warnings; // documents
    QueueEntry queued;
    bool is_running;
    int64_t began_ns;
    bool is_again; // only its series is wanted: the result is saved already
    Job *jobs;     // those who wait for it, by next_shared
    Wakers askers; // readers of the outcome
    atomic_bool is_stopped;
    atomic_uint progress; // in 1/10,000
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
    Client *client;                      // NULL while it was not admitted
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
    Computation *running; // or NULL
    bool is_spare;        // beyond the number asked for: takes quick work while all others are slow
    Workspace workspace;  // of its thread alone
} Worker;

struct Intake {
    atomic_size_t holds; // the owner's and one of each Job: a job may be looked at after the intake
                         // has closed
    Store *store;
    IntakeSettings settings;
    pthread_mutex_t lock;
    pthread_cond_t work;
    pthread_cond_t spare_work; // for the spare worker alone
    pthread_cond_t keys_free;  // a KeyHold was given up
    struct KeyHold *keys;
    Worker *workers;     // settings.workers of them, and the spare one
    size_t worker_count; // started
    size_t slow_running;
    double pace; // run time over what was foretold, of late
    bool is_closing;
    Index *jobs;        // not yet finished
    Index *in_flight;   // computations
    Queue *queue;       // of computations
    size_t live;        // jobs not yet finished
    size_t scene_bytes; // of them all
    Cache *cache;
    Failure failures[OUTCOME_FAILURES]; // of computations for readers, told once
    size_t next_failure;
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
// `client` NULL: ahead of all.
void intake_enqueue(Intake *intake, Computation *computation, Client *client);
Computation *computation_of(QueueEntry *entry);
void intake_admit(Intake *intake, Job *job); // it is live, held by the index
void intake_attach(Job *job, Computation *computation);
void intake_detach(Job *job); // from its computation, which stops when nobody is left

// An unfinished job of the store, from an earlier life. Takes the row. Only what concerns the whole
// program is an error.
Status intake_take_up(Intake *intake, JobRow *row, Problem *problem);

void *worker_main(void *worker);

#endif
