// Sweeps. A chunk is written whole, so what is there is right, and the same chunk may come twice:
// its bytes are the same.
#include <stdlib.h>
#include <string.h>

#include "server/db/db_private.h"

// clang-format off
static const SqlColumn sweep_columns[] = {
    COLUMN_READ(SweepRow, number, "number"),
    COLUMN_WITH(SweepRow, result, COLUMN_CHECKED | COLUMN_ID),
    COLUMN_WITH(SweepRow, scene, COLUMN_CHECKED),
    COLUMN_WITH(SweepRow, points, COLUMN_CHECKED),
    COLUMN_WITH(SweepRow, metrics, COLUMN_CHECKED),
    COLUMN_WITH(SweepRow, chunks, COLUMN_CHECKED),
    COLUMN(SweepRow, retries),
    COLUMN_WITH(SweepRow, created_unix_ms, COLUMN_CHECKED),
    COLUMN_END
};
const CheckedTable sweep_rows_table = CHECKED_TABLE("sweeps", sweep_columns, SweepRow);

static const SqlColumn chunk_columns[] = {
    COLUMN_READ(SweepChunkRow, number, "number"),
    COLUMN_WITH(SweepChunkRow, sweep, COLUMN_CHECKED | COLUMN_ID),
    COLUMN_WITH(SweepChunkRow, chunk, COLUMN_CHECKED | COLUMN_ID),
    COLUMN_WITH(SweepChunkRow, failed, COLUMN_MUTABLE | COLUMN_CHECKED),
    COLUMN_WITH(SweepChunkRow, is_open, COLUMN_MUTABLE),
    COLUMN_WITH(SweepChunkRow, reasons, COLUMN_MUTABLE | COLUMN_LONG | COLUMN_CHECKED),
    COLUMN_WITH(SweepChunkRow, rows, COLUMN_MUTABLE | COLUMN_LONG | COLUMN_CHECKED),
    COLUMN_END
};
const CheckedTable chunks_table = CHECKED_TABLE("sweep_chunks", chunk_columns, SweepChunkRow);
// clang-format on

void sweep_row_clear(SweepRow *row) {
    row_clear(sweep_columns, row, sizeof *row);
}

void sweep_chunk_row_clear(SweepChunkRow *row) {
    row_clear(chunk_columns, row, sizeof *row);
}

void sweep_chunk_rows_clear(SweepChunkRows *rows) {
    rows_clear(chunk_columns, sizeof *rows->at, rows);
}

static Status sweep_apply_begin(Sqlite *database, const void *work, Problem *problem) {
    static const char sql[] = "INSERT INTO sweeps {insert} ON CONFLICT (result) DO NOTHING";
    return sqlite_change(database, sql, sweep_columns, work, NULL, problem);
}

Status db_sweep_begin(Db *db, SweepRow *row, Problem *problem) {
    char result[sizeof row->result];
    memcpy(result, row->result, sizeof result);
    TRY(db_write(db, sweep_apply_begin, row, problem));
    sweep_row_clear(row);
    return db_sweep_load(db, result, row, problem);
}

Status db_sweep_load(Db *db, const char *result, SweepRow *row, Problem *problem) {
    static const char sql[] = "SELECT {columns} FROM sweeps WHERE result = :id";
    TRY(db_get(db, sql, &(QueryKey){.id = result}, sweep_columns, row, sizeof *row, problem,
               "there is no table of \"%.72s\": either no such result, or its scene asked for "
               "no sweep",
               result));
    if (row->chunks > 0)
        return STATUS_OK;
    sweep_row_clear(row);
    return problem_set(problem, STATUS_INTERNAL,
                       "the database is damaged: the table of %.72s has no parts", result);
}

Status db_sweep_asked(Db *db, const char *job, SweepRow *row, Problem *problem) {
    static const char sql[] = "SELECT result, scene FROM jobs WHERE id = :id AND scene <> ''";
    return db_get(db, sql, &(QueryKey){.id = job}, sweep_columns, row, sizeof *row, problem,
                  "there is no job \"%.40s\"", job);
}

static Status sweep_apply_take(Sqlite *database, const void *work, Problem *problem) {
    static const char sql[] = "INSERT INTO sweep_chunks {insert} ON CONFLICT (sweep, chunk) DO "
                              "UPDATE SET {set} WHERE is_open";
    return sqlite_change(database, sql, chunk_columns, work, NULL, problem);
}

Status db_sweep_take(Db *db, const SweepChunkRow *chunk, Problem *problem) {
    return db_write(db, sweep_apply_take, chunk, problem);
}

Status db_sweep_chunks(Db *db, int64_t sweep, SweepChunkRows *chunks, Problem *problem) {
    static const char sql[] = "SELECT {head} FROM sweep_chunks WHERE sweep = :sweep ORDER BY chunk";
    const SweepChunkRow key = {.sweep = sweep};
    return db_list(db, sql, chunk_columns, &key, chunk_columns, sizeof *chunks->at, chunks,
                   problem);
}

