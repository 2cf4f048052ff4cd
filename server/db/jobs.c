// Jobs. The integer key rises with the order of acceptance, which a start follows. Lists are in the
// order of (created, number), downwards. The rarest condition chooses the index of a search; the
// others are tested row by row. Words are searched literally: "\n" separates the lines of what is
// searched, and no text contains one.
#include <pthread.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "server/db/db_private.h"
#include "server/util/bytes.h"
#include "server/util/clock.h"

// clang-format off
#define CHECKED(Type, member, flags) COLUMN_WITH(Type, member, COLUMN_CHECKED | (flags))
static const SqlColumn job_columns[] = {
    // The first two as in notes_columns.
    CHECKED(JobRow, title, 0),
    CHECKED(JobRow, labels, 0),
    CHECKED(JobRow, id, COLUMN_ID),
    CHECKED(JobRow, state, COLUMN_MUTABLE),
    CHECKED(JobRow, result, COLUMN_MUTABLE),
    CHECKED(JobRow, is_cached, COLUMN_MUTABLE),
    CHECKED(JobRow, created_unix_ms, 0),
    CHECKED(JobRow, started_unix_ms, COLUMN_MUTABLE),
    CHECKED(JobRow, finished_unix_ms, COLUMN_MUTABLE),
    CHECKED(JobRow, queued, COLUMN_MUTABLE),
    CHECKED(JobRow, run, COLUMN_MUTABLE),
    CHECKED(JobRow, total, COLUMN_MUTABLE),
    CHECKED(JobRow, problem, COLUMN_MUTABLE),
    CHECKED(JobRow, warnings, 0),
    CHECKED(JobRow, study, 0),
    CHECKED(JobRow, client, 0),
    COLUMN_READ(JobRow, has_result, "EXISTS (SELECT 1 FROM results WHERE id = jobs.result)"),
    {.name = "scene", .kind = COLUMN_TEXT, .offset = offsetof(JobRow, scene), .size = sizeof(char *),
     .flags = COLUMN_LONG | COLUMN_CHECKED | COLUMN_MUTABLE | COLUMN_KEPT,
     .write = "coalesce(:scene, scene)"},
    COLUMN_WITH(JobRow, words, COLUMN_LONG), // is made of title and labels, and never shown
    CHECKED(JobRow, idempotency_key, COLUMN_LONG),
    CHECKED(JobRow, request, COLUMN_LONG),
    COLUMN_END
};
// The same, of which a damaged one does not hide the others.
static SqlColumn job_list_columns[COUNT(job_columns) + 1] = {COLUMN_READ(JobRow, is_damaged, "0")};

static void job_list_columns_make(void) {
    memcpy(job_list_columns + 1, job_columns, sizeof job_columns);
}

const CheckedTable jobs_table = CHECKED_TABLE("jobs", job_columns, JobRow);
// clang-format on

void job_row_clear(JobRow *row) {
    free(row->uses);
    row_clear(job_columns, row, sizeof *row);
}

void job_rows_clear(JobRows *rows) {
    rows_clear(job_columns, sizeof *rows->at, rows);
}

static const char no_job[] = "there is no job \"%.40s\"";

static const char insert_sql[] = "INSERT INTO jobs {insert}";

// The scene of a successful job is its result's.
static Status job_insert(Sqlite *database, const char *sql, const JobRow *row, Problem *problem) {
    JobRow stored = *row;
    if (row->state == 2 || row->scene == NULL)
        stored.scene = "";
    return sqlite_change(database, sql, job_columns, &stored, NULL, problem);
}

static Status job_apply_add(Sqlite *database, const void *work, Problem *problem) {
    static const char uses_sql[] = "INSERT INTO job_uses (job, name) VALUES "
                                   "(last_insert_rowid(), :name) ON CONFLICT DO NOTHING";
    const JobRow *row = work;
    TRY(job_insert(database, insert_sql, row, problem));
    return row->state < 2 ? use_lines_add(database, uses_sql, row->uses, problem) : STATUS_OK;
}

