// A copy is of one moment, whatever a daemon writes meanwhile, and is whole or not there:
//
//     source --> TARGET.xxxxxx --> check --> sync --> TARGET
#include <errno.h>
#include <limits.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <sys/statvfs.h>
#include <unistd.h>

#include "server/db/db_private.h"
#include "server/db/sqlite.h"
#include "server/util/embedded.h"

// The daemon's own, and the log of earlier versions; a copy under one of these names would be used
// as a part of its database.
static const char *const own_names[] = {"impactd.db",
                                        "impactd.db-wal",
                                        "impactd.db-shm",
                                        "impactd.lock",
                                        "impactd.db-journal",
                                        "impactd.late",
                                        NULL};

static const double copy_share = 0.8; // of the time; the check takes the rest

typedef struct Copying {
    const BackupRequest *request;
    const char *source, *target; // one of them is `own`, the server's database
    char own[PATH_MAX];
    char folder[PATH_MAX]; // of the target
    char part[PATH_MAX];   // the target's name until it is whole; "": there is none
    int file;              // the part
    Sqlite *copy;
    Backup backup;
} Copying;

static const SqlColumn backup_columns[] = {COLUMN(Backup, jobs), COLUMN(Backup, results),
                                           COLUMN(Backup, materials), COLUMN_END};

static bool is_same_file(const struct stat *a, const struct stat *b) {
    return a->st_dev == b->st_dev && a->st_ino == b->st_ino;
}

static Status refuse_taken(const Copying *copying, Problem *problem) {
    return problem_set(problem, STATUS_CONFLICT,
                       "%s is there already: name another file, or --force replaces it",
                       copying->target);
}

static Status check_target(const Copying *copying, Problem *problem) {
    const char *path = copying->target, *slash = strrchr(path, '/');
    const char *name = slash != NULL ? slash + 1 : path, *directory = copying->request->directory;
    struct stat folder, there, own;
    char own_path[PATH_MAX];
    const bool is_there = stat(path, &there) == 0;
    const bool is_in_folder = stat(copying->folder, &folder) == 0 && stat(directory, &own) == 0 &&
                              is_same_file(&folder, &own);
    for (size_t i = 0; own_names[i] != NULL; i++) {
        snprintf(own_path, sizeof own_path, "%.4000s/%s", directory, own_names[i]);
        if ((is_in_folder && strcmp(name, own_names[i]) == 0) ||
            (is_there && stat(own_path, &own) == 0 && is_same_file(&there, &own)))
            return problem_set(problem, STATUS_CONFLICT,
                               "%s is the server's own file: name another one", path);
    }
    if (is_there && S_ISDIR(there.st_mode))
        return problem_set(problem, STATUS_CONFLICT, "%s is a folder: name a file in it", path);
    if (is_there && !S_ISREG(there.st_mode))
        return problem_set(problem, STATUS_CONFLICT, "%s is not a regular file", path);
    return is_there && !copying->request->replaces ? refuse_taken(copying, problem) : STATUS_OK;
}

static Status open_part(Copying *copying, Problem *problem) {
    const int size = snprintf(copying->part, sizeof copying->part, "%s.XXXXXX", copying->target);
    // For this user alone: it has the tokens' digests.
    copying->file = (size_t)size < sizeof copying->part ? mkstemp(copying->part) : -1;
    if (copying->file >= 0)
        return sqlite_open(copying->part, DATABASE_COPY, &copying->copy, problem);
    const int code = (size_t)size < sizeof copying->part ? errno : ENAMETOOLONG;
    copying->part[0] = '\0';
    return problem_set(problem, code == EACCES || code == EPERM ? STATUS_FORBIDDEN : STATUS_IO,
                       "%.400s cannot be written: %s", copying->target, strerror(code));
}

static void copy_keep_damage(void *context, const char *damage) {
    char *first = context;
    if (first[0] == '\0')
        text_fit(first, DAMAGE_SIZE, damage);
}