Status db_sweep_chunk(Db *db, int64_t sweep, uint64_t number, SweepChunkRow *chunk,
                      Problem *problem) {
    static const char sql[] = "SELECT {columns} FROM sweep_chunks "
                              "WHERE sweep = :sweep AND chunk = :chunk";
    const SweepChunkRow key = {.sweep = sweep, .chunk = number};
    bool is_found;
    memset(chunk, 0, sizeof *chunk);
    TRY(db_first(db, sql, chunk_columns, &key, chunk_columns, chunk, &is_found, problem));
    return is_found ? STATUS_OK
                    : problem_set(problem, STATUS_NOT_FOUND, "the chunk is not there yet");
}

static Status sweep_apply_compare(Sqlite *database, const void *key, Problem *problem) {
    static const CheckedTable chunks = {
        .sql = "SELECT {checked} FROM sweep_chunks WHERE sweep = :sweep",
        .columns = chunk_columns,
        .size = sizeof(SweepChunkRow)};
    TableCheck check = {.keys = chunk_columns, .key = key};
    return sqlite_check_table(database, &chunks, &check, problem);
}

Status db_sweep_compare(Db *db, int64_t sweep, Problem *problem) {
    return db_read(db, sweep_apply_compare, &(SweepChunkRow){.sweep = sweep}, problem);
}

static Status sweep_check_row(Sqlite *database, const char *sql, const SqlColumn *columns,
                              const void *item, Problem *problem) {
    SweepRow none = {0};
    bool is_there;
    TRY(sqlite_first(database, sql, columns, item, sweep_columns, &none, &is_there, problem));
    return is_there ? STATUS_OK
                    : problem_set(
                          problem, STATUS_CONFLICT,
                          "the sweep's rows were deleted or computed again while they were read");
}

typedef struct SweepRead {
    const SweepRow *sweep;
    const SweepChunkRows *chunks;
    size_t offset, size;
    unsigned char *target;
} SweepRead;

static Status sweep_apply_read(Sqlite *database, const void *work, Problem *problem) {
    static const char sweep_sql[] = "SELECT 1 FROM sweeps WHERE number = :number AND result = "
                                    ":result AND created_unix_ms = :created_unix_ms";
    static const char chunk_sql[] =
        "SELECT 1 FROM sweep_chunks WHERE number = :number AND sweep = :sweep AND chunk = :chunk "
        "AND failed = :failed AND is_open = :is_open";
    const SweepRead *read = work;
    TRY(sweep_check_row(database, sweep_sql, sweep_columns, read->sweep, problem));
    for (size_t i = 0; i < read->chunks->count; i++) {
        const SweepChunkRow *chunk = &read->chunks->at[i];
        TRY(sweep_check_row(database, chunk_sql, chunk_columns, chunk, problem));
        TRY(sqlite_read_part(database, "sweep_chunks", "rows", chunk->number, read->offset,
                             read->size, read->target + i * read->size, problem));
    }
    return STATUS_OK;
}

Status db_sweep_read(Db *db, const SweepRow *sweep, const SweepChunkRows *chunks, size_t offset,
                     size_t size, unsigned char *target, Problem *problem) {
    return db_read(db, sweep_apply_read, &(SweepRead){sweep, chunks, offset, size, target},
                   problem);
}

static Status sweep_apply_reopen(Sqlite *database, const void *work, Problem *problem) {
    static const char chunks[] = "UPDATE sweep_chunks SET is_open = 1 WHERE failed > 0 AND sweep = "
                                 "(SELECT number FROM sweeps WHERE result = :id)";
    static const char sweep[] = "UPDATE sweeps SET retries = retries + 1 WHERE result = :id";
    int changes = 0;
    TRY(sqlite_change(database, chunks, query_key_columns, work, &changes, problem));
    if (changes == 0)
        return problem_set(problem, STATUS_CONFLICT, "no point of the sweep has failed");
    return sqlite_change(database, sweep, query_key_columns, work, NULL, problem);
}

Status db_sweep_reopen(Db *db, const char *result, Problem *problem) {
    const QueryKey key = {.id = result};
    return db_write(db, sweep_apply_reopen, &key, problem);
}

static Status sweep_apply_tidy(Sqlite *database, const void *work, Problem *problem) {
    static const char sql[] =
        "DELETE FROM sweeps WHERE result NOT IN (SELECT id FROM results) AND result NOT IN "
        "(SELECT result FROM jobs WHERE state < 2)";
    return sqlite_change(database, sql, NULL, work, NULL, problem);
}

Status db_sweep_tidy(Db *db, Problem *problem) {
    return db_write(db, sweep_apply_tidy, NULL, problem);
}
