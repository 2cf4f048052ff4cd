// Records as they are stored: whole, unchanged, shared in memory, and kept as long as they are
// used.
#include "server/db/records.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "server/db/sqlite.h"
#include "server/util/bytes.h"
#include "server/util/gzip.h"
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
    static const char used[] =
        "INSERT INTO results (number, id, engine, sample_rate, count, created_unix_ms, summary, "
        "plan, warnings, impact_count, scene, outcome) VALUES (1, 'r-1', 'e', 1, 1, 0, '{}', '{}', "
        "'[]', 0, '{}', x'00'); INSERT INTO result_uses VALUES ('record:elcentro', 1)";
    Db *db = db_make();
    char path[SCRATCH_SIZE + 16];
    Sqlite *database;
    NamedRecord *named;
    add_new(db, "elcentro", 0.1);
    db_close(db);
    snprintf(path, sizeof path, "%s/impactd.db", folder);
    assert_int_equal(sqlite_open(path, DATABASE_WRITER, &database, &problem), STATUS_OK);
    assert_int_equal(sqlite_execute(database, used, &problem), STATUS_OK);
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

// Samples whose checksums are right and whose digest is not: another value, one too few.
TEST(samples_that_have_not_their_digest_are_no_answer) {
    static const double other[] = {1, -2, 0.25};
    Db *db = db_make();
    NamedRecord *named;
    char path[SCRATCH_SIZE + 16];
    Sqlite *database;
    add_new(db, "quake", 1);
    db_close(db);
    snprintf(path, sizeof path, "%s/impactd.db", folder);
    for (size_t count = 3; count >= 2; count--) {
        const uint32_t checks[] = {gzip_crc32(0, (const char *)other, count * sizeof *other),
                                   gzip_crc32(0, "quake", 5)};
        Bytes sql = {0};
        bytes_text(
            &sql,
            "DROP TRIGGER IF EXISTS record_samples_keep; UPDATE record_samples SET samples = x'");
        for (size_t i = 0; i < count * sizeof *other; i++)
            bytes_format(&sql, "%02x", (unsigned)((const unsigned char *)other)[i]);
        bytes_text(&sql, "', checks = x'");
        for (size_t i = 0; i < sizeof checks; i++)
            bytes_format(&sql, "%02x", (unsigned)((const unsigned char *)checks)[i]);
        bytes_text(&sql, "'");
        assert_int_equal(sqlite_open(path, DATABASE_WRITER, &database, &problem), STATUS_OK);
        if (sqlite_execute(database, sql.at, &problem) != STATUS_OK)
            fail_msg("%s", problem.detail);
        sqlite_close(database);
        bytes_clear(&sql);
        assert_int_equal(db_open(folder, &db, &problem), STATUS_OK);
        problem_clear(&problem);
        assert_int_equal(db_record_named(db, "quake", &named, &problem), STATUS_INTERNAL);
        assert_null(named);
        assert_non_null(strstr(problem.detail, "its samples differ from their digest"));
        db_close(db);
    }
    scratch_remove(folder);
}

TEST(a_record_that_is_not_there_is_not_deleted) {
    Db *db = db_make();
    RecordUses uses;
    problem_clear(&problem);
    assert_int_equal(db_record_delete(db, "quake", &uses, &problem), STATUS_NOT_FOUND);
    assert_string_equal(problem.detail, "there is no record \"quake\"");
    db_end(db);
}
