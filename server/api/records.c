// Ground-motion records: upload, list, one with what uses it, its samples, deletion.
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "server/api/columns.h"
#include "server/api/query.h"
#include "server/api/records_upload.h"
#include "server/http/access.h"
#include "server/http/reply.h"
#include "server/jobs/documents.h"
#include "server/json/encode.h"
#include "server/util/base_path.h"
#include "server/util/clock.h"

enum { LIST_INITIAL = 50, LIST_MAX = 500 };

// clang-format off
static const Field row_fields[] = {
    FIELD_TEXT(RecordRow, name, 0, PRESENCE_OPTIONAL, 0, "what scenes call it"),
    FIELD_TEXT(RecordRow, earthquake, 0, PRESENCE_OPTIONAL, 0, "which one"),
    FIELD_TEXT(RecordRow, station, 0, PRESENCE_OPTIONAL, 0, "where it was measured"),
    FIELD_TEXT(RecordRow, source, 0, PRESENCE_OPTIONAL, 0, "where the file comes from"),
    FIELD_TEXT(RecordRow, processing, 0, PRESENCE_OPTIONAL, 0, "what was done to it"),
    FIELD_TEXT(RecordRow, notes, 0, PRESENCE_OPTIONAL, 0, "what else one should know"),
    FIELD_TEXT(RecordRow, layout, 0, PRESENCE_OPTIONAL, 0, "of the file"),
    FIELD_TEXT(RecordRow, header, 0, PRESENCE_OPTIONAL, 0, "what stands before its numbers"),
    FIELD_TEXT(RecordRow, unit, 0, PRESENCE_OPTIONAL, 0, "of the file's numbers, as it was taken"),
    FIELD_TEXT(RecordRow, stated_unit, 0, PRESENCE_OPTIONAL, 0, "as the file tells it"),
    FIELD_REAL(RecordRow, interval, "s", ANY, OPTIONAL, "time between samples"),
    FIELD_COUNT(RecordRow, count, NULL, AT_MIN(1), OPTIONAL, "samples"),
    FIELD_REAL(RecordRow, peak, "m/s^2", ANY, OPTIONAL, "the largest magnitude"),
    FIELD_REAL(RecordRow, peak_time, "s", ANY, OPTIONAL, "when"),
    FIELD_REAL(RecordRow, peak_velocity, "m/s", ANY, OPTIONAL, "of the base, from rest"),
    FIELD_REAL(RecordRow, end_velocity, "m/s", ANY, OPTIONAL, "likewise, at the end"),
    FIELD_TEXT(RecordRow, digest, 0, PRESENCE_OPTIONAL, 0, "SHA-256 of interval and samples"),
    FIELD_TEXT(RecordRow, author, 0, PRESENCE_OPTIONAL, 0, "the token's name it came with"),
    FIELD_END
};
// clang-format on

// Without the closing brace.
static void record_put(Bytes *bytes, const RecordRow *row) {
    char created[32];
    clock_rfc3339(row->created_unix_ms, created);
    bytes_text(bytes, "{");
    (void)encode_members(bytes, row_fields, row, WRITE_REPORT);
    bytes_text(bytes, ", \"duration\": ");
    bytes_real(bytes, (double)(row->count - 1) / (1 / row->interval));
    bytes_format(bytes,
                 ", \"created\": \"%s\", \"links\": {\"self\": \"%s/v1/records/%s\", \"samples\": "
                 "\"%s/v1/records/%s/samples\"}",
                 created, base_path(), row->name, base_path(), row->name);
}

static void record_put_uses(Bytes *bytes, const RecordUses *uses) {
    bytes_format(bytes, ", \"used_by\": {\"results\": %llu, \"unfinished_jobs\": %llu}",
                 (unsigned long long)uses->results, (unsigned long long)uses->jobs);
}

