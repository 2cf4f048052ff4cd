// MaterialGroup commit. While one transaction is made durable the next ones queue up, and all of
// them become the next transaction:
//
//     BEGIN IMMEDIATE   apply...   COMMIT
//
// Where one fails, all is rolled back and done again with a savepoint around each, so that this one
// alone leaves no trace. (Savepoints at once would copy every page that a write touches.) Where
// that is lost too (a full disk, a failed commit), each is tried once more by itself, so that
// everyone is told their own fate and no other's.
//
// The next transaction is all that comes now and what is due by then, and takes along what comes
// soon. Where there is none of these, it is one of what is low.
#include "server/db/writer.h"

#include <pthread.h>
#include <stdlib.h>
#include <string.h>
#include <time.h>

#include "server/util/clock.h"

static const int64_t delay_ms[STORE_TURNS] = {[STORE_SOON] = 5, [STORE_LATER] = 250};

// Tickets in the order of their coming.
typedef struct Line {
    PendingWrite *first, **last;
} Line;

// One write: on the stack of a caller who waits, or on the heap with a copy of its work behind it.
struct PendingWrite {
    PendingWrite *next, **link; // `link` points at what points here
    Line *line;                 // NULL: it is queued no more
    int64_t due_ns;             // 0: at once
    StoreApply *apply;
    const void *work;
    WriteDone done; // `call` NULL: its caller waits
    Status status;
    bool is_done;
    pthread_cond_t settled;
    char detail[sizeof((Problem){0}.detail)];
};

struct Writer {
    Sqlite *database;
    Db *shared;
    pthread_t thread;
    pthread_mutex_t lock;
    pthread_cond_t some;
    Line lines[STORE_TURNS];
    int64_t wakes_ns; // when the thread wakes by itself; INT64_MAX: never, 0: it does not sleep
    bool is_stopping, is_writing;
    DbStats totals;
    Problem problem; // of the write in hand; the thread's own, for it is large
};

static void settle(PendingWrite *write, Status status, const Problem *problem) {
    write->status = status;
    if (status != STATUS_OK)
        memcpy(write->detail, problem->detail, sizeof write->detail);
}

