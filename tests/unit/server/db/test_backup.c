// A copy of the database, stopped at every moment.
#include <dirent.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "server/db/db.h"
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
