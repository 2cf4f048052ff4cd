// POST /v1/compare: a result beside a measured motion, sent as JSON or as a table of text with the
// rest in the query. The measured samples are moved by a shift in time, given or found by
// cross-correlation, and both are compared over their common span at the samples of the coarser
// one.
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "core/base/spelling.h"
#include "core/excitation/recorded_motion.h"
#include "core/formats/ground_motion_text.h"
#include "core/result/signal_comparison.h"
#include "core/result/spectrum_distance.h"
#include "server/api/compare.h"
#include "server/http/header.h"
#include "server/http/reply.h"
#include "server/json/encode.h"
#include "server/json/parse.h"
#include "server/util/base_path.h"

enum { MEASURED_MIN = 16, SEGMENT = 4096 }; // samples; of the spectra

typedef enum MeasuredQuantity {
    QUANTITY_ACCELERATION,
    QUANTITY_VELOCITY,
    QUANTITY_DISPLACEMENT
} MeasuredQuantity;
static const char *const quantity_names[] = {"acceleration", "velocity", "displacement", NULL};
static const char *const quantity_units[] = {"m/s^2", "m/s", "m"};

typedef enum Align { ALIGN_GIVEN, ALIGN_AUTO } Align;
static const char *const align_names[] = {"given", "auto", NULL};

typedef struct Measured {
    Reals samples;
    double interval, start; // [s]
    int quantity;           // MeasuredQuantity
} Measured;

typedef struct MeasuredRequest {
    char *a;
    char *channel;
    Measured measured;
    int align;         // Align
    double shift;      // [s]
    double most_shift; // [s]
} MeasuredRequest;

// clang-format off
static const Field measured_fields[] = {
    FIELD_REALS(Measured, samples, NULL, ANY, RECORD_SAMPLES, PRESENCE_REQUIRED, "what was measured, in SI units"),
    FIELD_REAL(Measured, interval, "s", WITHIN(1e-9, 1e6), REQUIRED, "from one sample to the next"),
    FIELD_REAL(Measured, start, "s", WITHIN(-1e9, 1e9), 0, "time of the first sample; the result's first is at 0"),
    FIELD_CHOICE(Measured, quantity, quantity_names, QUANTITY_ACCELERATION, "what was measured"),
    FIELD_END
};

static const Field measured_request_fields[] = {
    FIELD_TEXT(MeasuredRequest, a, 80, PRESENCE_REQUIRED, 0, "a result or a finished job"),
    FIELD_TEXT(MeasuredRequest, channel, 64, PRESENCE_OPTIONAL, 0, "the result's channel; if absent the quantity's, or for an acceleration mean_acceleration where that alone was sampled"),
    FIELD_ITEM(MeasuredRequest, measured, measured_fields, NULL, PRESENCE_DEFAULT, "the measurement"),
    FIELD_CHOICE(MeasuredRequest, align, align_names, ALIGN_GIVEN, "given: by shift; auto: the shift at which both correlate best"),
    FIELD_REAL(MeasuredRequest, shift, "s", WITHIN(-1e9, 1e9), 0, "that the measured samples are moved by to later times, under given"),
    FIELD_REAL(MeasuredRequest, most_shift, "s", ABOVE(0), OPTIONAL, "under auto, within which it is sought; anywhere if absent"),
    FIELD_END
};
// clang-format on

static void measured_free(void *asked) {
    if (asked != NULL)
        fields_clear(measured_request_fields, asked);
    free(asked);
}

static Status measured_read_document(const Request *request, MeasuredRequest *asked,
                                     Problem *problem) {
    if (request->query_count > 0)
        return problem_set(problem, STATUS_USAGE,
                           "beside JSON there is no query: \"%.40s\" is a member of the document",
                           request->queries[0].name);
    return json_parse(request->body, request->body_size, measured_request_fields, asked, problem);
}

static Status measured_read_name(const Request *request, const char *name, char **target,
                                 Problem *problem) {
    const char *text = request_query(request, name);
    *target = text != NULL && *text != '\0' ? strdup(text) : NULL;
    return *target == NULL && text != NULL && *text != '\0'
               ? problem_set(problem, STATUS_NO_MEMORY, "no memory for the measurement")
               : STATUS_OK;
}

