// The store from outside: durable when a call returns, one daemon a folder, seeds, jobs and
// results.
#include "server/db/db.h"
#include "server/db/materials.h"

#include <pthread.h>
#include <signal.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/resource.h>
#include <sys/stat.h>
#include <sys/wait.h>
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

TEST(the_papers_materials_are_there) {
    Db *db = open_store(NULL);
    MaterialRevisions materials;
    assert_int_equal(db_material_heads(db, "", 100, &materials, NULL), STATUS_OK);
    assert_int_equal(materials.count, 5);
    assert_string_equal(materials.at[0].slug, "aluminium");
    material_revisions_clear(&materials);

    MaterialRevision sponge;
    assert_int_equal(db_material(db, "sponge", 0, &sponge, NULL), STATUS_OK);
    assert_string_equal(sponge.material.name, "Sponge");
    assert_string_equal(sponge.status, "approved");
    assert_string_equal(sponge.material.source, "doi:10.1002/stc.238, Table I");
    assert_int_equal(sponge.revision, 1);
    assert_true(sponge.material.restitution == 0.61 && sponge.material.contact_time == 0.025);
    material_revision_clear(&sponge);
    assert_int_equal(db_material(db, "sponge", 1, &sponge, NULL), STATUS_OK);
    material_revision_clear(&sponge);
    assert_int_equal(db_material(db, "sponge", 2, &sponge, NULL), STATUS_NOT_FOUND);
    assert_int_equal(db_material(db, "sponge", UINT64_MAX, &sponge, NULL), STATUS_NOT_FOUND);
    assert_int_equal(db_material(db, "spong", 0, &sponge, NULL), STATUS_NOT_FOUND);
    assert_int_equal(db_material(db, "", 0, &sponge, NULL), STATUS_NOT_FOUND);
    db_close(db);
}

TEST_IN(jobs_survive_closing_and_are_listed_newest_first, make_folder, remove_folder) {
    Db *db = open_store(folder);
    JobRow row;
    const char *const ids[] = {"j-1", "j-2", "j-3"};
    for (size_t i = 0; i < 3; i++) {
        row = job_row(ids[i], 0);
        assert_int_equal(db_job_add(db, &row, NULL), STATUS_OK);
    }
    assert_int_equal(db_job_add(db, &row, NULL), STATUS_CONFLICT);
    row = job_row("j-2", 3);
    row.problem = "{\"status\": 500}";
    row.finished_unix_ms = 2000;
    row.run = 0.25;
    assert_int_equal(db_job_update(db, &row, NULL), STATUS_OK);
    row = job_row("j-9", 3);
    assert_int_equal(db_job_update(db, &row, NULL), STATUS_NOT_FOUND);
    db_close(db);

    db = open_store(folder);
    assert_int_equal(db_job_load(db, "j-2", &row, NULL), STATUS_OK);
    assert_int_equal(row.state, 3);
    assert_string_equal(row.problem, "{\"status\": 500}");
    assert_string_equal(row.title, "T");
    assert_int_equal(row.created_unix_ms, 1000);
    assert_true(row.run == 0.25);
    job_row_clear(&row);
    assert_int_equal(db_job_load(db, "j-9", &row, NULL), STATUS_NOT_FOUND);

    JobRows rows;
    JobSearch search = job_search_all(2);
    assert_int_equal(db_job_search(db, &search, &rows, NULL), STATUS_OK);
    assert_int_equal(rows.count, 2);
    assert_string_equal(rows.at[0].id, "j-3");
    assert_string_equal(rows.at[1].id, "j-2");
    job_rows_clear(&rows);
    search.before = "j-2";
    assert_int_equal(db_job_search(db, &search, &rows, NULL), STATUS_OK);
    assert_int_equal(rows.count, 1);
    assert_string_equal(rows.at[0].id, "j-1");
    job_rows_clear(&rows);
    search.before = "j-9";
    assert_int_equal(db_job_search(db, &search, &rows, NULL), STATUS_NOT_FOUND);
    assert_int_equal(rows.count, 0);

    assert_int_equal(db_job_unfinished(db, &rows, NULL), STATUS_OK);
    assert_int_equal(rows.count, 2);
    assert_string_equal(rows.at[0].id, "j-1");
    assert_string_equal(rows.at[0].scene, "{\"a\": 1}");
    assert_string_equal(rows.at[1].id, "j-3");
    job_rows_clear(&rows);
    db_close(db);
}

static ResultRow result_row(const char *id) {
    ResultRow row = {.engine = "e",
                     .scene = "{}",
                     .plan = "{}",
                     .summary = "{\"a\": 1}",
                     .warnings = "[]",
                     .notes = "[2]",
                     .outcome = {"x", 1},
                     .count = 11,
                     .sample_rate = 10};
    snprintf(row.id, sizeof row.id, "%s", id);
    return row;
}

