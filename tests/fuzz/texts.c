// Texts that are read without a daemon: scenes and studies, materials, ground motions, force
// traces, heads of requests.
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "core/base/rfc3339.h"
#include "core/excitation/recorded_motion.h"
#include "core/formats/force_trace_text.h"
#include "core/formats/ground_motion_text.h"
#include "server/http/header.h"
#include "server/http/request.h"
#include "server/jobs/documents.h"
#include "server/jobs/jobs_private.h"
#include "server/materials/exchange.h"
#include "server/util/units.h"
#include "tests/fuzz/fuzz.h"

static Problem problem;

static Db *database_open(void) {
    Db *db = NULL;
    problem_clear(&problem);
    fuzz_check(db_open(NULL, &db, &problem) == STATUS_OK, "a database in memory can be opened");
    return db;
}

// A scene, perhaps with a study. What is accepted is the same scene when it is read again from the
// form in which it is stored.
void fuzz_scene(const char *text, size_t size) {
    static const SimulationLimits limits = {
        .samples = 1 << 16, .impacts = 1 << 12, .steps = 1e6, .bytes = 1e8, .points = 1000};
    static Db *db;
    if (db == NULL)
        db = database_open();
    StudyRequest request, again;
    Warnings warnings = {NULL, 0};
    problem_clear(&problem);
    const Status status = jobs_prepare(db, text, size, &limits, &request, &warnings, &problem);
    if (status == STATUS_OK) {
        char id[72];
        bool is_same = false;
        Bytes scene = {0};
        document_scene(&scene, &request);
        fuzz_check(jobs_result_id(&request, id, &problem) == STATUS_OK, "a scene has an id");
        fuzz_check(jobs_prepare_stored(db, scene.at, id, &again, &is_same, &problem) == STATUS_OK,
                   "a completed scene can be read");
        fuzz_check(is_same, "a completed scene that is read again keeps its id");
        study_request_clear(&again);
        bytes_clear(&scene);
    } else {
        fuzz_check_problem(&problem);
    }
    study_request_clear(&request);
    warnings_clear(&warnings);
}

static Status materials_import(Db *db, const char *text, size_t size, bool is_table, bool is_dry) {
    const ImportOptions options = {.is_table = is_table, .is_dry = is_dry, .may_all = true};
    ImportTally tally;
    problem_clear(&problem);
    return import_file(db, text, size, &options, &tally, &problem);
}

static void materials_export(Db *db, bool is_table, Bytes *text) {
    MaterialExport export;
    bool is_last = false;
    Status status = material_export_open(db, is_table, &export, &problem);
    while (status == STATUS_OK && !is_last)
        status = material_export_next(&export, text, &is_last, &problem);
    fuzz_check(status == STATUS_OK, "materials can be exported");
}

// An export, imported into another database, is exported from there as the same bytes.
static void materials_check_round(Db *db, bool is_table) {
    Bytes first = {0}, second = {0};
    Db *other = database_open();
    materials_export(db, is_table, &first);
    fuzz_check(materials_import(other, first.at, first.count, is_table, false) == STATUS_OK,
               "an export can be imported");
    materials_export(other, is_table, &second);
    fuzz_check(first.count == second.count && memcmp(first.at, second.at, first.count) == 0,
               "an imported export is exported as the same bytes");
    bytes_clear(&first);
    bytes_clear(&second);
    db_close(other);
}

// A file of materials: a document, or a table. Faults of a table have a row.
void fuzz_materials(const char *text, size_t size) {
    static Db *empty; // has the built-in materials alone
    if (empty == NULL)
        empty = database_open();
    const bool is_table = size == 0 || text[0] != '{';
    const Status status = materials_import(empty, text, size, is_table, true);
    if (status == STATUS_OK) {
        Db *db = database_open();
        fuzz_check(materials_import(db, text, size, is_table, false) == STATUS_OK,
                   "what a dry run accepts can be imported");
        materials_check_round(db, is_table);
        materials_check_round(db, !is_table);
        db_close(db);
        return;
    }
    fuzz_check(status == STATUS_INVALID || status == STATUS_UNREADABLE,
               "an import fails because of its text");
    fuzz_check_problem(&problem);
    fuzz_check(problem.count > 0, "an import that fails has faults");
    for (size_t i = 0; i < problem.count && i < PROBLEM_FAULTS; i++)
        fuzz_check(!is_table || problem.faults[i].row > 0 || problem.faults[i].pointer[0] == '\0',
                   "a fault of a table has a row");
}

static void reals_check(const Reals *samples, double interval) {
    fuzz_check(samples->count >= 2, "there are samples");
    fuzz_check(interval > 0 && isfinite(interval), "the interval is a positive number");
    for (size_t i = 0; i < samples->count; i++)
        fuzz_check(isfinite(samples->at[i]), "a sample is a number");
}

