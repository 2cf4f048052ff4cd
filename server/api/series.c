// Results as columns: series, spectra, the table of impacts. They come from the Outcome, which is
// in memory or is computed anew by a worker while the request sleeps.
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "server/api/app.h"
#include "server/api/results.h"
#include "server/base/clock.h"
#include "server/encode/encoder.h"
#include "server/http/header.h"
#include "server/http/reply.h"

static const double outcome_wait_most = 60; // [s]

// The encoder asked for by extension, else by Accept.
static Status choose_encoder(const Request *request, size_t parameter, Reply *reply,
                             const Encoder **encoder, Problem *problem) {
    const char *extension = request->parameters[parameter];
    char known[96] = "";
    const char *types[16] = {NULL};
    for (size_t i = 0; encoders[i] != NULL && i + 1 < COUNT(types); i++) {
        const size_t used = strlen(known);
        snprintf(known + used, sizeof known - used, "%s%s", i > 0 ? ", " : "",
                 encoders[i]->extension);
        types[i] = encoders[i]->content_type;
        types[i + 1] = NULL;
    }
    if (extension != NULL) {
        *encoder = encoder_find(extension);
        if (*encoder != NULL)
            return STATUS_OK;
        return problem_set(problem, STATUS_NOT_FOUND, "there is no format \"%.20s\"; there are %s",
                           extension, known);
    }
    reply->varies_by_accept = true;
    const int choice = header_accept(request->accept, types);
    if (choice < 0)
        return problem_set(problem, STATUS_NOT_ACCEPTABLE,
                           "none of the formats fits Accept; there are %s, by extension too",
                           known);
    *encoder = encoders[choice];
    return STATUS_OK;
}

// The outcome of a part of a result. *outcome is a hold, or NULL when the reply is made already:
// the client has the part, or the request has been put to sleep.
static Status get_outcome(App *app, const Request *request, Reply *reply, const char *what,
                          const char *extension, Outcome **outcome, Problem *problem) {
    const char *id = request->parameters[0];
    char tag[104];
    snprintf(tag, sizeof tag, "%.72s-%s.%s", id, what, extension);
    // Nothing is computed anew for a client who has it.
    if (request->if_none_match != NULL && !store_result_exists(app->store, id))
        return problem_set(problem, STATUS_NOT_FOUND, "there is no result %.80s", id);
    if (reply_immutable(reply, request, tag))
        return STATUS_OK;
    const Status status = intake_outcome(app->intake, id, request->waker, outcome, problem);
    if (status == STATUS_GONE)
        snprintf(reply->link, sizeof reply->link,
                 "</v1/results/%.72s/manifest>; rel=\"describedby\"", id);
    if (status == STATUS_BUSY)
        reply->retry_after = 2;
    if (status != STATUS_OK || *outcome != NULL)
        return status;
    const double left =
        outcome_wait_most - 1e-9 * (double)(clock_monotonic_ns() - request->started_ns);
    if (left <= 0 || request->is_expired) {
        reply->retry_after = 5;
        return problem_set(problem, STATUS_BUSY,
                           "the series is still being computed anew; ask again a little later");
    }
    reply_wait(reply, (int)(1000 * left) + 1, NULL, NULL);
    return STATUS_OK;
}

static Status reply_table(App *app, Reply *reply, const Encoder *encoder, const Table *table,
                          Problem *problem) {
    Bytes bytes = {.most = app->reply_most};
    encoder->write(table, &bytes);
    reply->accepts_ranges = encoder->is_binary;
    return reply_bytes(reply, 200, encoder->content_type, &bytes, problem);
}

static void list_names(const Columns *columns, char *target, size_t size) {
    target[0] = '\0';
    for (size_t i = 0; i < columns->count; i++) {
        const size_t used = strlen(target), more = strlen(columns->at[i].name) + 2;
        if (used + more + sizeof ", and 1000 more" > size) {
            snprintf(target + used, size - used, ", and %zu more", columns->count - i);
            return;
        }
        snprintf(target + used, size - used, "%s%s", i > 0 ? ", " : "", columns->at[i].name);
    }
}