static Status measured_read_choice(const Request *request, const char *name, const char *pointer,
                                   const char *const *names, int *choice, Problem *problem) {
    const char *text = request_query(request, name);
    for (int i = 0; text != NULL && names[i] != NULL; i++)
        if (strcmp(names[i], text) == 0) {
            *choice = i;
            return STATUS_OK;
        }
    return text == NULL ? STATUS_OK : spelling_reject(names, text, pointer, problem);
}

// The table; `text` is the caller's.
static Status measured_read_table(const char *text, size_t size, const GroundMotionOptions *wanted,
                                  MeasuredRequest *asked, Problem *problem) {
    GroundMotionText import = {0};
    Problem *fault = calloc(1, sizeof *fault);
    if (fault == NULL)
        return problem_set(problem, STATUS_NO_MEMORY, "no memory for the measurement");
    const Status status =
        ground_motion_text_read(text, size, RECORD_SAMPLES, wanted, &import, fault);
    if (status != STATUS_OK && fault->count > 0) // its places are lines, no pointers
        (void)problem_add(problem, status, "", "%s: %s", fault->faults[0].pointer,
                          fault->faults[0].detail);
    else if (status != STATUS_OK)
        (void)problem_set(problem, status, "%s", fault->detail);
    free(fault);
    asked->measured.samples = import.samples;
    asked->measured.interval = import.interval;
    asked->measured.start = import.start;
    import.samples = (Reals){NULL, 0};
    ground_motion_text_clear(&import);
    return status;
}

// A table of accelerations as `impactd import` reads them, and everything else in the query.
static Status measured_read_text(const Request *request, MeasuredRequest *asked, Problem *problem) {
    GroundMotionOptions wanted = {.interval = (double)NAN, .unit = CHOICE_ABSENT};
    TRY(measured_read_name(request, "a", &asked->a, problem));
    TRY(measured_read_name(request, "channel", &asked->channel, problem));
    TRY(measured_read_choice(request, "align", "/align", align_names, &asked->align, problem));
    TRY(measured_read_choice(request, "unit", "/unit", acceleration_unit_names, &wanted.unit,
                             problem));
    TRY(request_number(request, "shift", -1e9, 1e9, 0, &asked->shift, problem));
    TRY(request_number(request, "most_shift", 1e-12, 1e9, (double)NAN, &asked->most_shift,
                       problem));
    TRY(request_number(request, "interval", 1e-9, 1e6, (double)NAN, &wanted.interval, problem));
    char *text = malloc(request->body_size + 1);
    if (text == NULL)
        return problem_set(problem, STATUS_NO_MEMORY, "no memory for the measurement");
    memcpy(text, request->body, request->body_size + 1);
    // In text/csv a comma parts two cells; elsewhere it might be a decimal one and is a fault.
    const bool has_commas = header_type_is(request->content_type, "text/csv");
    for (size_t i = 0; has_commas && i < request->body_size; i++)
        if (text[i] == ',')
            text[i] = ' ';
    const Status status = measured_read_table(text, request->body_size, &wanted, asked, problem);
    free(text);
    return status;
}

static Status measured_check_type(const Request *request, bool *is_text, Problem *problem) {
    *is_text = header_type_is(request->content_type, "text/csv") ||
               header_type_is(request->content_type, "text/plain");
    if (!*is_text && !header_type_is(request->content_type, type_json))
        return problem_set(
            problem, STATUS_UNSUPPORTED_TYPE,
            "the body must be application/json, or a table of times and accelerations as text/csv "
            "or text/plain with ?a=RESULT, is %.60s",
            request->content_type != NULL ? request->content_type : "of no given type");
    return *is_text ? request_require_body(request, problem)
                    : request_require_json(request, problem);
}

