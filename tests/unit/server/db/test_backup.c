// A copy of the database, stopped at every moment.
#include <dirent.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <unistd.h>

#include "server/db/db_private.h"
#include "server/db/sqlite.h"
#include "tests/support/scratch.h"
#include "tests/support/test.h"

static char data[SCRATCH_SIZE], target[SCRATCH_SIZE];
static Problem problem;

static int folders_make(void **state) {
    (void)state;
    scratch_make(data);
    scratch_make(target);
    return 0;
}

static int folders_remove(void **state) {
    (void)state;
    scratch_remove(data);
    scratch_remove(target);
    return 0;
}

static Db *open_store(const char *folder) {
    Db *db;
    problem_clear(&problem);
    if (db_open(folder, &db, &problem) != STATUS_OK)
        fail_msg("%s", problem.detail);
    return db;
}

static JobRow job_row(unsigned long number) {
    JobRow row = {.state = 2, .created_unix_ms = 1000, .scene = "{}", .warnings = "[]"};
    snprintf(row.id, sizeof row.id, "j-%08lu", number);
    return row;
}

static Status copy(const Progress *watch, Backup *backup) {
    char path[SCRATCH_SIZE + 16];
    snprintf(path, sizeof path, "%s/impactd.db", target);
    problem_clear(&problem);
    return backup_write(&(BackupRequest){data, path, true, watch}, backup, &problem);
}

static size_t files_in(const char *folder) {
    DIR *opened = opendir(folder);
    size_t count = 0;
    for (const struct dirent *one; (one = readdir(opened)) != NULL;)
        count += one->d_name[0] != '.';
    closedir(opened);
    return count;
}

static void write_text(const char *path, const char *text) {
    FILE *file = fopen(path, "w");
    assert_non_null(file);
    fputs(text, file);
    fclose(file);
}

static void read_text(const char *path, char *text, int size) {
    FILE *file = fopen(path, "r");
    assert_non_null(file);
    assert_non_null(fgets(text, size, file));
    fclose(file);
}

static bool stop_at(void *context, double fraction) {
    int *left = context;
    assert_true(fraction >= 0 && fraction <= 1);
    return (*left)-- > 0;
}

TEST_IN(stopped_at_any_moment_it_leaves_nothing, folders_make, folders_remove) {
    enum { TITLE = 60000, JOBS = 40 }; // some steps of copying
    Db *db = open_store(data);
    char *title = calloc(1, TITLE);
    memset(title, 'x', TITLE - 1);
    for (unsigned long number = 0; number < JOBS; number++) {
        JobRow row = job_row(number);
        row.title = title;
        assert_int_equal(db_job_add(db, &row, NULL), STATUS_OK);
    }
    free(title);
    Status status = STATUS_CANCELLED;
    int moment = 0;
    for (; status == STATUS_CANCELLED && moment < 10000; moment++) {
        int left = moment;
        Backup backup;
        status = copy(&(Progress){&left, stop_at}, &backup);
        if (status == STATUS_CANCELLED) {
            assert_int_equal(files_in(target), 0);
            assert_int_equal(backup.jobs, 0);
        }
    }
    assert_int_equal(status, STATUS_OK);
    assert_true(moment > 5);
    assert_int_equal(files_in(target), 1);
    db_close(db);
}

// What the watch of a copy does once, when it has come to `fraction`.
typedef struct Meanwhile {
    double fraction;
    int calls; // since then
    const char *path;
    bool is_folder;
} Meanwhile;

static bool do_meanwhile(void *context, double fraction) {
    Meanwhile *meanwhile = context;
    if (fraction < meanwhile->fraction || meanwhile->calls++ > 0)
        return true;
    if (!meanwhile->is_folder)
        write_text(meanwhile->path, "made meanwhile");
    else if (access(meanwhile->path, F_OK) == 0)
        assert_int_equal(unlink(meanwhile->path), 0);
    if (meanwhile->is_folder)
        assert_int_equal(mkdir(meanwhile->path, 0700), 0);
    return true;
}

static bool stop_in_check(void *context, double fraction) {
    return fraction < 0.8 || ++*(int *)context < 2; // the first one ends the copying
}

static Status apply_sql(Sqlite *database, const void *sql, Problem *fault) {
    return sqlite_execute(database, sql, fault);
}

