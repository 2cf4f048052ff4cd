// The response spectrum of a ground motion, made for one request, in the background where it takes
// long.
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "core/excitation/response_spectrum.h"
#include "server/api/app.h"
#include "server/db/records.h"

enum { POINTS_INITIAL = 200, POINTS_MAX = 2000 };

static const double steps_max = 1e8, step_seconds = 10e-9;

typedef struct SpectrumRun {
    NamedRecord *named;
    double damping_ratio;
    Columns columns; // period, displacement, pseudo-velocity and pseudo-acceleration
    Status status;
} SpectrumRun;

static void spectrum_free(void *context) {
    SpectrumRun *spectrum = context;
    if (spectrum->named != NULL)
        refcount_unref(&spectrum->named->shared);
    columns_clear(&spectrum->columns);
    free(spectrum);
}

static void spectrum_run(void *context, const Progress *watch) {
    SpectrumRun *spectrum = context;
    const Column *column = spectrum->columns.at;
    const size_t count = spectrum->columns.rows;
    spectrum->status = response_spectrum_make(&spectrum->named->samples, spectrum->named->interval,
                                              spectrum->damping_ratio, column[0].values, count,
                                              watch, column[1].values);
    for (size_t i = 0; i < count; i++) {
        const double omega = 6.28318530717958647693 / column[0].values[i];
        column[2].values[i] = omega * column[1].values[i];
        column[3].values[i] = omega * column[2].values[i];
    }
}

static Status spectrum_read_request(const Request *request, SpectrumRun *spectrum,
                                    Problem *problem) {
    static const char *const names[][2] = {{"period", "s"},
                                           {"displacement", "m"},
                                           {"pseudo_velocity", "m/s"},
                                           {"pseudo_acceleration", "m/s^2"}};
    double from, to;
    size_t points;
    TRY(request_number(request, "damping_ratio", 0, RESPONSE_SPECTRUM_DAMPING_MAX, 0.05,
                       &spectrum->damping_ratio, problem));
    TRY(request_number(request, "from", 1e-4, 1e4, 0.02, &from, problem));
    TRY(request_number(request, "to", 1e-4, 1e4, 10, &to, problem));
    TRY(request_count(request, "points", 2, POINTS_MAX, POINTS_INITIAL, &points, problem));
    if (from >= to)
        return problem_set(problem, STATUS_USAGE, "\"from\" is %g s, must be below \"to\", %g s",
                           from, to);
    TRY(columns_allocate(&spectrum->columns, COUNT(names), points, 0, problem));
    for (size_t i = 0; i < COUNT(names); i++)
        columns_name(&spectrum->columns, i, names[i][0], names[i][1]);
    response_spectrum_periods(from, to, points, spectrum->columns.at[0].values);
    return STATUS_OK;
}

static double spectrum_steps(const SpectrumRun *spectrum) {
    return response_spectrum_steps(spectrum->columns.at[0].values, spectrum->columns.rows,
                                   spectrum->named->samples.count, spectrum->named->interval);
}

static Status spectrum_check_steps(double steps, Problem *problem) {
    if (steps <= steps_max)
        return STATUS_OK;
    return problem_set(problem, STATUS_LIMIT,
                       "the spectrum would take %.3g steps of oscillators, at most %.3g are "
                       "allowed: ask for fewer points, or \"from\" a longer period",
                       steps, steps_max);
}

static void spectrum_put_json(const SpectrumRun *spectrum, Bytes *bytes) {
    bytes_json(bytes, "{\"record\": %s, \"damping_ratio\": %g", spectrum->named->name,
               spectrum->damping_ratio);
    for (size_t i = 0; i < spectrum->columns.count; i++) {
        const Column *column = &spectrum->columns.at[i];
        bytes_json(bytes, ",\n \"%s\": {\"unit\": %s, \"values\": [", column->name, column->unit);
        bytes_reals(bytes, column->values, spectrum->columns.rows);
        bytes_text(bytes, "]}");
    }
    bytes_text(bytes, "}\n");
}

static Status spectrum_put_csv(const SpectrumRun *spectrum, Bytes *bytes, Problem *problem) {
    const Column *column = spectrum->columns.at;
    const Column *const columns[] = {&column[1], &column[2], &column[3]};
    const Table table = {.axis_name = column->name,
                         .axis_unit = column->unit,
                         .axis = column->values,
                         .count = spectrum->columns.rows,
                         .columns = columns,
                         .column_count = COUNT(columns)};
    return format_write(&format_csv, &table, bytes, problem);
}

static const TableFormat *const spectrum_formats[] = {&format_json, &format_csv, &format_svg, NULL};

// Sets the tag. True: the client has it.
static bool spectrum_is_cached(const Request *request, Reply *reply, const SpectrumRun *spectrum,
                               const TableFormat *format) {
    char tag[112];
    const Column *period = spectrum->columns.at;
    const size_t count = spectrum->columns.rows;
    snprintf(tag, sizeof tag, "%.16s-%.17g-%.17g-%.17g-%zu-%s", spectrum->named->digest,
             spectrum->damping_ratio, period->values[0], period->values[count - 1], count,
             format->extension);
    return reply_tagged(reply, request, tag);
}

static Status spectrum_reply(App *app, const Request *request, Reply *reply, void *context,
                             Problem *problem) {
    SpectrumRun *spectrum = context;
    const TableFormat *format;
    Bytes bytes = {.most = app->reply_most};
    TRY(columns_format(request, 1, spectrum_formats, reply, &format, problem));
    if (spectrum->status != STATUS_OK)
        return problem_set(problem, spectrum->status, "the spectrum was stopped");
    if (spectrum_is_cached(request, reply, spectrum, format))
        return STATUS_OK;
    if (format == &format_json)
        spectrum_put_json(spectrum, &bytes);
    else if (format == &format_svg)
        chart_response_spectrum(spectrum->named->name, spectrum->damping_ratio, &spectrum->columns,
                                &bytes);
    else
        TRY(spectrum_put_csv(spectrum, &bytes, problem));
    return reply_bytes(reply, 200, format->content_type, &bytes, problem);
}

Status records_spectrum(App *app, const Request *request, Reply *reply, Problem *problem) {
    static const RequestRun run = {spectrum_run, spectrum_free, spectrum_reply,
                                   "the spectrum takes longer than expected: ask for fewer points"};
    const TableFormat *format;
    TRY(columns_format(request, 1, spectrum_formats, reply, &format, problem));
    if (request->kept != NULL)
        return request_run_resume(app, request, reply, &run, problem);
    SpectrumRun *spectrum = calloc(1, sizeof *spectrum);
    if (spectrum == NULL)
        return problem_set(problem, STATUS_NO_MEMORY, "no memory for the spectrum");
    Status status = spectrum_read_request(request, spectrum, problem);
    if (status == STATUS_OK)
        status = db_record_named(app->db, request->parameters[0], &spectrum->named, problem);
    if (status == STATUS_OK)
        status = spectrum_check_steps(spectrum_steps(spectrum), problem);
    if (status == STATUS_OK && !spectrum_is_cached(request, reply, spectrum, format))
        return request_run_start(app, request, reply, &run, spectrum,
                                 spectrum_steps(spectrum) * step_seconds, problem);
    spectrum_free(spectrum);
    return status;
}
