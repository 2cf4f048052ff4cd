// Records as they are stored: whole, unchanged, shared in memory, and kept as long as they are
// used.
#include "server/db/records.h"

#include <pthread.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "server/db/sqlite.h"
#include "tests/support/scratch.h"
#include "tests/support/test.h"

static Problem problem;
static char folder[SCRATCH_SIZE];

static Db *db_make(void) {
    Db *db;
    scratch_make(folder);
    problem_clear(&problem);
    if (db_open(folder, &db, &problem) != STATUS_OK)
        fail_msg("%s", problem.detail);
    return db;
}

static void db_end(Db *db) {
    db_close(db);
    scratch_remove(folder);
}

// A record whose first sample is `first`.
static Status add(Db *db, const char *name, double first, const char *source, bool *is_there) {
    double values[] = {first, -2, 0.5};
    const Reals samples = {values, 3};
    char digest[RECORD_DIGEST_SIZE];
    record_digest(0.02, &samples, digest);
    const RecordRow row = {.name = (char *)name,
                           .source = (char *)source,
                           .layout = "json",
                           .unit = "m/s^2",
                           .interval = 0.02,
                           .count = 3,
                           .peak = 2,
                           .digest = digest,
                           .created_unix_ms = 1000};
    problem_clear(&problem);
    return db_record_add(db, &row, &samples, is_there, &problem);
}

static void add_new(Db *db, const char *name, double first) {
    bool is_there = true;
    if (add(db, name, first, NULL, &is_there) != STATUS_OK)
        fail_msg("%s", problem.detail);
    assert_false(is_there);
}

TEST(a_record_comes_back_to_the_bit) {
    Db *db = db_make();
    NamedRecord *named, *again;
    RecordRow row;
    add_new(db, "elcentro", 0.1);
    assert_int_equal(db_record(db, "elcentro", &row, &problem), STATUS_OK);
    assert_true(row.count == 3 && row.interval == 0.02 && row.peak == 2);
    assert_null(row.author);
    record_row_clear(&row);
    assert_int_equal(db_record_named(db, "elcentro", &named, &problem), STATUS_OK);
    assert_true(named->samples.count == 3 && named->interval == 0.02);
    assert_true(named->samples.at[0] == 0.1 && named->samples.at[2] == 0.5);
    // Others share them, also when something else came in between.
    add_new(db, "other", 0.2);
    assert_int_equal(db_record_named(db, "elcentro", &again, &problem), STATUS_OK);
    assert_ptr_equal(named, again);
    refcount_unref(&named->shared);
    refcount_unref(&again->shared);
    assert_int_equal(db_record_named(db, "elcentr", &named, &problem), STATUS_NOT_FOUND);
    assert_null(named);
    db_end(db);
}

TEST(what_is_there_already_is_told_from_what_would_change_it) {
    Db *db = db_make();
    bool is_there = false;
    add_new(db, "elcentro", 0.1);
    assert_int_equal(add(db, "elcentro", 0.1, NULL, &is_there), STATUS_OK);
    assert_true(is_there);
    assert_int_equal(add(db, "elcentro", 0.2, NULL, &is_there), STATUS_CONFLICT);
    assert_non_null(strstr(problem.detail, "samples"));
    assert_int_equal(add(db, "elcentro", 0.1, "PEER", &is_there), STATUS_CONFLICT);
    assert_non_null(strstr(problem.detail, "another source"));
    RecordRow row;
    assert_int_equal(db_record(db, "elcentro", &row, &problem), STATUS_OK);
    assert_null(row.source);
    RecordRows twins;
    assert_int_equal(db_record_twins(db, &row, &twins, &problem), STATUS_OK);
    assert_int_equal(twins.count, 0);
    add_new(db, "same", 0.1);
    assert_int_equal(db_record_twins(db, &row, &twins, &problem), STATUS_OK);
    assert_int_equal(twins.count, 1);
    assert_string_equal(twins.at[0].name, "same");
    record_rows_clear(&twins);
    record_row_clear(&row);
    db_end(db);
}

