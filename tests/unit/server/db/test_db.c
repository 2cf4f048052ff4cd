// The store from outside: durable when a call returns, one daemon a folder, seeds, jobs and
// results.
#include "server/db/db.h"

#include <pthread.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <unistd.h>

#include "server/db/sqlite.h"
#include "tests/support/test.h"

static char folder[64];

static int make_folder(void **state) {
    (void)state;
    strcpy(folder, "/tmp/impactd_store_XXXXXX");
    return mkdtemp(folder) == NULL;
}

static int remove_folder(void **state) {
    (void)state;
    char command[128];
    snprintf(command, sizeof command, "rm -rf '%s'", folder);
    return system(command);
}

static Db *open_store(const char *directory) {
    Db *db;
    static Problem problem;
    problem_clear(&problem);
    if (db_open(directory, &db, &problem) != STATUS_OK)
        fail_msg("%s", problem.detail);
    return db;
}

static JobRow job_row(const char *id, int state) {
    JobRow row = {.state = state,
                  .created_unix_ms = 1000,
                  .scene = "{\"a\": 1}",
                  .warnings = "[]",
                  .title = "T"};
    snprintf(row.id, sizeof row.id, "%s", id);
    return row;
}

TEST_IN(a_second_daemon_is_refused_with_the_folders_name, make_folder, remove_folder) {
    Db *db = open_store(folder), *other;
    static Problem problem;
    problem_clear(&problem);
    assert_int_equal(db_open(folder, &other, &problem), STATUS_CONFLICT);
    assert_null(other);
    assert_non_null(strstr(problem.detail, folder));
    db_close(db);
    db_close(open_store(folder));
}

TEST_IN(what_stands_in_the_way_of_a_file_is_reported_with_its_path, make_folder, remove_folder) {
    static const char *const taken[] = {"impactd.lock", "impactd.db"};
    static Problem problem;
    char path[4200], below[128];
    Db *db;
    for (size_t i = 0; i < COUNT(taken); i++) { // folders in place of files
        snprintf(path, sizeof path, "%s/%s", folder, taken[i]);
        assert_int_equal(mkdir(path, 0700), 0);
        problem_clear(&problem);
        assert_int_equal(db_open(folder, &db, &problem), STATUS_IO);
        assert_non_null(strstr(problem.detail, path));
        assert_int_equal(rmdir(path), 0);
    }
    db_close(open_store(folder));
    snprintf(below, sizeof below, "%s/impactd.db/x", folder);
    problem_clear(&problem);
    assert_int_equal(db_open(below, &db, &problem), STATUS_IO);
    assert_non_null(strstr(problem.detail, "cannot make the folder"));
    memset(path, 'a', sizeof path - 1);
    path[sizeof path - 1] = '\0';
    assert_int_equal(db_open(path, &db, &problem), STATUS_IO);
    assert_int_equal(db_open("", &db, &problem), STATUS_IO);
}

TEST_IN(a_missing_folder_is_made_for_this_user_alone, make_folder, remove_folder) {
    char deep[128], file[160];
    snprintf(deep, sizeof deep, "%s/a/b", folder);
    db_close(open_store(deep));
    struct stat about;
    assert_int_equal(stat(deep, &about), 0);
    assert_int_equal(about.st_mode & 0777, 0700);
    snprintf(file, sizeof file, "%s/impactd.db", deep);
    assert_int_equal(stat(file, &about), 0);
    assert_int_equal(about.st_mode & 0777, 0600);
    Db *db;
    assert_int_equal(db_open(file, &db, NULL), STATUS_IO);
    assert_int_equal(db_open("", &db, NULL), STATUS_IO);
}

typedef struct Hammer {
    Db *db;
    int number, failures;
} Hammer;

static void *hammer(void *context) {
    Hammer *own = context;
    for (int i = 0; i < 40; i++) {
        char id[32];
        snprintf(id, sizeof id, "j-%d-%d", own->number, i);
        JobRow row = job_row(id, 0);
        own->failures += db_job_add(own->db, &row, NULL) != STATUS_OK;
        // Every other caller does something that must fail, without effect on the others.
        if (own->number % 2 == 0)
            own->failures += db_job_add(own->db, &row, NULL) != STATUS_CONFLICT;
        own->failures += db_job_load(own->db, id, &row, NULL) != STATUS_OK;
        job_row_clear(&row);
    }
    return NULL;
}

