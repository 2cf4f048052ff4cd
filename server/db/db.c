// Who may touch which connection: the writer thread has one of its own, readers take theirs from a
// small pool and put it back. A database in memory has a single connection, which is the whole pool
// then; the writer takes it like anyone.
#include "server/db/db.h"

#include <limits.h>
#include <pthread.h>
#include <stdatomic.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "server/db/data_dir.h"
#include "server/db/db_private.h"
#include "server/db/sqlite.h"
#include "server/db/writer.h"
#include "server/util/embedded.h"

enum { READERS = 4 };

struct Db {
    int lock_file;
    Sqlite *own; // the writer's; NULL where it shares the pool's
    Writer *writer;
    MaterialMemory *materials;
    RecordMemory *records;
    atomic_uint_fast64_t catalog_version; // of the catalogue
    atomic_uint_fast64_t measured;        // materials
    atomic_uint_fast64_t evictions;       // of series
    PendingWrite probe;                   // of db_is_writable
    atomic_bool is_probing;
    pthread_mutex_t lock;
    pthread_cond_t some;
    Sqlite *readers[READERS]; // of which the first `free_count` are not taken
    size_t free_count;
};

static Status open_files(Db *db, const char *directory, bool is_beside, Problem *problem) {
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
        TRY(sqlite_migrate(db->own, embedded_sql, problem));
        TRY(data_dir_sync(directory, problem));
    }
    while (db->free_count < READERS) {
        TRY(sqlite_open(path, DATABASE_READER, &db->readers[db->free_count], problem));
        db->free_count++;
    }
    return STATUS_OK;
}

static Status open_memory(Db *db, Problem *problem) {
    TRY(sqlite_open(NULL, DATABASE_WRITER, &db->readers[0], problem));
    db->free_count = 1;
    return sqlite_migrate(db->readers[0], embedded_sql, problem);
}

static Status open_store(const char *directory, bool is_beside, Db **db, Problem *problem) {
    *db = NULL;
    Db *made = calloc(1, sizeof *made);
    if (made == NULL)
        return problem_set(problem, STATUS_NO_MEMORY, "no memory for the store");
    made->lock_file = -1;
    pthread_mutex_init(&made->lock, NULL);
    pthread_cond_init(&made->some, NULL);
    made->materials = material_memory_new();
    made->records = record_memory_new();
    Status status = made->materials == NULL || made->records == NULL
                        ? problem_set(problem, STATUS_NO_MEMORY, "no memory for the store")
                    : directory != NULL ? open_files(made, directory, is_beside, problem)
                                        : open_memory(made, problem);
    if (status == STATUS_OK)
        status = writer_start(made->own, made->own == NULL ? made : NULL, &made->writer, problem);
    if (status != STATUS_OK) {
        db_close(made);
        return status;
    }
    *db = made;
    return STATUS_OK;
}

Status db_open(const char *directory, Db **db, Problem *problem) {
    return open_store(directory, false, db, problem);
}

Status db_open_beside(const char *directory, Db **db, Problem *problem) {
    return open_store(directory, true, db, problem);
}

void db_close(Db *db) {
    if (db == NULL)
        return;
    writer_stop(db->writer);
    for (size_t i = 0; i < db->free_count; i++)
        sqlite_close(db->readers[i]);
    // The last one to close moves the journal into the database.
    sqlite_close(db->own);
    data_dir_unlock(db->lock_file);
    material_memory_free(db->materials);
    record_memory_free(db->records);
    pthread_cond_destroy(&db->some);
    pthread_mutex_destroy(&db->lock);
    free(db);
}

const DbStats *db_totals(const Db *db) {
    return writer_totals(db->writer);
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
    if (!atomic_load(&db_totals(db)->is_failing))
        return true;
    if (!atomic_exchange(&db->is_probing, true)) {
        db->probe.done = (WriteDone){db_probe_ended, db};
        db_enqueue(db, db_apply_probe, NULL, WRITE_NORMAL, &db->probe);
    }
    return false;
}

Status db_write(Db *db, StoreApply *apply, const void *work, Problem *problem) {
    return writer_do(db->writer, apply, work, problem);
}

void db_enqueue(Db *db, StoreApply *apply, const void *work, WritePriority priority,
                PendingWrite *write) {
    writer_enqueue(db->writer, apply, work, priority, write);
}

atomic_uint_fast64_t *db_evictions(Db *db) {
    return &db->evictions;
}

MaterialMemory *db_material_memory(Db *db) {
    return db->materials;
}

RecordMemory *db_record_memory(Db *db) {
    return db->records;
}

bool db_is_private(const Db *db) {
    return db->own == NULL;
}

uint64_t db_catalog_version(Db *db) {
    return atomic_load(&db->catalog_version);
}

void db_catalog_changed(Db *db) {
    atomic_fetch_add(&db->catalog_version, 1);
}

// Both only rise: their sum is the same only while both are.
uint64_t db_audit_version(Db *db) {
    return atomic_load(&db->catalog_version) + atomic_load(&db->measured);
}

void db_material_measured(Db *db) {
    atomic_fetch_add(&db->measured, 1);
}

Sqlite *db_take(Db *db) {
    pthread_mutex_lock(&db->lock);
    while (db->free_count == 0)
        pthread_cond_wait(&db->some, &db->lock);
    Sqlite *database = db->readers[--db->free_count];
    pthread_mutex_unlock(&db->lock);
    return database;
}

void db_put(Db *db, Sqlite *database) {
    pthread_mutex_lock(&db->lock);
    db->readers[db->free_count++] = database;
    pthread_cond_signal(&db->some);
    pthread_mutex_unlock(&db->lock);
}

Status db_first(Db *db, const char *sql, const SqlColumn *keys, const void *key,
                const SqlColumn *columns, void *target, bool *is_found, Problem *problem) {
    Sqlite *database = db_take(db);
    const Status status =
        sqlite_first(database, sql, keys, key, columns, target, is_found, problem);
    db_put(db, database);
    return status;
}

Status db_list(Db *db, const char *sql, const SqlColumn *keys, const void *key,
               const SqlColumn *columns, size_t size, void *list, Problem *problem) {
    Sqlite *database = db_take(db);
    const Status status = sqlite_list(database, sql, keys, key, columns, size, list, problem);
    db_put(db, database);
    return status;
}

const SqlColumn query_key_columns[] = {COLUMN(QueryKey, id),     COLUMN(QueryKey, name),
                                       COLUMN(QueryKey, client), COLUMN(QueryKey, digest),
                                       COLUMN(QueryKey, words),  COLUMN(QueryKey, before),
                                       COLUMN(QueryKey, max),    COLUMN_END};
const SqlColumn query_counts_columns[] = {COLUMN(QueryCounts, count), COLUMN(QueryCounts, bytes),
                                          COLUMN(QueryCounts, results), COLUMN(QueryCounts, jobs),
                                          COLUMN_END};