// "?channels=a,b": those columns in that order; all without it.
static Status choose_columns(const Request *request, const Columns *columns, const Column **chosen,
                             size_t *count, Problem *problem) {
    const char *text = request_query(request, "channels");
    *count = 0;
    if (text == NULL) {
        for (size_t i = 0; i < columns->count; i++)
            chosen[(*count)++] = &columns->at[i];
        return STATUS_OK;
    }
    char there[256];
    list_names(columns, there, sizeof there);
    for (const char *at = text; at != NULL;
         at = strchr(at, ',') != NULL ? strchr(at, ',') + 1 : NULL) {
        char name[48];
        snprintf(name, sizeof name, "%.*s", (int)strcspn(at, ","), at);
        const Column *column = columns_find(columns, name);
        if (column == NULL)
            return problem_set(problem, STATUS_NOT_FOUND,
                               "the scene did not ask for the channel \"%s\"; there are: %s", name,
                               there[0] != '\0' ? there : "none");
        for (size_t i = 0; i < *count; i++)
            if (chosen[i] == column)
                return problem_set(problem, STATUS_USAGE, "the channel \"%s\" is named twice",
                                   name);
        chosen[(*count)++] = column;
    }
    return STATUS_OK;
}

static Status choose_rows(const Request *request, const Response *response, Table *table,
                          Problem *problem) {
    // The half of a rounding on either side keeps a sample that stands at the very time asked for.
    const double rate = response->sample_rate, end = (double)(response->count - 1) / rate;
    double from, to;
    TRY(request_number(request, "from", 0, 1e12, 0, &from, problem));
    TRY(request_number(request, "to", 0, 1e12, end, &to, problem));
    const double first = ceil(from * rate * (1 - 1e-12)), last = floor(to * rate * (1 + 1e-12));
    char text[32], text_to[32];
    if (first > (double)(response->count - 1))
        return problem_set(problem, STATUS_USAGE,
                           "\"from\" is %s s, behind the last sample at %s s",
                           text_real(text, from), text_real(text_to, end));
    if (last < first)
        return problem_set(problem, STATUS_USAGE, "there is no sample from %s s to %s s",
                           text_real(text, from), text_real(text_to, to));
    table->first = (size_t)first;
    table->count =
        (last < (double)response->count ? (size_t)last : response->count - 1) - table->first + 1;
    return STATUS_OK;
}

static Status series_of(App *app, const Request *request, Reply *reply, const Encoder *encoder,
                        const Response *response, Problem *problem) {
    Table table = {.axis_name = "time", .axis_unit = "s", .axis_rate = response->sample_rate};
    if (response->count == 0)
        return problem_set(problem, STATUS_NOT_FOUND, "the result has no samples");
    const Column **chosen = calloc(response->series.count + 1, sizeof *chosen);
    if (chosen == NULL)
        return problem_set(problem, STATUS_NO_MEMORY, "no memory for the series");
    Status status =
        choose_columns(request, &response->series, chosen, &table.column_count, problem);
    if (status == STATUS_OK)
        status = choose_rows(request, response, &table, problem);
    table.columns = chosen;
    if (status == STATUS_OK)
        status = reply_table(app, reply, encoder, &table, problem);
    free(chosen);
    return status;
}

Status results_series(App *app, const Request *request, Reply *reply, Problem *problem) {
    const Encoder *encoder = NULL;
    Outcome *outcome = NULL;
    TRY(choose_encoder(request, 1, reply, &encoder, problem));
    TRY(get_outcome(app, request, reply, "series", encoder->extension, &outcome, problem));
    if (outcome == NULL)
        return STATUS_OK;
    const Status status = series_of(app, request, reply, encoder, &outcome->response, problem);
    outcome_drop(outcome);
    return status;
}

