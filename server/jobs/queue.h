// The queue of tasks: fair between clients by the CPU time that each was given; for each client
// quick tasks before slow ones, until the slow ones have waited long enough. Not locked: callers
// hold the lock of the job manager.
#ifndef SERVER_JOBS_QUEUE_H
#define SERVER_JOBS_QUEUE_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

typedef struct Queue Queue;

// A sender of jobs: the name of a token, "" for clients without a token. There are as many as
// tokens; each lives as long as the queue.
typedef struct QueueClient {
    struct QueueClient *next;
    size_t live;        // unfinished jobs
    double allowance;   // jobs that it might send at the time allowed_ns; see submit.c
    int64_t allowed_ns; // 0: it has sent none
    size_t waiting;     // entries
    double served;      // predicted CPU time of what it was given [s]
    double ordinary;    // of these, since the last turn
    struct QueueEntry *lanes[3];
    char name[];
} QueueClient;

// A member of what waits. All zero: it does not wait.
typedef struct QueueEntry {
    struct QueueEntry *child, *next, *previous;
    QueueClient *client; // NULL: ahead of all
    double seconds;      // predicted CPU time
    double charge;       // of these, what its client is counted when it is taken; 0: all
    bool is_turn;        // of long work: it goes between the ordinary work of its client
    double rank;
    uint64_t number; // of arrival, from 1; 0: does not wait
} QueueEntry;

// An entry with a predicted CPU time up to this is quick [s].
extern const double queue_quick;

Queue *queue_new(void); // NULL without memory
void queue_free(Queue *queue);

// Made when it is first needed; NULL without memory.
QueueClient *queue_client(Queue *queue, const char *name);

// `now` in seconds on any clock that only rises; entry->seconds is set. Not waiting yet.
void queue_put(Queue *queue, QueueEntry *entry, QueueClient *client, double now);
// Ahead of all clients, behind earlier entries of this kind.
void queue_push_front(Queue *queue, QueueEntry *entry);
// Takes the next entry, or NULL; `only_quick`: the next quick one.
QueueEntry *queue_take(Queue *queue, bool only_quick);
void queue_remove(Queue *queue, QueueEntry *entry); // nothing if it does not wait
// Moves an entry that `client` wants too to that client, where it has fewer that wait.
void queue_rebalance(Queue *queue, QueueEntry *entry, QueueClient *client);

size_t queue_count(const Queue *queue);
double queue_seconds(const Queue *queue); // predicted CPU time of all that wait

#endif
