// Materials in the database: no SQL changes it, and there are limits.
#include "server/db/materials.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "core/contact/contact.h"
#include "server/db/db_private.h"
#include "server/db/sqlite.h"
#include "tests/support/felt.h"
#include "tests/support/scratch.h"
#include "tests/support/test.h"

static char folder[SCRATCH_SIZE];

static int make_folder(void **state) {
    (void)state;
    scratch_make(folder);
    return 0;
}

static int remove_folder(void **state) {
    (void)state;
    scratch_remove(folder);
    return 0;
}

static Sqlite *open_database(void) {
    char path[128];
    Sqlite *database;
    snprintf(path, sizeof path, "%s/impactd.db", folder);
    assert_int_equal(sqlite_open(path, DATABASE_WRITER, &database, NULL), STATUS_OK);
    return database;
}

// All that the materials' tables hold, as one text.
static char *dump(Sqlite *database) {
    static const char sql[] =
        "SELECT (SELECT group_concat(json_array(number, slug)) FROM materials) || "
        "(SELECT group_concat(json_array(number, material, revision, name, kind, thickness, "
        "hardness, supplier, notes, restitution, restitution_deviation, contact_time, "
        "contact_time_deviation, separation, least_speed, most_speed, least_temperature, "
        "most_temperature, impactor, impactor_mass, base, base_mass, source, lists, reverts, "
        "author, comment, created_unix_ms)) FROM material_revisions) || "
        "(SELECT group_concat(json_array(number, material, revision, status, reason, reviewer, "
        "created_unix_ms)) FROM material_reviews) || "
        "(SELECT group_concat(json_array(number, material, measurement, author, comment, "
        "created_unix_ms, document)) FROM material_measurements) || "
        "(SELECT group_concat(json_array(number, material, version, action, revision, measurement, "
        "who, why, created_unix_ms)) FROM material_trail) AS text";
    static const SqlColumn columns[] = {
        {.name = "text", .kind = COLUMN_TEXT, .size = sizeof(char *)}, COLUMN_END};
    char *text = NULL;
    assert_int_equal(sqlite_first(database, sql, NULL, NULL, columns, &text, NULL, NULL),
                     STATUS_OK);
    assert_non_null(text);
    return text;
}

