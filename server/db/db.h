// The database: jobs, results, series, sweeps. One writer thread commits what is queued; each
// reader has a connection of its own. A write is durable when its call returns, except db_*_post,
// which reports it later. SQL is only in this folder.
#ifndef SERVER_DB_DB_H
#define SERVER_DB_DB_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#include "core/base/field.h"
#include "core/base/progress.h"
#include "core/base/status.h"
#include "server/db/sqlite.h"
#include "server/util/bytes.h"
#include "server/util/metrics.h"

typedef struct Db Db;

// Opens (and makes or migrates) DIR/impactd.db, DIR too if it is missing; `directory` NULL is a
// private database in memory, for `impactd run`. STATUS_CONFLICT if another daemon has the folder,
// or the database is a newer program's.
Status db_open(const char *directory, Db **db, Problem *problem);
// The same folder while a daemon has it, or none: for commands that read or write a few rows. Locks
// the folder only where the database has to be made or migrated.
Status db_open_beside(const char *directory, Db **db, Problem *problem);
// Whether the folder has a database. STATUS_NOT_FOUND.
Status db_exists(const char *directory, Problem *problem);
void db_close(Db *db);
// Makes new names in a folder durable.
Status data_dir_sync(const char *directory, Problem *problem);
bool db_is_private(const Db *db); // in memory, gone with the program

// A write that is not waited for. Its owner keeps it, and what it borrows, until `done` was called:
// once, from the writer's thread, when the write is durable or has failed (then with the reason).
// `done` must be quick; it may enqueue. Writes of normal priority are done in the order in which
// they were enqueued, many in one transaction; those of low priority when no other is queued.
typedef enum WritePriority { WRITE_NORMAL, WRITE_LOW } WritePriority;
typedef struct WriteDone {
    void (*call)(void *context, Status status, const char *detail);
    void *context;
} WriteDone;
typedef struct Sqlite Sqlite;
// Does one write on the writer's thread. It may be called again with the same `work` after the
// first time was rolled back.
typedef Status DbApply(Sqlite *database, const void *work, Problem *problem);
typedef struct PendingWrite {
    WriteDone done; // the owner's; all below is the writer's
    struct PendingWrite *next;
    DbApply *apply;
    const void *work;
    Status status;
    char *detail;
} PendingWrite;

// What was written since the start; counted on.
typedef struct DbStats {
    Counter writes, rows, errors;
    Histogram commits;      // transactions, from their beginning until they are durable
    atomic_bool is_failing; // the last transaction could not be made durable
} DbStats;
const DbStats *db_stats(const Db *db);
// Whether the last transaction was made durable; if not, another one is tried meanwhile, so that a
// later call knows whether the cause has gone. Does not wait.
bool db_is_writable(Db *db);

typedef struct JobRow {
    char id[40];
    int state; // JobState
    char result[72];
    bool is_cached;
    int64_t created_unix_ms, started_unix_ms, finished_unix_ms;
    double queued, run, total; // [s]
    bool is_damaged;           // of a search: the row differs from its checksums; see db_job_search
    char *scene;               // canonical JSON, resolved
    char *problem, *warnings, *title;
    char *labels;          // JSON array of texts; NULL: none
    char *words;           // what is searched: job_words; NULL: nothing
    char *study;           // the kind of its study; NULL: none
    char *client;          // its sender; NULL: none
    char *idempotency_key; // NULL: none
    char *request;         // with a key: SHA-256 of the body it came with
    char *uses;      // when added: the records it names, "record:elcentro", a line each, which
                     // then are used until it ends; NULL: none
    bool has_result; // loaded rows: its result is there
    // No columns:
    bool is_unsaved;           // it may not be in the database yet, so that saving it inserts it
    const struct JobRow *next; // saved in the same transaction
} JobRow;
void job_row_clear(JobRow *row);
// `scene` and `warnings` are required. STATUS_CONFLICT where the id exists.
Status db_job_add(Db *db, const JobRow *row, Problem *problem);
// The same without waiting; borrows `row`.
void db_job_post(Db *db, const JobRow *row, PendingWrite *write);
// State, is_cached, times, problem, result. STATUS_NOT_FOUND, unless it is_unsaved.
Status db_job_update(Db *db, const JobRow *row, Problem *problem);
void db_job_update_post(Db *db, const JobRow *row, PendingWrite *write);
// All but the scene, as in lists. `row` may be uninitialised.
Status db_job_load(Db *db, const char *id, JobRow *row, Problem *problem);
Status db_job_load_with_scene(Db *db, const char *id, JobRow *row, Problem *problem);
// The scene that it asked for, to be freed: canonical JSON. STATUS_NOT_FOUND; STATUS_GONE where it
// went with a deleted result.
Status db_job_scene(Db *db, const char *id, char **scene, Problem *problem);
// The same if it has at most `most` characters; STATUS_NOT_FOUND or STATUS_GONE beyond.
Status db_job_scene_within(Db *db, const char *id, size_t most, char **scene, Problem *problem);
// The job that `client` (NULL: none) sent under that key. STATUS_NOT_FOUND.
Status db_job_keyed(Db *db, const char *client, const char *key, JobRow *row, Problem *problem);
typedef struct JobRows {
    JobRow *at;
    size_t count;
} JobRows;
Status db_job_unfinished(Db *db, JobRows *rows, Problem *problem); // ids alone, oldest first
void job_rows_clear(JobRows *rows);
// Ids that begin with `prefix`, of jobs ("j-...") or results ("r-..."), `max` at most, in order: as
// `result` of the rows.
Status db_ids_with_prefix(Db *db, const char *prefix, size_t max, JobRows *rows, Problem *problem);