TEST(a_list_goes_on_behind_a_name_and_searches_words) {
    static const char *const names[] = {"b", "a", "C", "d"};
    Db *db = db_make();
    RecordRows rows;
    bool is_there;
    for (size_t i = 0; i < COUNT(names); i++)
        assert_int_equal(
            add(db, names[i], (double)i, i == 3 ? "The Imperial Valley" : NULL, &is_there),
            STATUS_OK);
    assert_int_equal(db_records(db, NULL, "", 2, &rows, &problem), STATUS_OK);
    assert_int_equal(rows.count, 2);
    assert_string_equal(rows.at[0].name, "C");
    assert_string_equal(rows.at[1].name, "a");
    record_rows_clear(&rows);
    assert_int_equal(db_records(db, NULL, "a", 9, &rows, &problem), STATUS_OK);
    assert_int_equal(rows.count, 2);
    record_rows_clear(&rows);
    assert_int_equal(db_records(db, "imperial", "", 9, &rows, &problem), STATUS_OK);
    assert_int_equal(rows.count, 1);
    assert_string_equal(rows.at[0].name, "d");
    record_rows_clear(&rows);
    assert_int_equal(db_records(db, "%", "", 9, &rows, &problem), STATUS_OK);
    assert_int_equal(rows.count, 0);
    record_rows_clear(&rows);
    db_end(db);
}

static JobRow job_add(Db *db, const char *id, int state, const char *uses) {
    JobRow row = {.state = state, .scene = "{}", .warnings = "[]", .uses = (char *)uses};
    snprintf(row.id, sizeof row.id, "%s", id);
    assert_int_equal(db_job_add(db, &row, &problem), STATUS_OK);
    return row;
}

TEST(a_record_in_use_is_not_deleted) {
    Db *db = db_make();
    RecordUses uses;
    NamedRecord *named;
    add_new(db, "elcentro", 0.1);
    add_new(db, "kobe", 0.3);
    JobRow job = job_add(db, "j-1", 0, "record:elcentro\nrecord:kobe\nrecord:elcentro\n");
    job_add(db, "j-2", 2, "record:elcentro\n");
    ResultRow result = {.id = "r-1",
                        .engine = "e",
                        .scene = "{}",
                        .plan = "{}",
                        .summary = "{}",
                        .warnings = "[]",
                        .outcome = {"x", 1},
                        .uses = "sponge@1\nrecord:elcentro\n"};
    assert_int_equal(db_result_save(db, &result, NULL, &problem), STATUS_OK);
    assert_int_equal(db_record_uses(db, "elcentro", &uses, &problem), STATUS_OK);
    assert_true(uses.results == 1 && uses.jobs == 1);
    assert_int_equal(db_record_delete(db, "kobe", &uses, NULL), STATUS_CONFLICT);
    assert_true(uses.results == 0 && uses.jobs == 1);
    problem_clear(&problem);
    assert_int_equal(db_record_delete(db, "elcentro", &uses, &problem), STATUS_CONFLICT);
    assert_true(uses.results == 1 && uses.jobs == 1);
    assert_non_null(strstr(problem.detail, "1 result and 1 unfinished job:"));
    // A job that has ended uses nothing any more.
    job.state = 3;
    assert_int_equal(db_job_update(db, &job, &problem), STATUS_OK);
    assert_int_equal(db_record_uses(db, "elcentro", &uses, &problem), STATUS_OK);
    assert_true(uses.results == 1 && uses.jobs == 0);
    assert_int_equal(db_record_delete(db, "kobe", &uses, &problem), STATUS_OK);
    assert_int_equal(db_record_named(db, "kobe", &named, NULL), STATUS_NOT_FOUND);
    assert_int_equal(db_record_delete(db, "kobe", &uses, NULL), STATUS_NOT_FOUND);
    // The name is free, and means the new samples at once.
    add_new(db, "kobe", 0.7);
    assert_int_equal(db_record_named(db, "kobe", &named, &problem), STATUS_OK);
    assert_true(named->samples.at[0] == 0.7);
    refcount_unref(&named->shared);
    db_end(db);
}