TEST_IN(stopped_while_it_is_checked_it_leaves_nothing, folders_make, folders_remove) {
    static const char sql[] =
        "CREATE TABLE ballast (number INTEGER PRIMARY KEY); "
        "WITH RECURSIVE n (i) AS (SELECT 1 UNION ALL SELECT i + 1 FROM n WHERE i < 100000) "
        "INSERT INTO ballast SELECT i FROM n";
    Db *db = open_store(data);
    int calls = 0;
    Backup backup;
    assert_int_equal(db_write(db, apply_sql, sql, &problem), STATUS_OK);
    assert_int_equal(copy(&(Progress){&calls, stop_in_check}, &backup), STATUS_CANCELLED);
    assert_int_equal(calls, 2);
    assert_non_null(strstr(problem.detail, "was interrupted"));
    assert_int_equal(files_in(target), 0);
    db_close(db);
}

TEST_IN(what_is_made_under_its_name_meanwhile_stays, folders_make, folders_remove) {
    char path[SCRATCH_SIZE + 16], text[32];
    Meanwhile meanwhile = {.path = path};
    BackupRequest request = {data, path, false, &(Progress){&meanwhile, do_meanwhile}};
    Backup backup;
    snprintf(path, sizeof path, "%s/copy.db", target);
    db_close(open_store(data));
    assert_int_equal(backup_write(&request, &backup, &problem), STATUS_CONFLICT);
    assert_non_null(strstr(problem.detail, "is there already"));
    read_text(path, text, sizeof text);
    assert_string_equal(text, "made meanwhile");
    assert_int_equal(files_in(target), 1);

    request.replaces = true;
    meanwhile = (Meanwhile){.path = path, .is_folder = true};
    problem_clear(&problem);
    assert_int_equal(backup_write(&request, &backup, &problem), STATUS_IO);
    assert_non_null(strstr(problem.detail, "copy.db cannot be written: Is a directory"));
    assert_int_equal(files_in(target), 1);
    assert_int_equal(files_in(path), 0);
}

TEST_IN(a_log_that_cannot_be_restored_over_keeps_its_name, folders_make, folders_remove) {
    char path[SCRATCH_SIZE + 16], own[SCRATCH_SIZE + 16], log[SCRATCH_SIZE + 32], text[32];
    Meanwhile meanwhile = {.path = own, .is_folder = true};
    const BackupRequest request = {data, path, true, &(Progress){&meanwhile, do_meanwhile}};
    Backup backup;
    snprintf(path, sizeof path, "%s/impactd.db", target);
    snprintf(own, sizeof own, "%s/impactd.db", data);
    snprintf(log, sizeof log, "%s-wal", own);
    db_close(open_store(data));
    assert_int_equal(copy(NULL, &backup), STATUS_OK);
    write_text(log, "of the old one");
    assert_int_equal(backup_restore(&request, &backup, &problem), STATUS_IO);
    assert_non_null(strstr(problem.detail, "impactd.db cannot be written"));
    read_text(log, text, sizeof text);
    assert_string_equal(text, "of the old one");
    assert_int_equal(files_in(data), 3); // and the lock's
}

TEST_IN(paths_that_cannot_be_are_refused_with_the_reason, folders_make, folders_remove) {
    char path[SCRATCH_SIZE + 32], long_path[5000];
    BackupRequest request = {data, long_path, false, NULL};
    Backup backup;
    db_close(open_store(data));
    for (size_t i = 0; i + 1 < sizeof long_path; i++)
        long_path[i] = i % 100 == 99 ? '/' : 'a';
    long_path[sizeof long_path - 1] = '\0';
    for (size_t i = 0; i < 2; i++) { // its own, and that of the part
        problem_clear(&problem);
        assert_int_equal(backup_write(&request, &backup, &problem), STATUS_IO);
        assert_non_null(strstr(problem.detail, "cannot be written: File name too long"));
        long_path[4090] = '\0';
    }
    request.path = path;
    snprintf(path, sizeof path, "%s/impactd.lock/copy.db", data);
    problem_clear(&problem);
    assert_int_equal(backup_restore(&request, &backup, &problem), STATUS_IO);
    assert_non_null(strstr(problem.detail, "cannot be read: Not a directory"));
    request.path = target;
    problem_clear(&problem);
    assert_int_equal(backup_restore(&request, &backup, &problem), STATUS_CONFLICT);
    assert_non_null(strstr(problem.detail, "is not a regular file"));
}
