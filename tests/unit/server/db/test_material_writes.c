// Writing materials: who comes second is told, the head follows the reviews, nobody approves their
// own.
#include "server/db/materials.h"

#include <pthread.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stdatomic.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>

#include "server/db/db_private.h"
#include "tests/support/felt.h"
#include "tests/support/scratch.h"

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

static uint64_t head_of(Db *db) {
    MaterialRevision found;
    const Status status = db_material(db, "felt", 0, &found, NULL);
    const uint64_t revision = status == STATUS_OK ? found.revision : 0;
    material_revision_clear(&found);
    return revision;
}

static void who_has_not_seen_the_present_version_is_told(void **state) {
    (void)state;
    Db *db = felt_store(NULL);
    MaterialRevision one = felt_saying(0.5);
    MaterialMeasurement drop = {.slug = "felt", .comment = "c", .document = "{}"};
    static Problem problem;
    problem_clear(&problem);
    assert_int_equal(db_material_revise(db, &one, ANY_VERSION, NULL), STATUS_NOT_FOUND);
    assert_int_equal(db_material_add(db, &one, NULL), STATUS_OK);
    assert_int_equal(db_material_revise(db, &one, 1, NULL), STATUS_OK);
    assert_int_equal(db_material_revise(db, &one, 1, &problem), STATUS_STALE);
    assert_non_null(strstr(problem.detail, "version 2"));
    assert_int_equal(db_material_measure(db, &drop, 1, NULL), STATUS_STALE);
    assert_int_equal(felt_review(db, 1, "approved", NULL, 3), STATUS_STALE);
    assert_int_equal(db_material_measure(db, &drop, 2, NULL), STATUS_OK);
    assert_int_equal(db_material_measure(db, &drop, ANY_VERSION, NULL), STATUS_OK);
    assert_int_equal(drop.measurement, 2);
    MaterialState now;
    assert_int_equal(db_material_state(db, "felt", &now, NULL), STATUS_OK);
    assert_int_equal(now.latest, 2);
    assert_int_equal(now.version, 4);
    assert_int_equal(now.measurements, 2);
    assert_int_equal(db_material_state(db, "wood", &now, NULL), STATUS_NOT_FOUND);
    db_close(db);
}

static void a_measurement_changes_what_is_told_but_not_what_a_name_means(void **state) {
    (void)state;
    Db *db = felt_store(NULL);
    MaterialRevision one = felt_saying(0.5), head;
    MaterialMeasurement made = {.slug = "felt", .comment = "", .document = "{}"};
    assert_int_equal(db_material_add(db, &one, NULL), STATUS_OK);
    assert_int_equal(head_of(db), 1); // and is remembered
    const uint64_t catalog_version = db_catalog_version(db);
    assert_int_equal(db_material_measure(db, &made, ANY_VERSION, NULL), STATUS_OK);
    assert_int_equal(db_catalog_version(db), catalog_version);
    assert_int_equal(db_material(db, "felt", 0, &head, NULL), STATUS_OK);
    assert_int_equal(head.version, 2);
    material_revision_clear(&head);
    db_close(db);
}

static void the_head_is_the_newest_approved_then_the_newest_draft(void **state) {
    (void)state;
    Db *db = felt_store(NULL);
    MaterialRevision one = felt_saying(0.5);
    assert_int_equal(db_material_add(db, &one, NULL), STATUS_OK);
    for (int i = 0; i < 3; i++)
        assert_int_equal(db_material_revise(db, &one, ANY_VERSION, NULL), STATUS_OK);
    const uint64_t catalog_version = db_catalog_version(db);
    assert_int_equal(head_of(db), 4);
    assert_int_equal(felt_review(db, 2, "approved", NULL, ANY_VERSION), STATUS_OK);
    assert_true(db_catalog_version(db) > catalog_version);
    assert_int_equal(head_of(db), 2);
    assert_int_equal(felt_review(db, 1, "approved", NULL, ANY_VERSION), STATUS_OK);
    assert_int_equal(head_of(db), 2);
    assert_int_equal(felt_review(db, 2, "approved", NULL, ANY_VERSION), STATUS_CONFLICT);
    assert_int_equal(felt_review(db, 2, "deprecated", NULL, ANY_VERSION), STATUS_OK);
    assert_int_equal(head_of(db), 1);
    assert_int_equal(felt_review(db, 2, "approved", NULL, ANY_VERSION), STATUS_OK);
    assert_int_equal(head_of(db), 2);
    for (uint64_t i = 1; i <= 4; i++)
        assert_int_equal(felt_review(db, i, "deprecated", NULL, ANY_VERSION), STATUS_OK);
    assert_int_equal(head_of(db), 0);
    assert_int_equal(felt_review(db, 5, "deprecated", NULL, ANY_VERSION), STATUS_NOT_FOUND);
    AuditEntries audit_entries;
    assert_int_equal(db_audit_entries(db, "felt", 100, 100, &audit_entries, NULL), STATUS_OK);
    assert_int_equal(audit_entries.count, 12);
    assert_int_equal(audit_entries.at[0].version, 12);
    assert_string_equal(audit_entries.at[7].action, "approve");
    assert_string_equal(audit_entries.at[7].why, "because");
    assert_int_equal(audit_entries.at[7].revision, 2);
    audit_entries_clear(&audit_entries);
    assert_int_equal(db_audit_entries(db, "felt", 3, 1, &audit_entries, NULL), STATUS_OK);
    assert_int_equal(audit_entries.count, 1);
    assert_int_equal(audit_entries.at[0].version, 2);
    audit_entries_clear(&audit_entries);
    db_close(db);
}

