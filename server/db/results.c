// Results. A row is written once, in the same transaction as the jobs that it finishes.
#include <stdlib.h>
#include <string.h>

#include "server/db/db.h"
#include "server/db/jobs.h"

// clang-format off
static const RowColumn result_columns[] = {
    ROW_COLUMN(ResultRow, id, COLUMN_NAME),
    ROW_COLUMN(ResultRow, engine, COLUMN_TEXT),
    ROW_COLUMN(ResultRow, sample_rate, COLUMN_REAL),
    ROW_COLUMN(ResultRow, count, COLUMN_COUNT),
    ROW_COLUMN(ResultRow, created_unix_ms, COLUMN_INTEGER),
    ROW_COLUMN(ResultRow, summary, COLUMN_TEXT),
    ROW_COLUMN(ResultRow, plan, COLUMN_TEXT),
    ROW_COLUMN(ResultRow, warnings, COLUMN_TEXT),
    ROW_COLUMN(ResultRow, work, COLUMN_TEXT),
    ROW_COLUMN(ResultRow, notes, COLUMN_TEXT),
    ROW_COLUMN(ResultRow, energy, COLUMN_TEXT),
    ROW_COLUMN(ResultRow, scene, COLUMN_TEXT),
    ROW_COLUMN(ResultRow, impacts, COLUMN_TEXT),
    ROW_COLUMN(ResultRow, psd, COLUMN_TEXT),
    ROW_COLUMN(ResultRow, study, COLUMN_TEXT),
    ROW_END
};
// clang-format on

void result_row_clear(ResultRow *row) {
    free(row->uses);
    row_clear(result_columns, row, sizeof *row);
}

typedef struct Finish {
    const ResultRow *result;
    const JobRow *const *jobs;
    size_t job_count;
} Finish;

static Status finish(Sqlite *database, const void *work, Problem *problem) {
    static const char sql[] =
        "INSERT INTO results (id, engine, sample_rate, count, "
        "created_unix_ms, summary, plan, warnings, work, notes, energy, "
        "scene, impacts, psd, study) VALUES (:id, :engine, :sample_rate, :count, "
        ":created_unix_ms, :summary, :plan, :warnings, :work, :notes, "
        ":energy, :scene, :impacts, :psd, :study) ON CONFLICT (id) DO NOTHING";
    static const char uses_sql[] = "INSERT INTO result_uses (name, result) VALUES (:name, "
                                   "last_insert_rowid()) ON CONFLICT DO NOTHING";
    const Finish *both = work;
    int added = 0;
    if (both->result != NULL)
        TRY(sqlite_change(database, sql, result_columns, both->result, &added, problem));
    if (added > 0)
        TRY(use_lines_add(database, uses_sql, both->result->uses, problem));
    for (size_t i = 0; i < both->job_count; i++)
        TRY(job_row_save(database, both->jobs[i], problem));
    return STATUS_OK;
}

Status db_result_save(Db *db, const ResultRow *result, const JobRow *const *jobs, size_t job_count,
                      Problem *problem) {
    return db_write(db, finish, &(Finish){result, jobs, job_count}, problem);
}

Status db_result_post(Db *db, const ResultRow *result, const JobRow *const *jobs, size_t job_count,
                      WritePriority turn, const WriteDone *done) {
    const Finish work = {result, jobs, job_count};
    return db_enqueue(db, finish, &work, sizeof work, turn, done, NULL);
}

typedef struct Key {
    char *id;
} Key;
static const RowColumn key_columns[] = {ROW_COLUMN(Key, id, COLUMN_TEXT), ROW_END};

static Status load(Db *db, const char *sql, const char *id, ResultRow *row, Problem *problem) {
    const Key key = {(char *)id};
    bool is_found;
    memset(row, 0, sizeof *row);
    TRY(db_first(db, sql, key_columns, &key, result_columns, row, &is_found, problem));
    return is_found ? STATUS_OK
                    : problem_set(problem, STATUS_NOT_FOUND, "there is no result \"%.72s\"", id);
}

