// The writer thread has a connection of its own, readers take theirs from a small pool and put it
// back. A database in memory has a single connection, which is the whole pool then; the writer
// takes it too.
//
// Group commit. While one transaction is made durable the next writes queue up, and all of them
// become the next transaction:
//
//     BEGIN IMMEDIATE   apply...   COMMIT
//
// Where one fails, all is rolled back and done again with a savepoint around each, so that this one
// alone leaves no trace. (Savepoints at once would copy every page that a write touches.) Where
// that fails too (a full disk, a failed commit), each is tried once more by itself, so that each
// gets its own error. Writes of low priority are done one by one, when nothing else is queued.
#include "server/db/db.h"

#include <limits.h>
#include <pthread.h>
#include <stdarg.h>
#include <stdatomic.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "server/db/db_private.h"
#include "server/util/clock.h"
#include "server/util/embedded.h"
#include "server/util/thread_pool.h"

enum { READERS = 4, RECORDS_BYTES = 64 << 20, MATERIALS_BYTES = 1 << 20 };

typedef struct WriteQueue {
    PendingWrite *first, **last;
} WriteQueue;

// On the stack of a caller who waits; its `done.call` is NULL.
typedef struct WriteWaiter {
    PendingWrite write;
    bool is_done;
    pthread_cond_t done;
} WriteWaiter;

struct Db {
    int lock_file;
    SharedCache *caches[CACHE_COUNT];
    atomic_uint_fast64_t evictions; // of series
    PendingWrite probe;             // of db_is_writable
    atomic_bool is_probing;

    pthread_mutex_t lock; // of the readers
    pthread_cond_t some;
    Sqlite *readers[READERS]; // of which the first `free_count` are not taken
    size_t free_count;

    Sqlite *own; // the writer's; NULL where it shares the pool's
    pthread_t writer;
    pthread_mutex_t queue_lock;
    pthread_cond_t wake;
    WriteQueue queues[WRITE_LOW + 1];
    bool is_writing, is_stopping; // the thread runs; it is to end
    DbStats stats;
    Problem problem; // of the current write; the writer's own, for it is large
};

// Prepared when a connection is opened, so that a transaction can end without memory. An open one
// would make all later ones fail, and a reader would go on with old rows.
static const char sql_read[] = "BEGIN", sql_begin[] = "BEGIN IMMEDIATE", sql_commit[] = "COMMIT",
                  sql_rollback[] = "ROLLBACK", sql_savepoint[] = "SAVEPOINT one",
                  sql_rollback_one[] = "ROLLBACK TO one", sql_release[] = "RELEASE one";
static const char *const sql_transaction[] = {sql_read,     sql_begin,     sql_commit,
                                              sql_rollback, sql_savepoint, sql_rollback_one,
                                              sql_release,  NULL};

static void connection_rollback(Sqlite *database) {
    if (sqlite_is_in_transaction(database))
        (void)sqlite_change(database, sql_rollback, NULL, NULL, NULL, NULL);
}

static Sqlite *reader_take(Db *db) {
    pthread_mutex_lock(&db->lock);
    while (db->free_count == 0)
        pthread_cond_wait(&db->some, &db->lock);
    Sqlite *database = db->readers[--db->free_count];
    pthread_mutex_unlock(&db->lock);
    return database;
}

static void reader_put(Db *db, Sqlite *database) {
    connection_rollback(database);
    pthread_mutex_lock(&db->lock);
    db->readers[db->free_count++] = database;
    pthread_cond_signal(&db->some);
    pthread_mutex_unlock(&db->lock);
}

// The writer.

static void writer_set_status(PendingWrite *write, Status status, const Problem *problem) {
    free(write->detail);
    write->detail = status != STATUS_OK ? strdup(problem->detail) : NULL;
    write->status = status;
}

static Status writer_apply_saved(Db *db, Sqlite *database, PendingWrite *write) {
    Status status = sqlite_change(database, sql_savepoint, NULL, NULL, NULL, &db->problem);
    if (status == STATUS_OK) {
        status = write->apply(database, write->work, &db->problem);
        // Half a write must not be committed with the others: where it cannot be undone by itself,
        // all is.
        Status undone = STATUS_OK;
        if (status != STATUS_OK && sqlite_is_in_transaction(database))
            undone = sqlite_change(database, sql_rollback_one, NULL, NULL, NULL, NULL);
        if (undone == STATUS_OK && sqlite_is_in_transaction(database))
            undone = sqlite_change(database, sql_release, NULL, NULL, NULL, NULL);
        if (undone != STATUS_OK)
            connection_rollback(database);
    }
    return status;
}