// Jobs by name, outcome and time of arrival. Texts are the caller's; NULL: any.
typedef struct JobSearch {
    const char *before;          // an id: only those that follow it in the list
    int64_t before_unix_ms;      // of its arrival, where it may be deleted; -1: it must exist
    int64_t before_number;       // set by the search
    int least_state, most_state; // JobState
    const char *words;           // within the title or a label, ignoring case
    const char *label;           // one whole label, or "key" of a label "key=value"; likewise
    const char *result;          // its id
    const char *study;           // the study's kind; "none": without one
    int64_t since_unix_ms, until_unix_ms; // of arrival, both included
    size_t most;
} JobSearch;
JobSearch job_search_all(size_t most);
// Newest first. STATUS_NOT_FOUND where there is no job `before`, and before_unix_ms is -1.
// A damaged row does not hide the others: it is a failed job whose problem says so.
Status db_job_search(Db *db, const JobSearch *search, JobRows *rows, Problem *problem);
// The title and the labels (a JSON array) of a job, with their words. NULL: as it is; "": none.
typedef struct JobNotes {
    const char *id, *title, *labels, *title_words, *label_words;
} JobNotes;
// STATUS_NOT_FOUND.
Status db_job_annotate(Db *db, const JobNotes *notes, Problem *problem);
// The text that a search by words looks into: a line for the title and one for each label.
void job_words(Bytes *bytes, const char *title, const char *const *labels, size_t label_count);

// Everything of a result but its series, which is computed anew when asked for.
typedef struct ResultRow {
    char id[72];
    char *engine;
    char *scene, *plan, *summary, *warnings; // JSON documents
    char *work;                              // JSON document; NULL: not known
    char *notes;         // JSON array, what the run itself warned of; NULL: nothing
    StoredBytes outcome; // jobs/outcome_blob.c
    uint64_t impact_count;
    char *study;    // JSON, the answer of the scene's study; NULL: none
    char *uses;     // when saved: what of the catalogue it was made with, "sponge@1", a line each;
                    // NULL: nothing
    uint64_t count; // samples
    double sample_rate;
    int64_t created_unix_ms;
} ResultRow;
void result_row_clear(ResultRow *row);
// The result (NULL: none) and the list of jobs that it finishes, saved in one transaction; a result
// that is there already stays as it is.
typedef struct ResultCommit {
    const ResultRow *result;
    const JobRow *jobs;
} ResultCommit;
// Saved without waiting; all of it is borrowed.
void db_result_post(Db *db, const ResultCommit *commit, PendingWrite *write);
// All but the outcome.
Status db_result_load(Db *db, const char *id, ResultRow *row, Problem *problem);
// Id and outcome alone.
Status db_result_outcome(Db *db, const char *id, ResultRow *row, Problem *problem);
// The same as db_result_load without scene and study, which may be long.
Status db_result_head(Db *db, const char *id, ResultRow *row, Problem *problem);
// Id, engine and scene alone: what computing it anew takes.
Status db_result_scene(Db *db, const char *id, ResultRow *row, Problem *problem);
// The same if the scene has at most `most` characters; STATUS_NOT_FOUND beyond.
Status db_result_scene_within(Db *db, const char *id, size_t most, ResultRow *row,
                              Problem *problem);
