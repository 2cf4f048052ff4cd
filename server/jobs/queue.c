// Between clients: the one that was given the least CPU time goes next. Time is counted when work
// is taken, as predicted; a client that comes back starts at what the others have reached, so that
// neither idling nor new names save anything up. With equal jobs this is round robin.
//
// For one client: by rank = arrival + patience * seconds, so a job of 1 s is passed by quicker ones
// for `patience` seconds and by none after that: nothing waits for ever. Equal ranks go by arrival.
//
// Each client has two lanes, quick and slow, each a pairing heap by rank: workers take the first of
// both, the spare worker takes from the quick lane only. A third lane holds the turns of long work,
// such as sweeps; they go when nothing else of their client waits, and once in turn_after seconds
// of what does.
#include "server/jobs/queue.h"

#include <stdlib.h>
#include <string.h>

const double queue_quick = 0.1;

static const double patience = 10;      // [s] for each second
static const double seconds_min = 1e-5; // [s] that any job counts as
static const double turn_after = 0.05;  // [s]

enum { QUICK, SLOW, TURNS };

struct Queue {
    QueueClient *first, **last; // in order of their first job
    QueueEntry *urgent, *urgent_last;
    size_t count;
    double seconds;
    double reached; // `served` of the client that was taken from last
    uint64_t arrivals;
};

Queue *queue_new(void) {
    Queue *queue = calloc(1, sizeof *queue);
    if (queue != NULL)
        queue->last = &queue->first;
    return queue;
}

void queue_free(Queue *queue) {
    if (queue == NULL)
        return;
    while (queue->first != NULL) {
        QueueClient *client = queue->first;
        queue->first = client->next;
        free(client);
    }
    free(queue);
}

QueueClient *queue_client(Queue *queue, const char *name) {
    for (QueueClient *client = queue->first; client != NULL; client = client->next)
        if (strcmp(client->name, name) == 0)
            return client;
    const size_t size = strlen(name) + 1;
    QueueClient *client = calloc(1, sizeof *client + size);
    if (client == NULL)
        return NULL;
    memcpy(client->name, name, size);
    *queue->last = client;
    queue->last = &client->next;
    return client;
}

static bool queue_is_before(const QueueEntry *a, const QueueEntry *b) {
    return a->rank < b->rank || (a->rank == b->rank && a->number < b->number);
}

// Two heaps as one. `previous` is the left neighbour, or the parent of a first child.
static QueueEntry *queue_merge(QueueEntry *a, QueueEntry *b) {
    if (a == NULL || b == NULL)
        return a != NULL ? a : b;
    if (queue_is_before(b, a)) {
        QueueEntry *other = a;
        a = b;
        b = other;
    }
    b->previous = a;
    b->next = a->child;
    if (a->child != NULL)
        a->child->previous = b;
    a->child = b;
    a->next = a->previous = NULL;
    return a;
}

static QueueEntry *queue_merge_all(QueueEntry *first) {
    QueueEntry *pairs = NULL, *root = NULL;
    while (first != NULL) {
        QueueEntry *a = first, *b = a->next;
        first = b != NULL ? b->next : NULL;
        a->next = a->previous = NULL;
        if (b != NULL)
            b->next = b->previous = NULL;
        a = queue_merge(a, b);
        a->next = pairs;
        pairs = a;
    }
    while (pairs != NULL) {
        QueueEntry *next = pairs->next;
        pairs->next = NULL;
        root = queue_merge(root, pairs);
        pairs = next;
    }
    return root;
}

static QueueEntry **queue_lane_of(QueueClient *client, const QueueEntry *entry) {
    return &client->lanes[entry->is_turn ? TURNS : entry->seconds <= queue_quick ? QUICK : SLOW];
}

static void queue_count_in(Queue *queue, QueueEntry *entry) {
    entry->child = entry->next = entry->previous = NULL;
    entry->number = ++queue->arrivals;
    queue->count++;
    queue->seconds += entry->seconds;
}

