// Results with their series, and what of the catalogue results and unfinished jobs were made with.
// A row is written once, in the same transaction as the jobs that it finishes.
#include <stdatomic.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "server/db/db_private.h"
#include "server/db/materials.h"

// clang-format off
static const SqlColumn result_columns[] = {
    COLUMN_WITH(ResultRow, id, COLUMN_ID | COLUMN_BOUND),
    COLUMN_WITH(ResultRow, engine, COLUMN_BOUND),
    COLUMN_WITH(ResultRow, sample_rate, COLUMN_CHECKED),
    COLUMN_WITH(ResultRow, count, COLUMN_CHECKED),
    COLUMN_WITH(ResultRow, created_unix_ms, COLUMN_CHECKED),
    COLUMN_WITH(ResultRow, summary, COLUMN_CHECKED),
    COLUMN_WITH(ResultRow, plan, COLUMN_CHECKED),
    COLUMN_WITH(ResultRow, warnings, COLUMN_CHECKED),
    COLUMN_WITH(ResultRow, work, COLUMN_CHECKED),
    COLUMN_WITH(ResultRow, notes, COLUMN_CHECKED),
    COLUMN_WITH(ResultRow, impact_count, COLUMN_CHECKED),
    COLUMN_WITH(ResultRow, scene, COLUMN_LONG | COLUMN_CHECKED),
    COLUMN_WITH(ResultRow, outcome, COLUMN_LONG | COLUMN_CHECKED),
    COLUMN_WITH(ResultRow, study, COLUMN_LONG | COLUMN_CHECKED),
    COLUMN_END
};
// clang-format on
const CheckedTable results_table = CHECKED_TABLE("results", result_columns, ResultRow);

void result_row_clear(ResultRow *row) {
    free(row->uses);
    row_clear(result_columns, row, sizeof *row);
}

void result_rows_clear(ResultRows *rows) {
    rows_clear(result_columns, sizeof *rows->at, rows);
}

static const char no_result[] = "there is no result \"%.72s\"";

Status use_lines_add(Sqlite *database, const char *sql, const char *lines, Problem *problem) {
    while (lines != NULL && *lines != '\0') {
        const size_t size = strcspn(lines, "\n");
        char name[160];
        snprintf(name, sizeof name, "%.*s", (int)size, lines);
        TRY(sqlite_change(database, sql, query_key_columns, &(QueryKey){.name = name}, NULL,
                          problem));
        lines += size + (lines[size] == '\n');
    }
    return STATUS_OK;
}

Status result_row_add(Sqlite *database, const ResultRow *row, Problem *problem) {
    static const char sql[] = "INSERT INTO results {insert} ON CONFLICT (id) DO NOTHING";
    static const char uses_sql[] = "INSERT INTO result_uses (name, result) VALUES (:name, "
                                   "last_insert_rowid()) ON CONFLICT DO NOTHING";
    int added;
    TRY(sqlite_change(database, sql, result_columns, row, &added, problem));
    return added > 0 ? use_lines_add(database, uses_sql, row->uses, problem) : STATUS_OK;
}

static Status result_load(Db *db, const char *sql, const char *id, ResultRow *row,
                          Problem *problem) {
    return db_get(db, sql, &(QueryKey){.id = id}, result_columns, row, sizeof *row, problem,
                  no_result, id);
}

Status db_result_load(Db *db, const char *id, ResultRow *row, Problem *problem) {
    static const char sql[] = "SELECT {head}, scene, study FROM results WHERE id = :id";
    return result_load(db, sql, id, row, problem);
}

Status db_result_outcome(Db *db, const char *id, ResultRow *row, Problem *problem) {
    static const char sql[] = "SELECT id, outcome, checks FROM results WHERE id = :id";
    return result_load(db, sql, id, row, problem);
}

Status db_result_head(Db *db, const char *id, ResultRow *row, Problem *problem) {
    static const char sql[] = "SELECT {head} FROM results WHERE id = :id";
    return result_load(db, sql, id, row, problem);
}

Status db_result_scene(Db *db, const char *id, ResultRow *row, Problem *problem) {
    return db_result_scene_within(db, id, SIZE_MAX / 2, row, problem);
}

Status db_result_scene_within(Db *db, const char *id, size_t most, ResultRow *row,
                              Problem *problem) {
    static const char sql[] = "SELECT id, engine, scene, checks FROM results "
                              "WHERE id = :id AND length(scene) <= :before";
    const QueryKey key = {.id = id, .before = (int64_t)most};
    return db_get(db, sql, &key, result_columns, row, sizeof *row, problem, no_result, id);
}

Status db_result_find(Db *db, const char *id, Problem *problem) {
    static const char sql[] = "SELECT id FROM results WHERE id = :id";
    ResultRow row;
    return result_load(db, sql, id, &row, problem);
}

bool db_result_exists(Db *db, const char *id) {
    return db_result_find(db, id, NULL) == STATUS_OK;
}

Status db_result_sharer(Db *db, const char *id, const char *client, char sharer[72],
                        Problem *problem) {
    static const char sql[] =
        "SELECT client AS id FROM jobs WHERE substr(result, 3, 12) = substr(:id, 3, 12) "
        "AND result = :id AND state = 2 AND client <> :client LIMIT 1";
    const QueryKey key = {.id = id, .client = client};
    ResultRow found = {.id = ""};
    TRY(db_first(db, sql, query_key_columns, &key, result_columns, &found, NULL, problem));
    text_fit(sharer, sizeof found.id, found.id);
    return STATUS_OK;
}