static Status apply_saved(Writer *writer, Sqlite *database, PendingWrite *write) {
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

// Does writes from `first` up to `end` in one transaction. False if all of it is lost;
// writer->problem then says why. Without savepoints one failure loses all.
static bool commit(Writer *writer, Sqlite *database, PendingWrite *first, const PendingWrite *end,
                   bool has_savepoints) {
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
        settle(write, apply_saved(writer, database, write), &writer->problem);
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

static void commit_alone(Writer *writer, Sqlite *database, PendingWrite *write) {
    write->status = STATUS_OK;
    if (commit(writer, database, write, write->next, true) || write->status != STATUS_OK)
        return;
    const Status status = writer->problem.status;
    atomic_store(&writer->totals.is_failing, true);
    settle(write, status != STATUS_OK ? status : STATUS_IO, &writer->problem);
}

static void commit_all(Writer *writer, PendingWrite *first) {
    Sqlite *database = writer->shared != NULL ? db_take(writer->shared) : writer->database;
    if (!commit(writer, database, first, NULL, false) &&
        (first->next == NULL || !commit(writer, database, first, NULL, true)))
        for (PendingWrite *write = first; write != NULL; write = write->next)
            commit_alone(writer, database, write);
    if (writer->shared != NULL)
        db_put(writer->shared, database);
}

// With the lock held, which is let go while others are told.
static void tell(Writer *writer, PendingWrite *write) {
    while (write != NULL) {
        // Its owner may be gone as soon as the lock is free, not before.
        PendingWrite *next = write->next;
        if (write->done.call == NULL) {
            write->is_done = true;
            pthread_cond_signal(&write->settled);
        } else {
            pthread_mutex_unlock(&writer->lock);
            write->done.call(write->done.context, write->status,
                             write->status != STATUS_OK ? write->detail : "");
            free(write);
            pthread_mutex_lock(&writer->lock);
        }
        write = next;
    }
}

static void append(Line *line, PendingWrite *write) {
    write->line = line;
    write->link = line->last;
    write->next = NULL;
    *line->last = write;
    line->last = &write->next;
}

static void leave(PendingWrite *write) {
    *write->link = write->next;
    if (write->next != NULL)
        write->next->link = write->link;
    else
        write->line->last = write->link;
    write->line = NULL;
    write->next = NULL;
}

// With the lock held.
static void call_up(Writer *writer, WritePriority turn, int64_t until_ns) {
    const Line *line = &writer->lines[turn];
    while (line->first != NULL && line->first->due_ns <= until_ns) {
        PendingWrite *write = line->first;
        leave(write);
        append(&writer->lines[STORE_NOW], write);
    }
}

// With the lock held: all that is to be written now, else one of what is low; NULL: nothing.
static PendingWrite *take(Writer *writer) {
    Line *line = &writer->lines[STORE_NOW];
    const int64_t now_ns = writer->is_stopping ? INT64_MAX : clock_monotonic_ns();
    call_up(writer, STORE_LATER, now_ns);
    call_up(writer, STORE_SOON, now_ns);
    if (line->first != NULL)
        call_up(writer, STORE_SOON, INT64_MAX);
    PendingWrite *write = line->first != NULL ? line->first : writer->lines[STORE_LOW].first;
    if (line->first == NULL && write != NULL)
        leave(write);
    for (PendingWrite *at = line->first; at != NULL; at = at->next)
        at->line = NULL;
    *line = (Line){NULL, &line->first};
    return write;
}

static int64_t due_ns(const Line *line) {
    return line->first != NULL ? line->first->due_ns : INT64_MAX;
}

// With the lock held: until there is something new, or what waits is due.
static void wait(Writer *writer) {
    const int64_t soon_ns = due_ns(&writer->lines[STORE_SOON]);
    const int64_t later_ns = due_ns(&writer->lines[STORE_LATER]);
    writer->wakes_ns = soon_ns < later_ns ? soon_ns : later_ns;
    const struct timespec until = {(time_t)(writer->wakes_ns / 1000000000),
                                   (long)(writer->wakes_ns % 1000000000)};
    if (writer->wakes_ns == INT64_MAX)
        pthread_cond_wait(&writer->some, &writer->lock);
    else
        pthread_cond_timedwait(&writer->some, &writer->lock, &until);
    writer->wakes_ns = 0;
}

static void *work(void *context) {
    Writer *writer = context;
    PendingWrite *write;
    pthread_mutex_lock(&writer->lock);
    for (;;) {
        while ((write = take(writer)) == NULL && !writer->is_stopping)
            wait(writer);
        if (write == NULL)
            break;
        writer->is_writing = true;
        pthread_mutex_unlock(&writer->lock);
        commit_all(writer, write);
        pthread_mutex_lock(&writer->lock);
        writer->is_writing = false;
        tell(writer, write);
    }
    pthread_mutex_unlock(&writer->lock);
    return NULL;
}

Status writer_start(Sqlite *database, Db *shared, Writer **writer, Problem *problem) {
    *writer = NULL;
    Writer *made = calloc(1, sizeof *made);
    if (made == NULL)
        return problem_set(problem, STATUS_NO_MEMORY, "no memory for the database's writer");
    made->database = database;
    made->shared = shared;
    for (size_t i = 0; i < COUNT(made->lines); i++)
        made->lines[i].last = &made->lines[i].first;
    pthread_condattr_t monotonic;
    pthread_condattr_init(&monotonic);
    pthread_condattr_setclock(&monotonic, CLOCK_MONOTONIC);
    pthread_mutex_init(&made->lock, NULL);
    pthread_cond_init(&made->some, &monotonic);
    pthread_condattr_destroy(&monotonic);
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

const DbStats *writer_totals(const Writer *writer) {
    return &writer->totals;
}

// With the lock held.
static void enqueue(Writer *writer, PendingWrite *write, WritePriority turn) {
    write->due_ns = delay_ms[turn] > 0 ? clock_monotonic_ns() + delay_ms[turn] * 1000000 : 0;
    append(&writer->lines[turn], write);
    if (write->due_ns < writer->wakes_ns) {
        writer->wakes_ns = 0; // woken once is enough
        pthread_cond_signal(&writer->some);
    }
}

Status writer_do(Writer *writer, StoreApply *apply, const void *work_, Problem *problem) {
    PendingWrite write = {.apply = apply, .work = work_};
    pthread_cond_init(&write.settled, NULL);
    pthread_mutex_lock(&writer->lock);
    enqueue(writer, &write, STORE_NOW);
    while (!write.is_done)
        pthread_cond_wait(&write.settled, &writer->lock);
    pthread_mutex_unlock(&writer->lock);
    pthread_cond_destroy(&write.settled);
    if (write.status != STATUS_OK)
        problem_set(problem, write.status, "%s", write.detail);
    return write.status;
}

Status writer_enqueue(Writer *writer, StoreApply *apply, const void *work_, size_t size,
                      WritePriority turn, const WriteDone *done, PendingWrite **ticket) {
    PendingWrite *write = malloc(sizeof *write + size);
    if (write == NULL)
        return STATUS_NO_MEMORY;
    write->apply = apply;
    write->work = size > 0 ? memcpy(write + 1, work_, size) : work_;
    write->done = *done;
    if (ticket != NULL)
        *ticket = write;
    pthread_mutex_lock(&writer->lock);
    enqueue(writer, write, turn);
    pthread_mutex_unlock(&writer->lock);
    return STATUS_OK;
}

bool writer_cancel(Writer *writer, PendingWrite *write) {
    pthread_mutex_lock(&writer->lock);
    const bool is_queued = write->line != NULL;
    if (is_queued)
        leave(write);
    pthread_mutex_unlock(&writer->lock);
    if (is_queued)
        free(write);
    return is_queued;
}

void writer_expedite(Writer *writer, PendingWrite *write) {
    pthread_mutex_lock(&writer->lock);
    if (write->line == &writer->lines[STORE_LATER]) {
        leave(write);
        enqueue(writer, write, STORE_NOW);
    }
    pthread_mutex_unlock(&writer->lock);
}

static Status write_nothing(Sqlite *database, const void *work_, Problem *problem) {
    (void)database, (void)work_, (void)problem;
    return STATUS_OK;
}

void writer_flush(Writer *writer) {
    pthread_mutex_lock(&writer->lock);
    call_up(writer, STORE_LATER, INT64_MAX);
    call_up(writer, STORE_SOON, INT64_MAX);
    const bool is_settled = writer->lines[STORE_NOW].first == NULL && !writer->is_writing;
    pthread_mutex_unlock(&writer->lock);
    // Behind all of them in the same transaction.
    if (!is_settled)
        (void)writer_do(writer, write_nothing, NULL, NULL);
}
