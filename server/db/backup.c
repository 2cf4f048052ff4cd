// The database as it is at one moment, beside whatever a daemon writes meanwhile.
//
//     impactd.db --> FILE.xxxxxx --> check --> sync --> FILE
#include "server/db/backup.h"

#include <errno.h>
#include <limits.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <sys/statvfs.h>
#include <unistd.h>

#include "server/db/data_dir.h"
#include "server/db/row.h"
#include "server/db/sqlite.h"
#include "server/util/embedded.h"

// The daemon's own, and the log of an earlier one; a copy under one of these names would be taken
// for a part of its database.
static const char *const own_names[] = {"impactd.db",
                                        "impactd.db-wal",
                                        "impactd.db-shm",
                                        "impactd.late",
                                        "impactd.lock",
                                        "impactd.db-journal",
                                        NULL};

static const double copy_share = 0.8; // of the time, the rest is the check's

typedef struct Work {
    const BackupRequest *request;
    char folder[PATH_MAX]; // that the copy is to be in
    char part[PATH_MAX];   // its name until it is whole
    int file;              // that file
    Sqlite *copy;
    Backup backup;
} Work;

static bool is_same(const struct stat *a, const struct stat *b) {
    return a->st_dev == b->st_dev && a->st_ino == b->st_ino;
}

static Status refuse_place(const char *path, Problem *problem) {
    return problem_set(problem, STATUS_CONFLICT,
                       "%s is there already: name another file, or --force replaces it", path);
}

static Status check_place(Work *work, Problem *problem) {
    const char *path = work->request->path, *slash = strrchr(path, '/');
    const char *name = slash != NULL ? slash + 1 : path;
    struct stat there, own;
    char own_path[PATH_MAX];
    snprintf(work->folder, sizeof work->folder, "%.*s",
             slash == NULL   ? 1
             : slash == path ? 1
                             : (int)(slash - path),
             slash == NULL ? "." : path);
    const bool is_there = stat(path, &there) == 0;
    const bool is_in_folder = stat(work->folder, &there) == 0 &&
                              stat(work->request->directory, &own) == 0 && is_same(&there, &own);
    if (is_there)
        (void)stat(path, &there);
    for (size_t i = 0; own_names[i] != NULL; i++) {
        snprintf(own_path, sizeof own_path, "%.4000s/%s", work->request->directory, own_names[i]);
        if ((is_in_folder && strcmp(name, own_names[i]) == 0) ||
            (is_there && stat(own_path, &own) == 0 && is_same(&there, &own)))
            return problem_set(problem, STATUS_CONFLICT,
                               "%s is the daemon's own file: name another one", path);
    }
    if (is_there && S_ISDIR(there.st_mode))
        return problem_set(problem, STATUS_CONFLICT, "%s is a folder: name a file in it", path);
    if (is_there && !S_ISREG(there.st_mode))
        return problem_set(problem, STATUS_CONFLICT, "%s is not a regular file", path);
    return is_there && !work->request->replaces ? refuse_place(path, problem) : STATUS_OK;
}

static Status open_source(Work *work, Sqlite **source, Problem *problem) {
    static const char sql[] =
        "SELECT count(*) AS jobs FROM sqlite_schema WHERE name IN ('jobs', 'results', 'materials')";
    static const RowColumn columns[] = {ROW_COLUMN(Backup, jobs, COLUMN_COUNT), ROW_END};
    const char *directory = work->request->directory;
    char path[PATH_MAX];
    bool has_row;
    Statement *statement;
    snprintf(path, sizeof path, "%.4000s/impactd.db", directory);
    if (access(path, F_OK) != 0 && errno != EACCES)
        return problem_set(problem, STATUS_NOT_FOUND,
                           "there is no database in %s; --data DIR names the daemon's folder",
                           directory);
    TRY(sqlite_open(path, DATABASE_READER, source, problem));
    TRY(sqlite_is_current(*source, embedded_sql, NULL, problem));
    TRY(statement_begin(*source, sql, NULL, NULL, &statement, problem));
    Status status = statement_step(statement, &has_row, problem);
    if (status == STATUS_OK && has_row)
        status = row_read(statement, columns, &work->backup, problem);
    statement_end(statement);
    if (status == STATUS_OK && work->backup.jobs != 3)
        return problem_set(problem, STATUS_NOT_FOUND,
                           "%s holds nothing yet: no daemon has begun there", path);
    return status;
}

static Status open_part(Work *work, Problem *problem) {
    const char *path = work->request->path;
    const int size = snprintf(work->part, sizeof work->part, "%s.XXXXXX", path);
    if (size < 0 || (size_t)size >= sizeof work->part - 8)
        return problem_set(problem, STATUS_IO, "%.200s...: the name is too long", path);
    work->file = mkstemp(work->part); // for this user alone: tokens' digests are in it
    if (work->file >= 0)
        return sqlite_open(work->part, DATABASE_COPY, &work->copy, problem);
    work->part[0] = '\0';
    return problem_set(problem, errno == EACCES || errno == EPERM ? STATUS_FORBIDDEN : STATUS_IO,
                       "%s cannot be written: %s", path, strerror(errno));
}

typedef struct Verdict {
    char *text;
} Verdict;

