// Group commit. While one transaction is made durable the next writes queue up, and all of them
// become the next transaction:
//
//     BEGIN IMMEDIATE   apply...   COMMIT
//
// Where one fails, all is rolled back and done again with a savepoint around each, so that this one
// alone leaves no trace. (Savepoints at once would copy every page that a write touches.) Where
// that fails too (a full disk, a failed commit), each is tried once more by itself, so that each
// gets its own error.
//
// Writes of low priority are done one by one, when nothing else is queued.
#include "server/db/writer.h"

#include <pthread.h>
#include <stdlib.h>
#include <string.h>

#include "server/util/clock.h"

typedef struct WriteQueue {
    PendingWrite *first, **last;
} WriteQueue;

// On the stack of a caller who waits; its `done.call` is NULL.
typedef struct WriteWaiter {
    PendingWrite write;
    bool is_done;
    pthread_cond_t done;
} WriteWaiter;

struct Writer {
    Sqlite *database;
    Db *shared;
    pthread_t thread;
    pthread_mutex_t lock;
    pthread_cond_t wake;
    WriteQueue queues[WRITE_LOW + 1];
    bool is_stopping;
    DbStats totals;
    Problem problem; // of the current write; the thread's own, for it is large
};

static void writer_set_status(PendingWrite *write, Status status, const Problem *problem) {
    free(write->detail);
    write->detail = status != STATUS_OK ? strdup(problem->detail) : NULL;
    write->status = status;
}

static Status writer_apply_saved(Writer *writer, Sqlite *database, PendingWrite *write) {
    static const char open[] = "SAVEPOINT one", undo[] = "ROLLBACK TO one", end[] = "RELEASE one";
    Status status = sqlite_change(database, open, NULL, NULL, NULL, &writer->problem);
    if (status == STATUS_OK) {
        status = write->apply(database, write->work, &writer->problem);
        if (status != STATUS_OK && sqlite_is_in_transaction(database))
            (void)sqlite_change(database, undo, NULL, NULL, NULL, NULL);
        if (sqlite_is_in_transaction(database))
            (void)sqlite_change(database, end, NULL, NULL, NULL, NULL);
    }
    return status;
}

// Does writes from `first` up to `end` in one transaction. False if all of it was rolled back;
// writer->problem then has the reason. Without savepoints one failure rolls back all.
static bool writer_commit(Writer *writer, Sqlite *database, PendingWrite *first,
                          const PendingWrite *end, bool has_savepoints) {
    static const char begin[] = "BEGIN IMMEDIATE", commit[] = "COMMIT", undo[] = "ROLLBACK";
    const int64_t began_ns = clock_monotonic_ns();
    const uint64_t rows = sqlite_rows_changed(database);
    uint64_t writes = 0;
    problem_clear(&writer->problem);
    Status status = sqlite_change(database, begin, NULL, NULL, NULL, &writer->problem);
    if (status == STATUS_OK)
        status = sqlite_check_place(database, &writer->problem);
    for (PendingWrite *write = first; status == STATUS_OK && write != end; write = write->next) {
        problem_clear(&writer->problem);
        if (!has_savepoints) {
            status = write->apply(database, write->work, &writer->problem);
            write->status = STATUS_OK;
            writes++;
            continue;
        }
        writer_set_status(write, writer_apply_saved(writer, database, write), &writer->problem);
        writes += write->status == STATUS_OK;
        if (!sqlite_is_in_transaction(database)) {
            counter_add(&writer->totals.errors, 1);
            return false;
        }
    }
    if (status == STATUS_OK) {
        problem_clear(&writer->problem);
        status = sqlite_change(database, commit, NULL, NULL, NULL, &writer->problem);
    }
    if (status != STATUS_OK && sqlite_is_in_transaction(database))
        (void)sqlite_change(database, undo, NULL, NULL, NULL, NULL);
    if (status == STATUS_OK) {
        atomic_store(&writer->totals.is_failing, false);
        histogram_add(&writer->totals.commits, clock_monotonic_ns() - began_ns);
        counter_add(&writer->totals.writes, writes);
        counter_add(&writer->totals.rows, sqlite_rows_changed(database) - rows);
    } else {
        counter_add(&writer->totals.errors, 1);
    }
    return status == STATUS_OK;
}

static void writer_commit_alone(Writer *writer, Sqlite *database, PendingWrite *write) {
    write->status = STATUS_OK;
    if (writer_commit(writer, database, write, write->next, true) || write->status != STATUS_OK)
        return;
    const Status status = writer->problem.status;
    atomic_store(&writer->totals.is_failing, true);
    writer_set_status(write, status != STATUS_OK ? status : STATUS_IO, &writer->problem);
}

