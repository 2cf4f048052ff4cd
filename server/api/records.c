// Ground-motion records: upload, list, one with what uses it, its samples, deletion. An upload is a
// file as it is published, with the rest in the query, or all of it as JSON; both fill one struct,
// whose rows validate it.
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "core/base/json_pointer.h"
#include "core/base/spelling.h"
#include "core/excitation/recorded_motion.h"
#include "core/formats/ground_motion_text.h"
#include "server/api/app.h"
#include "server/db/records.h"
#include "server/http/access.h"
#include "server/http/header.h"
#include "server/jobs/documents.h"
#include "server/json/encode.h"
#include "server/json/parse.h"
#include "server/util/base_path.h"
#include "server/util/clock.h"

typedef struct RecordUpload {
    RecordRow row;
    int unit;          // of the samples as they came
    Reals samples;     // [m/s^2], once it is read
    Warnings warnings; // of what is allowed but unlikely
} RecordUpload;

#define INTERVAL_MIN 1e-9
#define INTERVAL_MAX 1e6

// clang-format off
static const Field upload_row_fields[] = {
    FIELD_TEXT(RecordRow, name, RECORD_NAME_SIZE - 1, PRESENCE_REQUIRED, 0, "what scenes call it: letters, digits, dot, underscore and dash"),
    FIELD_TEXT(RecordRow, source, 1000, PRESENCE_OPTIONAL, 0, "where the file comes from"),
    FIELD_TEXT(RecordRow, processing, 1000, PRESENCE_OPTIONAL, 0, "what was done to it: filters, baseline"),
    FIELD_TEXT(RecordRow, earthquake, 200, PRESENCE_OPTIONAL, 0, "which one"),
    FIELD_TEXT(RecordRow, station, 200, PRESENCE_OPTIONAL, 0, "where it was measured, and in which direction"),
    FIELD_TEXT(RecordRow, notes, 4000, PRESENCE_OPTIONAL, 0, "what else one should know"),
    FIELD_REAL(RecordRow, interval, "s", WITHIN(INTERVAL_MIN, INTERVAL_MAX), REQUIRED, "time between samples"),
    FIELD_END
};

static const Field upload_fields[] = {
    FIELD_BASE(RecordUpload, row, upload_row_fields),
    FIELD_CHOICE(RecordUpload, unit, acceleration_unit_names, OPTIONAL, "of the samples: g, m/s^2 (if absent) or cm/s^2"),
    FIELD_REALS(RecordUpload, samples, NULL, ANY, RECORD_SAMPLES, PRESENCE_REQUIRED, "base acceleration from the start on"),
    FIELD_END
};
// clang-format on

static void upload_clear(RecordUpload *upload) {
    record_row_clear(&upload->row);
    free(upload->samples.at);
    warnings_clear(&upload->warnings);
}

static Status upload_no_memory(Problem *problem) {
    return problem_set(problem, STATUS_NO_MEMORY, "no memory for the record");
}

static Status upload_copy(char **target, const char *text, Problem *problem) {
    *target = strdup(text);
    return *target != NULL ? STATUS_OK : upload_no_memory(problem);
}

static Status upload_read_document(const Request *request, RecordUpload *upload, Problem *problem) {
    TRY(request_read_document(request, upload_fields, upload, problem));
    if (upload->unit == CHOICE_ABSENT)
        upload->unit = ACCELERATION_METRES;
    return upload_copy(&upload->row.layout, "json", problem);
}

static Status upload_warn_file(const GroundMotionText *file, bool has_unit, Warnings *warnings) {
    const char *unit = acceleration_unit_names[file->unit];
    char start[32];
    if (file->stated_unit == CHOICE_ABSENT && !has_unit)
        TRY(warnings_add(warnings, "/unit", "the file states no unit, %s is assumed", unit));
    if (file->stated_unit != CHOICE_ABSENT && file->stated_unit != file->unit)
        TRY(warnings_add(warnings, "/unit", "the file states %s, %s is used",
                         acceleration_unit_names[file->stated_unit], unit));
    if (file->start != 0)
        TRY(warnings_add(warnings, "/samples",
                         "begin at %s s in the file; the record begins at 0 s",
                         text_real(start, file->start)));
    return STATUS_OK;
}