static Status check_copy(Work *work, Problem *problem) {
    static const char sql[] = "SELECT integrity_check AS text FROM pragma_integrity_check(1)";
    static const RowColumn columns[] = {ROW_COLUMN(Verdict, text, COLUMN_TEXT), ROW_END};
    Verdict verdict = {0};
    Statement *statement;
    bool has_row = false;
    TRY(statement_begin(work->copy, sql, NULL, NULL, &statement, problem));
    Status status = statement_step(statement, &has_row, problem);
    if (status == STATUS_OK && has_row)
        status = row_read(statement, columns, &verdict, problem);
    statement_end(statement);
    if (status == STATUS_OK && (verdict.text == NULL || strcmp(verdict.text, "ok") != 0))
        status = problem_set(problem, STATUS_IO,
                             "the database in %s is damaged (%.200s); there is no copy of it; keep "
                             "the backups there are",
                             work->request->directory,
                             verdict.text != NULL ? verdict.text : "it cannot be checked");
    row_clear(columns, &verdict, sizeof verdict);
    return status;
}

static Status count_copy(Work *work, Problem *problem) {
    static const char sql[] = "SELECT (SELECT count(*) FROM jobs) AS jobs, "
                              "(SELECT count(*) FROM results) AS results, "
                              "(SELECT count(*) FROM materials) AS materials";
    static const RowColumn columns[] = {ROW_COLUMN(Backup, jobs, COLUMN_COUNT),
                                        ROW_COLUMN(Backup, results, COLUMN_COUNT),
                                        ROW_COLUMN(Backup, materials, COLUMN_COUNT), ROW_END};
    Statement *statement;
    bool has_row = false;
    TRY(statement_begin(work->copy, sql, NULL, NULL, &statement, problem));
    Status status = statement_step(statement, &has_row, problem);
    if (status == STATUS_OK && has_row)
        status = row_read(statement, columns, &work->backup, problem);
    statement_end(statement);
    return status;
}

static Status fill(Work *work, Problem *problem) {
    Sqlite *source = NULL;
    ProgressRange copying = {work->request->watch, 0, copy_share, 0};
    ProgressRange checking = {work->request->watch, copy_share, 1 - copy_share, 0};
    const Progress watches[] = {progress_range_view(&copying), progress_range_view(&checking)};
    Status status = open_source(work, &source, problem);
    if (status == STATUS_OK)
        status = open_part(work, problem);
    if (status == STATUS_OK)
        status = sqlite_copy(source, work->copy, &watches[0], problem);
    sqlite_close(source);
    TRY(status);
    sqlite_watch(work->copy, &watches[1]);
    TRY(check_copy(work, problem));
    TRY(count_copy(work, problem));
    return STATUS_OK;
}

// Never over a file that has come since it was looked for, unless that may be replaced; where the
// file system has no links to tell, what was just seen must do.
static Status give_name(Work *work, Problem *problem) {
    const char *path = work->request->path;
    struct stat what;
    if (fsync(work->file) != 0 || fstat(work->file, &what) != 0)
        return problem_set(problem, errno == ENOSPC || errno == EDQUOT ? STATUS_FULL : STATUS_IO,
                           "%s cannot be written: %s", path, strerror(errno));
    work->backup.bytes = (uint64_t)what.st_size;
    if (!progress_advance(work->request->watch, 1))
        return problem_set(problem, STATUS_CANCELLED, "it was interrupted");
    TRY(check_place(work, problem));
    const bool is_linked = !work->request->replaces && link(work->part, path) == 0;
    if (!is_linked && !work->request->replaces && errno == EEXIST)
        return refuse_place(path, problem);
    if (!is_linked && rename(work->part, path) != 0)
        return problem_set(problem, STATUS_IO, "%s cannot be written: %s", path, strerror(errno));
    if (is_linked)
        (void)unlink(work->part);
    work->part[0] = '\0';
    return data_dir_sync(work->folder, problem);
}

// The database's own words are about itself.
static Status tell_full(const Work *work, Problem *problem) {
    char path[PATH_MAX];
    struct statvfs disk;
    struct stat source;
    snprintf(path, sizeof path, "%.4000s/impactd.db", work->request->directory);
    if (stat(path, &source) != 0 || statvfs(work->folder, &disk) != 0)
        return STATUS_FULL;
    problem_clear(problem);
    return problem_set(problem, STATUS_FULL,
                       "there is no room left in %s: a copy takes %llu bytes, %llu are free",
                       work->folder, (unsigned long long)source.st_size,
                       (unsigned long long)disk.f_bavail * (unsigned long long)disk.f_frsize);
}

static void remove_part(Work *work) {
    static const char *const beside[] = {"", "-journal", "-wal", "-shm"};
    char path[PATH_MAX + 16];
    for (size_t i = 0; work->part[0] != '\0' && i < sizeof beside / sizeof *beside; i++) {
        snprintf(path, sizeof path, "%s%s", work->part, beside[i]);
        (void)unlink(path);
    }
    if (work->file >= 0)
        close(work->file);
}

Status backup_write(const BackupRequest *request, Backup *backup, Problem *problem) {
    Work *work = calloc(1, sizeof *work);
    *backup = (Backup){0};
    if (work == NULL)
        return problem_set(problem, STATUS_NO_MEMORY, "no memory for a backup");
    work->request = request;
    work->file = -1;
    Status status = check_place(work, problem);
    if (status == STATUS_OK)
        status = fill(work, problem);
    sqlite_close(work->copy);
    if (status == STATUS_OK)
        status = give_name(work, problem);
    remove_part(work);
    if (status == STATUS_FULL)
        status = tell_full(work, problem);
    if (status == STATUS_OK)
        *backup = work->backup;
    free(work);
    return status;
}