static Status check_copy(Copying *copying, Problem *problem) {
    static const char sql[] = "SELECT (SELECT count(*) FROM jobs) AS jobs, "
                              "(SELECT count(*) FROM results) AS results, "
                              "(SELECT count(*) FROM materials) AS materials";
    char damage[DAMAGE_SIZE] = "";
    const DbCheck check = {.report_damage = copy_keep_damage, .context = damage};
    Problem found = {0};
    const Status status = check_run(copying->copy, &check, &found);
    if (status != STATUS_OK)
        return problem_set(problem, status,
                           "%s: %s%s%s; nothing was copied, keep the other backups",
                           sqlite_could_not_read(copying->copy) ? copying->target : copying->source,
                           found.detail, damage[0] != '\0' ? ": " : "", damage);
    return sqlite_first(copying->copy, sql, NULL, NULL, backup_columns, &copying->backup, NULL,
                        problem);
}

static Status fill_part(Copying *copying, Problem *problem) {
    Sqlite *source = NULL;
    ProgressRange reading = {copying->request->watch, 0, copy_share, 0};
    ProgressRange checking = {copying->request->watch, copy_share, 1 - copy_share, 0};
    const Progress watches[] = {progress_range_view(&reading), progress_range_view(&checking)};
    Status status = check_open(copying->source, &source, problem);
    if (status == STATUS_OK)
        status = open_part(copying, problem);
    if (status == STATUS_OK)
        status = sqlite_copy(source, copying->copy, &watches[0], problem);
    sqlite_close(source);
    TRY(status);
    sqlite_watch(copying->copy, &watches[1]);
    return check_copy(copying, problem);
}

static Status sync_part(Copying *copying, Problem *problem) {
    struct stat what;
    if (fsync(copying->file) != 0 || fstat(copying->file, &what) != 0)
        return problem_set(problem, errno == ENOSPC || errno == EDQUOT ? STATUS_FULL : STATUS_IO,
                           "%s cannot be written: %s", copying->target, strerror(errno));
    copying->backup.bytes = (uint64_t)what.st_size;
    return progress_advance(copying->request->watch, 1)
               ? STATUS_OK
               : problem_set(problem, STATUS_CANCELLED, "it was interrupted");
}

// Where the target may not be replaced it is not, also if it was made a moment ago; in a file
// system without links one that is made at this very moment is.
static Status rename_part(Copying *copying, bool replaces, Problem *problem) {
    const bool is_linked = !replaces && link(copying->part, copying->target) == 0;
    if (!is_linked && !replaces && (errno == EEXIST || access(copying->target, F_OK) == 0))
        return refuse_taken(copying, problem);
    if (!is_linked && rename(copying->part, copying->target) != 0)
        return problem_set(problem, STATUS_IO, "%s cannot be written: %s", copying->target,
                           strerror(errno));
    if (is_linked)
        (void)unlink(copying->part);
    copying->part[0] = '\0';
    return data_dir_sync(copying->folder, problem);
}

// SQLite's own message is about the database, not about the copy.
static Status report_full(const Copying *copying, Problem *problem) {
    struct statvfs disk;
    struct stat source;
    if (stat(copying->source, &source) != 0 || statvfs(copying->folder, &disk) != 0)
        return STATUS_FULL;
    problem_clear(problem);
    return problem_set(problem, STATUS_FULL,
                       "there is no room left in %s: a copy takes %llu bytes, %llu are free",
                       copying->folder, (unsigned long long)source.st_size,
                       (unsigned long long)disk.f_bavail * (unsigned long long)disk.f_frsize);
}

// The files next to a database, those of which the names end with `end` too.
static void remove_beside(const char *path, const char *end) {
    static const char *const endings[] = {"-journal", "-wal", "-shm"};
    char name[PATH_MAX + 32];
    for (size_t i = 0; i < sizeof endings / sizeof *endings; i++) {
        snprintf(name, sizeof name, "%s%s%s", path, endings[i], end);
        (void)unlink(name);
    }
}

static Status check_restored_file(const char *path, Problem *problem) {
    struct stat source;
    if (stat(path, &source) != 0)
        return problem_set(problem, errno == ENOENT ? STATUS_NOT_FOUND : STATUS_IO,
                           "%s cannot be read: %s", path, strerror(errno));
    return S_ISREG(source.st_mode)
               ? STATUS_OK
               : problem_set(problem, STATUS_CONFLICT, "%s is not a regular file", path);
}