static void hammer_store(const char *directory) {
    Db *db = open_store(directory);
    pthread_t threads[16];
    Hammer hammers[16];
    for (int i = 0; i < 16; i++) {
        hammers[i] = (Hammer){db, i, 0};
        assert_int_equal(pthread_create(&threads[i], NULL, hammer, &hammers[i]), 0);
    }
    for (int i = 0; i < 16; i++) {
        pthread_join(threads[i], NULL);
        assert_int_equal(hammers[i].failures, 0);
    }
    JobRows rows;
    assert_int_equal(db_job_unfinished(db, &rows, NULL), STATUS_OK);
    assert_int_equal(rows.count, 16 * 40);
    job_rows_clear(&rows);
    db_close(db);
}

TEST_IN(a_folder_that_everyone_may_write_to_is_refused, make_folder, remove_folder) {
    Db *db;
    static Problem problem;
    static const struct {
        mode_t mode;
        Status status;
    } cases[] = {{0777, STATUS_FORBIDDEN}, {01777, STATUS_OK}, {0770, STATUS_OK}};
    for (size_t i = 0; i < sizeof cases / sizeof *cases; i++) {
        assert_int_equal(chmod(folder, cases[i].mode), 0);
        problem_clear(&problem);
        assert_int_equal(db_open(folder, &db, &problem), cases[i].status);
        if (cases[i].status == STATUS_OK)
            db_close(db);
        else
            assert_non_null(strstr(problem.detail, "chmod o-w"));
    }
}

TEST_IN(sixteen_threads_write_and_no_failure_spoils_another, make_folder, remove_folder) {
    hammer_store(folder);
    hammer_store(NULL);
}

static const EmbeddedFile two_steps[] = {
    {"schema/sql/001_a.sql", "CREATE TABLE a (x INTEGER) STRICT; INSERT INTO a VALUES (7);", 60,
     ""},
    {"schema/sql/002_b.sql", "ALTER TABLE a ADD COLUMN y INTEGER; UPDATE a SET y = x;", 55, ""},
    {0},
};
static const EmbeddedFile one_step[] = {
    {"schema/sql/001_a.sql", "CREATE TABLE a (x INTEGER) STRICT;", 34, ""}, {0}};
static const EmbeddedFile broken_step[] = {
    {"schema/sql/001_a.sql", "CREATE TABLE a (x INTEGER) STRICT;", 34, ""},
    {"schema/sql/002_b.sql", "CREATE TABLE c (x INTEGER) STRICT; CREATE TABEL d (x);", 54, ""},
    {0},
};

static Sqlite *open_database(const char *name) {
    char path[128];
    Sqlite *database;
    snprintf(path, sizeof path, "%s/%s", folder, name);
    assert_int_equal(sqlite_open(path, DATABASE_WRITER, &database, NULL), STATUS_OK);
    return database;
}

TEST_IN(a_database_is_migrated_from_each_step, make_folder, remove_folder) {
    Sqlite *database = open_database("m.db");
    assert_int_equal(sqlite_migrate(database, one_step, NULL, NULL), STATUS_OK);
    assert_int_equal(sqlite_migrate(database, one_step, NULL, NULL), STATUS_OK);
    assert_int_not_equal(sqlite_migrate(database, broken_step, NULL, NULL), STATUS_OK);
    assert_int_not_equal(sqlite_execute(database, "SELECT * FROM c", NULL), STATUS_OK);
    assert_false(sqlite_is_in_transaction(database));
    assert_int_equal(sqlite_migrate(database, two_steps, NULL, NULL), STATUS_OK);
    assert_int_equal(sqlite_execute(database, "SELECT y FROM a", NULL), STATUS_OK);
    sqlite_close(database);
}

static char *schema_text(Sqlite *database) {
    static const char sql[] = "SELECT group_concat(sql, ';') AS text FROM (SELECT sql FROM "
                              "sqlite_schema WHERE sql IS NOT NULL ORDER BY name)";
    static const SqlColumn columns[] = {{.name = "text", .kind = COLUMN_TEXT}, COLUMN_END};
    char *text = NULL;
    bool is_found;
    assert_int_equal(sqlite_first(database, sql, NULL, NULL, columns, &text, &is_found, NULL),
                     STATUS_OK);
    return text;
}