// Does writes from `first` up to `end` in one transaction. False if all of it was rolled back;
// db->problem then has the reason. Without savepoints one failure rolls back all.
static bool writer_commit(Db *db, Sqlite *database, PendingWrite *first, const PendingWrite *end,
                          bool has_savepoints) {
    const int64_t began_ns = clock_monotonic_ns();
    const uint64_t rows = sqlite_rows_changed(database);
    uint64_t writes = 0;
    problem_clear(&db->problem);
    Status status = sqlite_change(database, sql_begin, NULL, NULL, NULL, &db->problem);
    if (status == STATUS_OK)
        status = sqlite_check_place(database, &db->problem);
    for (PendingWrite *write = first; status == STATUS_OK && write != end; write = write->next) {
        problem_clear(&db->problem);
        if (!has_savepoints) {
            status = write->apply(database, write->work, &db->problem);
            write->status = STATUS_OK;
            writes++;
            continue;
        }
        writer_set_status(write, writer_apply_saved(db, database, write), &db->problem);
        writes += write->status == STATUS_OK;
        if (!sqlite_is_in_transaction(database)) {
            counter_add(&db->stats.errors, 1);
            return false;
        }
    }
    if (status == STATUS_OK) {
        problem_clear(&db->problem);
        status = sqlite_change(database, sql_commit, NULL, NULL, NULL, &db->problem);
    }
    if (status != STATUS_OK)
        connection_rollback(database);
    if (status == STATUS_OK) {
        atomic_store(&db->stats.is_failing, false);
        histogram_add(&db->stats.commits, clock_monotonic_ns() - began_ns);
        counter_add(&db->stats.writes, writes);
        counter_add(&db->stats.rows, sqlite_rows_changed(database) - rows);
    } else {
        counter_add(&db->stats.errors, 1);
    }
    return status == STATUS_OK;
}

static void writer_commit_alone(Db *db, Sqlite *database, PendingWrite *write) {
    write->status = STATUS_OK;
    if (writer_commit(db, database, write, write->next, true) || write->status != STATUS_OK)
        return;
    const Status status = db->problem.status;
    atomic_store(&db->stats.is_failing, true);
    writer_set_status(write, status != STATUS_OK ? status : STATUS_IO, &db->problem);
}

static void writer_commit_all(Db *db, PendingWrite *first) {
    Sqlite *database = db->own != NULL ? db->own : reader_take(db);
    if (!writer_commit(db, database, first, NULL, false) &&
        (first->next == NULL || !writer_commit(db, database, first, NULL, true)))
        for (PendingWrite *write = first; write != NULL; write = write->next)
            writer_commit_alone(db, database, write);
    if (database != db->own)
        reader_put(db, database);
}

// The owner may free `write` as soon as done.call was called or, if it waits, the queue's lock is
// released.
static void writer_report(Db *db, PendingWrite *write) {
    char *detail = write->detail;
    if (write->done.call != NULL) {
        const char *text = detail != NULL ? detail : "";
        write->detail = NULL;
        write->done.call(write->done.context, write->status, text);
        free(detail);
        return;
    }
    WriteWaiter *waiter = (WriteWaiter *)(void *)write;
    pthread_mutex_lock(&db->queue_lock);
    waiter->is_done = true;
    pthread_cond_signal(&waiter->done);
    pthread_mutex_unlock(&db->queue_lock);
}

// With the lock held: all of the queue, or one of low priority; NULL: nothing.
static PendingWrite *writer_take(Db *db) {
    WriteQueue *queue = &db->queues[WRITE_NORMAL], *low = &db->queues[WRITE_LOW];
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
    Db *db = context;
    PendingWrite *write, *next;
    pthread_mutex_lock(&db->queue_lock);
    for (;;) {
        while ((write = writer_take(db)) == NULL && !db->is_stopping)
            pthread_cond_wait(&db->wake, &db->queue_lock);
        if (write == NULL)
            break;
        pthread_mutex_unlock(&db->queue_lock);
        writer_commit_all(db, write);
        for (; write != NULL; write = next) {
            next = write->next;
            writer_report(db, write);
        }
        pthread_mutex_lock(&db->queue_lock);
    }
    pthread_mutex_unlock(&db->queue_lock);
    return NULL;
}

// With the lock held.
static void writer_append(Db *db, DbApply *apply, const void *work, WritePriority priority,
                          PendingWrite *write) {
    WriteQueue *queue = &db->queues[priority];
    write->apply = apply;
    write->work = work;
    write->next = NULL;
    write->detail = NULL;
    *queue->last = write;
    queue->last = &write->next;
    pthread_cond_signal(&db->wake);
}

