// POST /v1/compare: a result beside a measured motion. The measured samples are moved by a shift in
// time, given or found by cross-correlation, and both are looked at over their common span at the
// samples of the coarser one.
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "server/api/app.h"
#include "server/api/compare_parts.h"
#include "server/api/compare_side.h"
#include "server/api/compare_upload.h"
#include "server/http/reply.h"
#include "server/json/encode.h"
#include "server/util/base_path.h"

enum { SEGMENT = 4096 };

static const char *const statistic_units[] = {"m/s^2", "m/s", "m"};

static Status refuse_channel(const MeasuredRequest *asked, const Response *response,
                             Problem *problem) {
    char there[200] = "";
    for (size_t i = 0; i < response->series.count; i++) {
        const Column *column = &response->series.at[i];
        const size_t used = strlen(there);
        if (strcmp(column->unit, statistic_units[asked->measured.quantity]) == 0 &&
            used + sizeof column->name + 2 < sizeof there)
            text_list(there, sizeof there, column->name);
    }
    Fault fault = {.pointer = "/channel"};
    if (asked->channel != NULL)
        text_quote(fault.value, sizeof fault.value, asked->channel);
    snprintf(fault.detail, sizeof fault.detail,
             "must be a sampled channel in %s; the result has: %s",
             statistic_units[asked->measured.quantity], there[0] != '\0' ? there : "none");
    return problem_add_fault(problem, STATUS_INVALID, &fault);
}

static Status choose_channel(const MeasuredRequest *asked, const Response *response,
                             const Column **column, Problem *problem) {
    const int quantity = asked->measured.quantity;
    *column = columns_find(&response->series,
                           asked->channel != NULL ? asked->channel : statistic_names[quantity]);
    if (*column == NULL && asked->channel == NULL && quantity == QUANTITY_ACCELERATION)
        *column = columns_find(&response->series, "mean_acceleration");
    return *column != NULL && strcmp((*column)->unit, statistic_units[quantity]) == 0
               ? STATUS_OK
               : refuse_channel(asked, response, problem);
}

// Both spectra by the same method, of the common span.
static Status measure_spectra(const Signal *a, const Signal *b, Spectrum *spectrum,
                              Problem *problem) {
    static const char *const units[2] = {"", ""};
    Columns pair = {0};
    double rate;
    TRY(signal_comparison_align(a, b, MEASURED_MIN, &pair, &rate, problem));
    columns_name(&pair, 0, "a", "");
    columns_name(&pair, 1, "measured", "");
    const size_t segment = pair.rows < SEGMENT ? pair.rows : SEGMENT;
    const WelchSettings settings = {segment, segment / 2, WELCH_HANN, WELCH_DETREND_CONSTANT};
    const Status status =
        welch_spectrum(&pair, units, rate, &settings, NULL, NULL, spectrum, problem);
    columns_clear(&pair);
    return status;
}

static void write_answer(Bytes *bytes, const char *result, const Column *column,
                         const MeasuredRequest *asked, double shift, const Signal *a,
                         const Signal *b, const Spectrum *spectrum) {
    const SignalComparison likeness = signal_comparison_measure(a, b, COMPARE_PART, NULL);
    const SpectrumDistance distance =
        spectrum_distance_measure(spectrum, spectrum->densities.at[0].values, spectrum,
                                  spectrum->densities.at[1].values, (double)NAN, (double)NAN);
    bytes_format(bytes,
                 "{\"a\": {\"id\": \"%s\", \"links\": {\"self\": \"%s/v1/results/%s\"}}, "
                 "\"channel\": ",
                 result, base_path(), result);
    bytes_json_string(bytes, column->name);
    bytes_text(bytes, ", \"unit\": ");
    bytes_json_string(bytes, column->unit);
    bytes_format(bytes, ", \"align\": \"%s\", \"shift\": ", align_names[asked->align]);
    bytes_real(bytes, shift);
    bytes_text(bytes, ", \"motion\": ");
    encode_item(bytes, signal_comparison_fields, &likeness, WRITE_REPORT);
    bytes_format(bytes, ", \"psd\": {\"segment\": %zu, ", spectrum->settings.segment);
    encode_members(bytes, spectrum_distance_fields, &distance, WRITE_REPORT);
    bytes_text(bytes, "}, \"warnings\": [");
    if (b->rate > a->rate * (1 + 1e-9))
        compare_put_warning(bytes,
                            "the measurement has %g samples a second, the result %g: what is "
                            "faster than the result's samples is not filtered off",
                            b->rate, a->rate);
    bytes_text(bytes, "]}\n");
}

static Status compare(App *app, const char *result, const MeasuredRequest *asked,
                      const Outcome *outcome, Reply *reply, Problem *problem) {
    const Response *response = &outcome->response;
    const MeasuredUpload *measured = &asked->measured;
    const Column *column;
    TRY(choose_channel(asked, response, &column, problem));
    const Signal a = {column->values, response->count, response->sample_rate, 0};
    Signal b = {measured->samples.at, measured->samples.count, 1 / measured->interval,
                measured->start};
    double shift = asked->shift;
    const double longest = (double)a.count / a.rate + (double)b.count / b.rate + fabs(b.start);
    if (asked->align == ALIGN_AUTO)
        TRY(signal_comparison_shift(&a, &b, fmin(asked->most_shift, longest), &shift, problem));
    b.start += shift;
    Spectrum spectrum = {0};
    Bytes bytes = {.most = app->reply_most};
    TRY(measure_spectra(&a, &b, &spectrum, problem));
    write_answer(&bytes, result, column, asked, shift, &a, &b, &spectrum);
    spectrum_clear(&spectrum);
    return reply_bytes(reply, 200, type_json, &bytes, problem);
}

Status compare_measured(App *app, const Request *request, Reply *reply, Problem *problem) {
    Sides sides = sides_begin(request);
    char results[1][72];
    bool is_waiting = false;
    Status status = STATUS_OK;
    MeasuredRequest *asked = sides.asked;
    problem->whose = "comparison";
    if (asked == NULL)
        status = measured_upload_read(request, &asked, problem);
    sides.asked = asked;
    sides.release = measured_upload_free;
    if (status == STATUS_OK)
        status = side_resolve(app, "a", asked->a, results[0], problem);
    if (status == STATUS_OK)
        status = sides_outcomes(app, request, reply, 1, results, &sides, &is_waiting, problem);
    if (status == STATUS_OK && !is_waiting)
        status = compare(app, results[0], asked, sides.outcomes[0], reply, problem);
    sides_end(&sides);
    return status;
}
