// Group commit. While one transaction is made durable the next ones queue up, and all of them
// become the next transaction:
//
//     BEGIN IMMEDIATE   (SAVEPOINT  apply  RELEASE | ROLLBACK TO)...   COMMIT
//
// One that fails is rolled back to its savepoint alone. Where the whole transaction is lost (a full
// disk, a failed commit), each is tried once more by itself, so that everyone is told their own
// fate and no other's.
#include "server/store/writer.h"

#include <pthread.h>
#include <stdlib.h>

#include "server/base/clock.h"

// One caller's write; it lies on that caller's stack.
typedef struct Write {
    struct Write *next;
    StoreApply *apply;
    const void *work;
    Problem *problem;
    Status status;
    bool is_done;
    pthread_cond_t done;
} Write;

struct Writer {
    Database *database;
    Store *shared;
    pthread_t thread;
    pthread_mutex_t lock;
    pthread_cond_t some;
    Write *first, **last;
    bool is_stopping;
    StoreTotals totals;
    Problem problem; // of the write in hand; the thread's own, for it is large
};

static Status apply_one(Writer *writer, Database *database, Write *write) {
    static const char open[] = "SAVEPOINT one", undo[] = "ROLLBACK TO one", end[] = "RELEASE one";
    problem_clear(&writer->problem);
    Status status = database_change(database, open, NULL, NULL, NULL, &writer->problem);
    if (status == STATUS_OK) {
        status = write->apply(database, write->work, &writer->problem);
        if (status != STATUS_OK && database_is_in_transaction(database))
            (void)database_change(database, undo, NULL, NULL, NULL, NULL);
        if (database_is_in_transaction(database))
            (void)database_change(database, end, NULL, NULL, NULL, NULL);
    }
    write->status = status;
    if (status != STATUS_OK)
        problem_set(write->problem, status, "%s", writer->problem.detail);
    return status;
}

// Does writes from `first` up to `end` in one transaction. False if all of it is lost;
// writer->problem then says why.
static bool commit(Writer *writer, Database *database, Write *first, const Write *end) {
    static const char begin[] = "BEGIN IMMEDIATE", commit[] = "COMMIT", undo[] = "ROLLBACK";
    const int64_t began_ns = clock_monotonic_ns();
    const uint64_t rows = database_rows_changed(database);
    uint64_t writes = 0;
    problem_clear(&writer->problem);
    Status status = database_change(database, begin, NULL, NULL, NULL, &writer->problem);
    for (Write *write = first; status == STATUS_OK && write != end; write = write->next) {
        writes += apply_one(writer, database, write) == STATUS_OK;
        if (!database_is_in_transaction(database)) {
            counter_add(&writer->totals.errors, 1);
            return false;
        }
    }
    if (status == STATUS_OK) {
        problem_clear(&writer->problem);
        status = database_change(database, commit, NULL, NULL, NULL, &writer->problem);
    }
    if (status != STATUS_OK && database_is_in_transaction(database))
        (void)database_change(database, undo, NULL, NULL, NULL, NULL);
    if (status == STATUS_OK) {
        histogram_add(&writer->totals.commits, clock_monotonic_ns() - began_ns);
        counter_add(&writer->totals.writes, writes);
        counter_add(&writer->totals.rows, database_rows_changed(database) - rows);
    } else {
        counter_add(&writer->totals.errors, 1);
    }
    return status == STATUS_OK;
}

static void commit_alone(Writer *writer, Database *database, Write *write) {
    write->status = STATUS_OK;
    problem_clear(write->problem);
    if (commit(writer, database, write, write->next) || write->status != STATUS_OK)
        return;
    write->status = writer->problem.status != STATUS_OK ? writer->problem.status : STATUS_IO;
    problem_set(write->problem, write->status, "%s", writer->problem.detail);
}

static void commit_all(Writer *writer, Write *first) {
    Database *database = writer->shared != NULL ? store_take(writer->shared) : writer->database;
    if (!commit(writer, database, first, NULL))
        for (Write *write = first; write != NULL; write = write->next)
            commit_alone(writer, database, write);
    if (writer->shared != NULL)
        store_put(writer->shared, database);
}

static void *work(void *context) {
    Writer *writer = context;
    pthread_mutex_lock(&writer->lock);
    for (;;) {
        while (writer->first == NULL && !writer->is_stopping)
            pthread_cond_wait(&writer->some, &writer->lock);
        Write *write = writer->first;
        if (write == NULL)
            break;
        writer->first = NULL;
        writer->last = &writer->first;
        pthread_mutex_unlock(&writer->lock);
        commit_all(writer, write);
        pthread_mutex_lock(&writer->lock);
        while (write != NULL) {
            // Its owner may be gone as soon as the lock is free, not before.
            Write *next = write->next;
            write->is_done = true;
            pthread_cond_signal(&write->done);
            write = next;
        }
    }
    pthread_mutex_unlock(&writer->lock);
    return NULL;
}

Status writer_start(Database *database, Store *shared, Writer **writer, Problem *problem) {
    *writer = NULL;
    Writer *made = calloc(1, sizeof *made);
    if (made == NULL)
        return problem_set(problem, STATUS_NO_MEMORY, "no memory for the database's writer");
    made->database = database;
    made->shared = shared;
    made->last = &made->first;
    pthread_mutex_init(&made->lock, NULL);
    pthread_cond_init(&made->some, NULL);
    if (pthread_create(&made->thread, NULL, work, made) != 0) {
        pthread_cond_destroy(&made->some);
        pthread_mutex_destroy(&made->lock);
        free(made);
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
    pthread_cond_signal(&writer->some);
    pthread_mutex_unlock(&writer->lock);
    pthread_join(writer->thread, NULL);
    pthread_cond_destroy(&writer->some);
    pthread_mutex_destroy(&writer->lock);
    free(writer);
}

const StoreTotals *writer_totals(const Writer *writer) {
    return &writer->totals;
}

Status writer_do(Writer *writer, StoreApply *apply, const void *work_, Problem *problem) {
    Write write = {.apply = apply, .work = work_, .problem = problem};
    pthread_cond_init(&write.done, NULL);
    pthread_mutex_lock(&writer->lock);
    *writer->last = &write;
    writer->last = &write.next;
    pthread_cond_signal(&writer->some);
    while (!write.is_done)
        pthread_cond_wait(&write.done, &writer->lock);
    pthread_mutex_unlock(&writer->lock);
    pthread_cond_destroy(&write.done);
    return write.status;
}