Status db_write(Db *db, DbApply *apply, const void *work, Problem *problem) {
    WriteWaiter waiter = {.is_done = false};
    pthread_cond_init(&waiter.done, NULL);
    pthread_mutex_lock(&db->queue_lock);
    writer_append(db, apply, work, WRITE_NORMAL, &waiter.write);
    while (!waiter.is_done)
        pthread_cond_wait(&waiter.done, &db->queue_lock);
    pthread_mutex_unlock(&db->queue_lock);
    pthread_cond_destroy(&waiter.done);
    const Status status = waiter.write.status;
    if (status != STATUS_OK)
        problem_set(problem, status, "%s", waiter.write.detail != NULL ? waiter.write.detail : "");
    free(waiter.write.detail);
    return status;
}

void db_enqueue(Db *db, DbApply *apply, const void *work, WritePriority priority,
                PendingWrite *write) {
    pthread_mutex_lock(&db->queue_lock);
    writer_append(db, apply, work, priority, write);
    pthread_mutex_unlock(&db->queue_lock);
}

// Opening and reading.

static Status db_open_files(Db *db, const char *directory, bool is_beside,
                            const CheckedTable *const *tables, Problem *problem) {
    char path[PATH_MAX];
    bool is_current = false;
    if (!is_beside)
        TRY(data_dir_lock(directory, &db->lock_file, problem));
    else
        TRY(data_dir_make(directory, problem));
    snprintf(path, sizeof path, "%s/impactd.db", directory);
    TRY(sqlite_open(path, DATABASE_WRITER, &db->own, problem));
    if (is_beside)
        TRY(sqlite_is_current(db->own, embedded_sql, &is_current, problem));
    if (is_beside && !is_current)
        TRY(data_dir_lock(directory, &db->lock_file, problem));
    if (!is_current) {
        TRY(sqlite_migrate(db->own, embedded_sql, tables, problem));
        TRY(data_dir_sync(directory, problem));
    }
    while (db->free_count < READERS) {
        TRY(sqlite_open(path, DATABASE_READER, &db->readers[db->free_count], problem));
        db->free_count++;
        TRY(sqlite_prepare(db->readers[db->free_count - 1], sql_transaction, problem));
    }
    return sqlite_prepare(db->own, sql_transaction, problem);
}

static Status db_open_memory(Db *db, const CheckedTable *const *tables, Problem *problem) {
    TRY(sqlite_open(NULL, DATABASE_WRITER, &db->readers[0], problem));
    db->free_count = 1;
    TRY(sqlite_prepare(db->readers[0], sql_transaction, problem));
    return sqlite_migrate(db->readers[0], embedded_sql, tables, problem);
}

Status db_open_with(const char *directory, bool is_beside, const CheckedTable *const *tables,
                    Db **db, Problem *problem) {
    *db = NULL;
    Db *made = calloc(1, sizeof *made);
    if (made == NULL)
        return problem_set(problem, STATUS_NO_MEMORY, "no memory for the database");
    made->lock_file = -1;
    for (size_t i = 0; i < COUNT(made->queues); i++)
        made->queues[i].last = &made->queues[i].first;
    pthread_mutex_init(&made->lock, NULL);
    pthread_cond_init(&made->some, NULL);
    pthread_mutex_init(&made->queue_lock, NULL);
    pthread_cond_init(&made->wake, NULL);
    made->caches[CACHE_RECORDS] = shared_cache_new(RECORDS_BYTES);
    made->caches[CACHE_MATERIALS] = shared_cache_new(MATERIALS_BYTES);
    Status status = made->caches[CACHE_RECORDS] == NULL || made->caches[CACHE_MATERIALS] == NULL
                        ? problem_set(problem, STATUS_NO_MEMORY, "no memory for the database")
                    : directory != NULL ? db_open_files(made, directory, is_beside, tables, problem)
                                        : db_open_memory(made, tables, problem);
    if (status == STATUS_OK)
        status =
            thread_start(&made->writer, writer_main, made, "the database's writer thread", problem);
    made->is_writing = status == STATUS_OK;
    if (status != STATUS_OK) {
        db_close(made);
        return status;
    }
    *db = made;
    return STATUS_OK;
}