// Others with the same samples may be meant.
static Status record_warn_twins(App *app, RecordUpload *upload, Problem *problem) {
    RecordRows twins;
    char list[RECORD_TWINS * (RECORD_NAME_SIZE + 2) + 8] = "";
    TRY(db_record_twins(app->db, &upload->row, &twins, problem));
    for (size_t i = 0; i < twins.count; i++)
        text_list(list, sizeof list, twins.at[i].name);
    const size_t count = twins.count;
    record_rows_clear(&twins);
    if (count > 0 &&
        warnings_add(&upload->warnings, "/samples",
                     "are to the bit those of %s, under another name", list) != STATUS_OK)
        return problem_set(problem, STATUS_NO_MEMORY, "no memory for warnings");
    return STATUS_OK;
}

static Status record_answer(App *app, RecordUpload *upload, bool is_there, Reply *reply,
                            Problem *problem) {
    RecordRow row;
    RecordUses uses;
    Bytes bytes = {.most = app->reply_most};
    TRY(record_warn_twins(app, upload, problem));
    TRY(db_record(app->db, upload->row.name, &row, problem));
    const Status status = db_record_uses(app->db, row.name, &uses, problem);
    if (status == STATUS_OK) {
        record_put(&bytes, &row);
        record_put_uses(&bytes, &uses);
        bytes_text(&bytes, ", \"warnings\": ");
        document_warnings(&bytes, &upload->warnings);
        bytes_text(&bytes, "}\n");
        snprintf(reply->location, sizeof reply->location, "/v1/records/%.64s", row.name);
    }
    record_row_clear(&row);
    return status == STATUS_OK
               ? reply_bytes(reply, is_there ? 200 : 201, type_json, &bytes, problem)
               : status;
}

Status records_create(App *app, const Request *request, Reply *reply, Problem *problem) {
    RecordUpload upload;
    bool is_there = false;
    Status status = record_upload_read(request, &upload, problem);
    if (status == STATUS_OK && request->client != NULL &&
        (upload.row.author = strdup(request->client)) == NULL)
        status = problem_set(problem, STATUS_NO_MEMORY, "no memory for the record");
    if (status == STATUS_OK)
        status = db_record_add(app->db, &upload.row, &upload.samples, &is_there, problem);
    if (status == STATUS_OK)
        status = record_answer(app, &upload, is_there, reply, problem);
    record_upload_clear(&upload);
    return status;
}

Status records_list(App *app, const Request *request, Reply *reply, Problem *problem) {
    const char *words, *after;
    size_t limit;
    RecordRows rows;
    TRY(request_count(request, "limit", 1, LIST_MAX, LIST_INITIAL, &limit, problem));
    TRY(query_text(request, "q", &words, problem));
    TRY(query_text(request, "after", &after, problem));
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
        query_link_next(request, reply, "after", rows.at[limit - 1].name);
    record_rows_clear(&rows);
    return reply_bytes(reply, 200, type_json, &bytes, problem);
}

Status records_show(App *app, const Request *request, Reply *reply, Problem *problem) {
    RecordRow row;
    RecordUses uses;
    char tag[112];
    TRY(db_record(app->db, request->parameters[0], &row, problem));
    Status status = db_record_uses(app->db, row.name, &uses, problem);
    if (status != STATUS_OK) {
        record_row_clear(&row);
        return status;
    }
    snprintf(tag, sizeof tag, "%.32s-%lld-%llu-%llu", row.digest, (long long)row.number,
             (unsigned long long)uses.results, (unsigned long long)uses.jobs);
    const bool is_known = reply_tagged(reply, request, tag);
    Bytes bytes = {.most = app->reply_most};
    if (!is_known) {
        record_put(&bytes, &row);
        record_put_uses(&bytes, &uses);
        bytes_text(&bytes, "}\n");
        status = reply_bytes(reply, 200, type_json, &bytes, problem);
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
    TRY(columns_format(request, 1, false, reply, &format, problem));
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