TEST(nothing_written_beside_the_daemon_changes_a_record) {
    static const char *const attempts[] = {
        "UPDATE records SET peak = 0",
        "UPDATE records SET name = 'x'",
        "UPDATE record_samples SET samples = x'00'",
        "DELETE FROM record_samples",
        "REPLACE INTO record_samples (number, samples) SELECT number, x'00' FROM records",
        "REPLACE INTO records SELECT * FROM records",
        "INSERT OR REPLACE INTO records (name, layout, unit, interval, count, peak, peak_time, "
        "peak_velocity, end_velocity, digest, created_unix_ms) SELECT name, layout, unit, 1, "
        "count, 0, 0, 0, 0, digest, 0 FROM records",
        "INSERT INTO records (number, name, layout, unit, interval, count, peak, peak_time, "
        "peak_velocity, end_velocity, digest, created_unix_ms) SELECT number, name, layout, unit, "
        "1, count, 0, 0, 0, 0, digest, 0 FROM records WHERE true ON CONFLICT DO UPDATE SET peak = "
        "0",
        "DELETE FROM records",
    };
    Db *db = db_make();
    char path[SCRATCH_SIZE + 16];
    Sqlite *database;
    NamedRecord *named;
    add_new(db, "elcentro", 0.1);
    ResultRow result = {.id = "r-1",
                        .engine = "e",
                        .scene = "{}",
                        .plan = "{}",
                        .summary = "{}",
                        .warnings = "[]",
                        .outcome = {"x", 1},
                        .uses = "record:elcentro\n"};
    assert_int_equal(db_result_save(db, &result, NULL, &problem), STATUS_OK);
    db_close(db);
    snprintf(path, sizeof path, "%s/impactd.db", folder);
    assert_int_equal(sqlite_open(path, DATABASE_WRITER, &database, &problem), STATUS_OK);
    for (size_t i = 0; i < COUNT(attempts); i++) {
        problem_clear(&problem);
        if (sqlite_execute(database, attempts[i], &problem) == STATUS_OK)
            fail_msg("%s", attempts[i]);
        if (strstr(problem.detail, "record") == NULL)
            fail_msg("%s: %s", attempts[i], problem.detail);
    }
    sqlite_close(database);
    problem_clear(&problem);
    assert_int_equal(db_open(folder, &db, &problem), STATUS_OK);
    assert_int_equal(db_record_named(db, "elcentro", &named, &problem), STATUS_OK);
    assert_true(named->interval == 0.02 && named->samples.at[0] == 0.1);
    refcount_unref(&named->shared);
    db_end(db);
}

TEST(there_are_only_so_many) {
    static const char many[] =
        "WITH RECURSIVE n (i) AS (SELECT 1 UNION ALL SELECT i + 1 FROM n WHERE i < 20000) INSERT "
        "INTO records (name, layout, unit, interval, count, peak, peak_time, peak_velocity, "
        "end_velocity, digest, created_unix_ms) SELECT 'n' || i, 'json', 'g', 1, 1, 0, 0, 0, 0, "
        "printf('%064d', i), 0 FROM n";
    static const char huge[] =
        "INSERT INTO records (name, layout, unit, interval, count, peak, peak_time, "
        "peak_velocity, end_velocity, digest, created_unix_ms) SELECT 'huge', 'json', 'g', 1, "
        "2147483645 - sum(count), 0, 0, 0, 0, printf('%064d', 0), 0 FROM records";
    char path[SCRATCH_SIZE + 16];
    Db *db = db_make();
    Sqlite *database;
    RecordUses uses;
    bool is_there;
    snprintf(path, sizeof path, "%s/impactd.db", folder);
    assert_int_equal(sqlite_open(path, DATABASE_WRITER, &database, &problem), STATUS_OK);
    assert_int_equal(sqlite_execute(database, many, &problem), STATUS_OK);
    assert_int_equal(add(db, "one_more", 1, NULL, &is_there), STATUS_LIMIT);
    assert_non_null(strstr(problem.detail, "20000 records"));
    for (int i = 1; i <= 3; i++) {
        char name[16];
        snprintf(name, sizeof name, "n%d", i);
        assert_int_equal(db_record_delete(db, name, &uses, &problem), STATUS_OK);
    }
    // Now there is room for two, and for three samples.
    assert_int_equal(sqlite_execute(database, huge, &problem), STATUS_OK);
    add_new(db, "three", 1);
    assert_int_equal(db_record_delete(db, "n4", &uses, &problem), STATUS_OK);
    assert_int_equal(add(db, "three_more", 2, NULL, &is_there), STATUS_LIMIT);
    assert_non_null(strstr(problem.detail, "2147483648"));
    sqlite_close(database);
    db_end(db);
}

