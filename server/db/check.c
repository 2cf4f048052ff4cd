// The tables whose rows have checksums: the first rows get theirs when a database is made, all are
// compared when it is checked.
#include <errno.h>
#include <limits.h>
#include <stdio.h>
#include <stdlib.h>
#include <unistd.h>

#include "server/db/db_private.h"
#include "server/db/sqlite.h"
#include "server/util/embedded.h"

static const CheckedTable *const *checked_tables(void) {
    // clang-format off
    static const CheckedTable *const tables[] = {
        &revisions_table, &reviews_table, &measurements_table, &audit_table, &records_table, &samples_table,
        &results_table, &series_table, &sweep_rows_table, &chunks_table, &jobs_table, &tokens_table, NULL};
    // clang-format on
    (void)material_revision_columns(); // makes those of revisions_table
    return tables;
}

Status db_open(const char *directory, Db **db, Problem *problem) {
    return db_open_with(directory, false, checked_tables(), db, problem);
}

Status db_open_beside(const char *directory, Db **db, Problem *problem) {
    return db_open_with(directory, true, checked_tables(), db, problem);
}

typedef struct Orphan {
    char child[64], parent[64];
    int64_t number;
} Orphan;

// Rows that refer to a row that is missing.
static Status check_references(Sqlite *database, const DbCheck *check, uint64_t *damaged,
                               Problem *problem) {
    static const char sql[] =
        "SELECT \"table\" AS child, parent, coalesce(rowid, 0) AS number FROM "
        "pragma_foreign_key_check";
    static const SqlColumn columns[] = {COLUMN(Orphan, child), COLUMN(Orphan, parent),
                                        COLUMN(Orphan, number), COLUMN_END};
    struct {
        Orphan *at;
        size_t count;
    } orphans;
    TRY(sqlite_list(database, sql, NULL, NULL, columns, sizeof *orphans.at, &orphans, problem));
    for (size_t i = 0; i < orphans.count; i++) {
        const Orphan *orphan = &orphans.at[i];
        char text[256];
        snprintf(text, sizeof text, "a row of table %s (number %lld) refers to a missing row of %s",
                 orphan->child, (long long)orphan->number, orphan->parent);
        check->report_damage(check->context, text);
    }
    *damaged += orphans.count;
    free(orphans.at);
    return STATUS_OK;
}

// What cannot be read is damage too, after which the check goes on.
static Status check_go_on(Status status, const DbCheck *check, const char *what, uint64_t *faults,
                          Problem *problem) {
    char text[DAMAGE_SIZE];
    if (status != STATUS_IO && status != STATUS_INTERNAL)
        return status;
    snprintf(text, sizeof text, "%.60s cannot be read to its end: %.200s", what, problem->detail);
    check->report_damage(check->context, text);
    problem_clear(problem);
    ++*faults;
    return STATUS_OK;
}

Status check_run(Sqlite *database, const DbCheck *check, Problem *problem) {
    uint64_t faults = 0, damaged = 0;
    Status status = sqlite_check(database, check->report_damage, check->context, &faults, problem);
    TRY(check_go_on(status, check, "the file", &faults, problem));
    status = check_references(database, check, &damaged, problem);
    TRY(check_go_on(status, check, "the references between tables", &faults, problem));
    for (const CheckedTable *const *tables = checked_tables(); *tables != NULL; tables++) {
        TableCheck table = {.report = check->report_damage, .context = check->context};
        status = sqlite_check_table(database, *tables, &table, problem);
        TRY(check_go_on(status, check, (*tables)->name, &faults, problem));
        if (check->report_table != NULL)
            check->report_table(check->context, (*tables)->name, table.rows, table.damaged);
        damaged += table.damaged;
    }
    if (faults + damaged == 0)
        return STATUS_OK;
    const bool is_unreadable = sqlite_could_not_read(database);
    return problem_set(
        problem, STATUS_IO, "the database %s: %llu faults of the file, %llu damaged rows",
        is_unreadable ? "could not be read (Input/output error), try again" : "is damaged",
        (unsigned long long)faults, (unsigned long long)damaged);
}

Status check_open(const char *path, Sqlite **source, Problem *problem) {
    static const char sql[] =
        "SELECT count(*) AS jobs FROM sqlite_schema WHERE name IN ('jobs', 'results', 'materials')";
    static const SqlColumn columns[] = {COLUMN(Backup, jobs), COLUMN_END};
    bool is_current;
    Backup tables = {0};
    TRY(sqlite_open(path, DATABASE_READER, source, problem));
    TRY(sqlite_is_current(*source, embedded_sql, &is_current, problem));
    TRY(sqlite_first(*source, sql, NULL, NULL, columns, &tables, NULL, problem));
    if (tables.jobs != 3)
        return problem_set(problem, STATUS_NOT_FOUND,
                           "%s holds nothing yet: no server has begun there", path);
    return STATUS_OK;
}

Status check_exists(const char *path, const char *directory, Problem *problem) {
    return access(path, F_OK) == 0 || errno == EACCES
               ? STATUS_OK
               : problem_set(problem, STATUS_NOT_FOUND,
                             "there is no database in %s; --data DIR names the server's folder",
                             directory);
}

Status db_exists(const char *directory, Problem *problem) {
    char path[PATH_MAX];
    snprintf(path, sizeof path, "%.4000s/impactd.db", directory);
    return check_exists(path, directory, problem);
}

Status db_check(const char *directory, const DbCheck *check, Problem *problem) {
    char path[PATH_MAX];
    Sqlite *database = NULL;
    snprintf(path, sizeof path, "%.4000s/impactd.db", directory);
    TRY(check_exists(path, directory, problem));
    Status status = check_open(path, &database, problem);
    if (status == STATUS_OK)
        status = check_run(database, check, problem);
    sqlite_close(database);
    return status;
}