TEST_IN(a_database_of_each_step_since_the_first_schema_gets_the_schema_of_a_new_one, make_folder,
        remove_folder) {
    enum { STEPS_MAX = 100 };
    size_t last = 0;
    while (embedded_sql[last].path != NULL)
        last++;
    assert_in_range(last, 1, STEPS_MAX);
    Sqlite *database = open_database("new.db");
    assert_int_equal(sqlite_migrate(database, embedded_sql, NULL, NULL), STATUS_OK);
    char *expected = schema_text(database);
    sqlite_close(database);
    for (size_t step = 0; step <= last; step++) {
        EmbeddedFile steps[STEPS_MAX + 1] = {0};
        char name[16];
        memcpy(steps, embedded_sql, step * sizeof *steps);
        snprintf(name, sizeof name, "%zu.db", step);
        database = open_database(name);
        assert_int_equal(sqlite_migrate(database, steps, NULL, NULL), STATUS_OK);
        assert_int_equal(sqlite_migrate(database, embedded_sql, NULL, NULL), STATUS_OK);
        char *text = schema_text(database);
        assert_string_equal(text, expected);
        free(text);
        sqlite_close(database);
    }
    free(expected);
}

TEST_IN(an_older_database_is_refused_with_what_to_do, make_folder, remove_folder) {
    static const char *const older[] = {"ALTER TABLE tokens DROP COLUMN checks",
                                        "ALTER TABLE jobs RENAME COLUMN title TO name",
                                        "DROP TABLE sweep_chunks"};
    static Problem problem;
    for (size_t i = 0; i < COUNT(older); i++) {
        Db *db;
        db_close(open_store(folder));
        Sqlite *database = open_database("impactd.db");
        assert_int_equal(sqlite_execute(database, older[i], NULL), STATUS_OK);
        sqlite_close(database);
        problem_clear(&problem);
        assert_int_equal(db_open(folder, &db, &problem), STATUS_CONFLICT);
        assert_non_null(strstr(problem.detail, "before the first release"));
        assert_non_null(strstr(problem.detail, "use another folder"));
        assert_int_equal(remove_folder(NULL), 0);
        assert_int_equal(make_folder(NULL), 0);
    }
}

TEST_IN(a_newer_database_and_an_impossible_version_are_refused, make_folder, remove_folder) {
    static Problem problem;
    problem_clear(&problem);
    Sqlite *database = open_database("impactd.db");
    assert_int_equal(sqlite_migrate(database, two_steps, NULL, NULL), STATUS_OK);
    assert_int_equal(sqlite_migrate(database, one_step, NULL, &problem), STATUS_CONFLICT);
    assert_non_null(strstr(problem.detail, "newer"));
    assert_non_null(strstr(problem.detail, folder));
    assert_int_equal(sqlite_execute(database, "PRAGMA user_version = -1", NULL), STATUS_OK);
    problem_clear(&problem);
    assert_int_equal(sqlite_migrate(database, two_steps, NULL, &problem), STATUS_CONFLICT);
    assert_non_null(strstr(problem.detail, "damaged"));
    sqlite_close(database);
}

TEST_IN(a_database_of_another_program_is_refused_and_left_alone, make_folder, remove_folder) {
    char command[256];
    snprintf(command, sizeof command,
             "python3 -c \"import sqlite3; c = sqlite3.connect('%s/impactd.db'); c.execute('CREATE "
             "TABLE t (x)')\"",
             folder);
    assert_int_equal(system(command), 0);
    Db *db;
    static Problem problem;
    problem_clear(&problem);
    assert_int_equal(db_open(folder, &db, &problem), STATUS_CONFLICT);
    assert_non_null(strstr(problem.detail, "another program"));
    snprintf(command, sizeof command, "head -c 5000 /dev/urandom > %s/impactd.db", folder);
    assert_int_equal(system(command), 0);
    problem_clear(&problem);
    assert_int_equal(db_open(folder, &db, &problem), STATUS_IO);
    assert_non_null(strstr(problem.detail, "impactd.db is damaged"));
    assert_non_null(strstr(problem.detail, "to start with a new database"));
}

static void note_done(void *context, Status status, const char *detail) {
    (void)detail;
    *(Status *)context = status;
}