// Made also where it fails, except for STATUS_NO_MEMORY; freed by measured_free.
static Status measured_read(const Request *request, MeasuredRequest **made, Problem *problem) {
    bool is_text;
    TRY(measured_check_type(request, &is_text, problem));
    MeasuredRequest *asked = *made = calloc(1, sizeof *asked);
    if (asked == NULL || fields_default(measured_request_fields, asked) != STATUS_OK)
        return problem_set(problem, STATUS_NO_MEMORY, "no memory for the measurement");
    TRY(is_text ? measured_read_text(request, asked, problem)
                : measured_read_document(request, asked, problem));
    TRY(fields_validate(measured_request_fields, asked, "", problem));
    if (asked->measured.samples.count < MEASURED_MIN)
        return problem_add(problem, STATUS_INVALID, "/measured/samples",
                           "must be at least %d samples, are %zu", MEASURED_MIN,
                           asked->measured.samples.count);
    return STATUS_OK;
}

static Status measured_error_channel(const MeasuredRequest *asked, const Response *response,
                                     Problem *problem) {
    char there[200] = "";
    for (size_t i = 0; i < response->series.count; i++) {
        const Column *column = &response->series.at[i];
        const size_t used = strlen(there);
        if (strcmp(column->unit, quantity_units[asked->measured.quantity]) == 0 &&
            used + sizeof column->name + 2 < sizeof there)
            text_list(there, sizeof there, column->name);
    }
    Fault fault = {.pointer = "/channel"};
    if (asked->channel != NULL)
        text_quote(fault.value, sizeof fault.value, asked->channel);
    snprintf(fault.detail, sizeof fault.detail,
             "must be a sampled channel in %s; the result has: %s",
             quantity_units[asked->measured.quantity], there[0] != '\0' ? there : "none");
    return problem_add_fault(problem, STATUS_INVALID, &fault);
}

static Status measured_find_channel(const MeasuredRequest *asked, const Response *response,
                                    const Column **column, Problem *problem) {
    const int quantity = asked->measured.quantity;
    *column = columns_find(&response->series,
                           asked->channel != NULL ? asked->channel : quantity_names[quantity]);
    if (*column == NULL && asked->channel == NULL && quantity == QUANTITY_ACCELERATION)
        *column = columns_find(&response->series, "mean_acceleration");
    return *column != NULL && strcmp((*column)->unit, quantity_units[quantity]) == 0
               ? STATUS_OK
               : measured_error_channel(asked, response, problem);
}

// Both spectra by the same method, of the common span.
static Status measured_spectra(const Signal *a, const Signal *b, Spectrum *spectrum,
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

static void measured_write(Bytes *bytes, const char *result, const Column *column,
                           const MeasuredRequest *asked, double shift, const Signal *a,
                           const Signal *b, const Spectrum *spectrum) {
    const SignalComparison comparison = signal_comparison_measure(a, b, COMPARE_PART, NULL);
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
    encode_item(bytes, signal_comparison_fields, &comparison, WRITE_REPORT);
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

static Status measured_compare(App *app, const char *result, const MeasuredRequest *asked,
                               const Outcome *outcome, Reply *reply, Problem *problem) {
    const Response *response = &outcome->response;
    const Measured *measured = &asked->measured;
    const Column *column;
    TRY(measured_find_channel(asked, response, &column, problem));
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
    TRY(measured_spectra(&a, &b, &spectrum, problem));
    measured_write(&bytes, result, column, asked, shift, &a, &b, &spectrum);
    spectrum_clear(&spectrum);
    return reply_bytes(reply, 200, type_json, &bytes, problem);
}

Status compare_measured(App *app, const Request *request, Reply *reply, Problem *problem) {
    CompareSides sides = compare_begin(request);
    char results[1][72];
    bool is_waiting = false;
    Status status = STATUS_OK;
    MeasuredRequest *asked = sides.asked;
    problem->whose = "comparison";
    if (asked == NULL)
        status = measured_read(request, &asked, problem);
    sides.asked = asked;
    sides.release = measured_free;
    if (status == STATUS_OK)
        status = compare_resolve(app, "a", asked->a, results[0], problem);
    if (status == STATUS_OK)
        status = compare_outcomes(app, request, reply, 1, results, &sides, &is_waiting, problem);
    if (status == STATUS_OK && !is_waiting)
        status = measured_compare(app, results[0], asked, sides.outcomes[0], reply, problem);
    compare_end(&sides);
    return status;
}