TEST_IN(no_sql_changes_a_stored_row, make_folder, remove_folder) {
    static const char *const tables[] = {"materials", "material_revisions", "material_reviews",
                                         "material_measurements", "material_trail"};
    static const char *const harm[] = {
        "UPDATE %s SET number = number",
        "UPDATE OR REPLACE %s SET number = 1",
        "UPDATE OR IGNORE %s SET number = number + 1000",
        "DELETE FROM %s",
        "DELETE FROM %s WHERE number = 1",
        "INSERT OR REPLACE INTO %s SELECT * FROM %s",
        "REPLACE INTO %s SELECT * FROM %s LIMIT 1",
        "INSERT INTO %s SELECT * FROM %s",
        "INSERT OR REPLACE INTO %s SELECT * FROM %s ORDER BY number DESC",
        "INSERT INTO %s SELECT * FROM %s WHERE true ON CONFLICT DO UPDATE SET number = "
        "excluded.number + 1000",
        "PRAGMA foreign_keys = OFF; DELETE FROM %s",
        "PRAGMA recursive_triggers = OFF; PRAGMA ignore_check_constraints = ON; REPLACE INTO %s "
        "SELECT * FROM %s",
        "PRAGMA writable_schema = ON; DELETE FROM sqlite_schema WHERE type = 'trigger' AND "
        "tbl_name "
        "= '%s'",
        "PRAGMA writable_schema = ON; UPDATE sqlite_schema SET sql = '' WHERE tbl_name = '%s'",
        "UPDATE sqlite_schema SET rootpage = 1 WHERE name = '%s'"};
    static const char *const named[] = {
        "UPDATE material_revisions SET restitution = 0.9 WHERE revision = 1",
        "UPDATE material_revisions SET comment = comment || '!'",
        "UPDATE materials SET slug = 'other' WHERE slug = 'felt'",
        "UPDATE material_measurements SET document = '{}'",
        "UPDATE material_trail SET who = 'me'",
        "UPDATE material_reviews SET status = 'deprecated'",
        "INSERT OR REPLACE INTO material_revisions (material, revision, name, restitution, source, "
        "comment, created_unix_ms) SELECT material, revision, name, 0.9, source, comment, 0 FROM "
        "material_revisions",
        "INSERT OR REPLACE INTO material_measurements (material, measurement, comment, "
        "created_unix_ms, document) SELECT material, measurement, 'x', 0, '[]' FROM "
        "material_measurements",
        "INSERT OR REPLACE INTO materials (slug) VALUES ('felt')",
        ("INSERT OR REPLACE INTO material_trail (material, version, action, why, created_unix_ms) "
         "SELECT material, version, 'revise', 'x', 0 FROM material_trail"),
        "UPDATE material_states SET restitution = 0.9",
        "DELETE FROM material_states",
        "INSERT INTO material_states (slug) VALUES ('felt')"};
    Db *db = felt_store(folder);
    MaterialRevision one = felt_saying(0.5);
    MaterialMeasurement drop = {.slug = "felt", .comment = "c", .document = "{\"a\": 1}"};
    assert_int_equal(db_material_add(db, &one, NULL), STATUS_OK);
    assert_int_equal(db_material_measure(db, &drop, ANY_VERSION, NULL), STATUS_OK);
    assert_int_equal(felt_review(db, 1, "approved", NULL, ANY_VERSION), STATUS_OK);
    db_close(db);

    Sqlite *database = open_database();
    char *before = dump(database);
    for (size_t i = 0; i < COUNT(harm); i++)
        for (size_t k = 0; k < COUNT(tables); k++) {
            char sql[400];
            snprintf(sql, sizeof sql, harm[i], tables[k], tables[k]);
            if (sqlite_execute(database, sql, NULL) == STATUS_OK)
                fail_msg("taken: %s", sql);
        }
    for (size_t i = 0; i < COUNT(named); i++)
        if (sqlite_execute(database, named[i], NULL) == STATUS_OK)
            fail_msg("taken: %s", named[i]);
    char *after = dump(database);
    assert_string_equal(before, after);
    free(before);
    free(after);
    sqlite_close(database);
}

// A revision is read once as long as no material changes; a reference outlives the change.
TEST(shared_revisions_are_read_again_after_a_write) {
    Db *db = felt_store(NULL);
    MaterialRevision one = felt_saying(0.5), two = felt_saying(0.7);
    SharedRevision *head = NULL, *again = NULL;
    assert_int_equal(db_material_shared(db, "felt", 0, &head, NULL), STATUS_NOT_FOUND);
    assert_null(head);
    assert_int_equal(db_material_add(db, &one, NULL), STATUS_OK);
    assert_int_equal(db_material_shared(db, "felt", 0, &head, NULL), STATUS_OK);
    assert_int_equal(db_material_shared(db, "felt", 0, &again, NULL), STATUS_OK);
    assert_ptr_equal(head, again);
    refcount_unref(&again->refcount);
    assert_int_equal(db_material_revise(db, &two, ANY_VERSION, NULL), STATUS_OK);
    assert_int_equal(db_material_shared(db, "felt", 0, &again, NULL), STATUS_OK);
    assert_int_equal(again->revision.revision, 2);
    refcount_unref(&again->refcount);
    assert_int_equal(felt_review(db, 1, "approved", NULL, ANY_VERSION), STATUS_OK);
    assert_int_equal(db_material_shared(db, "felt", 0, &again, NULL), STATUS_OK);
    assert_int_equal(again->revision.revision, 1);
    assert_string_equal(again->revision.status, "approved");
    assert_string_equal(head->revision.status, "draft");
    refcount_unref(&again->refcount);
    db_close(db);
    refcount_unref(&head->refcount);
}

static Status apply_sql(Sqlite *database, const void *sql, Problem *problem) {
    return sqlite_execute(database, sql, problem);
}