// What one statement changes in the database of a store.
static void change(Db *db, const char *sql) {
    Sqlite *database = db_take(db);
    assert_int_equal(sqlite_execute(database, sql, NULL), STATUS_OK);
    db_put(db, database);
}

static void what_is_kept_for_good_has_an_end(void **state) {
    (void)state;
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

static void nobody_approves_their_own(void **state) {
    (void)state;
    Db *db = felt_store(NULL);
    MaterialRevision one = felt_saying(0.5);
    one.author = "ann";
    assert_int_equal(db_material_add(db, &one, NULL), STATUS_OK);
    assert_int_equal(felt_review(db, 1, "approved", "ann", ANY_VERSION), STATUS_FORBIDDEN);
    assert_int_equal(felt_review(db, 1, "approved", "ann", 1), STATUS_FORBIDDEN);
    assert_int_equal(felt_review(db, 1, "approved", "anne", 1), STATUS_OK);
    assert_int_equal(felt_review(db, 1, "deprecated", "ann", 2), STATUS_OK);
    assert_int_equal(felt_review(db, 1, "approved", NULL, 3), STATUS_OK);
    db_close(db);
}

typedef struct Writer {
    Db *db;
    int taken, told, other;
    atomic_int *of_version; // how many were taken that had seen it
} Writer;

static void *write_much(void *context) {
    Writer *own = context;
    for (int i = 0; i < 200; i++) {
        MaterialRevision one = felt_saying(0.5);
        MaterialState now;
        Status status = db_material_state(own->db, "felt", &now, NULL);
        if (status == STATUS_OK)
            status = db_material_revise(own->db, &one, now.version, NULL);
        own->taken += status == STATUS_OK;
        if (status == STATUS_OK)
            atomic_fetch_add(&own->of_version[now.version], 1);
        own->told += status == STATUS_STALE;
        own->other += status != STATUS_OK && status != STATUS_STALE;
    }
    return NULL;
}

static void of_eight_writers_each_is_taken_or_told(void **state) {
    (void)state;
    Db *db = felt_store(folder);
    MaterialRevision one = felt_saying(0.5);
    assert_int_equal(db_material_add(db, &one, NULL), STATUS_OK);
    static atomic_int of_version[8 * 200 + 2];
    pthread_t threads[8];
    Writer writers[8];
    for (int i = 0; i < 8; i++) {
        writers[i] = (Writer){db, 0, 0, 0, of_version};
        assert_int_equal(pthread_create(&threads[i], NULL, write_much, &writers[i]), 0);
    }
    uint64_t taken = 0;
    for (int i = 0; i < 8; i++) {
        pthread_join(threads[i], NULL);
        assert_int_equal(writers[i].other, 0);
        assert_int_equal(writers[i].taken + writers[i].told, 200);
        taken += (uint64_t)writers[i].taken;
    }
    MaterialState now;
    assert_int_equal(db_material_state(db, "felt", &now, NULL), STATUS_OK);
    assert_int_equal(now.latest, taken + 1);
    assert_int_equal(now.version, taken + 1);
    for (uint64_t version = 1; version <= taken; version++)
        assert_int_equal(atomic_load(&of_version[version]), 1);
    db_close(db);
}

#define IN_FOLDER(test) cmocka_unit_test_setup_teardown(test, make_folder, remove_folder)

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(who_has_not_seen_the_present_version_is_told),
        cmocka_unit_test(a_measurement_changes_what_is_told_but_not_what_a_name_means),
        cmocka_unit_test(the_head_is_the_newest_approved_then_the_newest_draft),
        cmocka_unit_test(what_is_kept_for_good_has_an_end),
        cmocka_unit_test(nobody_approves_their_own),
        IN_FOLDER(of_eight_writers_each_is_taken_or_told),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