static void queue_count_out(Queue *queue, QueueEntry *entry) {
    entry->child = entry->next = entry->previous = NULL;
    entry->number = 0;
    queue->count--;
    // Sums of what comes and goes drift; an empty queue has none.
    queue->seconds = queue->count > 0 ? queue->seconds - entry->seconds : 0;
}

static void queue_join(Queue *queue, QueueEntry *entry, QueueClient *client) {
    if (client->waiting++ == 0 && client->served < queue->reached)
        client->served = queue->reached;
    entry->client = client;
    QueueEntry **lane = queue_lane_of(client, entry);
    *lane = queue_merge(*lane, entry);
}

void queue_put(Queue *queue, QueueEntry *entry, QueueClient *client, double now) {
    queue_count_in(queue, entry);
    entry->rank = now + patience * entry->seconds;
    queue_join(queue, entry, client);
}

void queue_push_front(Queue *queue, QueueEntry *entry) {
    queue_count_in(queue, entry);
    entry->client = NULL;
    entry->previous = queue->urgent_last;
    *(queue->urgent_last != NULL ? &queue->urgent_last->next : &queue->urgent) = entry;
    queue->urgent_last = entry;
}

static void queue_leave(QueueEntry *entry) {
    QueueClient *client = entry->client;
    QueueEntry **lane = queue_lane_of(client, entry);
    QueueEntry *children = queue_merge_all(entry->child);
    client->waiting--;
    if (*lane == entry) {
        *lane = children;
        return;
    }
    *(entry->previous->child == entry ? &entry->previous->child : &entry->previous->next) =
        entry->next;
    if (entry->next != NULL)
        entry->next->previous = entry->previous;
    *lane = queue_merge(*lane, children);
}

void queue_remove(Queue *queue, QueueEntry *entry) {
    if (entry->number == 0)
        return;
    if (entry->client != NULL) {
        queue_leave(entry);
    } else {
        *(entry->previous != NULL ? &entry->previous->next : &queue->urgent) = entry->next;
        *(entry->next != NULL ? &entry->next->previous : &queue->urgent_last) = entry->previous;
    }
    queue_count_out(queue, entry);
}

void queue_rebalance(Queue *queue, QueueEntry *entry, QueueClient *client) {
    if (entry->number == 0 || entry->client == NULL || entry->client == client ||
        entry->client->waiting <= client->waiting + 1)
        return;
    queue_leave(entry);
    entry->child = entry->next = entry->previous = NULL;
    queue_join(queue, entry, client);
}

static QueueEntry *queue_first_of(const QueueClient *client, bool only_quick) {
    QueueEntry *first = client->lanes[QUICK], *slow = client->lanes[SLOW];
    if (only_quick)
        return first;
    if (first == NULL || (slow != NULL && queue_is_before(slow, first)))
        first = slow;
    QueueEntry *turn = client->lanes[TURNS];
    return first == NULL || (turn != NULL && client->ordinary >= turn_after) ? turn : first;
}

QueueEntry *queue_take(Queue *queue, bool only_quick) {
    QueueClient *next = NULL;
    if (queue->urgent != NULL && (!only_quick || queue->urgent->seconds <= queue_quick)) {
        QueueEntry *entry = queue->urgent;
        queue_remove(queue, entry);
        return entry;
    }
    for (QueueClient *client = queue->first; client != NULL; client = client->next)
        if (queue_first_of(client, only_quick) != NULL &&
            (next == NULL || client->served < next->served))
            next = client;
    if (next == NULL)
        return NULL;
    QueueEntry *entry = queue_first_of(next, only_quick);
    queue_remove(queue, entry);
    if (next->served > queue->reached)
        queue->reached = next->served;
    const double given = entry->charge > 0 ? entry->charge : entry->seconds;
    const double seconds = given > seconds_min ? given : seconds_min;
    next->served += seconds;
    next->ordinary = entry->is_turn ? 0 : next->ordinary + seconds;
    return entry;
}

size_t queue_count(const Queue *queue) {
    return queue->count;
}

double queue_seconds(const Queue *queue) {
    return queue->seconds;
}
