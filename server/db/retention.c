// A call looks with a reader's connection whether there is anything to do, so that nothing is
// written where there is not. Pages that deletion frees are used again; only where more than an
// eighth of the file is free are some given back.
#include "server/db/retention.h"

#include <string.h>

#include "server/db/db_private.h"
#include "server/util/clock.h"

typedef struct Extent {
    uint64_t jobs, unfinished, pages, free_pages, page_size;
} Extent;

typedef struct Victim {
    int64_t number;
    char result[72];
} Victim;

typedef struct Bounds {
    int64_t before;
    uint64_t most;
} Bounds;

// clang-format off
static const RowColumn extent_columns[] = {
    ROW_COLUMN(Extent, jobs, COLUMN_COUNT),
    ROW_COLUMN(Extent, unfinished, COLUMN_COUNT),
    ROW_COLUMN(Extent, pages, COLUMN_COUNT),
    ROW_COLUMN(Extent, free_pages, COLUMN_COUNT),
    ROW_COLUMN(Extent, page_size, COLUMN_COUNT),
    ROW_END
};
static const RowColumn victim_columns[] = {
    ROW_COLUMN(Victim, number, COLUMN_INTEGER),
    ROW_COLUMN(Victim, result, COLUMN_NAME),
    ROW_END
};
static const RowColumn bounds_columns[] = {
    ROW_COLUMN(Bounds, before, COLUMN_INTEGER),
    ROW_COLUMN(Bounds, most, COLUMN_COUNT),
    ROW_END
};
// clang-format on

enum { VACUUM_MIN = 256 }; // pages that are free before any are given back

static Status measure(Db *db, bool counts_jobs, Extent *extent, Problem *problem) {
    static const char sizes[] =
        "SELECT page_count AS pages, freelist_count AS free_pages, page_size "
        "FROM pragma_page_count, pragma_freelist_count, pragma_page_size";
    static const char counts[] = "SELECT count(*) AS jobs, (SELECT count(*) FROM jobs "
                                 "INDEXED BY jobs_unfinished WHERE state < 2) AS unfinished "
                                 "FROM jobs";
    bool is_found;
    *extent = (Extent){0};
    TRY(db_first(db, sizes, NULL, NULL, extent_columns, extent, &is_found, problem));
    if (counts_jobs)
        TRY(db_first(db, counts, NULL, NULL, extent_columns, extent, &is_found, problem));
    return STATUS_OK;
}

static Status has_older(Db *db, int64_t before, bool *has, Problem *problem) {
    static const char sql[] = "SELECT number, result FROM jobs INDEXED BY jobs_created "
                              "WHERE created_unix_ms < :before AND state > 1 LIMIT 1";
    Victim victim = {0};
    return db_first(db, sql, bounds_columns, &(Bounds){before, 1}, victim_columns, &victim, has,
                    problem);
}

typedef struct Removal {
    Bounds bounds;
    bool gives_back;
    Removed *removed;
} Removal;

static Status list_victims(Sqlite *database, const Bounds *bounds, Victim *victims, size_t *count,
                           Problem *problem) {
    static const char sql[] =
        "SELECT number, result FROM jobs INDEXED BY jobs_created "
        "WHERE created_unix_ms < :before AND state > 1 ORDER BY created_unix_ms, number "
        "LIMIT :most";
    Statement *statement;
    bool has_row = true;
    *count = 0;
    TRY(statement_begin(database, sql, bounds_columns, bounds, &statement, problem));
    Status status = STATUS_OK;
    while (status == STATUS_OK && *count < RETENTION_BATCH) {
        status = statement_step(statement, &has_row, problem);
        if (status != STATUS_OK || !has_row)
            break;
        status = row_read(statement, victim_columns, &victims[(*count)++], problem);
    }
    statement_end(statement);
    return status;
}

static Status apply(Sqlite *database, const void *work, Problem *problem) {
    static const char job_sql[] = "DELETE FROM jobs WHERE number = :number";
    static const char result_sql[] =
        "DELETE FROM results WHERE id = :result AND NOT EXISTS (SELECT 1 FROM jobs "
        "INDEXED BY jobs_of_result WHERE substr(result, 3, 12) = substr(:result, 3, 12) "
        "AND result = :result)";
    const Removal *removal = work;
    Removed *removed = removal->removed;
    Victim victims[RETENTION_BATCH];
    size_t count;
    *removed = (Removed){0};
    if (removal->gives_back)
        return sqlite_execute(database, "PRAGMA incremental_vacuum(64)", problem);
    memset(victims, 0, sizeof victims);
    TRY(list_victims(database, &removal->bounds, victims, &count, problem));
    for (size_t i = 0; i < count; i++) {
        int changes;
        TRY(sqlite_change(database, job_sql, victim_columns, &victims[i], NULL, problem));
        TRY(sqlite_change(database, result_sql, victim_columns, &victims[i], &changes, problem));
        removed->jobs++;
        if (changes > 0)
            memcpy(removed->result[removed->results++], victims[i].result,
                   sizeof victims[i].result);
    }
    return STATUS_OK;
}

Status db_remove(Db *db, const KeepRules *rules, Removed *removed, Problem *problem) {
    static const double day_ms = 86400000;
    const int64_t before = clock_unix_ms() - (int64_t)(rules->days * day_ms);
    Extent extent;
    Removal removal = {.removed = removed};
    bool is_older = false;
    *removed = (Removed){0};
    TRY(measure(db, rules->jobs > 0, &extent, problem));
    if (rules->days > 0)
        TRY(has_older(db, before, &is_older, problem));
    const uint64_t finished = extent.jobs - extent.unfinished;
    const uint64_t used = (extent.pages - extent.free_pages) * extent.page_size;
    if (rules->jobs > 0 && finished > rules->jobs)
        removal.bounds = (Bounds){INT64_MAX, finished - rules->jobs};
    else if (rules->bytes > 0 && used > rules->bytes)
        removal.bounds = (Bounds){INT64_MAX, RETENTION_BATCH / 4};
    else if (is_older)
        removal.bounds = (Bounds){before, RETENTION_BATCH};
    else if (extent.free_pages > VACUUM_MIN && extent.free_pages > extent.pages / 8)
        removal.gives_back = true;
    else
        return STATUS_OK;
    if (removal.bounds.most > RETENTION_BATCH)
        removal.bounds.most = RETENTION_BATCH;
    TRY(db_write(db, apply, &removal, problem));
    removed->is_more = removal.gives_back || removed->jobs > 0;
    return STATUS_OK;
}