Status db_result_load(Db *db, const char *id, ResultRow *row, Problem *problem) {
    static const char sql[] =
        "SELECT id, engine, sample_rate, count, created_unix_ms, summary, plan, warnings, work, "
        "notes, energy, scene, impacts, psd, study FROM results WHERE id = :id";
    return load(db, sql, id, row, problem);
}

Status db_result_head(Db *db, const char *id, ResultRow *row, Problem *problem) {
    static const char sql[] =
        "SELECT id, engine, sample_rate, count, created_unix_ms, summary, plan, warnings, work, "
        "notes FROM results WHERE id = :id";
    return load(db, sql, id, row, problem);
}

Status db_result_scene(Db *db, const char *id, ResultRow *row, Problem *problem) {
    static const char sql[] = "SELECT id, engine, scene FROM results WHERE id = :id";
    return load(db, sql, id, row, problem);
}

bool db_result_exists(Db *db, const char *id) {
    static const char sql[] = "SELECT id FROM results WHERE id = :id";
    ResultRow row;
    return load(db, sql, id, &row, NULL) == STATUS_OK;
}

typedef struct Sharer {
    char *id, *client;
    char sharer[72];
} Sharer;
static const RowColumn sharer_columns[] = {ROW_COLUMN(Sharer, id, COLUMN_TEXT),
                                           ROW_COLUMN(Sharer, client, COLUMN_TEXT),
                                           ROW_COLUMN(Sharer, sharer, COLUMN_NAME), ROW_END};

Status db_result_sharer(Db *db, const char *id, const char *client, char sharer[72],
                        Problem *problem) {
    static const char sql[] =
        "SELECT client AS sharer FROM jobs WHERE substr(result, 3, 12) = substr(:id, 3, 12) "
        "AND result = :id AND state = 2 AND client <> :client LIMIT 1";
    const Sharer key = {(char *)id, (char *)client, ""};
    Sharer found = {0};
    bool is_found;
    TRY(db_first(db, sql, sharer_columns, &key, sharer_columns, &found, &is_found, problem));
    text_fit(sharer, sizeof found.sharer, is_found ? found.sharer : "");
    return STATUS_OK;
}

static Status delete (Sqlite *database, const void *work, Problem *problem) {
    static const char sql[] = "DELETE FROM results WHERE id = :id";
    const Key *key = work;
    int changes;
    TRY(sqlite_change(database, sql, key_columns, key, &changes, problem));
    return changes > 0
               ? STATUS_OK
               : problem_set(problem, STATUS_NOT_FOUND, "there is no result \"%.72s\"", key->id);
}

Status db_result_delete(Db *db, const char *id, Problem *problem) {
    return db_write(db, delete, &(Key){(char *)id}, problem);
}

typedef struct Recent {
    uint64_t most, scene_max;
} Recent;
static const RowColumn recent_columns[] = {ROW_COLUMN(Recent, most, COLUMN_COUNT),
                                           ROW_COLUMN(Recent, scene_max, COLUMN_COUNT), ROW_END};

Status db_result_recent(Db *db, size_t most, size_t scene_max, ResultRows *rows, Problem *problem) {
    static const char sql[] =
        "SELECT id, engine, scene FROM (SELECT * FROM results ORDER BY number DESC LIMIT :most) "
        "WHERE length(scene) <= :scene_max";
    void *at;
    const Status status = db_all(db, sql, recent_columns, &(Recent){most, scene_max},
                                 result_columns, sizeof *rows->at, &at, &rows->count, problem);
    rows->at = at;
    if (status != STATUS_OK)
        result_rows_clear(rows);
    return status;
}

void result_rows_clear(ResultRows *rows) {
    for (size_t i = 0; i < rows->count; i++)
        result_row_clear(&rows->at[i]);
    free(rows->at);
    *rows = (ResultRows){0};
}
