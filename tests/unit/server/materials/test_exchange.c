// Files of materials against a database of the paper's five: what is added, what is the same, what
// is told.
#include "server/materials/exchange.h"

#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>

#include "server/formats/material_export.h"
#include "server/materials/exchange_csv.h"
#include "server/materials/exchange_json.h"

static Problem problem;

static Status bring(Db *db, const char *text, const char *who, bool may_all, ImportTally *metrics) {
    Exchange exchange = {.revision_room = 0};
    problem_clear(&problem);
    Status status = (text[0] == '{' ? exchange_read_json : exchange_read_csv)(text, strlen(text),
                                                                              &exchange, &problem);
    if (status == STATUS_OK || status == STATUS_INVALID)
        status = exchange_import(&exchange, db, who, may_all, false, metrics, &problem);
    exchange_clear(&exchange);
    return status;
}

static Db *open_store(void) {
    Db *db;
    assert_int_equal(db_open(NULL, &db, NULL), STATUS_OK);
    return db;
}

static char *export_all(Db *db, bool is_table) {
    Bytes bytes = {.most = 0};
    MaterialExport text;
    bool is_last = false;
    assert_int_equal(material_export_open(db, is_table, &text, NULL), STATUS_OK);
    while (!is_last)
        assert_int_equal(material_export_next(&text, &bytes, &is_last, NULL), STATUS_OK);
    char *whole = bytes_take(&bytes, NULL);
    assert_non_null(whole);
    return whole;
}

static void faults_are_told_at_their_places_and_nothing_is_written(void **state) {
    (void)state;
    static const struct {
        const char *text, *place;
    } cases[] = {
        {"slug,name,source,restitution\nx,X,s,1.5", "/2/restitution"},
        {"slug,name,source,restitution\n\nX,X,s,1", "/3/slug"},
        {"slug,name,source,restitution\nimport,X,s,1", "/2/slug"},
        {"slug,name,source,restitution,contact_time [ms]\nx,X,s,1,5", "/1/contact_time"},
        {"slug,name,source,restitution,restitution\nx,X,s,1,1", "/1/restitution"},
        {"slug,name,source,restitution\nx,X,s,1\nx,X,s,0", "/3/slug"},
        {"slug,name,source,restitution\nx,X,s,1,5", "/2/5"},
        {"slug,name,source,restitution,number\nx,X,s,1,2", "/2/number"},
        {"slug,name,source,restitution,number\nx,X,s,1,1\nx,X,s,1,1", "/3/number"},
        {"slug,name,source,restitution,number\nx,X,s,1,1\nx,X,s,1,3", "/3/number"},
        {"slug,name,source,restitution,reverts\nx,X,s,1,1", "/2/reverts"},
        {"slug,name,source,restitution,number,reverts\nx,X,s,1,1,\nx,X,s,0,2,1", "/3/reverts"},
        {"slug,name,source,restitution,measurements\nx,X,s,1,[1]", "/2/measurements/0"},
        {"slug,row,test\nx,measurement,\"{\"\"drops\"\": [{\"\"contact_time\"\": 1}]}\"",
         "/2/slug"},
        {"slug,name,source,restitution,reviews\nx,X,s,1,\"[{\"\"status\"\": \"\"deprecated\"\", "
         "\"\"reason\"\": \"\"r\"\"}, {\"\"status\"\": \"\"deprecated\"\", \"\"reason\"\": "
         "\"\"r\"\"}]\"",
         "/2/reviews/1/status"},
        {"slug,row,name\nsponge,measurement,X", "/2/name"},
        {"{\"format\": \"other\", \"version\": 1, \"materials\": []}", "/format"},
    };
    Db *db = open_store();
    char *before = export_all(db, false);
    for (size_t i = 0; i < COUNT(cases); i++) {
        ImportTally metrics;
        const uint64_t catalog_version = db_catalog_version(db);
        assert_int_equal(bring(db, cases[i].text, NULL, true, &metrics), STATUS_INVALID);
        bool is_told = false;
        for (size_t k = 0; k < problem.count; k++)
            is_told = is_told || strcmp(problem.faults[k].pointer, cases[i].place) == 0;
        if (!is_told)
            print_error("%s: %s\n", cases[i].text, problem.detail);
        assert_true(is_told);
        assert_true(problem.count <= 2);
        assert_true(db_catalog_version(db) == catalog_version);
    }
    char *after = export_all(db, false);
    assert_string_equal(before, after);
    free(after);
    free(before);
    db_close(db);
}

