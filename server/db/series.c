// Series as bytes, under a budget. What is deleted leaves free pages, which the next one takes.
#include <stdatomic.h>
#include <stdlib.h>
#include <string.h>

#include "server/db/db_private.h"

typedef struct Blob {
    char result[72];
    StoredBytes body;
    uint64_t bytes, most;
    atomic_uint_fast64_t *evictions;
    WriteDone done;
    PendingWrite write;
} Blob;

static const SqlColumn columns[] = {COLUMN(Blob, result), COLUMN_WITH(Blob, body, COLUMN_CHECKED),
                                    COLUMN(Blob, bytes), COLUMN_END};

static const char sum_sql[] =
    "SELECT count(*) AS count, coalesce(sum(bytes), 0) AS bytes FROM series";

static Status series_sum(Sqlite *database, uint64_t *bytes, Problem *problem) {
    QueryCounts sum = {0};
    TRY(sqlite_first(database, sum_sql, NULL, NULL, query_counts_columns, &sum, NULL, problem));
    *bytes = sum.bytes;
    return STATUS_OK;
}

static Status series_apply_put(Sqlite *database, const void *work, Problem *problem) {
    static const char drop_sql[] = "DELETE FROM series WHERE number = "
                                   "(SELECT number FROM series ORDER BY used LIMIT 1)";
    static const char again_sql[] = "DELETE FROM series WHERE result = :result";
    static const char head_sql[] = "INSERT INTO series (result, bytes, used) VALUES (:result, "
                                   ":bytes, (SELECT coalesce(max(used), 0) + 1 FROM series))";
    static const char body_sql[] =
        "INSERT INTO series_bodies (number, body, checks) "
        "SELECT number, :body, :checks FROM series WHERE result = :result";
    const Blob *blob = work;
    uint64_t there;
    int changes = 1;
    TRY(sqlite_change(database, again_sql, columns, blob, NULL, problem));
    TRY(series_sum(database, &there, problem));
    while (there + blob->bytes > blob->most && changes > 0) {
        TRY(sqlite_change(database, drop_sql, NULL, NULL, &changes, problem));
        TRY(series_sum(database, &there, problem));
        atomic_fetch_add(blob->evictions, changes > 0);
    }
    TRY(sqlite_change(database, head_sql, columns, blob, NULL, problem));
    return sqlite_change(database, body_sql, columns, blob, NULL, problem);
}

static void series_put_done(void *context, Status status, const char *detail) {
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
    blob->write.done = (WriteDone){series_put_done, blob};
    db_enqueue(db, series_apply_put, blob, WRITE_LOW, &blob->write);
    return STATUS_OK;
}

static Status series_apply_touch(Sqlite *database, const void *work, Problem *problem) {
    static const char sql[] = "UPDATE series SET used = (SELECT max(used) + 1 FROM series) "
                              "WHERE result = :result AND used < (SELECT max(used) FROM series)";
    return sqlite_change(database, sql, columns, work, NULL, problem);
}

static void series_touch_done(void *context, Status status, const char *detail) {
    (void)status;
    (void)detail;
    free(context);
}

Status db_series_load(Db *db, const char *result, char **body, size_t *size, Problem *problem) {
    static const char sql[] = "SELECT body, checks FROM series JOIN series_bodies USING (number) "
                              "WHERE result = :result";
    Blob blob = {.bytes = 0}, *used = calloc(1, sizeof *used);
    bool is_found = false;
    text_fit(blob.result, sizeof blob.result, result);
    Status status = db_first(db, sql, columns, &blob, columns, &blob, &is_found, problem);
    *body = blob.body.at;
    *size = blob.body.size;
    if (status == STATUS_OK && is_found && used != NULL) {
        used->write.done = (WriteDone){series_touch_done, used};
        text_fit(used->result, sizeof used->result, result);
        db_enqueue(db, series_apply_touch, used, WRITE_LOW, &used->write);
    } else {
        free(used);
    }
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
    QueryCounts sum = {0};
    (void)db_first(db, sum_sql, NULL, NULL, query_counts_columns, &sum, NULL, NULL);
    *count = sum.count;
    *bytes = sum.bytes;
    *evictions = atomic_load(db_evictions(db));
}