TEST(materials_revisions_and_bytes_have_limits) {
    Db *db = felt_store(NULL);
    MaterialRevision one = felt_saying(0.5), other = felt_saying(0.5);
    MaterialMeasurement made = {.slug = "felt", .comment = "", .document = "{}"};
    Problem problem;
    problem_clear(&problem);
    assert_int_equal(db_material_add(db, &one, NULL), STATUS_OK);
    assert_int_equal(db_write(db, apply_sql,
                              "INSERT INTO materials (number, slug) VALUES (100000, 'last')", NULL),
                     STATUS_OK);
    other.slug = "wood";
    assert_int_equal(db_material_add(db, &other, &problem), STATUS_LIMIT);
    assert_non_null(strstr(problem.detail, "100000 materials"));
    assert_int_equal(
        db_write(db, apply_sql,
                 "INSERT INTO material_revisions (material, revision, name, restitution, source, "
                 "comment, created_unix_ms) SELECT number, 10000, 'F', 0.5, 's', '', 1 FROM "
                 "materials WHERE slug = 'felt'",
                 NULL),
        STATUS_OK);
    problem_clear(&problem);
    assert_int_equal(db_material_revise(db, &one, ANY_VERSION, &problem), STATUS_LIMIT);
    assert_non_null(strstr(problem.detail, "10000 revisions"));
    assert_int_equal(db_material_measure(db, &made, ANY_VERSION, NULL), STATUS_OK);
    assert_int_equal(
        db_write(db, apply_sql, "UPDATE material_room SET bytes = (64 << 30) - 300", NULL),
        STATUS_OK);
    problem_clear(&problem);
    assert_int_equal(db_material_measure(db, &made, ANY_VERSION, &problem), STATUS_LIMIT);
    assert_non_null(strstr(problem.detail, "64 GiB"));
    assert_int_equal(felt_review(db, 1, "approved", NULL, ANY_VERSION), STATUS_LIMIT);
    MaterialState now;
    assert_int_equal(db_material_state(db, "felt", &now, NULL), STATUS_OK);
    assert_int_equal(now.measurements, 1);
    db_close(db);
}

TEST(what_is_not_there_is_not_written_to) {
    Db *db = felt_store(NULL);
    MaterialRevision one = felt_saying(0.5);
    MaterialMeasurement made = {.slug = "felt", .comment = "", .document = "{}"};
    Problem problem;
    problem_clear(&problem);
    assert_int_equal(db_material_revise(db, &one, ANY_VERSION, &problem), STATUS_NOT_FOUND);
    assert_string_equal(problem.detail, "there is no material \"felt\"");
    assert_int_equal(db_material_measure(db, &made, ANY_VERSION, NULL), STATUS_NOT_FOUND);
    assert_int_equal(felt_review(db, 1, "approved", NULL, ANY_VERSION), STATUS_NOT_FOUND);
    assert_int_equal(db_material_add(db, &one, NULL), STATUS_OK);
    assert_int_equal(felt_review(db, 2, "approved", NULL, ANY_VERSION), STATUS_NOT_FOUND);
    db_close(db);
}

// One revision is there of each material; where they are gone the database is damaged.
TEST(a_material_without_revisions_is_damage) {
    Db *db = felt_store(NULL);
    MaterialRevision one = felt_saying(0.5);
    MaterialState now;
    Problem problem;
    assert_int_equal(db_material_add(db, &one, NULL), STATUS_OK);
    assert_int_equal(
        db_write(db, apply_sql,
                 "PRAGMA defer_foreign_keys = ON; DROP TRIGGER material_revisions_stay; "
                 "DELETE FROM material_revisions WHERE name = 'Felt'",
                 NULL),
        STATUS_OK);
    problem_clear(&problem);
    assert_int_equal(db_material_state(db, "felt", &now, &problem), STATUS_INTERNAL);
    assert_non_null(strstr(problem.detail, "the revisions of the material felt are missing"));
    assert_int_equal(db_material_revise(db, &one, ANY_VERSION, NULL), STATUS_INTERNAL);
    db_close(db);
}