static Status result_apply_delete(Sqlite *database, const void *work, Problem *problem) {
    static const char sql[] = "DELETE FROM results WHERE id = :id";
    const QueryKey *key = work;
    int changes;
    TRY(sqlite_change(database, sql, query_key_columns, key, &changes, problem));
    return changes > 0 ? STATUS_OK : problem_set(problem, STATUS_NOT_FOUND, no_result, key->id);
}

Status db_result_delete(Db *db, const char *id, Problem *problem) {
    return db_write(db, result_apply_delete, &(QueryKey){.id = id}, problem);
}

Status db_result_recent(Db *db, size_t most, size_t scene_max, ResultRows *rows, Problem *problem) {
    static const char sql[] = "SELECT id, engine, scene, checks FROM (SELECT * FROM results ORDER "
                              "BY number DESC LIMIT :max) "
                              "WHERE length(scene) <= :before";
    const QueryKey key = {.max = most, .before = (int64_t)scene_max};
    return db_list(db, sql, query_key_columns, &key, result_columns, sizeof *rows->at, rows,
                   problem);
}

static const SqlColumn use_columns[] = {COLUMN(ResultUse, number), COLUMN(ResultUse, id),
                                        COLUMN(ResultUse, created_unix_ms), COLUMN_END};

Status db_result_uses(Db *db, const char *name, size_t most, int64_t before, ResultUses *uses,
                      uint64_t *total, Problem *problem) {
    static const char count_sql[] = "SELECT count(*) AS count FROM result_uses WHERE name = :name";
    static const char sql[] =
        "SELECT r.number, r.id, r.created_unix_ms FROM result_uses u JOIN results r ON r.number = "
        "u.result WHERE u.name = :name AND u.result < :before ORDER BY u.result DESC LIMIT :max";
    const QueryKey key = {.name = name, .max = most, .before = before == 0 ? INT64_MAX : before};
    QueryCounts counted = {0};
    *uses = (ResultUses){NULL, 0};
    TRY(db_first(db, count_sql, query_key_columns, &key, query_counts_columns, &counted, NULL,
                 problem));
    *total = counted.count;
    return db_list(db, sql, query_key_columns, &key, use_columns, sizeof *uses->at, uses, problem);
}

static const SqlColumn material_use_columns[] = {COLUMN(MaterialReference, revision),
                                                 COLUMN(MaterialReference, results),
                                                 COLUMN(MaterialReference, status), COLUMN_END};

Status db_material_uses(Db *db, const char *slug, MaterialReferences *uses, Problem *problem) {
    static const char sql[] =
        "SELECT revision, status, (SELECT count(*) FROM result_uses u WHERE u.name = slug || '@' "
        "|| revision) AS results FROM material_states WHERE slug = :name ORDER BY revision DESC";
    const QueryKey key = {.name = slug};
    *uses = (MaterialReferences){NULL, 0};
    TRY(db_reviews_compare(db, slug, slug, problem));
    return db_list(db, sql, query_key_columns, &key, material_use_columns, sizeof *uses->at, uses,
                   problem);
}

// Series as bytes, under a budget. What is deleted leaves free pages, which the next one takes.

typedef struct Blob {
    char result[72];
    StoredBytes body;
    uint64_t bytes, most;
    atomic_uint_fast64_t *evictions;
    WriteDone done;
    PendingWrite write;
} Blob;

static const SqlColumn series_columns[] = {
    COLUMN_OF(Blob, result, "result", COLUMN_ID | COLUMN_BOUND, "result"),
    COLUMN_WITH(Blob, body, COLUMN_CHECKED), COLUMN(Blob, bytes), COLUMN_END};
const CheckedTable series_table = CHECKED_TABLE_WITH(
    "series_bodies", series_columns, Blob,
    ", (SELECT result FROM series s WHERE s.number = series_bodies.number) AS result");

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
    TRY(sqlite_change(database, again_sql, series_columns, blob, NULL, problem));
    TRY(series_sum(database, &there, problem));
    while (there + blob->bytes > blob->most && changes > 0) {
        TRY(sqlite_change(database, drop_sql, NULL, NULL, &changes, problem));
        TRY(series_sum(database, &there, problem));
        atomic_fetch_add(blob->evictions, changes > 0);
    }
    TRY(sqlite_change(database, head_sql, series_columns, blob, NULL, problem));
    return sqlite_change(database, body_sql, series_columns, blob, NULL, problem);
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
    return sqlite_change(database, sql, series_columns, work, NULL, problem);
}

static void series_touch_done(void *context, Status status, const char *detail) {
    (void)status;
    (void)detail;
    free(context);
}

Status db_series_load(Db *db, const char *result, char **body, size_t *size, Problem *problem) {
    static const char sql[] =
        "SELECT number, result, body, checks FROM series JOIN series_bodies USING (number) "
        "WHERE result = :result";
    Blob blob = {.bytes = 0}, found = {.bytes = 0}, *used = calloc(1, sizeof *used);
    bool is_found = false;
    text_fit(blob.result, sizeof blob.result, result);
    Status status =
        db_first(db, sql, series_columns, &blob, series_columns, &found, &is_found, problem);
    *body = found.body.at;
    *size = found.body.size;
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
    return db_first(db, sql, series_columns, &blob, series_columns, &blob, &is_found, NULL) ==
               STATUS_OK &&
           is_found;
}

void db_series_stats(Db *db, uint64_t *count, uint64_t *bytes, uint64_t *evictions) {
    QueryCounts sum = {0};
    (void)db_first(db, sum_sql, NULL, NULL, query_counts_columns, &sum, NULL, NULL);
    *count = sum.count;
    *bytes = sum.bytes;
    *evictions = atomic_load(db_evictions(db));
}