Status db_job_add(Db *db, const JobRow *row, Problem *problem) {
    return db_write(db, job_apply_add, row, problem);
}

void db_job_post(Db *db, const JobRow *row, PendingWrite *write) {
    db_enqueue(db, job_apply_add, row, WRITE_NORMAL, write);
}

// All that changes of a job, or the whole of it where it is_unsaved. STATUS_NOT_FOUND.
static Status job_row_save(Sqlite *database, const JobRow *row, Problem *problem) {
    static const char update_sql[] = "UPDATE jobs SET {set} WHERE id = :id";
    static const char upsert_sql[] =
        "INSERT INTO jobs {insert} ON CONFLICT (id) DO UPDATE SET {set}";
    JobRow stored = *row;
    int changes;
    if (row->is_unsaved)
        return job_insert(database, upsert_sql, row, problem);
    stored.scene = row->state == 2 ? "" : NULL;
    TRY(sqlite_change(database, update_sql, job_columns, &stored, &changes, problem));
    return changes > 0 ? STATUS_OK : problem_set(problem, STATUS_NOT_FOUND, no_job, row->id);
}

static Status job_apply_commit(Sqlite *database, const void *work, Problem *problem) {
    const ResultCommit *commit = work;
    if (commit->result != NULL)
        TRY(result_row_add(database, commit->result, problem));
    for (const JobRow *row = commit->jobs; row != NULL; row = row->next)
        TRY(job_row_save(database, row, problem));
    return STATUS_OK;
}

void db_result_post(Db *db, const ResultCommit *commit, PendingWrite *write) {
    db_enqueue(db, job_apply_commit, commit, WRITE_NORMAL, write);
}

static Status job_apply_save(Sqlite *database, const void *work, Problem *problem) {
    return job_row_save(database, work, problem);
}

Status db_job_update(Db *db, const JobRow *row, Problem *problem) {
    return db_write(db, job_apply_save, row, problem);
}

void db_job_update_post(Db *db, const JobRow *row, PendingWrite *write) {
    db_enqueue(db, job_apply_save, row, WRITE_NORMAL, write);
}

