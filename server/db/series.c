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
    StoreDone done;
} Blob;

// clang-format off
static const RowColumn columns[] = {
    ROW_COLUMN(Blob, result, COLUMN_NAME),
    ROW_COLUMN(Blob, body, COLUMN_BYTES),
    ROW_COLUMN(Blob, bytes, COLUMN_COUNT),
    ROW_END
};
// clang-format on

static Status total(Database *database, uint64_t *bytes, Problem *problem) {
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

static Status put(Database *database, const void *work, Problem *problem) {
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
    TRY(database_change(database, again_sql, columns, blob, NULL, problem));
    TRY(total(database, &there, problem));
    while (there + blob->bytes > blob->most && changes > 0) {
        TRY(database_change(database, drop_sql, NULL, NULL, &changes, problem));
        TRY(total(database, &there, problem));
        atomic_fetch_add(blob->evictions, changes > 0);
    }
    TRY(database_change(database, head_sql, columns, blob, NULL, problem));
    return database_change(database, body_sql, columns, blob, NULL, problem);
}

static void was_put(void *context, Status status, const char *detail) {
    Blob *blob = context;
    blob->done.call(blob->done.context, status, detail);
    free(blob->body.at);
    free(blob);
}

Status store_series_post(Store *store, const char *result, char *body, size_t size, uint64_t most,
                         const StoreDone *done) {
    Blob *blob = size <= most ? calloc(1, sizeof *blob) : NULL;
    if (blob == NULL) {
        free(body);
        return size <= most ? STATUS_NO_MEMORY : STATUS_LIMIT;
    }
    text_fit(blob->result, sizeof blob->result, result);
    blob->body = (StoredBytes){body, size};
    blob->bytes = size;
    blob->most = most;
    blob->evictions = store_evictions(store);
    blob->done = *done;
    const StoreDone own = {was_put, blob};
    const Status status = store_post(store, put, blob, 0, STORE_LOW, &own, NULL);
    if (status != STATUS_OK) {
        free(blob->body.at);
        free(blob);
    }
    return status;
}

static Status touch(Database *database, const void *work, Problem *problem) {
    static const char sql[] = "UPDATE series SET used = (SELECT max(used) + 1 FROM series) "
                              "WHERE result = :result AND used < (SELECT max(used) FROM series)";
    return database_change(database, sql, columns, work, NULL, problem);
}

static void was_touched(void *context, Status status, const char *detail) {
    (void)status;
    (void)detail;
    free(context);
}

Status store_series_load(Store *store, const char *result, char **body, size_t *size,
                         Problem *problem) {
    static const char sql[] = "SELECT body FROM series JOIN series_bodies USING (number) "
                              "WHERE result = :result";
    Blob blob = {.bytes = 0}, *used = calloc(1, sizeof *used);
    bool is_found = false;
    text_fit(blob.result, sizeof blob.result, result);
    Status status = store_first(store, sql, columns, &blob, columns, &blob, &is_found, problem);
    *body = blob.body.at;
    *size = blob.body.size;
    if (status == STATUS_OK && is_found && used != NULL) {
        const StoreDone done = {was_touched, used};
        *used = (Blob){.bytes = 0};
        text_fit(used->result, sizeof used->result, result);
        if (store_post(store, touch, used, 0, STORE_LOW, &done, NULL) == STATUS_OK)
            used = NULL;
    }
    free(used);
    if (status == STATUS_OK && !is_found)
        status = STATUS_NOT_FOUND;
    return status;
}

bool store_series_exists(Store *store, const char *result) {
    static const char sql[] = "SELECT bytes FROM series WHERE result = :result";
    Blob blob = {.bytes = 0};
    bool is_found = false;
    text_fit(blob.result, sizeof blob.result, result);
    return store_first(store, sql, columns, &blob, columns, &blob, &is_found, NULL) == STATUS_OK &&
           is_found;
}

void store_series_tally(Store *store, uint64_t *count, uint64_t *bytes, uint64_t *evictions) {
    static const char sql[] =
        "SELECT count(*) AS count, coalesce(sum(bytes), 0) AS bytes FROM series";
    typedef struct Sum {
        uint64_t count, bytes;
    } Sum;
    static const RowColumn sums[] = {ROW_COLUMN(Sum, count, COLUMN_COUNT),
                                     ROW_COLUMN(Sum, bytes, COLUMN_COUNT), ROW_END};
    Sum sum = {0, 0};
    bool is_found;
    (void)store_first(store, sql, NULL, NULL, sums, &sum, &is_found, NULL);
    *count = sum.count;
    *bytes = sum.bytes;
    *evictions = atomic_load(store_evictions(store));
}