// The first byte is what the caller knows of the file: 'i' or more has the bits interval and unit.
void fuzz_motion(const char *text, size_t size) {
    if (size == 0)
        return;
    const int bits = text[0] - 'i';
    const GroundMotionOptions options = {(bits & 1) != 0 ? 0.01 : (double)NAN, (bits >> 1 & 3) - 1};
    GroundMotionText motion;
    problem_clear(&problem);
    const Status status =
        ground_motion_text_read(text + 1, size - 1, RECORD_SAMPLES, &options, &motion, &problem);
    if (status == STATUS_OK) {
        reals_check(&motion.samples, motion.interval);
    } else {
        fuzz_check_problem(&problem);
        fuzz_check(problem.count == 1 && strncmp(problem.faults[0].pointer, "line ", 5) == 0,
                   "there is one fault, at a line");
        fuzz_check(motion.samples.at == NULL && motion.header == NULL, "a failure leaves nothing");
    }
    ground_motion_text_clear(&motion);
}

// The first byte likewise.
void fuzz_trace(const char *text, size_t size) {
    if (size == 0)
        return;
    double interval = (text[0] - 'i') % 2 != 0 ? 0.01 : (double)NAN;
    Reals force = {0};
    problem_clear(&problem);
    const Status status =
        force_trace_text_read(text + 1, size - 1, 10000, &interval, &force, &problem);
    if (status == STATUS_OK)
        reals_check(&force, interval);
    else
        fuzz_check_problem(&problem);
    free(force.at);
}

static void head_check_values(const Request *request) {
    static const char *const types[] = {"application/json", "text/csv; charset=utf-8", NULL};
    enum { SIZE = 1000 };
    size_t first = SIZE, last = SIZE, size;
    if (header_range(request->range, SIZE, &first, &last) == RANGE_PART)
        fuzz_check(first <= last && last < SIZE, "a range is within the body");
    const int type = header_accept(request->accept, types);
    fuzz_check(type >= -1 && type < 2, "a type is one that is offered");
    (void)header_accepts_gzip(request->accept_encoding);
    const Prefer prefer = header_prefer(request->prefer);
    fuzz_check(!prefer.has_wait || prefer.wait >= 0, "a wait is not negative");
    const char *list = request->if_match != NULL ? request->if_match : "", *tag;
    (void)header_etag_matches(request->if_none_match, "\"a\"");
    while (header_etag_next(&list, &tag, &size)) {
        char *own = fuzz_copy(tag, size);
        fuzz_check(header_etag_matches(request->if_match, own), "a tag of a list matches it");
        free(own);
    }
}

static void head_check_queries(const Request *request) {
    static const char *const names[] = {"json", "csv", NULL};
    static const Field fields[] = {
        {.name = "q", .kind = FIELD_KIND_TEXT, .presence = PRESENCE_OPTIONAL},
        {.kind = FIELD_KIND_END}};
    char *q = NULL, reason[QUANTITY_REASON];
    for (size_t i = 0; i < request->query_count; i++) {
        const char *name = request->queries[i].name, *text;
        double real;
        size_t count;
        bool flag;
        int choice;
        int64_t unix_ms;
        if (request_number(request, name, -2, 1e6, 1, &real, &problem) == STATUS_OK)
            fuzz_check(real >= -2 && real <= 1e6, "a number is within its range");
        if (request_count(request, name, 1, 500, 1, &count, &problem) == STATUS_OK)
            fuzz_check(count >= 1 && count <= 500, "a count is within its range");
        (void)request_flag(request, name, &flag, &problem);
        if (request_choice(request, name, names, -1, &choice, &problem) == STATUS_OK)
            fuzz_check(choice >= -1 && choice < 2, "a choice is one of the names");
        if (request_text(request, name, &text, &problem) == STATUS_OK && text != NULL) {
            (void)rfc3339_read(text, &unix_ms);
            if (quantity_read(text, "m", &real, reason))
                fuzz_check(isfinite(real), "a quantity is a number");
        }
    }
    (void)request_read_fields(request, fields, &q, &problem);
    free(q);
}

// The text up to `end`, which is cut off *rest; NULL behind the last one.
static char *text_cut(char **rest, char end) {
    char *piece = *rest, *stop = piece != NULL ? strchr(piece, end) : NULL;
    if (stop != NULL)
        *stop++ = '\0';
    *rest = stop;
    return piece;
}

// The head of a request as the library gives it to us: METHOD TARGET VERSION, then a line for each
// header, name and value with a colon between.
void fuzz_head(const char *text, size_t size) {
    static const char *const origins[] = {"https://lab.example.org", NULL};
    const AcceptedHosts hosts = {loopback_hosts.names, size % 2 == 0, origins};
    char *copy = fuzz_copy(text, size), *rest = copy;
    const char *method = text_cut(&rest, ' '), *target = text_cut(&rest, ' '),
               *version = text_cut(&rest, '\n');
    if (target != NULL && version != NULL) {
        Request request = {.method = method};
        for (char *line; (line = text_cut(&rest, '\n')) != NULL;) {
            const char *name = text_cut(&line, ':');
            request_header(&request, name, strlen(name), line, line != NULL ? strlen(line) : 0);
        }
        problem_clear(&problem);
        const int code = request_validate(&request, &hosts, target, version, &problem);
        if (code != 0) {
            fuzz_check(code >= 400 && code <= 505, "a head is refused by a code of errors");
            fuzz_check_problem(&problem);
        }
        problem_clear(&problem);
        if (request_open(&request, target, &problem) == STATUS_OK)
            head_check_queries(&request);
        else
            fuzz_check_problem(&problem);
        head_check_values(&request);
        request_close(&request);
    }
    free(copy);
}
