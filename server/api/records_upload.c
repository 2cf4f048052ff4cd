// Both ways fill the same struct, whose rows judge it; the file's layouts are those of `impactd
// import`.
#include "server/api/records_upload.h"

#include <stdlib.h>
#include <string.h>

#include "core/base/json_pointer.h"
#include "core/base/spelling.h"
#include "core/formats/ground_motion_text.h"
#include "server/http/header.h"
#include "server/http/reply.h"
#include "server/json/parse.h"
#include "server/util/clock.h"

typedef struct Asked {
    char *name, *source, *processing, *earthquake, *station, *notes;
    double interval;
    int unit;
    Reals samples;
} Asked;

#define INTERVAL_MIN 1e-9
#define INTERVAL_MAX 1e6

// clang-format off
static const Field asked_fields[] = {
    FIELD_TEXT(Asked, name, RECORD_NAME_SIZE - 1, PRESENCE_REQUIRED, 0, "what scenes call it: letters, digits, dot, underscore and dash"),
    FIELD_TEXT(Asked, source, 1000, PRESENCE_OPTIONAL, 0, "where the file comes from"),
    FIELD_TEXT(Asked, processing, 1000, PRESENCE_OPTIONAL, 0, "what was done to it: filters, baseline"),
    FIELD_TEXT(Asked, earthquake, 200, PRESENCE_OPTIONAL, 0, "which one"),
    FIELD_TEXT(Asked, station, 200, PRESENCE_OPTIONAL, 0, "where it was measured, and in which direction"),
    FIELD_TEXT(Asked, notes, 4000, PRESENCE_OPTIONAL, 0, "what else one should know"),
    FIELD_REAL(Asked, interval, "s", WITHIN(INTERVAL_MIN, INTERVAL_MAX), REQUIRED, "time between samples"),
    FIELD_CHOICE(Asked, unit, acceleration_unit_names, OPTIONAL, "of the samples: g, m/s^2 (if absent) or cm/s^2"),
    FIELD_REALS(Asked, samples, NULL, ANY, RECORD_SAMPLES, PRESENCE_REQUIRED, "base acceleration from the start on"),
    FIELD_END
};
// clang-format on

void record_upload_clear(RecordUpload *upload) {
    record_row_clear(&upload->row);
    free(upload->samples.at);
    warnings_clear(&upload->warnings);
    *upload = (RecordUpload){.samples = {NULL, 0}};
}

static Status upload_no_memory(Problem *problem) {
    return problem_set(problem, STATUS_NO_MEMORY, "no memory for the record");
}

static Status upload_read_document(const Request *request, Asked *asked, RecordRow *row,
                                   Problem *problem) {
    if (request->query_count > 0)
        return problem_set(problem, STATUS_USAGE,
                           "beside JSON there is no query: \"%.40s\" is a member of the document",
                           request->queries[0].name);
    TRY(json_parse(request->body, request->body_size, asked_fields, asked, problem));
    row->layout = strdup("json");
    if (asked->unit == CHOICE_ABSENT)
        asked->unit = ACCELERATION_METRES;
    return row->layout != NULL ? STATUS_OK : upload_no_memory(problem);
}

static Status upload_read_name(const Request *request, const char *name, char **target,
                               Problem *problem) {
    const char *text = request_query(request, name);
    if (text == NULL || *text == '\0')
        return STATUS_OK;
    *target = strdup(text);
    return *target != NULL ? STATUS_OK : upload_no_memory(problem);
}

static Status upload_read_queries(const Request *request, Asked *asked, Problem *problem) {
    TRY(upload_read_name(request, "name", &asked->name, problem));
    TRY(upload_read_name(request, "source", &asked->source, problem));
    TRY(upload_read_name(request, "processing", &asked->processing, problem));
    TRY(upload_read_name(request, "earthquake", &asked->earthquake, problem));
    TRY(upload_read_name(request, "station", &asked->station, problem));
    TRY(upload_read_name(request, "notes", &asked->notes, problem));
    TRY(request_number(request, "interval", INTERVAL_MIN, INTERVAL_MAX, (double)NAN,
                       &asked->interval, problem));
    const char *unit = request_query(request, "unit");
    for (int i = 0; unit != NULL && acceleration_unit_names[i] != NULL; i++)
        if (strcmp(acceleration_unit_names[i], unit) == 0)
            asked->unit = i;
    return unit == NULL || asked->unit != CHOICE_ABSENT
               ? STATUS_OK
               : spelling_reject(acceleration_unit_names, unit, "/unit", problem);
}