Status db_result_find(Db *db, const char *id, Problem *problem);
bool db_result_exists(Db *db, const char *id);
// A client other than `client` of whose finished jobs it is the result; "" if there is none.
Status db_result_sharer(Db *db, const char *id, const char *client, char sharer[72],
                        Problem *problem);
Status db_result_delete(Db *db, const char *id, Problem *problem); // STATUS_NOT_FOUND
// Id, engine and scene of the newest ones, newest first, without scenes longer than that.
typedef struct ResultRows {
    ResultRow *at;
    size_t count;
} ResultRows;
Status db_result_recent(Db *db, size_t most, size_t scene_max, ResultRows *rows, Problem *problem);
void result_rows_clear(ResultRows *rows);

// Series of results as bytes, at most `most` of them in all: the longest unused make room. Posted
// behind all else that is to be written. Takes `body`, which is to be freed, also when it fails.
Status db_series_post(Db *db, const char *result, char *body, size_t size, uint64_t most,
                      const WriteDone *done);
// *body is to be freed. STATUS_NOT_FOUND.
Status db_series_load(Db *db, const char *result, char **body, size_t *size, Problem *problem);
bool db_series_exists(Db *db, const char *result);
void db_series_stats(Db *db, uint64_t *count, uint64_t *bytes, uint64_t *evictions);

// A sweep, stored before any of it runs.
typedef struct SweepRow {
    int64_t number; // in the database
    char result[72];
    char *scene;                      // canonical JSON, with the study
    uint64_t points, metrics, chunks; // scene i is in chunk i mod chunks
    uint64_t retries;
    int64_t created_unix_ms;
} SweepRow;
void sweep_row_clear(SweepRow *row);

// The rows of one chunk, all of them.
typedef struct SweepChunkRow {
    int64_t number; // in the database
    int64_t sweep;
    uint64_t chunk, failed;
    bool is_open;  // those that failed are to be tried again
    char *reasons; // "place sentence" lines of those that failed; NULL: none
    StoredBytes rows;
} SweepChunkRow;
typedef struct SweepChunkRows {
    SweepChunkRow *at;
    size_t count;
} SweepChunkRows;
void sweep_chunk_rows_clear(SweepChunkRows *rows);

// Stores the sweep. A stored one stays as it is and is loaded into `row`.
Status db_sweep_begin(Db *db, SweepRow *row, Problem *problem);
// STATUS_NOT_FOUND. `row` may be uninitialised.
Status db_sweep_load(Db *db, const char *result, SweepRow *row, Problem *problem);
// The sweep that a job requests, which may not be stored yet: result and scene alone.
// STATUS_NOT_FOUND.
Status db_sweep_asked(Db *db, const char *job, SweepRow *row, Problem *problem);
// Adds a chunk, in one transaction. One that is there already and not open stays as it is.
Status db_sweep_take(Db *db, const SweepChunkRow *chunk, Problem *problem);
// All that are there, by chunk, without reasons and rows.
Status db_sweep_chunks(Db *db, int64_t sweep, SweepChunkRows *chunks, Problem *problem);
// One of them. STATUS_NOT_FOUND.
Status db_sweep_chunk(Db *db, int64_t sweep, uint64_t number, SweepChunkRow *chunk,
                      Problem *problem);
void sweep_chunk_row_clear(SweepChunkRow *row);
// Compares the checksums of all its chunks, of which db_sweep_read reads parts. STATUS_INTERNAL:
// one is damaged.
Status db_sweep_compare(Db *db, int64_t sweep, Problem *problem);
// Bytes `offset` ... of the rows of each of these chunks, `size` or as many as there are: those of
// chunk i at target + i size. STATUS_CONFLICT where sweep or chunk is not what it was when it was
// loaded.
Status db_sweep_read(Db *db, const SweepRow *sweep, const SweepChunkRows *chunks, size_t offset,
                     size_t size, unsigned char *target, Problem *problem);
