// Imports and exports of materials, as far as HTTP does not show them.
#include "server/materials/exchange.h"

#include <stdlib.h>
#include <string.h>

#include "tests/support/test.h"

static Problem problem;

static Status import_text(Db *db, const char *text, ImportTally *tally) {
    const ImportOptions options = {.is_table = text[0] != '{', .may_all = true};
    problem_clear(&problem);
    return import_file(db, text, strlen(text), &options, tally, &problem);
}

static Db *open_database(void) {
    Db *db;
    assert_int_equal(db_open(NULL, &db, NULL), STATUS_OK);
    return db;
}

static char *export_all(Db *db, bool is_table) {
    Bytes bytes = {.most = 0};
    MaterialExport export;
    bool is_last = false;
    assert_int_equal(material_export_open(db, is_table, &export, NULL), STATUS_OK);
    while (!is_last)
        assert_int_equal(material_export_next(&export, &bytes, &is_last, NULL), STATUS_OK);
    char *whole = bytes_take(&bytes, NULL);
    assert_non_null(whole);
    return whole;
}

TEST(a_header_of_too_many_cells_is_one_fault_in_its_row) {
    Db *db = open_database();
    ImportTally tally;
    Bytes text = {.most = 0};
    for (int i = 0; i < 3000; i++)
        bytes_text(&text, "a,");
    assert_int_equal(import_text(db, text.at, &tally), STATUS_INVALID);
    assert_int_equal(problem.count, 1);
    assert_int_equal(problem.faults[0].row, 1);
    bytes_clear(&text);
    db_close(db);
}

// ESC, BEL, DEL, CSI as one character, a lone CR, formulas, and texts that look like JSON.
static const char *const unsafe[] = {
    "red \x1b[31m", "\x07", "a\x7f", "\xc2\x9b 2J", "over\rwritten", "=cmd()",    "+1",
    "-1",           "@x",   "\tx",   "\"quoted\"",  "\"\"",          "\"a\\nb\"",
};
// What stays readable: it needs no more than the quotes of CSV.
static const char *const plain[] = {"two\nlines",     "two\r\nlines",  "say \"so\"",
                                    "\"a\" or \"b\"", "40 \xc2\xb0Sh", "a=b"};

TEST(a_table_has_neither_control_characters_nor_formulas_and_comes_back) {
    Db *db = open_database(), *other = open_database();
    ImportTally tally;
    Bytes text = {.most = 0};
    bytes_text(&text, "{\"format\": \"impactd-materials\", \"version\": 1, \"materials\": [");
    for (size_t i = 0; i < COUNT(unsafe) + COUNT(plain); i++) {
        const char *note = i < COUNT(unsafe) ? unsafe[i] : plain[i - COUNT(unsafe)];
        bytes_format(&text,
                     "%s{\"slug\": \"m%zu\", \"revisions\": [{\"name\": \"M\", "
                     "\"restitution\": 0.5, \"source\": \"s\", \"notes\": ",
                     i > 0 ? "," : "", i);
        bytes_json_string(&text, note);
        bytes_text(&text, ", \"tags\": [");
        bytes_json_string(&text, note);
        bytes_text(&text, "]}], \"measurements\": [{\"test\": {\"drops\": [{\"contact_time\": "
                          "0.01}], \"notes\": ");
        bytes_json_string(&text, note);
        bytes_text(&text, "}}]}");
    }
    bytes_text(&text, "]}");
    char *document = bytes_take(&text, NULL);
    assert_int_equal(import_text(db, document, &tally), STATUS_OK);
    assert_int_equal(tally.revisions.added, COUNT(unsafe) + COUNT(plain));
    char *table = export_all(db, true);
    for (const char *at = table; *at != '\0'; at++) {
        const unsigned char c = (unsigned char)*at, next = (unsigned char)at[1];
        assert_true(c >= ' ' || c == '\n' || (c == '\r' && next == '\n'));
        assert_true(c != 0x7f && !(c == 0xc2 && next >= 0x80 && next < 0xa0));
        if (c == ',')
            assert_true(strchr("=+-@", next) == NULL);
    }
    for (size_t i = 0; i < COUNT(plain); i++)
        if (strchr(plain[i], '"') == NULL)
            assert_non_null(strstr(table, plain[i]));
    assert_int_equal(import_text(other, table, &tally), STATUS_OK);
    char *there = export_all(db, false), *back = export_all(other, false);
    assert_string_equal(back, there);
    free(back);
    free(there);
    free(table);
    free(document);
    db_close(other);
    db_close(db);
}

TEST(an_export_is_made_revision_by_revision) {
    Db *db = open_database();
    ImportTally tally;
    Bytes rows = {.most = 0}, piece = {.most = 0};
    MaterialExport export;
    bool is_last = false;
    size_t pieces = 0;
    bytes_text(&rows, "slug,number,name,source,restitution,notes\n");
    for (int i = 1; i <= 50; i++)
        bytes_format(&rows, "x,%d,X,s,0.5,%0500d\n", i, i);
    char *table = bytes_take(&rows, NULL);
    assert_int_equal(import_text(db, table, &tally), STATUS_OK);
    assert_int_equal(material_export_open(db, false, &export, NULL), STATUS_OK);
    for (; !is_last; pieces++) {
        assert_int_equal(material_export_next(&export, &piece, &is_last, NULL), STATUS_OK);
        assert_true(piece.count < 2000);
        piece.count = 0;
    }
    assert_true(pieces > 55);
    bytes_clear(&piece);
    free(table);
    db_close(db);
}