static Status upload_warn_file(const GroundMotionText *import, bool is_told, Warnings *warnings) {
    const char *unit = acceleration_unit_names[import->unit];
    char start[32];
    if (import->stated_unit == CHOICE_ABSENT && !is_told)
        TRY(warnings_add(warnings, "/unit", "the file tells no unit, %s is taken", unit));
    if (import->stated_unit != CHOICE_ABSENT && import->stated_unit != import->unit)
        TRY(warnings_add(warnings, "/unit", "the file tells %s, %s is taken",
                         acceleration_unit_names[import->stated_unit], unit));
    if (import->start != 0)
        TRY(warnings_add(warnings, "/samples",
                         "begin at %s s in the file; the record begins at 0 s",
                         text_real(start, import->start)));
    return STATUS_OK;
}

// Takes out of the import what the record keeps.
static Status upload_keep_import(GroundMotionText *import, Asked *asked, RecordUpload *upload,
                                 Problem *problem) {
    RecordRow *row = &upload->row;
    const bool is_told = asked->unit != CHOICE_ABSENT;
    row->layout = strdup(import->layout);
    row->header = import->header[0] != '\0' ? strdup(import->header) : NULL;
    if (import->stated_unit != CHOICE_ABSENT)
        row->stated_unit = strdup(acceleration_unit_names[import->stated_unit]);
    asked->unit = import->unit;
    asked->interval = import->interval;
    upload->samples = import->samples;
    import->samples = (Reals){NULL, 0};
    const bool is_whole = row->layout != NULL &&
                          (row->header != NULL || import->header[0] == '\0') &&
                          (row->stated_unit != NULL || import->stated_unit == CHOICE_ABSENT);
    return is_whole && upload_warn_file(import, is_told, &upload->warnings) == STATUS_OK
               ? STATUS_OK
               : upload_no_memory(problem);
}

// `text` is the caller's.
static Status upload_read_table(const char *text, size_t size, Asked *asked, RecordUpload *upload,
                                Problem *problem) {
    const GroundMotionOptions wanted = {.interval = asked->interval, .unit = asked->unit};
    GroundMotionText import = {0};
    Problem *fault = calloc(1, sizeof *fault);
    if (fault == NULL)
        return upload_no_memory(problem);
    Status status = ground_motion_text_read(text, size, RECORD_SAMPLES, &wanted, &import, fault);
    if (status != STATUS_OK && fault->count > 0) // its places are lines, no pointers
        (void)problem_add(problem, status, "", "%s: %s", fault->faults[0].pointer,
                          fault->faults[0].detail);
    else if (status != STATUS_OK)
        (void)problem_set(problem, status, "%s", fault->detail);
    free(fault);
    if (status == STATUS_OK) {
        status = upload_keep_import(&import, asked, upload, problem);
        ground_motion_text_clear(&import);
    }
    return status;
}

// The file in the body, and everything else in the query.
static Status upload_read_file(const Request *request, Asked *asked, RecordUpload *upload,
                               Problem *problem) {
    const Status queries = upload_read_queries(request, asked, problem);
    if (queries != STATUS_OK && queries != STATUS_INVALID)
        return queries;
    // In text/csv a comma parts two cells; elsewhere it might be a decimal one and is a fault.
    if (!header_type_is(request->content_type, "text/csv")) {
        const Status status =
            upload_read_table(request->body, request->body_size, asked, upload, problem);
        return queries != STATUS_OK ? queries : status;
    }
    char *text = malloc(request->body_size + 1);
    if (text == NULL)
        return upload_no_memory(problem);
    for (size_t i = 0; i < request->body_size; i++)
        text[i] = request->body[i] == ',' ? ' ' : request->body[i];
    text[request->body_size] = '\0';
    const Status status = upload_read_table(text, request->body_size, asked, upload, problem);
    free(text);
    return queries != STATUS_OK ? queries : status;
}

static Status upload_require_type(const Request *request, bool *is_json, Problem *problem) {
    static const char *const texts[] = {"text/plain", "application/octet-stream", "text/csv"};
    *is_json = header_type_is(request->content_type, type_json);
    bool is_known = *is_json;
    for (size_t i = 0; i < COUNT(texts); i++)
        is_known = is_known || header_type_is(request->content_type, texts[i]);
    if (!is_known)
        return problem_set(
            problem, STATUS_UNSUPPORTED_TYPE,
            "the body must be a ground motion's file as text/plain with ?name=NAME, or "
            "application/json, is %.60s; with curl use -H 'Content-Type: text/plain' "
            "--data-binary @motion.AT2",
            request->content_type != NULL ? request->content_type : "of no given type");
    return request_require_body(request, problem);
}

static Status upload_check_name(const Asked *asked, Problem *problem) {
    if (asked->name == NULL || record_name_is_sound(asked->name) ||
        problem_concerns(problem, "/name"))
        return STATUS_OK; // or told by the rows
    Fault fault = {.pointer = "/name",
                   .detail = "must be 1 to 64 letters, digits, dots, underscores and dashes, the "
                             "first a letter or a digit"};
    text_quote(fault.value, sizeof fault.value, asked->name);
    return problem_add_fault(problem, STATUS_INVALID, &fault);
}