// Takes out of the file what the record keeps.
static Status upload_take_file(GroundMotionText *file, RecordUpload *upload, Problem *problem) {
    RecordRow *row = &upload->row;
    const bool has_unit = upload->unit != CHOICE_ABSENT;
    upload->unit = file->unit;
    row->interval = file->interval;
    upload->samples = file->samples;
    file->samples = (Reals){NULL, 0};
    TRY(upload_copy(&row->layout, file->layout, problem));
    if (file->header[0] != '\0')
        TRY(upload_copy(&row->header, file->header, problem));
    if (file->stated_unit != CHOICE_ABSENT)
        TRY(upload_copy(&row->stated_unit, acceleration_unit_names[file->stated_unit], problem));
    return upload_warn_file(file, has_unit, &upload->warnings) == STATUS_OK
               ? STATUS_OK
               : upload_no_memory(problem);
}

Status records_read_motion(const Request *request, const GroundMotionOptions *options,
                           GroundMotionText *motion, Problem *problem) {
    char *text = malloc(request->body_size + 1);
    Problem *fault = calloc(1, sizeof *fault);
    Status status = STATUS_NO_MEMORY;
    if (text != NULL && fault != NULL) {
        memcpy(text, request->body, request->body_size + 1);
        // In text/csv a comma parts two cells; elsewhere it might be a decimal one and is a fault.
        if (header_type_is(request->content_type, "text/csv"))
            for (char *at = text;
                 (at = memchr(at, ',', request->body_size - (size_t)(at - text))) != NULL;)
                *at = ' ';
        status = ground_motion_text_read(text, request->body_size, RECORD_SAMPLES, options, motion,
                                         fault);
        if (status != STATUS_OK && fault->count > 0) // its places are lines, no pointers
            (void)problem_add(problem, status, "", "%s: %s", fault->faults[0].pointer,
                              fault->faults[0].detail);
        else if (status != STATUS_OK)
            (void)problem_set(problem, status, "%s", fault->detail);
    } else {
        (void)problem_set(problem, status, "no memory for the file");
    }
    free(text);
    free(fault);
    return status;
}

// The file in the body, and everything else in the query; faults of both are reported.
static Status upload_read_file(const Request *request, RecordUpload *upload, Problem *problem) {
    TRY(request_number(request, "interval", INTERVAL_MIN, INTERVAL_MAX, (double)NAN,
                       &upload->row.interval, problem));
    const Status queries = request_read_fields(request, upload_fields, upload, problem);
    if (queries != STATUS_OK && queries != STATUS_INVALID)
        return queries;
    const GroundMotionOptions options = {.interval = upload->row.interval, .unit = upload->unit};
    GroundMotionText file = {0};
    Status status = records_read_motion(request, &options, &file, problem);
    if (status == STATUS_OK)
        status = upload_take_file(&file, upload, problem);
    ground_motion_text_clear(&file);
    return queries != STATUS_OK ? queries : status;
}

