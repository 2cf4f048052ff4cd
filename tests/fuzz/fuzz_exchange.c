// Mutated files of materials, tables and documents. Each is either imported or refused with faults
// that have a place, in a table a row and a column; what was imported is the same after export and
// import. For the instrumented build: build-debug/tests/fuzz_exchange SECONDS [SEED]. A text that
// breaks the rule is printed.
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <time.h>

#include "server/materials/exchange.h"
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
        return "failed for another reason than the text";
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

static Status import(Db *db, const char *text, size_t size, bool is_table, bool is_dry,
                     Problem *problem) {
    const ImportOptions options = {.is_table = is_table, .is_dry = is_dry, .may_all = true};
    ImportTally tally;
    return import_file(db, text, size, &options, &tally, problem);
}

// An export, imported into another database, is exported from there as the same bytes.
static const char *judge_round(Db *db, bool is_table, Problem *problem) {
    Bytes texts[2] = {{.most = 0}, {.most = 0}};
    Db *other = NULL, *databases[2] = {db, NULL};
    const char *wrong = NULL;
    if (db_open(NULL, &other, problem) != STATUS_OK)
        return "no second database";
    databases[1] = other;
    for (int i = 0; i < 2 && wrong == NULL; i++) {
        MaterialExport export;
        bool is_last = false;
        Status status = material_export_open(databases[i], is_table, &export, problem);
        while (status == STATUS_OK && !is_last)
            status = material_export_next(&export, &texts[i], &is_last, problem);
        if (status != STATUS_OK)
            wrong = "cannot be exported";
        else if (i == 0 &&
                 import(other, texts[0].at, texts[0].count, is_table, false, problem) != STATUS_OK)
            wrong = "its export cannot be imported";
    }
    if (wrong == NULL && strcmp(texts[0].at, texts[1].at) != 0)
        wrong = "comes back as something else";
    bytes_clear(&texts[0]);
    bytes_clear(&texts[1]);
    db_close(other);
    return wrong;
}

static const char *judge_import(const char *text, size_t size, bool is_table, Problem *problem) {
    Db *db = NULL;
    if (db_open(NULL, &db, problem) != STATUS_OK)
        return "no database";
    const char *wrong = "valid in a dry run, and refused";
    if (import(db, text, size, is_table, false, problem) == STATUS_OK)
        wrong = judge_round(db, is_table, problem);
    if (wrong == NULL)
        wrong = judge_round(db, !is_table, problem);
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
            const Status status = import(db, text, size, is_table, true, &problem);
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
