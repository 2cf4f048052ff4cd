// What the files of the tables need of the database: its one writer and its readers.
#ifndef SERVER_DB_DB_PRIVATE_H
#define SERVER_DB_DB_PRIVATE_H

#include <stdatomic.h>

#include "server/db/db.h"
#include "server/db/sqlite.h"

// Runs `apply` within the next transaction and returns when that is durable, or with its error; a
// failed apply leaves no trace.
Status db_write(Db *db, StoreApply *apply, const void *work, Problem *problem);

// The same without waiting: write->done is set, `work` is borrowed.
void db_enqueue(Db *db, StoreApply *apply, const void *work, WritePriority priority,
                PendingWrite *write);

atomic_uint_fast64_t *db_evictions(Db *db); // of series

typedef struct MaterialMemory MaterialMemory; // cached revisions of materials
MaterialMemory *material_memory_new(void);    // NULL without memory
void material_memory_free(MaterialMemory *memory);
MaterialMemory *db_material_memory(Db *db);

typedef struct RecordMemory RecordMemory; // samples of records, each once
RecordMemory *record_memory_new(void);    // NULL without memory
void record_memory_free(RecordMemory *memory);
// Adds it, or frees it where the same record is there already; returns a reference to that.
struct NamedRecord *record_memory_add(RecordMemory *memory, uint64_t catalog_version,
                                      struct NamedRecord *named);
RecordMemory *db_record_memory(Db *db);

// A connection for reading, to be returned soon: there are few. Waits for one.
Sqlite *db_take(Db *db);
void db_put(Db *db, Sqlite *database);

// sqlite_first and sqlite_list on a reader's connection.
Status db_first(Db *db, const char *sql, const SqlColumn *keys, const void *key,
                const SqlColumn *columns, void *target, bool *is_found, Problem *problem);
Status db_list(Db *db, const char *sql, const SqlColumn *keys, const void *key,
               const SqlColumn *columns, size_t size, void *list, Problem *problem);

// What queries are asked by; each uses the members that its text names.
typedef struct QueryKey {
    const char *id, *name, *client, *digest, *words;
    int64_t before;
    uint64_t max;
} QueryKey;
extern const SqlColumn query_key_columns[];
// And numbers that come back.
typedef struct QueryCounts {
    uint64_t count, bytes, results, jobs;
} QueryCounts;
extern const SqlColumn query_counts_columns[];

// Within a transaction: all that changes of a job, or the whole of it where it is_unsaved.
// STATUS_NOT_FOUND.
Status job_row_save(Sqlite *database, const JobRow *row, Problem *problem);
// Within a transaction: runs `sql` with each of the lines as :name.
Status use_lines_add(Sqlite *database, const char *sql, const char *lines, Problem *problem);

#endif