static Status upload_check_name(const char *name, Problem *problem) {
    if (name == NULL || record_name_is_sound(name) || problem_concerns(problem, "/name"))
        return STATUS_OK; // or reported by the rows
    Fault fault = {.pointer = "/name",
                   .detail = "must be 1 to 64 letters, digits, dots, underscores and dashes, the "
                             "first a letter or a digit"};
    text_quote(fault.value, sizeof fault.value, name);
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

static Status upload_warn(const RecordLook *look, const RecordRow *row, Warnings *warnings) {
    Problem *doubts = calloc(1, sizeof *doubts);
    if (doubts == NULL)
        return STATUS_NO_MEMORY;
    record_look_doubt(look, "", "/samples", doubts);
    Status status = STATUS_OK;
    for (size_t i = 0; i < doubts->count && status == STATUS_OK; i++)
        status = warnings_add(warnings, doubts->faults[i].pointer, "%s", doubts->faults[i].detail);
    free(doubts);
    if (status == STATUS_OK && row->source == NULL)
        status = warnings_add(warnings, "/source", "is missing: state where the file comes from");
    if (status == STATUS_OK && row->processing == NULL)
        status = warnings_add(warnings, "/processing",
                              "is missing: the same earthquake with another filter or baseline is "
                              "another record");
    return status;
}

static Status upload_measure(RecordUpload *upload, Problem *problem) {
    RecordRow *row = &upload->row;
    const RecordLook look = record_look(&upload->samples, row->interval, 1);
    row->created_unix_ms = clock_unix_ms();
    if (record_row_measure(row, &upload->samples, upload->unit) != STATUS_OK)
        return upload_no_memory(problem);
    if (!isfinite(look.peak_velocity) || !isfinite(row->peak_time))
        return problem_add(problem, STATUS_INVALID, "/samples",
                           "must move the base at a speed that a number can hold");
    return upload_warn(&look, row, &upload->warnings) == STATUS_OK ? STATUS_OK
                                                                   : upload_no_memory(problem);
}

// Cleared by upload_clear in any case.
static Status upload_read(const Request *request, RecordUpload *upload, Problem *problem) {
    bool is_json;
    problem->whose = "record";
    static const char *const texts[] = {"text/plain", "application/octet-stream", "text/csv", NULL};
    TRY(request_require_type(
        request, texts,
        "a ground motion's file as text/plain with ?name=NAME, or "
        "application/json",
        "; with curl use -H 'Content-Type: text/plain' --data-binary @motion.AT2", &is_json,
        problem));
    if (fields_default(upload_fields, upload) != STATUS_OK)
        return upload_no_memory(problem);
    Status status = is_json ? upload_read_document(request, upload, problem)
                            : upload_read_file(request, upload, problem);
    // A file that cannot be read has no samples that could be missing.
    if (status == STATUS_OK || (is_json && status == STATUS_INVALID)) {
        const Status rows = fields_validate(upload_fields, upload, "", problem);
        const Status name = upload_check_name(upload->row.name, problem);
        status = status != STATUS_OK ? status : rows != STATUS_OK ? rows : name;
    }
    TRY(status);
    TRY(upload_scale(&upload->samples, is_json ? acceleration_unit_size(upload->unit) : 1,
                     problem));
    return upload_measure(upload, problem);
}

enum { LIST_INITIAL = 50, LIST_MAX = 500 };

// clang-format off
static const Field record_fields[] = {
    FIELD_TEXT(RecordRow, name, 0, PRESENCE_OPTIONAL, 0, "what scenes call it"),
    FIELD_TEXT(RecordRow, earthquake, 0, PRESENCE_OPTIONAL, 0, "which one"),
    FIELD_TEXT(RecordRow, station, 0, PRESENCE_OPTIONAL, 0, "where it was measured"),
    FIELD_TEXT(RecordRow, source, 0, PRESENCE_OPTIONAL, 0, "where the file comes from"),
    FIELD_TEXT(RecordRow, processing, 0, PRESENCE_OPTIONAL, 0, "what was done to it"),
    FIELD_TEXT(RecordRow, notes, 0, PRESENCE_OPTIONAL, 0, "what else one should know"),
    FIELD_TEXT(RecordRow, layout, 0, PRESENCE_OPTIONAL, 0, "of the file"),
    FIELD_TEXT(RecordRow, header, 0, PRESENCE_OPTIONAL, 0, "what precedes its numbers"),
    FIELD_TEXT(RecordRow, unit, 0, PRESENCE_OPTIONAL, 0, "of the file's numbers, as it was taken"),
    FIELD_TEXT(RecordRow, stated_unit, 0, PRESENCE_OPTIONAL, 0, "as the file states it"),
    FIELD_REAL(RecordRow, interval, "s", ANY, OPTIONAL, "time between samples"),
    FIELD_COUNT(RecordRow, count, NULL, AT_MIN(1), OPTIONAL, "samples"),
    FIELD_REAL(RecordRow, peak, "m/s^2", ANY, OPTIONAL, "the largest magnitude"),
    FIELD_REAL(RecordRow, peak_time, "s", ANY, OPTIONAL, "when"),
    FIELD_REAL(RecordRow, peak_velocity, "m/s", ANY, OPTIONAL, "of the base, from rest"),
    FIELD_REAL(RecordRow, end_velocity, "m/s", ANY, OPTIONAL, "the same at the end"),
    FIELD_TEXT(RecordRow, digest, 0, PRESENCE_OPTIONAL, 0, "SHA-256 of interval and samples"),
    FIELD_TEXT(RecordRow, author, 0, PRESENCE_OPTIONAL, 0, "name of the token that sent it"),
    FIELD_END
};
// clang-format on

// Without the closing brace.
static void record_put(Bytes *bytes, const RecordRow *row) {
    bytes_text(bytes, "{");
    (void)encode_members(bytes, record_fields, row, WRITE_REPORT);
    bytes_json(bytes,
               ", \"duration\": %g, \"created\": %s, \"links\": {\"self\": \"%s/v1/records/%s\", "
               "\"samples\": \"%s/v1/records/%s/samples\"}",
               (double)(row->count - 1) / (1 / row->interval),
               clock_rfc3339(row->created_unix_ms).at, base_path(), row->name, base_path(),
               row->name);
}

// Warns of others with the same samples.
static Status record_warn_twins(App *app, RecordUpload *upload, Problem *problem) {
    RecordRows twins;
    char list[RECORD_TWINS * (RECORD_NAME_SIZE + 2) + 8] = "";
    TRY(db_record_twins(app->db, &upload->row, &twins, problem));
    for (size_t i = 0; i < twins.count; i++)
        text_list(list, sizeof list, twins.at[i].name);
    record_rows_clear(&twins);
    return list[0] == '\0' ||
                   warnings_add(&upload->warnings, "/samples",
                                "are to the bit those of %s, under another name", list) == STATUS_OK
               ? STATUS_OK
               : upload_no_memory(problem);
}

// The record with its uses and, of an upload, warnings.
static Status record_reply(App *app, const RecordRow *row, const RecordUses *uses,
                           const Warnings *warnings, int code, Reply *reply, Problem *problem) {
    Bytes bytes = {.most = app->reply_most};
    record_put(&bytes, row);
    bytes_json(&bytes, ", \"used_by\": {\"results\": %llu, \"unfinished_jobs\": %llu}",
               (unsigned long long)uses->results, (unsigned long long)uses->jobs);
    if (warnings != NULL) {
        bytes_text(&bytes, ", \"warnings\": ");
        document_warnings(&bytes, warnings);
    }
    bytes_text(&bytes, "}\n");
    return reply_bytes(reply, code, type_json, &bytes, problem);
}

Status records_create(App *app, const Request *request, Reply *reply, Problem *problem) {
    RecordUpload upload = {.unit = CHOICE_ABSENT};
    RecordRow row = {.name = NULL};
    RecordUses uses;
    bool is_there = false;
    Status status = upload_read(request, &upload, problem);
    if (status == STATUS_OK && request->client != NULL)
        status = upload_copy(&upload.row.author, request->client, problem);
    if (status == STATUS_OK)
        status = db_record_add(app->db, &upload.row, &upload.samples, &is_there, problem);
    if (status == STATUS_OK)
        status = record_warn_twins(app, &upload, problem);
    if (status == STATUS_OK)
        status = db_record(app->db, upload.row.name, &row, problem);
    if (status == STATUS_OK)
        status = db_record_uses(app->db, row.name, &uses, problem);
    if (status == STATUS_OK) {
        snprintf(reply->location, sizeof reply->location, "/v1/records/%.64s", row.name);
        status =
            record_reply(app, &row, &uses, &upload.warnings, is_there ? 200 : 201, reply, problem);
    }
    record_row_clear(&row);
    upload_clear(&upload);
    return status;
}

Status records_list(App *app, const Request *request, Reply *reply, Problem *problem) {
    const char *words, *after;
    size_t limit;
    RecordRows rows;
    TRY(request_count(request, "limit", 1, LIST_MAX, LIST_INITIAL, &limit, problem));
    TRY(request_text(request, "q", &words, problem));
    TRY(request_text(request, "after", &after, problem));
    // One more than asked for tells whether there is a next page.
    TRY(db_records(app->db, words, after != NULL ? after : "", limit + 1, &rows, problem));
    Bytes bytes = {.most = app->reply_most};
    bytes_text(&bytes, "{\"records\": [");
    for (size_t i = 0; i < rows.count && i < limit; i++) {
        bytes_text(&bytes, i > 0 ? ",\n " : "");
        record_put(&bytes, &rows.at[i]);
        bytes_text(&bytes, "}");
    }
    bytes_text(&bytes, "]}\n");
    if (rows.count > limit)
        reply_link_next(request, reply, "after", rows.at[limit - 1].name, &bytes);
    record_rows_clear(&rows);
    return reply_bytes(reply, 200, type_json, &bytes, problem);
}

Status records_show(App *app, const Request *request, Reply *reply, Problem *problem) {
    RecordRow row;
    RecordUses uses;
    char tag[112];
    TRY(db_record(app->db, request->parameters[0], &row, problem));
    Status status = db_record_uses(app->db, row.name, &uses, problem);
    if (status == STATUS_OK) {
        snprintf(tag, sizeof tag, "%.32s-%lld-%llu-%llu", row.digest, (long long)row.number,
                 (unsigned long long)uses.results, (unsigned long long)uses.jobs);
        if (!reply_tagged(reply, request, tag))
            status = record_reply(app, &row, &uses, NULL, 200, reply, problem);
    }
    record_row_clear(&row);
    return status;
}

// All samples, or those asked for by time, or extremes of buckets of them.
static Status record_fill(const Request *request, const NamedRecord *named, TableStream *stream,
                          Problem *problem) {
    const Reals *samples = &named->samples;
    TRY(columns_allocate(&stream->made, 1, samples->count, 0, problem));
    columns_name(&stream->made, 0, "acceleration", "m/s^2");
    memcpy(stream->made.at[0].values, samples->at, samples->count * sizeof(double));
    TRY(table_stream_columns(stream, &stream->made, false, problem));
    stream->table.axis_name = "time";
    stream->table.axis_unit = "s";
    stream->table.axis_rate = 1 / named->interval;
    return columns_window(request, samples->count, stream, problem);
}

Status records_samples(App *app, const Request *request, Reply *reply, Problem *problem) {
    const TableFormat *format = NULL;
    NamedRecord *named;
    char tag[96];
    TRY(columns_format(request, 1, table_formats_without_chart, reply, &format, problem));
    TRY(db_record_named(app->db, request->parameters[0], &named, problem));
    snprintf(tag, sizeof tag, "%.64s-%.8s", named->digest, format->extension);
    TableStream *stream = table_stream_new(NULL);
    const Status status = stream != NULL ? record_fill(request, named, stream, problem) : STATUS_OK;
    refcount_unref(&named->shared);
    if (status == STATUS_OK && !reply_tagged(reply, request, tag))
        return columns_reply(app, reply, format, stream, problem);
    table_stream_free(stream);
    return status;
}

Status records_delete(App *app, const Request *request, Reply *reply, Problem *problem) {
    RecordRow row;
    RecordUses uses;
    char what[96];
    TRY(db_record(app->db, request->parameters[0], &row, problem));
    snprintf(what, sizeof what, "the record %.64s", row.name);
    Status status = access_owns(request, row.author, what, problem);
    if (status == STATUS_OK)
        status = db_record_delete(app->db, row.name, &uses, problem);
    record_row_clear(&row);
    if (status == STATUS_OK)
        reply_borrow(reply, 204, NULL, NULL, 0);
    return status;
}