static void writer_commit_all(Writer *writer, PendingWrite *first) {
    Sqlite *database = writer->shared != NULL ? db_take(writer->shared) : writer->database;
    if (!writer_commit(writer, database, first, NULL, false) &&
        (first->next == NULL || !writer_commit(writer, database, first, NULL, true)))
        for (PendingWrite *write = first; write != NULL; write = write->next)
            writer_commit_alone(writer, database, write);
    if (writer->shared != NULL)
        db_put(writer->shared, database);
}

// Its owner may free it as soon as it was called, or the lock is free.
static void writer_report(Writer *writer, PendingWrite *write) {
    char *detail = write->detail;
    if (write->done.call != NULL) {
        const char *text = detail != NULL ? detail : "";
        write->detail = NULL;
        write->done.call(write->done.context, write->status, text);
        free(detail);
        return;
    }
    WriteWaiter *waiter = (WriteWaiter *)(void *)write;
    pthread_mutex_lock(&writer->lock);
    waiter->is_done = true;
    pthread_cond_signal(&waiter->done);
    pthread_mutex_unlock(&writer->lock);
}

// With the lock held: all of the queue, or one of low priority; NULL: nothing.
static PendingWrite *writer_take(Writer *writer) {
    WriteQueue *queue = &writer->queues[WRITE_NORMAL], *low = &writer->queues[WRITE_LOW];
    PendingWrite *first = queue->first;
    if (first != NULL) {
        *queue = (WriteQueue){NULL, &queue->first};
    } else if ((first = low->first) != NULL) {
        low->first = first->next;
        if (low->first == NULL)
            low->last = &low->first;
        first->next = NULL;
    }
    return first;
}

static void *writer_main(void *context) {
    Writer *writer = context;
    PendingWrite *write, *next;
    pthread_mutex_lock(&writer->lock);
    for (;;) {
        while ((write = writer_take(writer)) == NULL && !writer->is_stopping)
            pthread_cond_wait(&writer->wake, &writer->lock);
        if (write == NULL)
            break;
        pthread_mutex_unlock(&writer->lock);
        writer_commit_all(writer, write);
        for (; write != NULL; write = next) {
            next = write->next;
            writer_report(writer, write);
        }
        pthread_mutex_lock(&writer->lock);
    }
    pthread_mutex_unlock(&writer->lock);
    return NULL;
}

static void writer_free(Writer *writer) {
    pthread_cond_destroy(&writer->wake);
    pthread_mutex_destroy(&writer->lock);
    free(writer);
}

Status writer_start(Sqlite *database, Db *shared, Writer **writer, Problem *problem) {
    *writer = NULL;
    Writer *made = calloc(1, sizeof *made);
    if (made == NULL)
        return problem_set(problem, STATUS_NO_MEMORY, "no memory for the database's writer");
    made->database = database;
    made->shared = shared;
    for (size_t i = 0; i < COUNT(made->queues); i++)
        made->queues[i].last = &made->queues[i].first;
    pthread_mutex_init(&made->lock, NULL);
    pthread_cond_init(&made->wake, NULL);
    if (pthread_create(&made->thread, NULL, writer_main, made) != 0) {
        writer_free(made);
        return problem_set(problem, STATUS_INTERNAL,
                           "the database's writer thread cannot be started");
    }
    *writer = made;
    return STATUS_OK;
}

void writer_stop(Writer *writer) {
    if (writer == NULL)
        return;
    pthread_mutex_lock(&writer->lock);
    writer->is_stopping = true;
    pthread_cond_signal(&writer->wake);
    pthread_mutex_unlock(&writer->lock);
    pthread_join(writer->thread, NULL);
    writer_free(writer);
}

const DbStats *writer_totals(const Writer *writer) {
    return &writer->totals;
}

// With the lock held.
static void writer_append(Writer *writer, PendingWrite *write, WritePriority priority) {
    WriteQueue *queue = &writer->queues[priority];
    write->next = NULL;
    write->detail = NULL;
    *queue->last = write;
    queue->last = &write->next;
    pthread_cond_signal(&writer->wake);
}

Status writer_do(Writer *writer, StoreApply *apply, const void *work, Problem *problem) {
    WriteWaiter waiter = {.write = {.apply = apply, .work = work}};
    pthread_cond_init(&waiter.done, NULL);
    pthread_mutex_lock(&writer->lock);
    writer_append(writer, &waiter.write, WRITE_NORMAL);
    while (!waiter.is_done)
        pthread_cond_wait(&waiter.done, &writer->lock);
    pthread_mutex_unlock(&writer->lock);
    pthread_cond_destroy(&waiter.done);
    const Status status = waiter.write.status;
    if (status != STATUS_OK)
        problem_set(problem, status, "%s", waiter.write.detail != NULL ? waiter.write.detail : "");
    free(waiter.write.detail);
    return status;
}

void writer_enqueue(Writer *writer, StoreApply *apply, const void *work, WritePriority priority,
                    PendingWrite *write) {
    write->apply = apply;
    write->work = work;
    pthread_mutex_lock(&writer->lock);
    writer_append(writer, write, priority);
    pthread_mutex_unlock(&writer->lock);
}