TEST_IN(a_result_and_its_jobs_are_saved_together_or_not_at_all, make_folder, remove_folder) {
    Db *db = open_store(folder);
    JobRow first = job_row("j-1", 0), second = job_row("j-2", 0);
    assert_int_equal(db_job_add(db, &first, NULL), STATUS_OK);
    first.state = second.state = 2;
    first.next = &second;
    ResultRow result = result_row("r-1");
    assert_int_equal(db_result_save(db, &result, &first, NULL), STATUS_NOT_FOUND);
    assert_false(db_result_exists(db, "r-1"));
    JobRow loaded;
    assert_int_equal(db_job_load(db, "j-1", &loaded, NULL), STATUS_OK);
    assert_int_equal(loaded.state, 0);
    job_row_clear(&loaded);

    first.next = NULL;
    assert_int_equal(db_result_save(db, &result, &first, NULL), STATUS_OK);
    assert_true(db_result_exists(db, "r-1"));
    result.summary = "other";
    assert_int_equal(db_result_save(db, &result, &first, NULL), STATUS_OK);
    ResultRow found;
    assert_int_equal(db_result_load(db, "r-1", &found, NULL), STATUS_OK);
    assert_string_equal(found.summary, "{\"a\": 1}");
    assert_int_equal(found.count, 11);
    result_row_clear(&found);
    assert_int_equal(db_result_head(db, "r-1", &found, NULL), STATUS_OK);
    assert_string_equal(found.summary, "{\"a\": 1}");
    assert_string_equal(found.notes, "[2]");
    assert_null(found.scene);
    result_row_clear(&found);
    assert_int_equal(db_result_load(db, "r-2", &found, NULL), STATUS_NOT_FOUND);
    db_close(db);
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
        // Every other caller does something that must fail, and nobody else may notice.
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

TEST_IN(what_was_acknowledged_survives_kill_9, make_folder, remove_folder) {
    for (int round = 0; round < 3; round++) {
        int pipe_ends[2];
        assert_int_equal(pipe(pipe_ends), 0);
        const pid_t child = fork();
        assert_true(child >= 0);
        if (child == 0) {
            Db *db;
            if (db_open(folder, &db, NULL) != STATUS_OK)
                _exit(1);
            for (int i = 0;; i++) {
                char id[40] = {0};
                snprintf(id, sizeof id, "j-%d-%d", round, i);
                JobRow row = job_row(id, 0);
                if (db_job_add(db, &row, NULL) != STATUS_OK ||
                    write(pipe_ends[1], id, sizeof id) < 0)
                    _exit(1);
            }
        }
        close(pipe_ends[1]);
        char next[40];
        int count = 0;
        while (count < 50 && read(pipe_ends[0], next, sizeof next) == (ssize_t)sizeof next)
            count++;
        assert_int_equal(count, 50);
        kill(child, SIGKILL);
        waitpid(child, NULL, 0);
        while (read(pipe_ends[0], next, sizeof next) == (ssize_t)sizeof next)
            count++;
        close(pipe_ends[0]);

        Db *db = open_store(folder);
        for (int i = 0; i < count; i++) {
            char id[40];
            snprintf(id, sizeof id, "j-%d-%d", round, i);
            JobRow row;
            assert_int_equal(db_job_load(db, id, &row, NULL), STATUS_OK);
            job_row_clear(&row);
        }
        db_close(db);
    }
}

// A limit on file sizes stands in for a full disk: writes fail the same way, for one process alone.
TEST_IN(a_full_disk_is_told_and_what_was_there_stays, make_folder, remove_folder) {
    const pid_t child = fork();
    assert_true(child >= 0);
    if (child == 0) {
        signal(SIGXFSZ, SIG_IGN);
        Db *db = open_store(folder);
        JobRow row = job_row("j-0", 0);
        if (db_job_add(db, &row, NULL) != STATUS_OK)
            _exit(1);
        setrlimit(RLIMIT_FSIZE, &(struct rlimit){2 << 20, 2 << 20});
        char *scene = calloc(1, 200001);
        memset(scene, ' ', 200000);
        Status status = STATUS_OK;
        for (int i = 1; i < 100 && status == STATUS_OK; i++) {
            snprintf(row.id, sizeof row.id, "j-%d", i);
            row.scene = scene;
            status = db_job_add(db, &row, NULL);
        }
        if (status != STATUS_FULL)
            _exit(2);
        row = job_row("j-after", 0);
        if (db_job_load(db, "j-0", &row, NULL) != STATUS_OK)
            _exit(3);
        _exit(0);
    }
    int ended;
    waitpid(child, &ended, 0);
    assert_true(WIFEXITED(ended));
    assert_int_equal(WEXITSTATUS(ended), 0);
    Db *db = open_store(folder);
    JobRow row;
    assert_int_equal(db_job_load(db, "j-0", &row, NULL), STATUS_OK);
    job_row_clear(&row);
    db_close(db);
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
    assert_int_equal(sqlite_migrate(database, one_step, NULL), STATUS_OK);
    assert_int_equal(sqlite_migrate(database, one_step, NULL), STATUS_OK);
    assert_int_not_equal(sqlite_migrate(database, broken_step, NULL), STATUS_OK);
    assert_int_not_equal(sqlite_execute(database, "SELECT * FROM c", NULL), STATUS_OK);
    assert_false(sqlite_is_in_transaction(database));
    assert_int_equal(sqlite_migrate(database, two_steps, NULL), STATUS_OK);
    assert_int_equal(sqlite_execute(database, "SELECT y FROM a", NULL), STATUS_OK);
    sqlite_close(database);
}

TEST_IN(a_newer_database_and_an_impossible_version_are_refused, make_folder, remove_folder) {
    static Problem problem;
    problem_clear(&problem);
    Sqlite *database = open_database("impactd.db");
    assert_int_equal(sqlite_migrate(database, two_steps, NULL), STATUS_OK);
    assert_int_equal(sqlite_migrate(database, one_step, &problem), STATUS_CONFLICT);
    assert_non_null(strstr(problem.detail, "newer"));
    assert_non_null(strstr(problem.detail, folder));
    assert_int_equal(sqlite_execute(database, "PRAGMA user_version = -1", NULL), STATUS_OK);
    problem_clear(&problem);
    assert_int_equal(sqlite_migrate(database, two_steps, &problem), STATUS_CONFLICT);
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
    assert_non_null(strstr(problem.detail, "to begin anew"));
}

TEST_IN(revisions_of_materials_never_change, make_folder, remove_folder) {
    db_close(open_store(folder));
    Sqlite *database = open_database("impactd.db");
    assert_int_equal(
        sqlite_execute(database, "UPDATE material_revisions SET restitution = 0.5", NULL),
        STATUS_CONFLICT);
    assert_int_equal(sqlite_execute(database, "DELETE FROM material_revisions", NULL),
                     STATUS_CONFLICT);
    assert_int_equal(
        sqlite_execute(
            database,
            "INSERT INTO material_revisions (material, revision, name, restitution, source, "
            "comment, created_unix_ms) VALUES (1, 2, 'Sponge', 0.7, 'x', 'y', 0);"
            "INSERT INTO material_revisions (material, revision, name, restitution, source, "
            "comment, created_unix_ms) VALUES (1, 3, 'Sponge', 0.8, 'x', 'y', 0);"
            "INSERT INTO material_reviews (material, revision, status, reason, "
            "created_unix_ms) VALUES (1, 2, 'approved', 'better', 0)",
            NULL),
        STATUS_OK);
    sqlite_close(database);
    Db *db = open_store(folder);
    MaterialRevision sponge;
    assert_int_equal(db_material(db, "sponge", 0, &sponge, NULL), STATUS_OK);
    assert_int_equal(sponge.revision, 2);
    assert_true(isnan(sponge.material.contact_time));
    material_revision_clear(&sponge);
    assert_int_equal(db_material(db, "sponge", 3, &sponge, NULL), STATUS_OK);
    assert_string_equal(sponge.status, "draft");
    material_revision_clear(&sponge);
    db_close(db);
}

static void note_done(void *context, Status status, const char *detail) {
    (void)detail;
    *(Status *)context = status;
}

TEST_IN(series_are_kept_under_a_budget_and_the_longest_unused_goes, make_folder, remove_folder) {
    Db *db = open_store(folder);
    static Status told[5];
    char *body, id[8];
    size_t size;
    for (size_t i = 0; i < 4; i++) {
        const WriteDone done = {note_done, &told[i]};
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
    db_series_tally(db, &count, &bytes, &evictions);
    assert_int_equal(count, 3);
    assert_int_equal(bytes, 3000);
    assert_int_equal(evictions, 1);
    const WriteDone done = {note_done, &told[4]};
    assert_int_equal(db_series_post(db, "r-9", malloc(9000), 9000, 3500, &done), STATUS_LIMIT);
    assert_int_equal(db_series_load(db, "r-9", &body, &size, NULL), STATUS_NOT_FOUND);
    db_close(db);
}
