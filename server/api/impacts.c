// Spectra, impacts and energies as columns. All of them come from the documents that were saved
// when the result was made, so that they stay whatever engine made it.
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "server/api/columns.h"
#include "server/api/results.h"
#include "server/formats/csv.h"
#include "server/formats/impacts_csv.h"
#include "server/formats/json.h"
#include "server/formats/struct_columns.h"
#include "server/http/reply.h"
#include "server/json/parse.h"
#include "server/json/stored_columns.h"

Status column_reply_psd(ColumnReply *column_reply, const char *text, Problem *problem) {
    TRY(stored_spectra(text, &column_reply->own, problem));
    return column_reply_own_axis(column_reply, problem);
}

static Status column_reply_impacts(ColumnReply *column_reply, const char *text, Problem *problem) {
    Impacts impacts;
    TRY(stored_impacts(text, &impacts, problem));
    const Status status = struct_columns(impact_fields, impacts.at, impacts.count,
                                         sizeof *impacts.at, &column_reply->own, problem);
    free(impacts.at);
    return status == STATUS_OK ? column_reply_own(column_reply, problem) : status;
}

// energy.json as it was saved.
typedef struct EnergyDocument {
    char *unit;
    Energy energy;
} EnergyDocument;

static const Field energy_document_fields[] = {
    FIELD_TEXT(EnergyDocument, unit, 0, PRESENCE_OPTIONAL, 0, "of all but the residual"),
    FIELD_BASE(EnergyDocument, energy, energy_fields),
    FIELD_END,
};

static Status column_reply_energy(ColumnReply *column_reply, const char *text, Problem *problem) {
    EnergyDocument document = {.unit = NULL};
    Problem fault;
    problem_clear(&fault);
    Status status = json_parse(text, strlen(text), energy_document_fields, &document, &fault);
    if (status != STATUS_OK) // ours, not the client's
        status = problem_set(problem, STATUS_INTERNAL, "the stored energies cannot be read: %s",
                             fault.detail);
    if (status == STATUS_OK)
        status = struct_columns(energy_fields, &document.energy, 1, sizeof document.energy,
                                &column_reply->own, problem);
    fields_clear(energy_document_fields, &document);
    return status == STATUS_OK ? column_reply_own(column_reply, problem) : status;
}

static const char *const document_names[] = {
    [DOCUMENT_PSD] = "psd",
    [DOCUMENT_IMPACTS] = "impacts",
    [DOCUMENT_ENERGY] = "energy",
};

// The text as it was saved, or why there is none.
static Status result_document(const ResultRow *row, Document document, const char **text,
                              Problem *problem) {
    *text = results_document(row, document);
    if (*text != NULL)
        return STATUS_OK;
    return document == DOCUMENT_IMPACTS
               ? problem_set(problem, STATUS_NOT_FOUND, "%s", no_impacts)
               : problem_set(problem, STATUS_NOT_FOUND, "the scene asked for no %s",
                             document_names[document]);
}

// What a saved document is as columns.
typedef Status Maker(ColumnReply *column_reply, const char *text, Problem *problem);
static Maker *const makers[] = {
    [DOCUMENT_PSD] = column_reply_psd,
    [DOCUMENT_IMPACTS] = column_reply_impacts,
    [DOCUMENT_ENERGY] = column_reply_energy,
};

// Kinds and sides as words, which no column of numbers has.
static Status reply_impacts_csv(App *app, Reply *reply, const char *text, Problem *problem) {
    Bytes bytes = {.most = app->reply_most};
    Impacts impacts;
    TRY(stored_impacts(text, &impacts, problem));
    impacts_csv(&impacts, &bytes);
    free(impacts.at);
    return reply_bytes(reply, 200, encoder_csv.content_type, &bytes, problem);
}

static Status reply_document(App *app, Reply *reply, const char *text, Problem *problem) {
    Bytes bytes = {.most = app->reply_most};
    bytes_text(&bytes, text);
    bytes_text(&bytes, "\n");
    return reply_bytes(reply, 200, type_json, &bytes, problem);
}

static Status reply_columns(App *app, Reply *reply, const TableFormat *encoder, Document document,
                            const char *text, Problem *problem) {
    if (document == DOCUMENT_IMPACTS && encoder == &encoder_csv)
        return reply_impacts_csv(app, reply, text, problem);
    ColumnReply column_reply = {.encoding = NULL};
    const Status status = makers[document](&column_reply, text, problem);
    if (status == STATUS_OK)
        return columns_reply(app, reply, encoder, &column_reply, problem);
    column_reply_clear(&column_reply);
    return status;
}

// The window of a ledger that the query asks for.
static Status impact_window(const Request *request, ImpactWindow *window, Problem *problem) {
    TRY(request_number(request, "from", 0, 1e12, 0, &window->from, problem));
    TRY(request_number(request, "to", 0, 1e12, 1e12, &window->to, problem));
    TRY(request_count(request, "first", 1, 1000000000, 1, &window->first, problem));
    TRY(request_count(request, "limit", 1, 1000000000, 1000000000, &window->limit, problem));
    char text[32], text_to[32];
    return window->from <= window->to
               ? STATUS_OK
               : problem_set(problem, STATUS_USAGE, "\"from\" is %s s, behind \"to\" at %s s",
                             text_real(text, window->from), text_real(text_to, window->to));
}

// The document with only the impacts asked for, in `bytes`, if not all are; *text is that then.
static Status choose_impacts(App *app, const Request *request, bool is_json, const char **text,
                             Bytes *bytes, Problem *problem) {
    ImpactWindow window;
    if (request->query_count == 0) // there is nothing else to ask for
        return STATUS_OK;
    TRY(impact_window(request, &window, problem));
    bytes->most = app->reply_most;
    TRY(stored_impacts_window(*text, &window, is_json, bytes, problem));
    if (bytes->is_failed)
        return problem_set(problem, STATUS_NO_MEMORY, "no memory for the impacts");
    *text = bytes->at;
    return STATUS_OK;
}

static Status results_part(App *app, const Request *request, Reply *reply, Document document,
                           Problem *problem) {
    const TableFormat *encoder = NULL;
    TRY(columns_format(request, 1, document == DOCUMENT_PSD, reply, &encoder, problem));
    ResultRow row = {.count = 0};
    const char *text = NULL;
    Bytes window = {.most = 0};
    char tag[104];
    Status status = db_result_load(app->db, request->parameters[0], &row, problem);
    if (status == STATUS_OK)
        status = result_document(&row, document, &text, problem);
    if (status == STATUS_OK && document == DOCUMENT_IMPACTS)
        status = choose_impacts(app, request, encoder == &encoder_json, &text, &window, problem);
    snprintf(tag, sizeof tag, "%.72s-%s.%s", row.id, document_names[document], encoder->extension);
    if (status == STATUS_OK && !reply_immutable(reply, request, tag))
        status = encoder == &encoder_json
                     ? reply_document(app, reply, text, problem)
                     : reply_columns(app, reply, encoder, document, text, problem);
    bytes_clear(&window);
    result_row_clear(&row);
    return status;
}

Status results_psd(App *app, const Request *request, Reply *reply, Problem *problem) {
    return results_part(app, request, reply, DOCUMENT_PSD, problem);
}

Status results_impacts(App *app, const Request *request, Reply *reply, Problem *problem) {
    return results_part(app, request, reply, DOCUMENT_IMPACTS, problem);
}

Status results_energy(App *app, const Request *request, Reply *reply, Problem *problem) {
    return results_part(app, request, reply, DOCUMENT_ENERGY, problem);
}
