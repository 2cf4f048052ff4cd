// Files of materials, tables and documents, mutated: whatever comes in, reading ends with what can
// be imported or with faults that have a place, in a table a row and a column; what is judged and
// exported again reads as the same. Meant for the instrumented build:
// build-debug/tests/fuzz_exchange SECONDS [SEED]. What breaks the rule is printed.
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <time.h>

#include "server/formats/material_export.h"
#include "server/materials/exchange_csv.h"
#include "server/materials/exchange_json.h"
#include "tests/support/mutate.h"

enum { ROUNDS_TIMED = 64, ROUND_EACH = 200 };

static const char *const seeds[] = {
    "slug,name,restitution,contact_time [s],source\nfelt,Felt,0.5,0.02,own\ncork,\"Cork, 3 "
    "mm\",0.4,3e-3,=1+1\n",
    "row,slug,number,name,table,source,measurements,author,created,reviews,test\r\n"
    "revision,felt,1,Felt,\"[{\"\"approach_speed\"\": 0.1, \"\"restitution\"\": 0.5}, "
    "{\"\"approach_speed\"\": 0.2, \"\"restitution\"\": 0.4}]\",s,[1],,2026-01-01T00:00:00.000Z,"
    "\"[{\"\"status\"\": \"\"approved\"\", \"\"reason\"\": \"\"r\"\"}]\",\r\n"
    "measurement,felt,1,,,,,anna,,,\"{\"\"drops\"\": [{\"\"drop_height\"\": 1, "
    "\"\"rebound_height\"\": 0.2}]}\"\r\n",
    "\xEF\xBB\xBFslug,number,name,restitution,source,tags,notes,reverts\nsponge,1,Sponge,0.61,"
    "x,\"[\"\"a\"\"]\",\"two\nlines\",\nfelt,1,F,0.1,s,,\"\",\nfelt,2,F,0.1,s,,,1\n",
    "{\"format\": \"impactd-materials\", \"version\": 1, \"materials\": [{\"slug\": \"felt\", "
    "\"revisions\": [{\"revision\": 1, \"name\": \"Felt\", \"restitution\": 0.5, \"source\": "
    "\"s\", \"author\": null, \"reviews\": [{\"status\": \"approved\", \"reason\": \"r\"}]}], "
    "\"measurements\": [{\"measurement\": 1, \"test\": {\"drops\": [{\"contact_time\": "
    "0.01}]}}]}]}",
};

static const char *const pieces[] = {
    ",",       "\"",         "\"\"",        "\n",
    "\r\n",    "\r",         ";",           "[",
    "]",       "{",          "}",           ":",
    "null",    "1e999",      "-1",          "0",
    "NaN",     "\xff",       "\xEF",        "slug",
    "number",  "revision",   "measurement", "test",
    "row",     "[s]",        "[ms]",        "restitution",
    "felt",    "sponge",     "2",           "99999999999999999999",
    "\\u0061", "2026",       "approved",    "author",
    "[1,2]",   "{\"a\": 1}", "=1+1",        "\xEF\xBB\xBF",
};

static Mutator mutator = {
    .seeds = seeds, .pieces = pieces, .seed_count = COUNT(seeds), .piece_count = COUNT(pieces)};

static const char *judge_faults(Status status, bool is_table, const Problem *problem) {
    if (status != STATUS_INVALID && status != STATUS_UNREADABLE)
        return "failed for no fault of the text's";
    if (problem->count == 0)
        return "failed without a fault";
    for (size_t i = 0; i < problem->count && i < PROBLEM_FAULTS; i++) {
        const Fault *fault = &problem->faults[i];
        if (fault->detail[0] == '\0')
            return "a fault says nothing";
        if (is_table && fault->row == 0 && fault->pointer[0] != '\0')
            return "a fault of a table has no row";
    }
    return NULL;
}

// What was brought in comes out of another database as it went in.
static const char *judge_round(Db *db, Problem *problem) {
    Bytes texts[2] = {{.most = 0}, {.most = 0}};
    Exchange exchange = {.revision_room = 0};
    ImportTally metrics = {0};
    Db *other = NULL, *stores[2] = {db, NULL};
    const char *wrong = NULL;
    if (db_open(NULL, &other, problem) != STATUS_OK)
        return "no second database";
    stores[1] = other;
    for (int i = 0; i < 2 && wrong == NULL; i++) {
        MaterialExport text;
        bool is_last = false;
        Status status = material_export_open(stores[i], false, &text, problem);
        while (status == STATUS_OK && !is_last)
            status = material_export_next(&text, &texts[i], &is_last, problem);
        if (status != STATUS_OK)
            wrong = "cannot be exported";
        else if (i == 0 && (exchange_read_json(texts[0].at, texts[0].count, &exchange, problem) !=
                                STATUS_OK ||
                            exchange_import(&exchange, other, NULL, true, false, &metrics,
                                            problem) != STATUS_OK))
            wrong = "its export cannot be imported";
    }
    if (wrong == NULL && strcmp(texts[0].at, texts[1].at) != 0)
        wrong = "comes back as something else";
    exchange_clear(&exchange);
    bytes_clear(&texts[0]);
    bytes_clear(&texts[1]);
    db_close(other);
    return wrong;
}

// Reads a text and imports it.
static Status bring(Db *db, const char *text, size_t size, bool is_table, bool is_dry,
                    Problem *problem) {
    Exchange exchange = {.revision_room = 0};
    ImportTally metrics;
    Status status =
        (is_table ? exchange_read_csv : exchange_read_json)(text, size, &exchange, problem);
    if (status == STATUS_OK || status == STATUS_INVALID)
        status = exchange_import(&exchange, db, NULL, true, is_dry, &metrics, problem);
    exchange_clear(&exchange);
    if (is_table)
        exchange_place_faults(problem);
    return status;
}

static const char *judge_import(const char *text, size_t size, bool is_table, Problem *problem) {
    Db *db = NULL;
    if (db_open(NULL, &db, problem) != STATUS_OK)
        return "no database";
    const char *wrong = bring(db, text, size, is_table, false, problem) == STATUS_OK
                            ? judge_round(db, problem)
                            : "judged as good, and refused";
    db_close(db);
    return wrong;
}

int main(int argc, char **argv) {
    static Problem problem;
    const double seconds = argc > 1 ? atof(argv[1]) : 10;
    mutator.state = argc > 2 ? strtoull(argv[2], NULL, 10) : 1;
    const time_t start = time(NULL);
    unsigned long long rounds = 0, passed = 0;
    Db *db = NULL; // of the paper's five alone
    if (db_open(NULL, &db, &problem) != STATUS_OK)
        return 1;
    while (difftime(time(NULL), start) < seconds)
        for (int i = 0; i < ROUNDS_TIMED; i++, rounds++) {
            size_t size;
            char *text = mutate_text(&mutator, &size);
            if (text == NULL)
                return 1;
            const bool is_table = size == 0 || text[0] != '{';
            problem = (Problem){.count = 0};
            const Status status = bring(db, text, size, is_table, true, &problem);
            const char *wrong = status != STATUS_OK ? judge_faults(status, is_table, &problem)
                                : passed++ % ROUND_EACH == 0
                                    ? judge_import(text, size, is_table, &problem)
                                    : NULL;
            if (wrong != NULL) {
                fprintf(stderr, "%s: ", problem.detail);
                return mutate_refuse(wrong, text, size);
            }
            free(text);
        }
    printf("%llu texts, %llu of them good\n", rounds, passed);
    db_close(db);
    return 0;
}
