// Spectra, impacts and energies as columns beside their JSON documents. The JSON was saved when the
// result was made; the numbers come from the Outcome, but for the energies, which are few.
#include <stdio.h>
#include <string.h>

#include "server/api/results.h"
#include "server/api/tables.h"
#include "server/codec/read.h"
#include "server/encode/csv.h"
#include "server/encode/impacts_csv.h"
#include "server/encode/json.h"
#include "server/encode/records.h"
#include "server/http/reply.h"

Status sheet_psd(Sheet *sheet, Problem *problem) {
    const Spectrum *spectrum = &sheet->outcome->spectrum;
    const Columns *densities = &spectrum->densities;
    if (densities->count == 0)
        return problem_set(problem, STATUS_NOT_FOUND, "the scene asked for no psd");
    TRY(sheet_make(sheet, densities->count, problem));
    for (size_t i = 0; i < densities->count; i++)
        sheet->chosen[i] = &densities->at[i];
    sheet->table = (Table){.axis_name = "frequency",
                           .axis_unit = "Hz",
                           .count = densities->rows,
                           .axis = spectrum->frequency,
                           .columns = sheet->chosen,
                           .column_count = densities->count};
    return STATUS_OK;
}

Status results_psd(App *app, const Request *request, Reply *reply, Problem *problem) {
    const Encoder *encoder = NULL;
    Sheet sheet = {.encoding = NULL};
    TRY(tables_encoder(request, 1, reply, &encoder, problem));
    if (encoder == &encoder_json)
        return results_document(app, request, reply, DOCUMENT_PSD, problem);
    TRY(tables_outcome(app, request, reply, "psd", encoder->extension, &sheet.outcome, problem));
    if (sheet.outcome == NULL)
        return STATUS_OK;
    const Status status = sheet_psd(&sheet, problem);
    if (status == STATUS_OK)
        return tables_reply(app, reply, encoder, &sheet, problem);
    sheet_clear(&sheet);
    return status;
}

static Status reply_impacts_csv(App *app, Reply *reply, const Impacts *impacts, Problem *problem) {
    Bytes bytes = {.most = app->reply_most};
    impacts_csv(impacts, &bytes);
    return reply_bytes(reply, 200, encoder_csv.content_type, &bytes, problem);
}

static Status reply_impacts(App *app, Reply *reply, const Encoder *encoder, Sheet *sheet,
                            Problem *problem) {
    const Response *response = &sheet->outcome->response;
    const Impacts *impacts = &response->impacts;
    Status status = STATUS_OK;
    if (response->is_unlisted)
        status = problem_set(problem, STATUS_NOT_FOUND, "%s", no_impacts);
    else if (encoder == &encoder_csv)
        status = reply_impacts_csv(app, reply, impacts, problem);
    else
        status = records_columns(impact_fields, impacts->at, impacts->count, sizeof *impacts->at,
                                 &sheet->own, problem);
    if (status == STATUS_OK && encoder != &encoder_csv &&
        (status = sheet_own(sheet, problem)) == STATUS_OK)
        return tables_reply(app, reply, encoder, sheet, problem);
    sheet_clear(sheet);
    return status;
}

Status results_impacts(App *app, const Request *request, Reply *reply, Problem *problem) {
    const Encoder *encoder = NULL;
    Sheet sheet = {.encoding = NULL};
    TRY(tables_encoder(request, 1, reply, &encoder, problem));
    if (encoder == &encoder_json)
        return results_document(app, request, reply, DOCUMENT_IMPACTS, problem);
    TRY(tables_outcome(app, request, reply, "impacts", encoder->extension, &sheet.outcome,
                       problem));
    if (sheet.outcome == NULL)
        return STATUS_OK;
    return reply_impacts(app, reply, encoder, &sheet, problem);
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

static Status sheet_energy(Sheet *sheet, const char *text, Problem *problem) {
    EnergyDocument document = {.unit = NULL};
    Problem fault;
    problem_clear(&fault);
    Status status = read_json(text, strlen(text), energy_document_fields, &document, &fault);
    if (status != STATUS_OK) // ours, not the client's
        status = problem_set(problem, STATUS_INTERNAL, "the stored energies cannot be read: %s",
                             fault.detail);
    if (status == STATUS_OK)
        status = records_columns(energy_fields, &document.energy, 1, sizeof document.energy,
                                 &sheet->own, problem);
    fields_clear(energy_document_fields, &document);
    return status == STATUS_OK ? sheet_own(sheet, problem) : status;
}

Status results_energy(App *app, const Request *request, Reply *reply, Problem *problem) {
    const Encoder *encoder = NULL;
    TRY(tables_encoder(request, 1, reply, &encoder, problem));
    if (encoder == &encoder_json)
        return results_document(app, request, reply, DOCUMENT_ENERGY, problem);
    ResultRow row = {.count = 0};
    Sheet sheet = {.encoding = NULL};
    char tag[104];
    Status status = store_result_load(app->store, request->parameters[0], &row, problem);
    if (status == STATUS_OK) {
        snprintf(tag, sizeof tag, "%.72s-energy.%s", row.id, encoder->extension);
        if (reply_immutable(reply, request, tag)) {
            result_row_clear(&row);
            return STATUS_OK;
        }
        status = row.energy != NULL
                     ? sheet_energy(&sheet, row.energy, problem)
                     : problem_set(problem, STATUS_NOT_FOUND, "the result has no energies");
    }
    result_row_clear(&row);
    if (status == STATUS_OK)
        return tables_reply(app, reply, encoder, &sheet, problem);
    sheet_clear(&sheet);
    return status;
}
