// Series as bytes, under a budget. What is deleted leaves free pages, which the next one takes.
#include <stdatomic.h>
#include <stdlib.h>
#include <string.h>

#include "server/db/db.h"
#include "server/db/db_private.h"

typedef struct Blob {
    char result[72];
    StoredBytes body;
    uint64_t bytes, most;
    atomic_uint_fast64_t *evictions;
    WriteDone done;
} Blob;

// clang-format off
static const RowColumn columns[] = {
    ROW_COLUMN(Blob, result, COLUMN_NAME),
    ROW_COLUMN(Blob, body, COLUMN_BYTES),
    ROW_COLUMN(Blob, bytes, COLUMN_COUNT),
    ROW_END
};
// clang-format on

static Status total(Sqlite *database, uint64_t *bytes, Problem *problem) {
    static const char sql[] = "SELECT coalesce(sum(bytes), 0) AS bytes FROM series";
    Statement *statement;
    bool has_row = false;
    Blob sum = {.bytes = 0};
    TRY(statement_begin(database, sql, NULL, NULL, &statement, problem));
    Status status = statement_step(statement, &has_row, problem);
    if (status == STATUS_OK && has_row)
        status = row_read(statement, columns, &sum, problem);
    statement_end(statement);
    *bytes = sum.bytes;
    return status;
}

static Status put(Sqlite *database, const void *work, Problem *problem) {
    static const char drop_sql[] = "DELETE FROM series WHERE number = "
                                   "(SELECT number FROM series ORDER BY used LIMIT 1)";
    static const char again_sql[] = "DELETE FROM series WHERE result = :result";
    static const char head_sql[] = "INSERT INTO series (result, bytes, used) VALUES (:result, "
                                   ":bytes, (SELECT coalesce(max(used), 0) + 1 FROM series))";
    static const char body_sql[] = "INSERT INTO series_bodies (number, body) "
                                   "SELECT number, :body FROM series WHERE result = :result";
    const Blob *blob = work;
    uint64_t there;
    int changes = 1;
    TRY(sqlite_change(database, again_sql, columns, blob, NULL, problem));
    TRY(total(database, &there, problem));
    while (there + blob->bytes > blob->most && changes > 0) {
        TRY(sqlite_change(database, drop_sql, NULL, NULL, &changes, problem));
        TRY(total(database, &there, problem));
        atomic_fetch_add(blob->evictions, changes > 0);
    }
    TRY(sqlite_change(database, head_sql, columns, blob, NULL, problem));
    return sqlite_change(database, body_sql, columns, blob, NULL, problem);
}

static void was_put(void *context, Status status, const char *detail) {
    Blob *blob = context;
    blob->done.call(blob->done.context, status, detail);
    free(blob->body.at);
    free(blob);
}

Status db_series_post(Db *db, const char *result, char *body, size_t size, uint64_t most,
                      const WriteDone *done) {
    Blob *blob = size <= most ? calloc(1, sizeof *blob) : NULL;
    if (blob == NULL) {
        free(body);
        return size <= most ? STATUS_NO_MEMORY : STATUS_LIMIT;
    }
    text_fit(blob->result, sizeof blob->result, result);
    blob->body = (StoredBytes){body, size};
    blob->bytes = size;
    blob->most = most;
    blob->evictions = db_evictions(db);
    blob->done = *done;
    const WriteDone own = {was_put, blob};
    const Status status = db_enqueue(db, put, blob, 0, STORE_LOW, &own, NULL);
    if (status != STATUS_OK) {
        free(blob->body.at);
        free(blob);
    }
    return status;
}

static Status touch(Sqlite *database, const void *work, Problem *problem) {
    static const char sql[] = "UPDATE series SET used = (SELECT max(used) + 1 FROM series) "
                              "WHERE result = :result AND used < (SELECT max(used) FROM series)";
    return sqlite_change(database, sql, columns, work, NULL, problem);
}

static void was_touched(void *context, Status status, const char *detail) {
    (void)status;
    (void)detail;
    free(context);
}

Status db_series_load(Db *db, const char *result, char **body, size_t *size, Problem *problem) {
    static const char sql[] = "SELECT body FROM series JOIN series_bodies USING (number) "
                              "WHERE result = :result";
    Blob blob = {.bytes = 0}, *used = calloc(1, sizeof *used);
    bool is_found = false;
    text_fit(blob.result, sizeof blob.result, result);
    Status status = db_first(db, sql, columns, &blob, columns, &blob, &is_found, problem);
    *body = blob.body.at;
    *size = blob.body.size;
    if (status == STATUS_OK && is_found && used != NULL) {
        const WriteDone done = {was_touched, used};
        *used = (Blob){.bytes = 0};
        text_fit(used->result, sizeof used->result, result);
        if (db_enqueue(db, touch, used, 0, STORE_LOW, &done, NULL) == STATUS_OK)
            used = NULL;
    }
    free(used);
    if (status == STATUS_OK && !is_found)
        status = STATUS_NOT_FOUND;
    return status;
}

bool db_series_exists(Db *db, const char *result) {
    static const char sql[] = "SELECT bytes FROM series WHERE result = :result";
    Blob blob = {.bytes = 0};
    bool is_found = false;
    text_fit(blob.result, sizeof blob.result, result);
    return db_first(db, sql, columns, &blob, columns, &blob, &is_found, NULL) == STATUS_OK &&
           is_found;
}

void db_series_tally(Db *db, uint64_t *count, uint64_t *bytes, uint64_t *evictions) {
    static const char sql[] =
        "SELECT count(*) AS count, coalesce(sum(bytes), 0) AS bytes FROM series";
    typedef struct Sum {
        uint64_t count, bytes;
    } Sum;
    static const RowColumn sums[] = {ROW_COLUMN(Sum, count, COLUMN_COUNT),
                                     ROW_COLUMN(Sum, bytes, COLUMN_COUNT), ROW_END};
    Sum sum = {0, 0};
    bool is_found;
    (void)db_first(db, sql, NULL, NULL, sums, &sum, &is_found, NULL);
    *count = sum.count;
    *bytes = sum.bytes;
    *evictions = atomic_load(db_evictions(db));
}
