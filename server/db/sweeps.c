// Sweeps. A chunk is written whole, so what is there is right, and the same chunk may come twice:
// its bytes are the same.
#include <stdlib.h>
#include <string.h>

#include "server/db/db.h"
#include "server/db/db_private.h"

// clang-format off
static const RowColumn sweep_columns[] = {
    ROW_COLUMN(SweepRow, number, COLUMN_INTEGER),
    ROW_COLUMN(SweepRow, result, COLUMN_NAME),
    ROW_COLUMN(SweepRow, scene, COLUMN_TEXT),
    ROW_COLUMN(SweepRow, points, COLUMN_COUNT),
    ROW_COLUMN(SweepRow, metrics, COLUMN_COUNT),
    ROW_COLUMN(SweepRow, chunks, COLUMN_COUNT),
    ROW_COLUMN(SweepRow, retries, COLUMN_COUNT),
    ROW_COLUMN(SweepRow, created_unix_ms, COLUMN_INTEGER),
    ROW_END
};

static const RowColumn chunk_columns[] = {
    ROW_COLUMN(SweepChunkRow, number, COLUMN_INTEGER),
    ROW_COLUMN(SweepChunkRow, sweep, COLUMN_INTEGER),
    ROW_COLUMN(SweepChunkRow, chunk, COLUMN_COUNT),
    ROW_COLUMN(SweepChunkRow, failed, COLUMN_COUNT),
    ROW_COLUMN(SweepChunkRow, is_open, COLUMN_FLAG),
    ROW_COLUMN(SweepChunkRow, reasons, COLUMN_TEXT),
    ROW_COLUMN(SweepChunkRow, rows, COLUMN_BYTES),
    ROW_END
};
// clang-format on

void sweep_row_clear(SweepRow *row) {
    row_clear(sweep_columns, row, sizeof *row);
}

void sweep_chunk_row_clear(SweepChunkRow *row) {
    row_clear(chunk_columns, row, sizeof *row);
}

void sweep_chunk_rows_clear(SweepChunkRows *rows) {
    for (size_t i = 0; i < rows->count; i++)
        sweep_chunk_row_clear(&rows->at[i]);
    free(rows->at);
    *rows = (SweepChunkRows){NULL, 0};
}

static Status begin(Sqlite *database, const void *work, Problem *problem) {
    static const char sql[] =
        "INSERT INTO sweeps (result, scene, points, metrics, chunks, retries, created_unix_ms) "
        "VALUES (:result, :scene, :points, :metrics, :chunks, 0, :created_unix_ms) "
        "ON CONFLICT (result) DO NOTHING";
    return sqlite_change(database, sql, sweep_columns, work, NULL, problem);
}

Status db_sweep_begin(Db *db, SweepRow *row, Problem *problem) {
    char result[sizeof row->result];
    memcpy(result, row->result, sizeof result);
    TRY(db_write(db, begin, row, problem));
    sweep_row_clear(row);
    return db_sweep_load(db, result, row, problem);
}

static SweepRow key_of(const char *result) {
    SweepRow key = {0};
    if (strlen(result) < sizeof key.result)
        memcpy(key.result, result, strlen(result));
    return key;
}

Status db_sweep_load(Db *db, const char *result, SweepRow *row, Problem *problem) {
    static const char sql[] = "SELECT number, result, scene, points, metrics, chunks, retries, "
                              "created_unix_ms FROM sweeps WHERE result = :result";
    const SweepRow key = key_of(result);
    bool is_found;
    memset(row, 0, sizeof *row);
    TRY(db_first(db, sql, sweep_columns, &key, sweep_columns, row, &is_found, problem));
    return is_found ? STATUS_OK
                    : problem_set(problem, STATUS_NOT_FOUND,
                                  "there is no table of \"%.72s\": either no such result, or its "
                                  "scene asked for no sweep",
                                  result);
}

Status db_sweep_asked(Db *db, const char *job, SweepRow *row, Problem *problem) {
    static const char sql[] = "SELECT result, scene FROM jobs WHERE id = :result AND scene <> ''";
    const SweepRow key = key_of(job);
    bool is_found;
    memset(row, 0, sizeof *row);
    TRY(db_first(db, sql, sweep_columns, &key, sweep_columns, row, &is_found, problem));
    return is_found ? STATUS_OK
                    : problem_set(problem, STATUS_NOT_FOUND, "there is no job \"%.40s\"", job);
}

static Status take(Sqlite *database, const void *work, Problem *problem) {
    static const char sql[] =
        "INSERT INTO sweep_chunks (sweep, chunk, failed, is_open, reasons, rows) VALUES (:sweep, "
        ":chunk, :failed, :is_open, :reasons, :rows) ON CONFLICT (sweep, chunk) DO UPDATE SET "
        "failed = excluded.failed, is_open = excluded.is_open, reasons = excluded.reasons, "
        "rows = excluded.rows WHERE is_open";
    return sqlite_change(database, sql, chunk_columns, work, NULL, problem);
}

