// Jobs. The integer key rises with the order of acceptance: listing walks it downwards, a start
// walks it upwards.
#include <stdlib.h>
#include <string.h>

#include "server/db/db.h"
#include "server/db/jobs.h"

// clang-format off
const RowColumn job_columns[] = {
    ROW_COLUMN(JobRow, id, COLUMN_NAME),
    ROW_COLUMN(JobRow, state, COLUMN_CHOICE),
    ROW_COLUMN(JobRow, result, COLUMN_NAME),
    ROW_COLUMN(JobRow, is_cached, COLUMN_FLAG),
    ROW_COLUMN(JobRow, created_unix_ms, COLUMN_INTEGER),
    ROW_COLUMN(JobRow, started_unix_ms, COLUMN_INTEGER),
    ROW_COLUMN(JobRow, finished_unix_ms, COLUMN_INTEGER),
    ROW_COLUMN(JobRow, queued, COLUMN_REAL),
    ROW_COLUMN(JobRow, run, COLUMN_REAL),
    ROW_COLUMN(JobRow, total, COLUMN_REAL),
    ROW_COLUMN(JobRow, title, COLUMN_TEXT),
    ROW_COLUMN(JobRow, problem, COLUMN_TEXT),
    ROW_COLUMN(JobRow, warnings, COLUMN_TEXT),
    ROW_COLUMN(JobRow, scene, COLUMN_TEXT),
    ROW_COLUMN(JobRow, labels, COLUMN_TEXT),
    ROW_COLUMN(JobRow, words, COLUMN_TEXT),
    ROW_COLUMN(JobRow, study, COLUMN_TEXT),
    ROW_COLUMN(JobRow, client, COLUMN_TEXT),
    ROW_COLUMN(JobRow, idempotency_key, COLUMN_TEXT),
    ROW_COLUMN(JobRow, request, COLUMN_TEXT),
    ROW_COLUMN(JobRow, has_result, COLUMN_FLAG),
    ROW_END
};
// clang-format on

void job_row_clear(JobRow *row) {
    free(row->uses);
    row_clear(job_columns, row, sizeof *row);
}

void job_rows_clear(JobRows *rows) {
    for (size_t i = 0; i < rows->count; i++)
        job_row_clear(&rows->at[i]);
    free(rows->at);
    *rows = (JobRows){0};
}

static Status not_found(const char *id, Problem *problem) {
    return problem_set(problem, STATUS_NOT_FOUND, "there is no job \"%.40s\"", id);
}

// The scene of a successful job is its result's.
#define JOB_INSERT                                                                                 \
    "INSERT INTO jobs (" JOB_SHORT                                                                 \
    ", words, idempotency_key, request, scene) VALUES (:id, :state, :result, :is_cached, "         \
    ":created_unix_ms, :started_unix_ms, :finished_unix_ms, :queued, :run, :total, :title, "       \
    ":problem, :warnings, :labels, :study, :client, :words, :idempotency_key, :request, "          \
    "CASE :state WHEN 2 THEN '' ELSE coalesce(:scene, '') END)"
#define JOB_CHANGE                                                                                 \
    "SET state = :state, result = :result, is_cached = :is_cached, "                               \
    "started_unix_ms = :started_unix_ms, finished_unix_ms = :finished_unix_ms, "                   \
    "queued = :queued, run = :run, total = :total, problem = :problem, "                           \
    "scene = CASE :state WHEN 2 THEN '' ELSE scene END"

static Status add(Sqlite *database, const void *work, Problem *problem) {
    static const char sql[] = JOB_INSERT;
    static const char uses_sql[] = "INSERT INTO job_uses (job, name) VALUES "
                                   "(last_insert_rowid(), :name) ON CONFLICT DO NOTHING";
    const JobRow *row = work;
    TRY(sqlite_change(database, sql, job_columns, row, NULL, problem));
    return row->state < 2 ? use_lines_add(database, uses_sql, row->uses, problem) : STATUS_OK;
}

Status db_job_add(Db *db, const JobRow *row, Problem *problem) {
    return db_write(db, add, row, problem);
}

Status db_job_post(Db *db, const JobRow *row, WritePriority turn, const WriteDone *done,
                   PendingWrite **ticket) {
    return db_enqueue(db, add, row, 0, turn, done, ticket);
}