// clang-format off
#define NOTE(member) \
    {.name = #member, .kind = COLUMN_TEXT, .offset = offsetof(JobNotes, member), .size = sizeof(char *), \
     .flags = COLUMN_CHECKED | COLUMN_MUTABLE | COLUMN_KEPT, \
     .write = "nullif(coalesce(:" #member ", " #member "), '')"}
static const SqlColumn notes_columns[] = {
    COLUMN(JobNotes, id),
    NOTE(title),
    NOTE(labels),
    COLUMN(JobNotes, title_words),
    COLUMN(JobNotes, label_words),
    COLUMN_END
};
// clang-format on

static Status job_apply_annotate(Sqlite *database, const void *work, Problem *problem) {
    // The words are the title's line and then the labels' lines; without both there are none.
    static const char sql[] =
        "UPDATE jobs SET {set}, words = nullif("
        "coalesce(:title_words, substr(words, 1, instr(words, char(10))), char(10)) || "
        "coalesce(:label_words, substr(words, instr(words, char(10)) + 1), ''), char(10)) "
        "WHERE id = :id";
    const JobNotes *notes = work;
    int changes;
    TRY(sqlite_change(database, sql, notes_columns, notes, &changes, problem));
    return changes > 0 ? STATUS_OK : problem_set(problem, STATUS_NOT_FOUND, no_job, notes->id);
}

Status db_job_annotate(Db *db, const JobNotes *notes, Problem *problem) {
    return db_write(db, job_apply_annotate, notes, problem);
}

Status db_job_load(Db *db, const char *id, JobRow *row, Problem *problem) {
    static const char sql[] = "SELECT {head} FROM jobs WHERE id = :id";
    return db_get(db, sql, &(QueryKey){.id = id}, job_columns, row, sizeof *row, problem, no_job,
                  id);
}

Status db_job_load_with_scene(Db *db, const char *id, JobRow *row, Problem *problem) {
    static const char sql[] = "SELECT {head}, scene FROM jobs WHERE id = :id";
    return db_get(db, sql, &(QueryKey){.id = id}, job_columns, row, sizeof *row, problem, no_job,
                  id);
}

Status db_job_scene(Db *db, const char *id, char **scene, Problem *problem) {
    return db_job_scene_within(db, id, SIZE_MAX / 2, scene, problem);
}

Status db_job_scene_within(Db *db, const char *id, size_t most, char **scene, Problem *problem) {
    static const char sql[] = "SELECT id, result, scene, checks FROM jobs "
                              "WHERE id = :id AND length(scene) <= :before";
    const QueryKey key = {.id = id, .before = (int64_t)most};
    JobRow row;
    ResultRow result;
    *scene = NULL;
    TRY(db_get(db, sql, &key, job_columns, &row, sizeof row, problem, no_job, id));
    if (row.scene[0] != '\0') {
        *scene = row.scene;
        return STATUS_OK;
    }
    free(row.scene);
    const Status status = db_result_scene_within(db, row.result, most, &result, problem);
    if (status == STATUS_NOT_FOUND) {
        problem_clear(problem);
        return problem_set(problem, STATUS_GONE,
                           "the scene of the job \"%.40s\" went with its result, which was deleted",
                           id);
    }
    TRY(status);
    *scene = result.scene;
    result.scene = NULL;
    result_row_clear(&result);
    return STATUS_OK;
}

Status db_job_keyed(Db *db, const char *client, const char *key, JobRow *row, Problem *problem) {
    static const char sql[] = "SELECT {head}, request FROM jobs "
                              "WHERE idempotency_key = :name AND coalesce(client, '') = :client";
    const QueryKey asked = {.client = client != NULL ? client : "", .name = key};
    return db_get(db, sql, &asked, job_columns, row, sizeof *row, problem,
                  "there is no job of that key");
}

Status db_ids_with_prefix(Db *db, const char *prefix, size_t max, JobRows *rows, Problem *problem) {
    static const char jobs_sql[] = "SELECT id AS result FROM jobs WHERE id >= :id AND id < :name "
                                   "ORDER BY id LIMIT :max";
    static const char results_sql[] = "SELECT id AS result FROM results WHERE id >= :id AND "
                                      "id < :name ORDER BY id LIMIT :max";
    char end[80]; // behind all that go on with a digit
    snprintf(end, sizeof end, "%.72sg", prefix);
    const QueryKey key = {.id = prefix, .name = end, .max = max};
    return db_list(db, prefix[0] == 'j' ? jobs_sql : results_sql, query_key_columns, &key,
                   job_columns, sizeof *rows->at, rows, problem);
}

Status db_job_unfinished(Db *db, JobRows *rows, Problem *problem) {
    static const char sql[] = "SELECT id FROM jobs WHERE state < 2 ORDER BY number";
    return db_list(db, sql, NULL, NULL, job_columns, sizeof *rows->at, rows, problem);
}

// clang-format off
static const SqlColumn search_columns[] = {
    COLUMN(JobSearch, before),
    COLUMN(JobSearch, before_unix_ms),
    COLUMN(JobSearch, before_number),
    COLUMN(JobSearch, words),
    COLUMN(JobSearch, label),
    COLUMN(JobSearch, result),
    COLUMN(JobSearch, study),
    COLUMN(JobSearch, since_unix_ms),
    COLUMN(JobSearch, until_unix_ms),
    COLUMN(JobSearch, least_state),
    COLUMN(JobSearch, most_state),
    COLUMN(JobSearch, most),
    COLUMN_END
};
// clang-format on

// created_unix_ms <= :before_unix_ms says nothing new, but lets an index begin there.
#define PLACE                                                                                      \
    "created_unix_ms <= :before_unix_ms AND created_unix_ms >= :since_unix_ms AND "                \
    "created_unix_ms <= :until_unix_ms AND (created_unix_ms < :before_unix_ms OR number < "        \
    ":before_number) "
#define WORDS                                                                                      \
    "AND (:words IS NULL OR instr(words, :words) > 0) "                                            \
    "AND (:label IS NULL OR instr(words, char(10) || :label || char(10)) > 0 OR "                  \
    "instr(words, char(10) || :label || '=') > 0) "
#define KIND                                                                                       \
    "AND state BETWEEN :least_state AND :most_state "                                              \
    "AND (:result IS NULL OR result = :result) "                                                   \
    "AND (:study IS NULL OR coalesce(study, 'none') = :study) "
#define ORDER "ORDER BY created_unix_ms DESC, number DESC LIMIT :most"
#define SELECT "SELECT {head} FROM jobs "

static const char plain_sql[] = SELECT "INDEXED BY jobs_created WHERE " PLACE KIND ORDER;
static const char words_sql[] =
    SELECT "INDEXED BY jobs_worded WHERE words IS NOT NULL AND " PLACE WORDS KIND ORDER;
static const char result_sql[] = SELECT
    "INDEXED BY jobs_of_result WHERE substr(result, 3, 12) = substr(:result, 3, 12) AND " PLACE
        WORDS KIND ORDER;
static const char study_sql[] =
    SELECT "INDEXED BY jobs_studied WHERE study = :study AND " PLACE WORDS KIND ORDER;
static const char unsuccessful_sql[] =
    SELECT "INDEXED BY jobs_unsuccessful WHERE state > 2 AND state = :least_state AND " PLACE WORDS
        KIND ORDER;
static const char unfinished_sql[] =
    SELECT "INDEXED BY jobs_unfinished WHERE state < 2 AND " PLACE WORDS KIND ORDER;

static const char *search_choose(const JobSearch *search) {
    if (search->result != NULL)
        return result_sql;
    if (search->most_state < 2)
        return unfinished_sql;
    if (search->words != NULL || search->label != NULL)
        return words_sql;
    if (search->study != NULL && strcmp(search->study, "none") != 0)
        return study_sql;
    if (search->least_state > 2 && search->least_state == search->most_state)
        return unsuccessful_sql;
    return plain_sql;
}

JobSearch job_search_all(size_t most) {
    return (JobSearch){
        .before_unix_ms = -1, .most_state = 4, .until_unix_ms = INT64_MAX, .most = most};
}

void job_words(Bytes *bytes, const char *title, const char *const *labels, size_t label_count) {
    if (title != NULL)
        bytes_folded(bytes, title);
    if (title != NULL || label_count > 0)
        bytes_text(bytes, "\n");
    for (size_t i = 0; i < label_count; i++) {
        bytes_folded(bytes, labels[i]);
        bytes_text(bytes, "\n");
    }
}

// *text becomes the folded one, to be freed.
static bool search_fold(const char **text) {
    Bytes bytes = {0};
    if (*text != NULL) {
        bytes_folded(&bytes, *text);
        *text = bytes_take(&bytes, NULL);
        return *text != NULL;
    }
    return true;
}

// The place in the list from which the search continues.
static Status search_find_place(Db *db, JobSearch *search, Problem *problem) {
    static const char sql[] = "SELECT created_unix_ms AS before_unix_ms, number AS before_number "
                              "FROM jobs WHERE id = :before";
    bool is_found = true;
    search->before_number = 0; // of a job deleted between two pages the place is its arrival
    if (search->before == NULL)
        search->before_unix_ms = search->before_number = INT64_MAX;
    else
        TRY(db_first(db, sql, search_columns, search, search_columns, search, &is_found, problem));
    return is_found || search->before_unix_ms >= 0
               ? STATUS_OK
               : problem_set(problem, STATUS_NOT_FOUND, no_job, search->before);
}

// What is left of a damaged row: a failed job that says so.
static Status job_row_mark(JobRow *row) {
    static const char problem[] =
        "{\"type\": \"/problems/internal\", \"title\": \"Internal error\", \"status\": 500, "
        "\"detail\": \"this job is damaged: its row in the table jobs differs from its checksums. "
        "impactd check-db lists what is damaged, impactd restore replaces the database by a "
        "backup\"}";
    JobRow mark = {.state = 3, .is_damaged = true, .created_unix_ms = row->created_unix_ms};
    text_fit(mark.id, sizeof mark.id, row->id);
    job_row_clear(row);
    *row = mark;
    return text_copy(problem, &row->problem);
}

Status db_job_search(Db *db, const JobSearch *search, JobRows *rows, Problem *problem) {
    JobSearch folded = *search;
    *rows = (JobRows){0};
    TRY(search_find_place(db, &folded, problem));
    const bool has_words = search_fold(&folded.words), has_label = search_fold(&folded.label);
    static pthread_once_t once = PTHREAD_ONCE_INIT;
    (void)pthread_once(&once, job_list_columns_make);
    Status status = has_words && has_label
                        ? db_list(db, search_choose(search), search_columns, &folded,
                                  job_list_columns, sizeof *rows->at, rows, problem)
                        : problem_set(problem, STATUS_NO_MEMORY, "no memory for a search");
    free((char *)folded.words);
    free((char *)folded.label);
    for (size_t i = 0; i < rows->count && status == STATUS_OK; i++)
        if (rows->at[i].is_damaged && job_row_mark(&rows->at[i]) != STATUS_OK)
            status = problem_set(problem, STATUS_NO_MEMORY, "no memory for a search");
    if (status != STATUS_OK)
        job_rows_clear(rows);
    return status;
}

// Retention. Each call first asks on a reader's connection whether there is anything to do, so that
// nothing is written where there is not. Pages that deletion frees are used again; only where more
// than an eighth of the file is free are some returned to the disk.

typedef struct Extent {
    uint64_t jobs, unfinished, pages, free_pages, page_size;
} Extent;
static const SqlColumn extent_columns[] = {COLUMN(Extent, jobs),      COLUMN(Extent, unfinished),
                                           COLUMN(Extent, pages),     COLUMN(Extent, free_pages),
                                           COLUMN(Extent, page_size), COLUMN_END};

typedef struct Victim {
    int64_t number;
    char result[72];
} Victim;
static const SqlColumn victim_columns[] = {COLUMN(Victim, number), COLUMN(Victim, result),
                                           COLUMN_END};

enum { VACUUM_MIN = 256 }; // pages that are free before any are given back

static Status retention_measure(Db *db, bool counts_jobs, Extent *extent, Problem *problem) {
    static const char sizes[] =
        "SELECT page_count AS pages, freelist_count AS free_pages, page_size "
        "FROM pragma_page_count, pragma_freelist_count, pragma_page_size";
    static const char counts[] = "SELECT count(*) AS jobs, (SELECT count(*) FROM jobs "
                                 "INDEXED BY jobs_unfinished WHERE state < 2) AS unfinished "
                                 "FROM jobs";
    *extent = (Extent){0};
    TRY(db_first(db, sizes, NULL, NULL, extent_columns, extent, NULL, problem));
    return counts_jobs ? db_first(db, counts, NULL, NULL, extent_columns, extent, NULL, problem)
                       : STATUS_OK;
}

static const char victims_sql[] =
    "SELECT number, result FROM jobs INDEXED BY jobs_created WHERE created_unix_ms < :before AND "
    "state > 1 ORDER BY created_unix_ms, number LIMIT :max";

static Status has_older(Db *db, int64_t before, bool *has, Problem *problem) {
    Victim victim = {0};
    return db_first(db, victims_sql, query_key_columns, &(QueryKey){.before = before, .max = 1},
                    victim_columns, &victim, has, problem);
}

typedef struct Removal {
    const char *sql; // the jobs
    QueryKey bounds;
    bool gives_back;
    Removed *removed;
} Removal;

static Status retention_apply(Sqlite *database, const void *work, Problem *problem) {
    static const char jobs_sql[] = "DELETE FROM jobs WHERE number = :number";
    static const char results_sql[] =
        "DELETE FROM results WHERE id = :result AND NOT EXISTS (SELECT 1 FROM jobs "
        "INDEXED BY jobs_of_result WHERE substr(result, 3, 12) = substr(:result, 3, 12) "
        "AND result = :result)";
    const Removal *removal = work;
    Removed *removed = removal->removed;
    struct {
        Victim *at;
        size_t count;
    } victims;
    *removed = (Removed){0};
    if (removal->gives_back)
        return sqlite_execute(database, "PRAGMA incremental_vacuum(64)", problem);
    TRY(sqlite_list(database, removal->sql, query_key_columns, &removal->bounds, victim_columns,
                    sizeof *victims.at, &victims, problem));
    Status status = STATUS_OK;
    for (size_t i = 0; i < victims.count && status == STATUS_OK; i++) {
        const Victim *victim = &victims.at[i];
        int changes = 0;
        status = sqlite_change(database, jobs_sql, victim_columns, victim, NULL, problem);
        if (status == STATUS_OK)
            status =
                sqlite_change(database, results_sql, victim_columns, victim, &changes, problem);
        removed->jobs++;
        if (changes > 0)
            memcpy(removed->result[removed->results++], victim->result, sizeof victim->result);
    }
    rows_clear(victim_columns, sizeof *victims.at, &victims);
    return status;
}

Status db_remove(Db *db, const KeepRules *rules, Removed *removed, Problem *problem) {
    static const double day_ms = 86400000;
    const int64_t before = clock_unix_ms() - (int64_t)(rules->days * day_ms);
    Extent extent;
    Removal removal = {.sql = victims_sql, .removed = removed};
    bool is_older = false;
    *removed = (Removed){0};
    TRY(retention_measure(db, rules->jobs > 0, &extent, problem));
    if (rules->days > 0)
        TRY(has_older(db, before, &is_older, problem));
    const uint64_t finished = extent.jobs - extent.unfinished;
    const uint64_t used = (extent.pages - extent.free_pages) * extent.page_size;
    if (rules->jobs > 0 && finished > rules->jobs)
        removal.bounds = (QueryKey){.before = INT64_MAX, .max = finished - rules->jobs};
    else if (rules->bytes > 0 && used > rules->bytes)
        removal.bounds = (QueryKey){.before = INT64_MAX, .max = RETENTION_BATCH / 4};
    else if (is_older)
        removal.bounds = (QueryKey){.before = before, .max = RETENTION_BATCH};
    else if (extent.free_pages > VACUUM_MIN && extent.free_pages > extent.pages / 8)
        removal.gives_back = true;
    else
        return STATUS_OK;
    if (removal.bounds.max > RETENTION_BATCH)
        removal.bounds.max = RETENTION_BATCH;
    TRY(db_write(db, retention_apply, &removal, problem));
    removed->is_more = removal.gives_back || removed->jobs > 0;
    return STATUS_OK;
}

Status db_job_remove(Db *db, const char *id, Removed *removed, Problem *problem) {
    static const char sql[] = "SELECT number, result FROM jobs WHERE id = :id AND state > 1";
    const Removal removal = {.sql = sql, .bounds = {.id = id}, .removed = removed};
    TRY(db_write(db, retention_apply, &removal, problem));
    return removed->jobs > 0
               ? STATUS_OK
               : problem_set(problem, STATUS_NOT_FOUND, "there is no finished job \"%.40s\"", id);
}
