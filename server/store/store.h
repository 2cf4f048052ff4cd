// The database as the rest of the server sees it: jobs, results, materials. One writer thread
// commits whatever is queued (durable when a call returns), each reader has its own connection. No
// SQL outside this room.
#ifndef SERVER_STORE_STORE_H
#define SERVER_STORE_STORE_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#include "core/base/field.h"
#include "core/base/status.h"
#include "server/base/tally.h"

typedef struct Store Store;

// Opens (and makes or migrates) DIR/impactd.db, DIR too if it is missing; `directory` NULL is a
// private database in memory, for `impactd run`. STATUS_CONFLICT if another daemon has the folder,
// or the database is a newer program's.
Status store_open(const char *directory, Store **store, Problem *problem);
// The same folder while a daemon has it, or none: for commands that read or write a few rows. Locks
// the folder only where the database has to be made or migrated.
Status store_open_beside(const char *directory, Store **store, Problem *problem);
void store_close(Store *store);

// What was written since the start; counted on.
typedef struct StoreTotals {
    Counter writes, rows, errors;
    Histogram commits; // transactions, from their beginning until they are durable
} StoreTotals;
const StoreTotals *store_totals(const Store *store);

typedef struct MaterialRevision {
    char *slug, *name, *status, *source;
    uint64_t revision;
    double restitution, contact_time;
} MaterialRevision;
typedef struct MaterialRevisions {
    MaterialRevision *at;
    size_t count;
} MaterialRevisions;
extern const Field material_fields[];
// revision 0: the approved head, else the newest draft. STATUS_NOT_FOUND. Cleared by
// fields_clear(material_fields). A member that is not known is NAN.
Status store_material(Store *store, const char *slug, uint64_t revision, MaterialRevision *material,
                      Problem *problem);
// The head of every material, by slug; of those that are all deprecated the newest revision.
Status store_materials(Store *store, MaterialRevisions *materials, Problem *problem);
void material_revisions_clear(MaterialRevisions *materials);

typedef struct JobRow {
    char id[40];
    int state; // JobState
    char result[72];
    bool is_cached;
    int64_t created_unix_ms, started_unix_ms, finished_unix_ms;
    double queued, run, total; // [s]
    char *scene;               // canonical JSON, resolved
    char *problem, *warnings, *title;
} JobRow;
void job_row_clear(JobRow *row);
// `scene` and `warnings` are required. STATUS_CONFLICT where the id exists.
Status store_job_add(Store *store, const JobRow *row, Problem *problem);
// State, is_cached, times, problem, result. STATUS_NOT_FOUND.
Status store_job_update(Store *store, const JobRow *row, Problem *problem);
// All but the scene, here and in the list; the unfinished ones come with theirs. `row` may be
// uninitialised.
Status store_job_load(Store *store, const char *id, JobRow *row, Problem *problem);
// Newest first; `before` is an id to go on after (STATUS_NOT_FOUND), or NULL.
typedef struct JobRows {
    JobRow *at;
    size_t count;
} JobRows;
Status store_job_list(Store *store, const char *before, size_t most, JobRows *rows,
                      Problem *problem);
Status store_job_unfinished(Store *store, JobRows *rows, Problem *problem); // oldest first
void job_rows_clear(JobRows *rows);

// Everything of a result but its series, which is computed anew when asked for.
typedef struct ResultRow {
    char id[72];
    char *engine;
    char *scene, *plan, *summary, *warnings, *energy, *impacts; // JSON documents
    char *work;                                                 // JSON document; NULL: not known
    char *notes;    // JSON array, what the run itself warned of; NULL: nothing
    char *psd;      // JSON; NULL where none was asked for
    char *study;    // JSON, the answer of the scene's study; NULL: none
    uint64_t count; // samples
    double sample_rate;
    int64_t created_unix_ms;
} ResultRow;
void result_row_clear(ResultRow *row);
// Saves the result (NULL: none) and the finished jobs in one transaction; a result already there
// stays as it is.
Status store_result_save(Store *store, const ResultRow *result, const JobRow *const *jobs,
                         size_t job_count, Problem *problem);
Status store_result_load(Store *store, const char *id, ResultRow *row, Problem *problem);
// The same without scene, energy, impacts, psd and study, which may be long.
Status store_result_head(Store *store, const char *id, ResultRow *row, Problem *problem);
// Id, engine and scene alone: what computing it anew takes.
Status store_result_scene(Store *store, const char *id, ResultRow *row, Problem *problem);
bool store_result_exists(Store *store, const char *id);

typedef struct StoredBytes {
    void *at;
    size_t size;
} StoredBytes;

// A sweep: what is to be done, written before any of it runs.
typedef struct SweepRow {
    int64_t number; // the store's
    char result[72];
    char *scene;                      // canonical JSON, with the study
    uint64_t points, metrics, chunks; // scene i stands in chunk i mod chunks
    uint64_t retries;
    int64_t created_unix_ms;
} SweepRow;
void sweep_row_clear(SweepRow *row);

// The rows of one chunk, all of them.
typedef struct SweepChunkRow {
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

// Writes the sweep down; one that is there already stays as it is, and `row` becomes that one.
Status store_sweep_begin(Store *store, SweepRow *row, Problem *problem);
// STATUS_NOT_FOUND. `row` may be uninitialised.
Status store_sweep_load(Store *store, const char *result, SweepRow *row, Problem *problem);
// What a job asked for, of which nothing may be written down yet: result and scene alone.
// STATUS_NOT_FOUND.
Status store_sweep_asked(Store *store, const char *job, SweepRow *row, Problem *problem);
// Adds a chunk, in one transaction. One that is there already and not open stays as it is.
Status store_sweep_take(Store *store, const SweepChunkRow *chunk, Problem *problem);
// All that are there, by chunk; `has_rows` false: without reasons and rows.
Status store_sweep_chunks(Store *store, int64_t sweep, bool has_rows, SweepChunkRows *chunks,
                          Problem *problem);
// One of them. STATUS_NOT_FOUND.
Status store_sweep_chunk(Store *store, int64_t sweep, uint64_t number, SweepChunkRow *chunk,
                         Problem *problem);
void sweep_chunk_row_clear(SweepChunkRow *row);
// Opens every chunk that has failures. STATUS_CONFLICT where none has.
Status store_sweep_reopen(Store *store, const char *result, Problem *problem);
// Forgets a sweep whose result was never finished.
Status store_sweep_forget(Store *store, const char *result, Problem *problem);
// Forgets all sweeps that have neither a result nor an unfinished job.
Status store_sweep_tidy(Store *store, Problem *problem);

#endif
