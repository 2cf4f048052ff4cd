// Writing materials, as far as HTTP does not show it: limits, and the catalog's version.
#include "server/db/materials.h"

#include <string.h>

#include "server/db/db_private.h"
#include "tests/support/felt.h"
#include "tests/support/test.h"

static uint64_t head_of(Db *db) {
    MaterialRevision found;
    const Status status = db_material(db, "felt", 0, &found, NULL);
    const uint64_t revision = status == STATUS_OK ? found.revision : 0;
    material_revision_clear(&found);
    return revision;
}

TEST(a_measurement_changes_the_material_but_not_the_catalog) {
    Db *db = felt_store(NULL);
    MaterialRevision one = felt_saying(0.5), head;
    MaterialMeasurement made = {.slug = "felt", .comment = "", .document = "{}"};
    assert_int_equal(db_material_add(db, &one, NULL), STATUS_OK);
    assert_int_equal(head_of(db), 1); // and is cached
    const uint64_t catalog_version = db_catalog_version(db);
    assert_int_equal(db_material_measure(db, &made, ANY_VERSION, NULL), STATUS_OK);
    assert_int_equal(db_catalog_version(db), catalog_version);
    assert_int_equal(db_material(db, "felt", 0, &head, NULL), STATUS_OK);
    assert_int_equal(head.version, 2);
    material_revision_clear(&head);
    db_close(db);
}

// What one statement changes in the database of a store.
static void change(Db *db, const char *sql) {
    Sqlite *database = db_take(db);
    assert_int_equal(sqlite_execute(database, sql, NULL), STATUS_OK);
    db_put(db, database);
}

TEST(materials_revisions_and_bytes_have_limits) {
    Db *db = felt_store(NULL);
    MaterialRevision one = felt_saying(0.5), other = felt_saying(0.5);
    MaterialMeasurement made = {.slug = "felt", .comment = "", .document = "{}"};
    Problem problem;
    problem_clear(&problem);
    assert_int_equal(db_material_add(db, &one, NULL), STATUS_OK);
    change(db, "INSERT INTO materials (number, slug) VALUES (100000, 'last')");
    other.slug = "wood";
    assert_int_equal(db_material_add(db, &other, &problem), STATUS_LIMIT);
    assert_non_null(strstr(problem.detail, "100000 materials"));
    change(db, "INSERT INTO material_revisions (material, revision, name, restitution, source, "
               "comment, created_unix_ms) SELECT number, 10000, 'F', 0.5, 's', '', 1 FROM "
               "materials WHERE slug = 'felt'");
    problem_clear(&problem);
    assert_int_equal(db_material_revise(db, &one, ANY_VERSION, &problem), STATUS_LIMIT);
    assert_non_null(strstr(problem.detail, "10000 revisions"));
    assert_int_equal(db_material_measure(db, &made, ANY_VERSION, NULL), STATUS_OK);
    change(db, "UPDATE material_room SET bytes = (64 << 30) - 300");
    problem_clear(&problem);
    assert_int_equal(db_material_measure(db, &made, ANY_VERSION, &problem), STATUS_LIMIT);
    assert_non_null(strstr(problem.detail, "64 GiB"));
    assert_int_equal(felt_review(db, 1, "approved", NULL, ANY_VERSION), STATUS_LIMIT);
    MaterialState now;
    assert_int_equal(db_material_state(db, "felt", &now, NULL), STATUS_OK);
    assert_int_equal(now.measurements, 1);
    db_close(db);
}