Status job_row_save(Sqlite *database, const JobRow *row, Problem *problem) {
    static const char change_sql[] = "UPDATE jobs " JOB_CHANGE " WHERE id = :id";
    static const char put_sql[] = JOB_INSERT " ON CONFLICT (id) DO UPDATE " JOB_CHANGE;
    int changes;
    TRY(sqlite_change(database, row->is_unsaved ? put_sql : change_sql, job_columns, row, &changes,
                      problem));
    return changes > 0 ? STATUS_OK : not_found(row->id, problem);
}

static Status save(Sqlite *database, const void *work, Problem *problem) {
    return job_row_save(database, work, problem);
}

Status db_job_update(Db *db, const JobRow *row, Problem *problem) {
    return db_write(db, save, row, problem);
}

Status db_job_update_post(Db *db, const JobRow *row, const WriteDone *done) {
    return db_enqueue(db, save, row, 0, STORE_NOW, done, NULL);
}

typedef struct Key {
    char *id;
    uint64_t most;
} Key;
static const RowColumn key_columns[] = {ROW_COLUMN(Key, id, COLUMN_TEXT),
                                        ROW_COLUMN(Key, most, COLUMN_COUNT), ROW_END};

Status db_job_load(Db *db, const char *id, JobRow *row, Problem *problem) {
    static const char sql[] = "SELECT " JOB_SHOWN " FROM jobs WHERE id = :id";
    const Key key = {(char *)id, 0};
    bool is_found;
    memset(row, 0, sizeof *row);
    TRY(db_first(db, sql, key_columns, &key, job_columns, row, &is_found, problem));
    return is_found ? STATUS_OK : not_found(id, problem);
}

typedef struct Asked {
    char id[40], result[72];
    char *scene;
} Asked;
static const RowColumn asked_columns[] = {ROW_COLUMN(Asked, id, COLUMN_NAME),
                                          ROW_COLUMN(Asked, result, COLUMN_NAME),
                                          ROW_COLUMN(Asked, scene, COLUMN_TEXT), ROW_END};

Status db_job_scene(Db *db, const char *id, char **scene, Problem *problem) {
    static const char sql[] =
        "SELECT coalesce((SELECT scene FROM jobs WHERE id = :id AND scene <> ''), "
        "(SELECT scene FROM results WHERE id = :result)) AS scene";
    JobRow row;
    Asked asked = {.scene = NULL};
    bool is_found;
    *scene = NULL;
    // A job may be in memory alone as yet, its result not.
    TRY(db_job_load(db, id, &row, problem));
    memcpy(asked.id, row.id, sizeof asked.id);
    memcpy(asked.result, row.result, sizeof asked.result);
    job_row_clear(&row);
    TRY(db_first(db, sql, asked_columns, &asked, asked_columns, &asked, &is_found, problem));
    *scene = asked.scene;
    return *scene != NULL ? STATUS_OK
                          : problem_set(problem, STATUS_GONE,
                                        "the scene of the job \"%.40s\" went with its result, "
                                        "which was deleted",
                                        id);
}

typedef struct Keyed {
    char *client, *key;
} Keyed;
static const RowColumn idempotency_columns[] = {ROW_COLUMN(Keyed, client, COLUMN_TEXT),
                                                ROW_COLUMN(Keyed, key, COLUMN_TEXT), ROW_END};

Status db_job_keyed(Db *db, const char *client, const char *key, JobRow *row, Problem *problem) {
    static const char sql[] = "SELECT " JOB_SHOWN ", request FROM jobs "
                              "WHERE idempotency_key = :key AND coalesce(client, '') = :client";
    const Keyed keyed = {(char *)(client != NULL ? client : ""), (char *)key};
    bool is_found;
    memset(row, 0, sizeof *row);
    TRY(db_first(db, sql, idempotency_columns, &keyed, job_columns, row, &is_found, problem));
    return is_found ? STATUS_OK
                    : problem_set(problem, STATUS_NOT_FOUND, "there is no job of that key");
}

static Status load(Db *db, const char *sql, const Key *key, JobRows *rows, Problem *problem) {
    void *at;
    const Status status = db_all(db, sql, key_columns, key, job_columns, sizeof *rows->at, &at,
                                 &rows->count, problem);
    rows->at = at;
    if (status != STATUS_OK)
        job_rows_clear(rows);
    return status;
}

Status db_job_unfinished(Db *db, JobRows *rows, Problem *problem) {
    static const char sql[] =
        "SELECT " JOB_SHORT ", scene FROM jobs WHERE state < 2 ORDER BY number";
    return load(db, sql, &(Key){0}, rows, problem);
}