typedef struct Racer {
    Db *db;
    pthread_t thread;
    Status status;
    bool is_there;
} Racer;

static void *race(void *of) {
    Racer *racer = of;
    double values[] = {0.1, -2, 0.5};
    const Reals samples = {values, 3};
    char digest[RECORD_DIGEST_SIZE];
    record_digest(0.02, &samples, digest);
    const RecordRow row = {.name = "same",
                           .layout = "json",
                           .unit = "m/s^2",
                           .interval = 0.02,
                           .count = 3,
                           .digest = digest};
    racer->status = db_record_add(racer->db, &row, &samples, &racer->is_there, NULL);
    return NULL;
}

TEST(of_two_same_uploads_at_once_one_is_kept) {
    Db *db = db_make();
    Racer racers[8];
    size_t kept = 0;
    for (size_t i = 0; i < COUNT(racers); i++) {
        racers[i] = (Racer){.db = db};
        assert_int_equal(pthread_create(&racers[i].thread, NULL, race, &racers[i]), 0);
    }
    for (size_t i = 0; i < COUNT(racers); i++) {
        pthread_join(racers[i].thread, NULL);
        assert_int_equal(racers[i].status, STATUS_OK);
        kept += !racers[i].is_there;
    }
    assert_int_equal(kept, 1);
    db_end(db);
}

TEST(names_are_fit_for_paths_and_files) {
    static const char *const sound[] = {"a", "7", "elcentro_NS-2.AT2", "A..b"};
    static const char *const unsound[] = {"",    ".",   "..",  ".a",       "-a", "_a",
                                          "a/b", "a b", "a\n", "\xC3\xA9", "a%"};
    char longest[66];
    for (size_t i = 0; i < COUNT(sound); i++)
        assert_true(record_name_is_sound(sound[i]));
    for (size_t i = 0; i < COUNT(unsound); i++)
        assert_false(record_name_is_sound(unsound[i]));
    memset(longest, 'x', sizeof longest);
    longest[65] = '\0';
    assert_false(record_name_is_sound(longest));
    longest[64] = '\0';
    assert_true(record_name_is_sound(longest));
}

TEST(a_record_is_in_memory_once_and_follows_the_catalogue) {
    Db *db = db_make();
    NamedRecord *first, *again, *other;
    RecordUses uses;
    bool is_there;
    assert_int_equal(add(db, "r", 1, "s", &is_there), STATUS_OK);
    assert_int_equal(db_record_named(db, "r", &first, &problem), STATUS_OK);
    assert_int_equal(db_record_named(db, "r", &again, &problem), STATUS_OK);
    assert_ptr_equal(first, again);
    assert_int_equal(db_record_delete(db, "r", &uses, &problem), STATUS_OK);
    assert_int_equal(db_record_named(db, "r", &other, &problem), STATUS_NOT_FOUND);
    assert_int_equal(add(db, "r", 3, "s", &is_there), STATUS_OK);
    problem_clear(&problem);
    assert_int_equal(db_record_named(db, "r", &other, &problem), STATUS_OK);
    assert_true(other->samples.at[0] == 3 && first->samples.at[0] == 1);
    refcount_unref(&first->shared);
    refcount_unref(&again->shared);
    refcount_unref(&other->shared);
    db_end(db);
}