// To m/s^2, and -0 to 0, so that what means the same has one digest.
static Status upload_scale(Reals *samples, double size, Problem *problem) {
    for (size_t i = 0; i < samples->count; i++) {
        char place[64];
        const double value = samples->at[i] * size + 0.0;
        if (!isfinite(value)) {
            json_pointer_index(place, sizeof place, "/samples", i);
            return problem_add_real(problem, STATUS_INVALID, place, samples->at[i], NULL,
                                    "is too large to be an acceleration in m/s^2");
        }
        samples->at[i] = value;
    }
    return STATUS_OK;
}

static char *upload_take(char **text) {
    char *taken = *text;
    *text = NULL;
    return taken;
}

static Status upload_measure(Asked *asked, RecordUpload *upload, Problem *problem) {
    RecordRow *row = &upload->row;
    char digest[RECORD_DIGEST_SIZE];
    const RecordLook look = record_look(&upload->samples, asked->interval, 1);
    record_digest(asked->interval, &upload->samples, digest);
    row->name = upload_take(&asked->name);
    row->source = upload_take(&asked->source);
    row->processing = upload_take(&asked->processing);
    row->earthquake = upload_take(&asked->earthquake);
    row->station = upload_take(&asked->station);
    row->notes = upload_take(&asked->notes);
    row->unit = strdup(acceleration_unit_names[asked->unit]);
    row->digest = digest[0] != '\0' ? strdup(digest) : NULL;
    row->interval = asked->interval;
    row->count = upload->samples.count;
    row->peak = fmax(look.highest, -look.lowest);
    row->peak_time = (double)look.peak_at / (1 / asked->interval);
    row->peak_velocity = look.peak_velocity;
    row->end_velocity = look.end_velocity;
    row->created_unix_ms = clock_unix_ms();
    if (row->unit == NULL || row->digest == NULL)
        return upload_no_memory(problem);
    if (!isfinite(look.peak_velocity) || !isfinite(row->peak_time))
        return problem_add(problem, STATUS_INVALID, "/samples",
                           "must move the base at a speed that a number can hold");
    return STATUS_OK;
}

static Status upload_warn(const RecordUpload *upload, Warnings *warnings) {
    const RecordRow *row = &upload->row;
    const RecordLook look = record_look(&upload->samples, row->interval, 1);
    Problem *doubts = calloc(1, sizeof *doubts);
    if (doubts == NULL)
        return STATUS_NO_MEMORY;
    record_look_doubt(&look, "", "/samples", doubts);
    Status status = STATUS_OK;
    for (size_t i = 0; i < doubts->count && status == STATUS_OK; i++)
        status = warnings_add(warnings, doubts->faults[i].pointer, "%s", doubts->faults[i].detail);
    free(doubts);
    TRY(status);
    if (row->source == NULL)
        TRY(warnings_add(warnings, "/source", "is not told: say where the file comes from"));
    if (row->processing == NULL)
        TRY(warnings_add(warnings, "/processing",
                         "is not told: the same earthquake with another filter or baseline is "
                         "another record"));
    return STATUS_OK;
}

static Status upload_validate(Asked *asked, RecordUpload *upload, Problem *problem) {
    if (upload->samples.count > 0) // of a file: they are lent to the rows that judge them
        asked->samples = upload->samples;
    const Status rows = fields_validate(asked_fields, asked, "", problem);
    const Status name = upload_check_name(asked, problem);
    upload->samples = asked->samples;
    asked->samples = (Reals){NULL, 0};
    TRY(rows);
    TRY(name);
    return STATUS_OK;
}

Status record_upload_read(const Request *request, RecordUpload *upload, Problem *problem) {
    Asked asked;
    bool is_json;
    *upload = (RecordUpload){.samples = {NULL, 0}};
    problem->whose = "record";
    TRY(upload_require_type(request, &is_json, problem));
    if (fields_default(asked_fields, &asked) != STATUS_OK)
        return upload_no_memory(problem);
    Status status = is_json ? upload_read_document(request, &asked, &upload->row, problem)
                            : upload_read_file(request, &asked, upload, problem);
    // A file that cannot be read has no samples that could be missing.
    if (status == STATUS_OK || (is_json && status == STATUS_INVALID)) {
        const Status judged = upload_validate(&asked, upload, problem);
        status = status == STATUS_OK ? judged : status;
    }
    if (status == STATUS_OK && is_json)
        status = upload_scale(&upload->samples, acceleration_unit_size(asked.unit), problem);
    else if (status == STATUS_OK)
        status = upload_scale(&upload->samples, 1, problem);
    if (status == STATUS_OK)
        status = upload_measure(&asked, upload, problem);
    if (status == STATUS_OK && upload_warn(upload, &upload->warnings) != STATUS_OK)
        status = upload_no_memory(problem);
    fields_clear(asked_fields, &asked);
    return status;
}
