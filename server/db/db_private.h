// What the files of the tables share: the one writer, the readers, and rows within a transaction.
#ifndef SERVER_DB_DB_PRIVATE_H
#define SERVER_DB_DB_PRIVATE_H

#include <stdatomic.h>

#include "server/db/db.h"
#include "server/db/sqlite.h"

// Makes `directory` and what is missing above it, for this user alone. STATUS_FORBIDDEN where every
// user may replace files in it.
Status data_dir_make(const char *directory, Problem *problem);
// The same, and locks it. *lock is to be given to data_dir_unlock. STATUS_CONFLICT if another
// process has it.
Status data_dir_lock(const char *directory, int *lock, Problem *problem);
void data_dir_unlock(int lock); // below 0: nothing

// check.c: SQLite's own check of the file, then references, then the checksums of all rows.
// STATUS_IO: there is damage.
Status check_run(Sqlite *database, const DbCheck *check, Problem *problem);
// Opens a database that a daemon has begun, to be closed in any case.
Status check_open(const char *path, Sqlite **source, Problem *problem);
// STATUS_NOT_FOUND where there is no database at `path`, in the daemon's folder.
Status check_exists(const char *path, const char *directory, Problem *problem);
// db_open and db_open_beside; `tables` is for sqlite_migrate.
Status db_open_with(const char *directory, bool is_beside, const CheckedTable *const *tables,
                    Db **db, Problem *problem);

// Runs `apply` within the next transaction and returns when that is durable, or with its error; a
// failed apply leaves no trace.
Status db_write(Db *db, DbApply *apply, const void *work, Problem *problem);
// The same without waiting: write->done is set, `work` is borrowed.
void db_enqueue(Db *db, DbApply *apply, const void *work, WritePriority priority,
                PendingWrite *write);
// Runs `apply` within a transaction of a reader, so that all it reads is of one moment.
Status db_read(Db *db, DbApply *apply, const void *work, Problem *problem);

// sqlite_first and sqlite_list on a reader's connection.
Status db_first(Db *db, const char *sql, const SqlColumn *keys, const void *key,
                const SqlColumn *columns, void *target, bool *is_found, Problem *problem);
Status db_list(Db *db, const char *sql, const SqlColumn *keys, const void *key,
               const SqlColumn *columns, size_t size, void *list, Problem *problem);

// What queries are asked by; each uses the members that its text names.
typedef struct QueryKey {
    const char *id, *name, *slug, *client, *digest, *words;
    int64_t before;
    uint64_t number, max;
    MaterialMoment moment;
} QueryKey;
extern const SqlColumn query_key_columns[];
// Numbers that queries have as their result.
typedef struct QueryCounts {
    uint64_t count, bytes, results, jobs;
} QueryCounts;
extern const SqlColumn query_counts_columns[];
// The first row of a query into `row` of `size` bytes, which is zeroed before. Without one
// STATUS_NOT_FOUND, of which the format says what is missing.
__attribute__((format(printf, 8, 9))) Status db_get(Db *db, const char *sql, const QueryKey *key,
                                                    const SqlColumn *columns, void *row,
                                                    size_t size, Problem *problem,
                                                    const char *format, ...);

atomic_uint_fast64_t *db_evictions(Db *db); // of series

// Objects that were read once and are shared, by key: samples of records, revisions of materials.
enum { SHARED_KEY_SIZE = 160 };
typedef struct SharedCache SharedCache;
SharedCache *shared_cache_new(size_t max_bytes); // NULL without memory
void shared_cache_free(SharedCache *cache);
void shared_cache_clear(SharedCache *cache);
// A reference, or NULL. *generation is for shared_cache_add.
Refcount *shared_cache_find(SharedCache *cache, const char *key, uint64_t *generation);
// Adds `object`, or removes the reference to it where an object of that key is there already;
// returns a reference to the object to use. Nothing is added if the cache was emptied since
// `generation` was found, for `object` may be out of date.
Refcount *shared_cache_add(SharedCache *cache, const char *key, uint64_t generation,
                           Refcount *object, size_t bytes);
typedef enum DbCache { CACHE_RECORDS, CACHE_MATERIALS, CACHE_COUNT } DbCache;
SharedCache *db_cache(Db *db, DbCache which);

// Within a transaction:

struct MaterialRevision;
struct MaterialReview;
struct MaterialMeasurement;
struct AuditEntry;

// Adds the result and its uses, unless it is there.
Status result_row_add(Sqlite *database, const ResultRow *row, Problem *problem);
// Runs `sql` with each of the lines as :name.
Status use_lines_add(Sqlite *database, const char *sql, const char *lines, Problem *problem);

// Tables whose rows have checksums.
extern const CheckedTable revisions_table, reviews_table, measurements_table, audit_table,
    records_table, samples_table, results_table, series_table, sweep_rows_table, chunks_table,
    jobs_table, tokens_table;
const SqlColumn *material_revision_columns(void);
// Compares the checksums of all reviews of the materials from slug `first` to `last`: the view
// material_states reads reviews without them. STATUS_INTERNAL: one is damaged.
Status db_reviews_compare(Db *db, const char *first, const char *last, Problem *problem);
extern const SqlColumn material_review_columns[], material_measurement_columns[];

// A material; all zero if it does not exist.
typedef struct MaterialKey {
    int64_t number;
    uint64_t latest, version, measurements;
    char slug[72];               // as its row has it
    char status[16], author[72]; // of the revision asked for; "": there is none, or unknown
} MaterialKey;
Status material_key_find(Sqlite *database, const char *slug, uint64_t revision, MaterialKey *key,
                         Problem *problem);

// Each adds a row without validation and without an audit entry. The material exists, except for
// the first. STATUS_LIMIT.
Status material_row_add(Sqlite *database, const char *slug, Problem *problem);
Status material_revision_add(Sqlite *database, const struct MaterialRevision *revision,
                             Problem *problem);
Status material_review_add(Sqlite *database, const struct MaterialReview *review, Problem *problem);
Status material_measurement_add(Sqlite *database, const struct MaterialMeasurement *measurement,
                                Problem *problem);
Status audit_entry_add(Sqlite *database, const struct AuditEntry *entry, Problem *problem);

// Reads revision->lists into the lists of its material. STATUS_INTERNAL: it is damaged.
Status material_lists_read(struct MaterialRevision *revision, Problem *problem);

#endif
