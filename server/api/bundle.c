// All of a result in one archive that explains itself.
#include <stdio.h>
#include <string.h>

#include "server/api/columns.h"
#include "server/api/results.h"
#include "server/formats/csv.h"
#include "server/formats/impacts_csv.h"
#include "server/formats/npz.h"
#include "server/formats/zip.h"
#include "server/http/reply.h"

static const char about[] =
    "A simulation of an impact damper, as impactd made it.\n"
    "\n"
    "Result   %s\n"
    "Engine   %s\n"
    "\n"
    "FILES\n"
    "scene.json      what was simulated, all defaults filled: submit it to have the same result\n"
    "result.json     the numbers asked for first (summary), the plan with its reasons, warnings,\n"
    "                and the unit of every quantity (units)\n"
    "manifest.json   engine, program and materials: what it takes to do it again\n"
    "series.npz      time series: one array of float64 for each channel, and time\n"
    "psd.json        power spectral densities and how they were estimated (if asked for)\n"
    "psd.csv         the same numbers as a table\n"
    "impacts.csv     every impact, a row for each (unless the scene asked for none)\n"
    "\n"
    "UNITS\n"
    "SI throughout: m, kg, s, N, J; frequencies in Hz; spectra one-sided, per Hz. Displacements\n"
    "and velocities are relative to the base, accelerations absolute. CSV columns carry their\n"
    "unit in the header; in an NPZ the unit of a channel is that in result.json.\n"
    "\n"
    "READING\n"
    "Python:  series = numpy.load('series.npz'); series['time'], series['displacement']\n"
    "         (with several storeys or dampers: displacement_1, ...)\n"
    "\n"
    "HOW TO CITE\n"
    "The model: K. Li and A. P. Darby, Modelling a buffered impact damper system using a\n"
    "spring-damper model of impact, Structural Control and Health Monitoring 16 (2009) 287-302,\n"
    "doi:10.1002/stc.238.\n"
    "The numbers: impactd, engine %s, result %s.\n";

static Status put_text(Zip *zip, const char *name, Bytes *bytes, Problem *problem) {
    Segments content = {.size = 0};
    if (bytes->is_failed)
        content.is_failed = true;
    else
        segments_put(&content, bytes->at, bytes->count);
    zip->layout->is_failed = zip->layout->is_failed || content.is_failed;
    const Status status = zip_put(zip, name, &content, problem);
    segments_clear(&content);
    bytes_clear(bytes);
    return status;
}

static Status put_document(Zip *zip, const char *name, const char *text, Problem *problem) {
    Bytes bytes = {.most = 0};
    bytes_text(&bytes, text);
    bytes_text(&bytes, "\n");
    return put_text(zip, name, &bytes, problem);
}

static Status put_series(Zip *zip, const Response *response, ColumnReply *column_reply,
                         Problem *problem) {
    Segments content = {.size = 0};
    TRY(column_reply_make(column_reply, response->series.count, problem));
    for (size_t i = 0; i < response->series.count; i++)
        column_reply->chosen[i] = &response->series.at[i];
    column_reply->table = (Table){.axis_name = "time",
                                  .axis_unit = "s",
                                  .axis_rate = response->sample_rate,
                                  .count = response->count,
                                  .columns = column_reply->chosen,
                                  .column_count = response->series.count};
    Status status = encoder_npz.lay(&column_reply->table, &content, problem);
    if (status == STATUS_OK)
        status = zip_put(zip, "series.npz", &content, problem);
    segments_clear(&content);
    return status;
}

static Status put_spectra(Zip *zip, const char *document, Problem *problem) {
    Bytes bytes = {.most = 0};
    ColumnReply column_reply = {.encoding = NULL};
    Status status = put_document(zip, "psd.json", document, problem);
    if (status == STATUS_OK)
        status = column_reply_psd(&column_reply, document, problem);
    if (status == STATUS_OK)
        status = encoding_write(&encoder_csv, &column_reply.table, &bytes, problem);
    if (status == STATUS_OK)
        status = put_text(zip, "psd.csv", &bytes, problem);
    bytes_clear(&bytes);
    column_reply_clear(&column_reply);
    return status;
}

// The sheet keeps the outcome whose series the layout borrows.
static Status fill(Zip *zip, const ResultRow *row, Bytes *manifest, ColumnReply *column_reply,
                   Problem *problem) {
    const Response *response = &column_reply->outcome->response;
    Bytes readme = {.most = 0}, result = {.most = 0}, impacts = {.most = 0};
    bytes_format(&readme, about, row->id, row->engine, row->engine, row->id);
    TRY(put_text(zip, "README.txt", &readme, problem));
    TRY(put_document(zip, "scene.json", row->scene, problem));
    const Status status = results_put(row, &result, problem);
    if (status != STATUS_OK) {
        bytes_clear(&result);
        return status;
    }
    TRY(put_text(zip, "result.json", &result, problem));
    TRY(put_text(zip, "manifest.json", manifest, problem));
    TRY(put_series(zip, response, column_reply, problem));
    const char *spectra = results_document(row, DOCUMENT_PSD);
    if (spectra != NULL)
        TRY(put_spectra(zip, spectra, problem));
    if (response->is_unlisted)
        return STATUS_OK;
    impacts_csv(&response->impacts, &impacts);
    return put_text(zip, "impacts.csv", &impacts, problem);
}

static Status pack(App *app, Reply *reply, const ResultRow *row, Bytes *manifest,
                   ColumnReply *column_reply, Problem *problem) {
    Segments layout = {.size = 0};
    Zip zip = {.layout = &layout};
    Status status = fill(&zip, row, manifest, column_reply, problem);
    const Status ended = zip_end(&zip, status == STATUS_OK ? problem : NULL);
    status = status != STATUS_OK ? status : ended;
    if (status == STATUS_OK)
        return columns_reply_segments(app, reply, "application/zip", &layout, column_reply,
                                      problem);
    segments_clear(&layout);
    column_reply_clear(column_reply);
    return status;
}

Status results_bundle(App *app, const Request *request, Reply *reply, Problem *problem) {
    ResultRow row = {.count = 0};
    Bytes manifest = {.most = app->reply_most};
    ColumnReply column_reply = {.encoding = NULL};
    Status status = db_result_load(app->db, request->parameters[0], &row, problem);
    if (status == STATUS_OK)
        status = manifest_put(app, &row, &manifest, problem);
    // The manifest tells all that may change: a material's status and the base of the links.
    if (status == STATUS_OK && !results_tagged(request, reply, &row, "bundle", &manifest)) {
        status = columns_choose(app, request, reply, &column_reply.outcome, problem);
        if (status == STATUS_OK && column_reply.outcome != NULL)
            status = pack(app, reply, &row, &manifest, &column_reply, problem);
    }
    bytes_clear(&manifest);
    result_row_clear(&row);
    return status;
}