void db_close(Db *db) {
    if (db == NULL)
        return;
    if (db->is_writing) {
        pthread_mutex_lock(&db->queue_lock);
        db->is_stopping = true;
        pthread_cond_signal(&db->wake);
        pthread_mutex_unlock(&db->queue_lock);
        pthread_join(db->writer, NULL);
    }
    for (size_t i = 0; i < db->free_count; i++)
        sqlite_close(db->readers[i]);
    // The last one to close moves the journal into the database.
    sqlite_close(db->own);
    data_dir_unlock(db->lock_file);
    for (size_t i = 0; i < CACHE_COUNT; i++)
        shared_cache_free(db->caches[i]);
    pthread_cond_destroy(&db->wake);
    pthread_mutex_destroy(&db->queue_lock);
    pthread_cond_destroy(&db->some);
    pthread_mutex_destroy(&db->lock);
    free(db);
}

const DbStats *db_stats(const Db *db) {
    return &db->stats;
}

// Writes the database's first page as it is.
static Status db_apply_probe(Sqlite *database, const void *work, Problem *problem) {
    (void)work;
    return sqlite_touch(database, problem);
}

static void db_probe_ended(void *context, Status status, const char *detail) {
    (void)status;
    (void)detail;
    atomic_store(&((Db *)context)->is_probing, false);
}

bool db_is_writable(Db *db) {
    if (!atomic_load(&db->stats.is_failing))
        return true;
    if (!atomic_exchange(&db->is_probing, true)) {
        db->probe.done = (WriteDone){db_probe_ended, db};
        db_enqueue(db, db_apply_probe, NULL, WRITE_NORMAL, &db->probe);
    }
    return false;
}

atomic_uint_fast64_t *db_evictions(Db *db) {
    return &db->evictions;
}

SharedCache *db_cache(Db *db, DbCache which) {
    return db->caches[which];
}

bool db_is_private(const Db *db) {
    return db->own == NULL;
}

Status db_read(Db *db, DbApply *apply, const void *work, Problem *problem) {
    Sqlite *database = reader_take(db);
    Status status = sqlite_change(database, sql_read, NULL, NULL, NULL, problem);
    if (status == STATUS_OK) {
        status = apply(database, work, problem);
        const Status ended = sqlite_change(database, sql_commit, NULL, NULL, NULL, NULL);
        status = status == STATUS_OK ? ended : status;
    }
    reader_put(db, database);
    return status;
}

Status db_first(Db *db, const char *sql, const SqlColumn *keys, const void *key,
                const SqlColumn *columns, void *target, bool *is_found, Problem *problem) {
    Sqlite *database = reader_take(db);
    const Status status =
        sqlite_first(database, sql, keys, key, columns, target, is_found, problem);
    reader_put(db, database);
    return status;
}

Status db_get(Db *db, const char *sql, const QueryKey *key, const SqlColumn *columns, void *row,
              size_t size, Problem *problem, const char *format, ...) {
    bool is_found;
    char missing[240];
    va_list arguments;
    memset(row, 0, size);
    TRY(db_first(db, sql, query_key_columns, key, columns, row, &is_found, problem));
    if (is_found)
        return STATUS_OK;
    va_start(arguments, format);
    vsnprintf(missing, sizeof missing, format, arguments);
    va_end(arguments);
    return problem_set(problem, STATUS_NOT_FOUND, "%s", missing);
}

Status db_list(Db *db, const char *sql, const SqlColumn *keys, const void *key,
               const SqlColumn *columns, size_t size, void *list, Problem *problem) {
    Sqlite *database = reader_take(db);
    const Status status = sqlite_list(database, sql, keys, key, columns, size, list, problem);
    reader_put(db, database);
    return status;
}

// clang-format off
const SqlColumn query_key_columns[] = {
    COLUMN(QueryKey, id),
    COLUMN(QueryKey, name),
    COLUMN(QueryKey, slug),
    COLUMN(QueryKey, client),
    COLUMN(QueryKey, digest),
    COLUMN(QueryKey, words),
    COLUMN(QueryKey, before),
    COLUMN(QueryKey, number),
    COLUMN(QueryKey, max),
    COLUMN_OF(QueryKey, moment.revisions, "revisions", 0, NULL),
    COLUMN_OF(QueryKey, moment.reviews, "reviews", 0, NULL),
    COLUMN_OF(QueryKey, moment.measurements, "measurements", 0, NULL),
    COLUMN_END
};

const SqlColumn query_counts_columns[] = {
    COLUMN(QueryCounts, count),
    COLUMN(QueryCounts, bytes),
    COLUMN(QueryCounts, results),
    COLUMN(QueryCounts, jobs),
    COLUMN_END
};
// clang-format on