TEST_IN(series_are_kept_under_a_budget_and_the_longest_unused_goes, make_folder, remove_folder) {
    Db *db = open_store(folder);
    static Status statuses[5];
    char *body, id[8];
    size_t size;
    for (size_t i = 0; i < 4; i++) {
        const WriteDone done = {note_done, &statuses[i]};
        body = malloc(1000);
        assert_non_null(body);
        memset(body, 'a' + (int)i, 1000);
        snprintf(id, sizeof id, "r-%zu", i);
        assert_int_equal(db_series_post(db, id, body, 1000, 3500, &done), STATUS_OK);
        // What is low waits for all else, so one that waits comes behind it.
        while (!db_series_exists(db, id))
            ;
        if (i == 2) {
            assert_int_equal(db_series_load(db, "r-0", &body, &size, NULL), STATUS_OK);
            assert_int_equal(size, 1000);
            assert_int_equal(body[999], 'a');
            free(body);
        }
    }
    assert_true(db_series_exists(db, "r-0"));
    assert_false(db_series_exists(db, "r-1"));
    assert_true(db_series_exists(db, "r-2") && db_series_exists(db, "r-3"));
    uint64_t count, bytes, evictions;
    db_series_stats(db, &count, &bytes, &evictions);
    assert_int_equal(count, 3);
    assert_int_equal(bytes, 3000);
    assert_int_equal(evictions, 1);
    const WriteDone done = {note_done, &statuses[4]};
    assert_int_equal(db_series_post(db, "r-9", malloc(9000), 9000, 3500, &done), STATUS_LIMIT);
    assert_int_equal(db_series_load(db, "r-9", &body, &size, NULL), STATUS_NOT_FOUND);
    db_close(db);
}

// Jobs go until the database is small enough, or none is left.
TEST(jobs_are_removed_while_the_database_is_too_large) {
    enum { TITLE = 60000, JOBS = 40 };
    Db *db = open_store(NULL);
    char *title = calloc(1, TITLE), id[16];
    JobRow row;
    Removed removed;
    size_t gone = 0;
    memset(title, 'x', TITLE - 1);
    for (int i = 0; i < JOBS; i++) {
        snprintf(id, sizeof id, "j-%d", i);
        row = job_row(id, i == 0 ? 0 : 2);
        row.title = title;
        row.created_unix_ms = 1000 + i;
        assert_int_equal(db_job_add(db, &row, NULL), STATUS_OK);
    }
    do {
        assert_int_equal(db_remove(db, &(KeepRules){.bytes = JOBS / 2 * TITLE}, &removed, NULL),
                         STATUS_OK);
        gone += removed.jobs;
    } while (removed.is_more);
    assert_in_range(gone, JOBS / 4, JOBS - 1);
    for (gone = 0; db_remove(db, &(KeepRules){.bytes = 1}, &removed, NULL) == STATUS_OK;) {
        gone += removed.jobs;
        if (!removed.is_more)
            break;
    }
    JobRow first;
    assert_int_equal(db_job_load(db, "j-0", &first, NULL), STATUS_OK); // it is not finished
    job_row_clear(&first);
    assert_int_equal(db_job_load(db, "j-39", &first, NULL), STATUS_NOT_FOUND);
    free(title);
    db_close(db);
}

static void note_fault(void *context, Status status, const char *detail) {
    assert_int_equal(status, STATUS_TOO_LARGE);
    text_fit(context, 200, detail);
}

TEST(a_series_of_more_than_a_billion_bytes_is_not_stored) {
    Db *db = open_store(NULL);
    const size_t size = 1000000001;
    char detail[200] = "", *body = malloc(size); // never touched
    if (body == NULL)
        skip();
    assert_int_equal(
        db_series_post(db, "r-1", body, size, 2 * size, &(WriteDone){note_fault, detail}),
        STATUS_OK);
    db_close(db);
    assert_string_equal(detail, "body is too long to be stored; must be at most a billion bytes");
}

TEST(a_job_that_is_not_there_is_not_changed) {
    Db *db = open_store(NULL);
    const JobRow row = job_row("j-1", 2);
    Removed removed;
    Problem problem;
    problem_clear(&problem);
    assert_int_equal(db_job_update(db, &row, &problem), STATUS_NOT_FOUND);
    assert_string_equal(problem.detail, "there is no job \"j-1\"");
    assert_int_equal(db_job_annotate(db, &(JobNotes){.id = "j-1", .title = "T"}, NULL),
                     STATUS_NOT_FOUND);
    assert_int_equal(db_job_remove(db, "j-1", &removed, NULL), STATUS_NOT_FOUND);
    db_close(db);
}