// Opens every chunk that has failures. STATUS_CONFLICT where none has.
Status db_sweep_reopen(Db *db, const char *result, Problem *problem);
// Deletes all sweeps that have neither a result nor an unfinished job.
Status db_sweep_tidy(Db *db, Problem *problem);

// What is kept: the oldest finished jobs are deleted first, and with the last job of a result the
// result. 0: no such rule.
typedef struct KeepRules {
    double days;
    uint64_t jobs, bytes; // finished jobs; of the database, without its free pages
} KeepRules;
enum { RETENTION_BATCH = 64 };
typedef struct Removed {
    size_t jobs, results;
    char result[RETENTION_BATCH][72]; // their ids
    bool is_more;                     // call again at once
} Removed;
// Removes some of what exceeds the rules, or returns some free pages to the disk where there are
// many, in one small transaction.
Status db_remove(Db *db, const KeepRules *rules, Removed *removed, Problem *problem);
// Removes one finished job, and its result if that was the last job of it. STATUS_NOT_FOUND.
Status db_job_remove(Db *db, const char *id, Removed *removed, Problem *problem);

// Access tokens as they are stored: names, digests, scopes, times.
enum { TOKEN_NAME_SIZE = 65, TOKENS_MAX = 1000 };

// Times in milliseconds since 1970; 0: never.
typedef struct TokenRow {
    char name[TOKEN_NAME_SIZE]; // [A-Za-z0-9._-]{1,64}
    char digest[65];            // SHA-256, in hexadecimal digits
    char scopes[64];            // "read,submit"
    int64_t created_unix_ms, used_unix_ms, expires_unix_ms, revoked_unix_ms;
    bool is_damaged; // the row differs from its checksums: it gives access to nothing
} TokenRow;
typedef struct TokenRows {
    TokenRow *at; // freed by free
    size_t count;
} TokenRows;

// STATUS_CONFLICT where the name is taken, STATUS_LIMIT where there are TOKENS_MAX.
Status db_token_add(Db *db, const TokenRow *row, Problem *problem);
// All, by name.
Status db_tokens(Db *db, TokenRows *rows, Problem *problem);
// Revokes at row->revoked_unix_ms; STATUS_NOT_FOUND, STATUS_CONFLICT if it is revoked already.
Status db_token_revoke(Db *db, const TokenRow *row, Problem *problem);
// Deletes it; STATUS_NOT_FOUND, STATUS_CONFLICT unless it is revoked.
Status db_token_forget(Db *db, const TokenRow *row, Problem *problem);
// Stores row->used_unix_ms.
Status db_token_used(Db *db, const TokenRow *row, Problem *problem);

// A check of the folder's database, while a daemon has it or without: SQLite's own, of references
// between tables and of the checksums of rows. Gets each table and a sentence for each damaged row.
typedef struct DbCheck {
    void (*report_table)(void *context, const char *name, uint64_t rows,
                         uint64_t damaged); // or NULL
    void (*report_damage)(void *context, const char *damage);
    void *context;
} DbCheck;
// STATUS_IO: there is damage. STATUS_NOT_FOUND without a database.
Status db_check(const char *directory, const DbCheck *check, Problem *problem);

// A database as one file: a copy of the daemon's, made beside it while it runs or without it, and
// the way back.
typedef struct BackupRequest {
    const char *directory; // the daemon's
    const char *path;      // of the copy
    bool replaces;         // the file that is written may exist
    const Progress *watch; // NULL: none
} BackupRequest;

// What a copy contains.
typedef struct Backup {
    uint64_t bytes, jobs, results, materials;
} Backup;

// Copies all that was acknowledged before it began to `path`, and checks it. The file appears whole
// and durable, or nothing is left: STATUS_CANCELLED when the watch stops, STATUS_FULL,
// STATUS_NOT_FOUND without a database, STATUS_CONFLICT where `path` is taken.
Status backup_write(const BackupRequest *request, Backup *backup, Problem *problem);

// Copies `path` to the folder's database, likewise. STATUS_CONFLICT where a daemon has the folder,
// where it has a database and that may not be replaced, and where the schema is not this program's.
Status backup_restore(const BackupRequest *request, Backup *backup, Problem *problem);

// Export reads row by row the state at one moment. Rows are only added, so that the newest number
// of each table is a moment.
typedef struct MaterialMoment {
    int64_t revisions, reviews, measurements;
} MaterialMoment;

#endif
