// All materials out and in: what is exported here is imported there, and says the same there to the
// byte.
#include <stdlib.h>
#include <string.h>

#include "server/api/app.h"
#include "server/formats/format.h"
#include "server/formats/material_export.h"
#include "server/http/header.h"
#include "server/http/reply.h"
#include "server/materials/exchange_csv.h"
#include "server/materials/exchange_json.h"

enum { WHOLE_MAX = 4 << 20 }; // what is longer is sent while it is made

typedef struct Sending {
    MaterialExport text;
    Bytes made;
    size_t taken; // of it
    bool is_last;
} Sending;

static void sending_free(void *context) {
    Sending *sending = context;
    bytes_clear(&sending->made);
    free(sending);
}

static ptrdiff_t send_next(void *context, char *target, size_t size) {
    Sending *sending = context;
    Bytes *made = &sending->made;
    size_t sent = 0;
    while (sent < size) {
        if (sending->taken == made->count) {
            if (sending->is_last)
                break;
            made->count = sending->taken = 0;
            if (material_export_next(&sending->text, made, &sending->is_last, NULL) != STATUS_OK)
                return STREAM_BROKEN;
            continue;
        }
        sent += bytes_hand(made, &sending->taken, target + sent, size - sent);
    }
    return sent > 0 ? (ptrdiff_t)sent : STREAM_END;
}

// The beginning at once: where that is all it is kept, and compressed.
static Status begin(Sending *sending, Db *db, bool is_table, Problem *problem) {
    TRY(material_export_open(db, is_table, &sending->text, problem));
    while (!sending->is_last && sending->made.count < WHOLE_MAX)
        TRY(material_export_next(&sending->text, &sending->made, &sending->is_last, problem));
    return STATUS_OK;
}

Status materials_export(App *app, const Request *request, Reply *reply, Problem *problem) {
    const char *format = request->parameters[0];
    const bool is_table = strcmp(format, format_csv.extension) == 0;
    const char *type = is_table ? format_csv.content_type : type_json;
    if (!is_table && strcmp(format, "json") != 0)
        return problem_set(problem, STATUS_NOT_FOUND,
                           "there are no materials.%.20s; they can be had as materials.json or "
                           "materials.csv",
                           format);
    Sending *sending = calloc(1, sizeof *sending);
    if (sending == NULL)
        return problem_set(problem, STATUS_NO_MEMORY, "no memory for the materials");
    Status status = begin(sending, app->db, is_table, problem);
    if (status == STATUS_OK && !sending->is_last) {
        reply_borrow(reply, 200, type, NULL, 0);
        reply->stream = (Stream){.next = send_next, .size = UINT64_MAX};
        reply->release = sending_free;
        reply->context = sending;
        return STATUS_OK;
    }
    if (status == STATUS_OK)
        status = reply_bytes(reply, 200, type, &sending->made, problem);
    sending_free(sending);
    return status;
}

static Status require_type(const Request *request, bool *is_table, Problem *problem) {
    *is_table = header_type_is(request->content_type, "text/csv");
    if (!*is_table && !header_type_is(request->content_type, type_json))
        return problem_set(problem, STATUS_UNSUPPORTED_TYPE,
                           "the body must be application/json or text/csv, is %.60s; with curl use "
                           "-H 'Content-Type: text/csv' --data-binary @materials.csv",
                           request->content_type != NULL ? request->content_type
                                                         : "of no given type");
    return request_require_body(request, problem);
}

static void put_count(Bytes *bytes, const char *name, const ImportCount *count) {
    bytes_format(bytes, ", \"%s\": {\"added\": %zu, \"same\": %zu}", name, count->added,
                 count->same);
}

static Status answer(Reply *reply, bool is_dry, const ImportTally *metrics, Problem *problem) {
    Bytes bytes = {.most = 0};
    bytes_format(&bytes, "{\"dry_run\": %s, \"materials\": %zu", is_dry ? "true" : "false",
                 metrics->materials);
    put_count(&bytes, "revisions", &metrics->revisions);
    put_count(&bytes, "measurements", &metrics->measurements);
    put_count(&bytes, "reviews", &metrics->reviews);
    bytes_text(&bytes, "}\n");
    return reply_bytes(reply, 200, type_json, &bytes, problem);
}

Status materials_import(App *app, const Request *request, Reply *reply, Problem *problem) {
    bool is_dry, is_table;
    TRY(request_flag(request, "dry_run", &is_dry, problem));
    TRY(require_type(request, &is_table, problem));
    const bool may_all = request->client == NULL || request->holder.is_admin;
    Exchange exchange = {.revision_room = 0};
    ImportTally metrics;
    Status status = (is_table ? exchange_read_csv : exchange_read_json)(
        request->body, request->body_size, &exchange, problem);
    // What could be read is judged beside the database, so that all faults are told at once.
    if (status == STATUS_OK || status == STATUS_INVALID)
        status = exchange_import(&exchange, app->db, request->client, may_all, is_dry, &metrics,
                                 problem);
    exchange_clear(&exchange);
    problem->whose = "file";
    if (is_table)
        exchange_place_faults(problem);
    return status == STATUS_OK ? answer(reply, is_dry, &metrics, problem) : status;
}