Status db_sweep_take(Db *db, const SweepChunkRow *chunk, Problem *problem) {
    return db_write(db, take, chunk, problem);
}

Status db_sweep_chunks(Db *db, int64_t sweep, SweepChunkRows *chunks, Problem *problem) {
    static const char sql[] = "SELECT number, sweep, chunk, failed, is_open FROM sweep_chunks "
                              "WHERE sweep = :sweep ORDER BY chunk";
    const SweepChunkRow key = {.sweep = sweep};
    void *at;
    const Status status = db_all(db, sql, chunk_columns, &key, chunk_columns, sizeof *chunks->at,
                                 &at, &chunks->count, problem);
    chunks->at = at;
    if (status != STATUS_OK)
        sweep_chunk_rows_clear(chunks);
    return status;
}

Status db_sweep_chunk(Db *db, int64_t sweep, uint64_t number, SweepChunkRow *chunk,
                      Problem *problem) {
    static const char sql[] = "SELECT sweep, chunk, failed, is_open, reasons, rows "
                              "FROM sweep_chunks WHERE sweep = :sweep AND chunk = :chunk";
    const SweepChunkRow key = {.sweep = sweep, .chunk = number};
    bool is_found;
    memset(chunk, 0, sizeof *chunk);
    TRY(db_first(db, sql, chunk_columns, &key, chunk_columns, chunk, &is_found, problem));
    return is_found ? STATUS_OK
                    : problem_set(problem, STATUS_NOT_FOUND, "the chunk is not there yet");
}

static Status check_there(Sqlite *database, const char *sql, const RowColumn *columns,
                          const void *item, Problem *problem) {
    Statement *statement;
    bool is_there = false;
    TRY(statement_begin(database, sql, columns, item, &statement, problem));
    const Status status = statement_step(statement, &is_there, problem);
    statement_end(statement);
    return status != STATUS_OK || is_there
               ? status
               : problem_set(problem, STATUS_CONFLICT,
                             "the sweep's rows were deleted or made anew while they were read");
}

static Status read_parts(Sqlite *database, const SweepRow *sweep, const SweepChunkRows *chunks,
                         size_t offset, size_t size, unsigned char *target, Problem *problem) {
    static const char sweep_sql[] = "SELECT 1 FROM sweeps WHERE number = :number AND result = "
                                    ":result AND created_unix_ms = :created_unix_ms";
    static const char chunk_sql[] =
        "SELECT 1 FROM sweep_chunks WHERE number = :number AND sweep = :sweep AND chunk = :chunk "
        "AND failed = :failed AND is_open = :is_open";
    TRY(check_there(database, sweep_sql, sweep_columns, sweep, problem));
    for (size_t i = 0; i < chunks->count; i++) {
        TRY(check_there(database, chunk_sql, chunk_columns, &chunks->at[i], problem));
        TRY(sqlite_read_part(database, "sweep_chunks", "rows", chunks->at[i].number, offset, size,
                             target + i * size, problem));
    }
    return STATUS_OK;
}

Status db_sweep_read(Db *db, const SweepRow *sweep, const SweepChunkRows *chunks, size_t offset,
                     size_t size, unsigned char *target, Problem *problem) {
    Sqlite *database = db_take(db);
    // One transaction: what was found to be the same stays so while it is read.
    Status status = sqlite_execute(database, "BEGIN", problem);
    if (status == STATUS_OK) {
        status = read_parts(database, sweep, chunks, offset, size, target, problem);
        const Status ended = sqlite_execute(database, "COMMIT", NULL);
        status = status == STATUS_OK ? ended : status;
    }
    db_put(db, database);
    return status;
}

static Status reopen(Sqlite *database, const void *work, Problem *problem) {
    static const char chunks[] = "UPDATE sweep_chunks SET is_open = 1 WHERE failed > 0 AND sweep = "
                                 "(SELECT number FROM sweeps WHERE result = :result)";
    static const char sweep[] = "UPDATE sweeps SET retries = retries + 1 WHERE result = :result";
    int changes = 0;
    TRY(sqlite_change(database, chunks, sweep_columns, work, &changes, problem));
    if (changes == 0)
        return problem_set(problem, STATUS_CONFLICT, "no point of the sweep has failed");
    return sqlite_change(database, sweep, sweep_columns, work, NULL, problem);
}

Status db_sweep_reopen(Db *db, const char *result, Problem *problem) {
    const SweepRow key = key_of(result);
    return db_write(db, reopen, &key, problem);
}

static Status tidy(Sqlite *database, const void *work, Problem *problem) {
    static const char sql[] =
        "DELETE FROM sweeps WHERE result NOT IN (SELECT id FROM results) AND result NOT IN "
        "(SELECT result FROM jobs WHERE state < 2)";
    return sqlite_change(database, sql, sweep_columns, work, NULL, problem);
}

Status db_sweep_tidy(Db *db, Problem *problem) {
    const SweepRow none = {0};
    return db_write(db, tidy, &none, problem);
}