static void an_unknown_number_is_the_next_unless_the_newest_says_the_same(void **state) {
    (void)state;
    Db *db = open_store();
    ImportTally metrics;
    const uint64_t catalog_version = db_catalog_version(db);
    static const char first[] = "slug,name,source,restitution\nx,X,s,0.5\n",
                      second[] = "slug,name,source,restitution,comment\nx,X,s,0.6,better\n";
    assert_int_equal(bring(db, first, NULL, true, &metrics), STATUS_OK);
    assert_int_equal(metrics.revisions.added, 1);
    assert_true(db_catalog_version(db) > catalog_version);
    assert_int_equal(bring(db, first, NULL, true, &metrics), STATUS_OK);
    assert_int_equal(metrics.revisions.same, 1);
    assert_int_equal(bring(db, second, NULL, true, &metrics), STATUS_OK);
    assert_int_equal(bring(db, second, NULL, true, &metrics), STATUS_OK);
    assert_int_equal(metrics.revisions.same, 1);
    // What an older one says is new all the same.
    assert_int_equal(bring(db, first, NULL, true, &metrics), STATUS_OK);
    assert_int_equal(metrics.revisions.added, 1);
    MaterialRevision newest = {0};
    assert_int_equal(db_material(db, "x", 3, &newest, NULL), STATUS_OK);
    assert_true(newest.material.restitution == 0.5);
    assert_string_equal(newest.comment, "imported");
    assert_null(newest.author);
    material_revision_clear(&newest);
    db_close(db);
}

static void who_may_not_speak_for_others_is_told_so(void **state) {
    (void)state;
    Db *db = open_store();
    ImportTally metrics;
    static const char by_bert[] = "slug,name,source,restitution,author\nx,X,s,0.5,bert\n",
                      by_nobody[] = "slug,name,source,restitution,author\nx,X,s,0.5,\n";
    assert_int_equal(bring(db, by_bert, "anna", false, &metrics), STATUS_FORBIDDEN);
    assert_string_equal(problem.faults[0].pointer, "/2/author");
    assert_int_equal(bring(db, by_nobody, "anna", false, &metrics), STATUS_OK);
    MaterialRevision found = {0};
    assert_int_equal(db_material(db, "x", 1, &found, NULL), STATUS_OK);
    assert_string_equal(found.author, "anna");
    material_revision_clear(&found);
    db_close(db);
}

static void both_kinds_of_exports_are_imports(void **state) {
    (void)state;
    Db *db = open_store(), *others[2] = {open_store(), open_store()};
    ImportTally metrics;
    static const char text[] =
        "row,slug,name,source,table,notes,test,reviews\r\n"
        "revision,x,\"a,\"\"b\"\"\",\"s\r\n2\",\"[{\"\"approach_speed\"\": 0.1, "
        "\"\"restitution\"\": "
        "0.5}, {\"\"approach_speed\"\": 0.2, \"\"restitution\"\": "
        "0.4}]\",\"\",,\"[{\"\"status\"\": "
        "\"\"approved\"\", \"\"reason\"\": \"\"=1+1\"\"}]\"\r\n"
        "measurement,x,,,,,\"{\"\"drops\"\": [{\"\"contact_time\"\": 0.01}]}\",\r\n";
    assert_int_equal(bring(db, text, NULL, true, &metrics), STATUS_OK);
    assert_int_equal(metrics.measurements.added, 1);
    assert_int_equal(metrics.reviews.added, 1);
    for (int i = 0; i < 2; i++) {
        char *whole = export_all(db, i == 1), *document = export_all(db, false);
        assert_int_equal(bring(others[i], whole, NULL, true, &metrics), STATUS_OK);
        assert_int_equal(metrics.revisions.same, 5);
        char *back = export_all(others[i], false);
        assert_string_equal(document, back);
        free(back);
        free(document);
        free(whole);
        db_close(others[i]);
    }
    db_close(db);
}

static void an_export_is_made_revision_by_revision(void **state) {
    (void)state;
    Db *db = open_store();
    ImportTally metrics;
    Bytes rows = {.most = 0}, piece = {.most = 0};
    MaterialExport text;
    bool is_last = false;
    size_t pieces = 0;
    bytes_text(&rows, "slug,number,name,source,restitution,notes\n");
    for (int i = 1; i <= 50; i++)
        bytes_format(&rows, "x,%d,X,s,0.5,%0500d\n", i, i);
    char *table = bytes_take(&rows, NULL);
    assert_int_equal(bring(db, table, NULL, true, &metrics), STATUS_OK);
    assert_int_equal(material_export_open(db, false, &text, NULL), STATUS_OK);
    for (; !is_last; pieces++) {
        assert_int_equal(material_export_next(&text, &piece, &is_last, NULL), STATUS_OK);
        assert_true(piece.count < 2000);
        piece.count = 0;
    }
    assert_true(pieces > 55);
    bytes_clear(&piece);
    free(table);
    db_close(db);
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(faults_are_told_at_their_places_and_nothing_is_written),
        cmocka_unit_test(an_unknown_number_is_the_next_unless_the_newest_says_the_same),
        cmocka_unit_test(who_may_not_speak_for_others_is_told_so),
        cmocka_unit_test(both_kinds_of_exports_are_imports),
        cmocka_unit_test(an_export_is_made_revision_by_revision),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