static Status check_restore(const Copying *copying, Problem *problem) {
    const char *directory = copying->request->directory, *path = copying->source;
    struct stat source, target;
    if (stat(path, &source) != 0 || stat(copying->target, &target) != 0)
        return STATUS_OK;
    if (is_same_file(&source, &target))
        return problem_set(problem, STATUS_CONFLICT,
                           "%s is the server's own database: name a copy of it", path);
    return copying->request->replaces
               ? STATUS_OK
               : problem_set(problem, STATUS_CONFLICT,
                             "%s has a database already: --force replaces it, or --data DIR names "
                             "another folder",
                             directory);
}

// The log of the database that is replaced must not be applied to the new one: it is moved into the
// old one, which thus stays whole until the new one has its name. A log that cannot be moved into
// it, because it is damaged or cannot be read now, is beside it under another name meanwhile.
static void finish_replaced(const char *path) {
    Sqlite *replaced;
    if (access(path, F_OK) == 0 && sqlite_open(path, DATABASE_WRITER, &replaced, NULL) == STATUS_OK)
        sqlite_close(replaced);
}

static void rename_logs(const char *path, const char *from, const char *to) {
    static const char *const endings[] = {"-journal", "-wal"};
    char old_name[PATH_MAX + 32], new_name[PATH_MAX + 32];
    for (size_t i = 0; i < sizeof endings / sizeof *endings; i++) {
        snprintf(old_name, sizeof old_name, "%s%s%s", path, endings[i], from);
        snprintf(new_name, sizeof new_name, "%s%s%s", path, endings[i], to);
        (void)rename(old_name, new_name);
    }
}

static Status replace_restored(Copying *copying, Problem *problem) {
    static const char aside[] = ".replaced";
    finish_replaced(copying->target);
    rename_logs(copying->target, "", aside);
    remove_beside(copying->target, "");
    const Status status = rename_part(copying, true, problem);
    if (copying->part[0] == '\0')
        remove_beside(copying->target, aside);
    else
        rename_logs(copying->target, aside, "");
    return status;
}

static Status backup_copy(const BackupRequest *request, bool is_restore, Backup *backup,
                          Problem *problem) {
    Copying *copying = calloc(1, sizeof *copying);
    *backup = (Backup){0};
    if (copying == NULL)
        return problem_set(problem, STATUS_NO_MEMORY, "no memory for a backup");
    copying->request = request;
    copying->file = -1;
    copying->source = is_restore ? request->path : copying->own;
    copying->target = is_restore ? copying->own : request->path;
    const char *slash = strrchr(request->path, '/');
    snprintf(copying->own, sizeof copying->own, "%.4000s/impactd.db", request->directory);
    if (is_restore)
        snprintf(copying->folder, sizeof copying->folder, "%.4000s", request->directory);
    else
        snprintf(copying->folder, sizeof copying->folder, "%.*s",
                 slash == NULL || slash == request->path ? 1 : (int)(slash - request->path),
                 slash == NULL ? "." : request->path);
    Status status = is_restore ? check_restore(copying, problem) : check_target(copying, problem);
    if (status == STATUS_OK && !is_restore)
        status = check_exists(copying->own, request->directory, problem);
    if (status == STATUS_OK)
        status = fill_part(copying, problem);
    sqlite_close(copying->copy);
    if (status == STATUS_OK)
        status = sync_part(copying, problem);
    if (status == STATUS_OK)
        status = is_restore ? replace_restored(copying, problem)
                            : rename_part(copying, request->replaces, problem);
    if (copying->part[0] != '\0') {
        remove_beside(copying->part, "");
        (void)unlink(copying->part);
    }
    if (copying->file >= 0)
        close(copying->file);
    if (status == STATUS_FULL)
        status = report_full(copying, problem);
    if (status == STATUS_OK)
        *backup = copying->backup;
    free(copying);
    return status;
}

Status backup_write(const BackupRequest *request, Backup *backup, Problem *problem) {
    return backup_copy(request, false, backup, problem);
}

Status backup_restore(const BackupRequest *request, Backup *backup, Problem *problem) {
    int lock;
    TRY(check_restored_file(request->path, problem)); // before a folder is made
    TRY(data_dir_lock(request->directory, &lock, problem));
    const Status status = backup_copy(request, true, backup, problem);
    data_dir_unlock(lock);
    return status;
}
