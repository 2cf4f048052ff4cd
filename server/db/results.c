// Results, and what of the catalogue results and unfinished jobs were made with. A row is written
// once, in the same transaction as the jobs that it finishes.
#include <stdlib.h>
#include <string.h>

#include "server/db/db_private.h"
#include "server/db/materials.h"

// clang-format off
static const SqlColumn result_columns[] = {
    COLUMN(ResultRow, id),
    COLUMN(ResultRow, engine),
    COLUMN_WITH(ResultRow, sample_rate, COLUMN_CHECKED),
    COLUMN_WITH(ResultRow, count, COLUMN_CHECKED),
    COLUMN(ResultRow, created_unix_ms),
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
        if (size > 0 && size < sizeof name) {
            memcpy(name, lines, size);
            name[size] = '\0';
            TRY(sqlite_change(database, sql, query_key_columns, &(QueryKey){.name = name}, NULL,
                              problem));
        }
        lines += size + (lines[size] == '\n');
    }
    return STATUS_OK;
}

static Status result_apply_finish(Sqlite *database, const void *work, Problem *problem) {
    static const char sql[] = "INSERT INTO results {insert} ON CONFLICT (id) DO NOTHING";
    static const char uses_sql[] = "INSERT INTO result_uses (name, result) VALUES (:name, "
                                   "last_insert_rowid()) ON CONFLICT DO NOTHING";
    const ResultCommit *commit = work;
    int added = 0;
    if (commit->result != NULL)
        TRY(sqlite_change(database, sql, result_columns, commit->result, &added, problem));
    if (added > 0)
        TRY(use_lines_add(database, uses_sql, commit->result->uses, problem));
    for (const JobRow *row = commit->jobs; row != NULL; row = row->next)
        TRY(job_row_save(database, row, problem));
    return STATUS_OK;
}

Status db_result_save(Db *db, const ResultRow *result, const JobRow *jobs, Problem *problem) {
    return db_write(db, result_apply_finish, &(ResultCommit){result, jobs}, problem);
}

void db_result_post(Db *db, const ResultCommit *commit, PendingWrite *write) {
    db_enqueue(db, result_apply_finish, commit, WRITE_NORMAL, write);
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
    static const char sql[] = "SELECT id, engine, scene, checks FROM results WHERE id = :id";
    return result_load(db, sql, id, row, problem);
}

bool db_result_exists(Db *db, const char *id) {
    static const char sql[] = "SELECT id FROM results WHERE id = :id";
    ResultRow row;
    return result_load(db, sql, id, &row, NULL) == STATUS_OK;
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
    return db_list(db, sql, query_key_columns, &key, material_use_columns, sizeof *uses->at, uses,
                   problem);
}