static Status psd_of(App *app, Reply *reply, const Encoder *encoder, const Spectrum *spectrum,
                     Problem *problem) {
    const Columns *densities = &spectrum->densities;
    if (densities->count == 0)
        return problem_set(problem, STATUS_NOT_FOUND, "the scene asked for no psd");
    const Column **all = calloc(densities->count, sizeof *all);
    if (all == NULL)
        return problem_set(problem, STATUS_NO_MEMORY, "no memory for the spectra");
    for (size_t i = 0; i < densities->count; i++)
        all[i] = &densities->at[i];
    const Table table = {.axis_name = "frequency",
                         .axis_unit = "Hz",
                         .count = densities->rows,
                         .axis = spectrum->frequency,
                         .columns = all,
                         .column_count = densities->count};
    const Status status = reply_table(app, reply, encoder, &table, problem);
    free(all);
    return status;
}

Status results_psd(App *app, const Request *request, Reply *reply, Problem *problem) {
    const Encoder *encoder = NULL;
    Outcome *outcome = NULL;
    TRY(choose_encoder(request, 1, reply, &encoder, problem));
    if (strcmp(encoder->extension, "json") == 0)
        return results_document(app, request, reply, DOCUMENT_PSD, problem);
    TRY(get_outcome(app, request, reply, "psd", encoder->extension, &outcome, problem));
    if (outcome == NULL)
        return STATUS_OK;
    const Status status = psd_of(app, reply, encoder, &outcome->spectrum, problem);
    outcome_drop(outcome);
    return status;
}

// A cell is empty where a number is not known.
static void write_cell(Bytes *bytes, const Field *field, const Impact *impact) {
    const char *at = (const char *)impact + field->offset;
    if (field_is_absent(field, impact))
        return;
    if (field->kind == FIELD_KIND_REAL)
        bytes_real(bytes, *(const double *)(const void *)at);
    else if (field->kind == FIELD_KIND_COUNT)
        bytes_format(bytes, "%llu", (unsigned long long)*(const uint64_t *)(const void *)at);
    else if (field->kind == FIELD_KIND_CHOICE)
        bytes_text(bytes, field->choices[*(const int *)(const void *)at]);
}

static Status impacts_csv(App *app, Reply *reply, const Impacts *impacts, Problem *problem) {
    Bytes bytes = {.most = app->reply_most};
    for (const Field *field = impact_fields; field->kind != FIELD_KIND_END; field++) {
        bytes_format(&bytes, "%s%s", field == impact_fields ? "" : ",", field->name);
        if (field->unit != NULL)
            bytes_format(&bytes, " [%s]", field->unit);
    }
    bytes_text(&bytes, "\n");
    for (size_t i = 0; i < impacts->count; i++) {
        for (const Field *field = impact_fields; field->kind != FIELD_KIND_END; field++) {
            bytes_text(&bytes, field == impact_fields ? "" : ",");
            write_cell(&bytes, field, &impacts->at[i]);
        }
        bytes_text(&bytes, "\n");
    }
    return reply_bytes(reply, 200, "text/csv; charset=utf-8", &bytes, problem);
}

Status results_impacts(App *app, const Request *request, Reply *reply, Problem *problem) {
    static const char *const types[] = {"application/json", "text/csv", NULL};
    const char *extension = request->parameters[1];
    int choice = extension == NULL                ? header_accept(request->accept, types)
                 : strcmp(extension, "json") == 0 ? 0
                 : strcmp(extension, "csv") == 0  ? 1
                                                  : -2;
    reply->varies_by_accept = extension == NULL;
    if (choice == -2)
        return problem_set(problem, STATUS_NOT_FOUND,
                           "there is no format \"%.20s\"; there are json, csv", extension);
    if (choice == -1)
        return problem_set(
            problem, STATUS_NOT_ACCEPTABLE,
            "none of the formats fits Accept; there are json, csv, by extension too");
    if (choice == 0)
        return results_document(app, request, reply, DOCUMENT_IMPACTS, problem);
    Outcome *outcome = NULL;
    TRY(get_outcome(app, request, reply, "impacts", "csv", &outcome, problem));
    if (outcome == NULL)
        return STATUS_OK;
    const Status status = outcome->response.is_unlisted
                              ? problem_set(problem, STATUS_NOT_FOUND, "%s", no_impacts)
                              : impacts_csv(app, reply, &outcome->response.impacts, problem);
    outcome_drop(outcome);
    return status;
}
