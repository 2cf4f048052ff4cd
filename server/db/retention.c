// Each call first asks on a reader's connection whether there is anything to do, so that nothing is
// written where there is not. Pages that deletion frees are used again; only where more than an
// eighth of the file is free are some returned to the disk.
#include <string.h>

#include "server/db/db_private.h"
#include "server/util/clock.h"

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
    static const char job_sql[] = "DELETE FROM jobs WHERE number = :number";
    static const char result_sql[] =
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
        status = sqlite_change(database, job_sql, victim_columns, victim, NULL, problem);
        if (status == STATUS_OK)
            status = sqlite_change(database, result_sql, victim_columns, victim, &changes, problem);
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
