// Comparisons of a result. GET: with another one, where motions and spectra need the series, which
// a worker may have to compute again; where another engine made one, the rest is compared. POST:
// with a measured motion, sent as JSON or as a table of text with the rest in the query. The
// measured samples are moved by a shift in time, given or found by cross-correlation, and both are
// compared over their common span at the samples of the coarser one.
#include <math.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "core/base/spelling.h"
#include "core/excitation/recorded_motion.h"
#include "core/formats/ground_motion_text.h"
#include "core/result/signal_comparison.h"
#include "core/result/spectrum_distance.h"
#include "server/api/app.h"
#include "server/http/header.h"
#include "server/json/document.h"
#include "server/json/encode.h"
#include "server/json/parse.h"
#include "server/util/base_path.h"

#define COMPARE_PART 0.01 // of the largest displacement, by which motions have parted

enum { COMPARE_SIDES = 2 };
enum { CHANNELS = 64, SAMPLES = 1 << 26 };  // compared, of each kind and in all
enum { MEASURED_MIN = 16, SEGMENT = 4096 }; // samples; of the spectra

typedef enum MeasuredQuantity {
    QUANTITY_ACCELERATION,
    QUANTITY_VELOCITY,
    QUANTITY_DISPLACEMENT,
    QUANTITY_FORCE
} MeasuredQuantity;
static const char *const quantity_names[] = {"acceleration", "velocity", "displacement", "force",
                                             NULL};
static const char *const quantity_units[] = {"m/s^2", "m/s", "m", "N"};

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
    bool densities;
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
    FIELD_FLAG(MeasuredRequest, densities, false, "answer both densities too"),
    FIELD_END
};

static const Field unit_fields[] = {
    FIELD_CHOICE(GroundMotionOptions, unit, acceleration_unit_names, OPTIONAL, "of a table of accelerations"),
    FIELD_END
};
// clang-format on

// What a request works with and keeps while it waits, so that no cache can drop one outcome while
// the other one is computed. The body is gone by then: the measurement is kept too.
typedef struct CompareSides {
    Outcome *outcomes[COMPARE_SIDES]; // references
    MeasuredRequest measured;         // of POST
    bool is_read;                     // it was
} CompareSides;

static void compare_free(void *context) {
    CompareSides *sides = context;
    for (size_t i = 0; i < COMPARE_SIDES; i++)
        outcome_unref(sides->outcomes[i]);
    fields_clear(measured_request_fields, &sides->measured);
    free(sides);
}

// A new one, or what an earlier call of the handler kept. NULL without memory.
static CompareSides *compare_begin(const Request *request, Problem *problem) {
    CompareSides *sides = request->kept != NULL ? request->kept : calloc(1, sizeof *sides);
    if (sides == NULL)
        (void)problem_set(problem, STATUS_NO_MEMORY, "no memory for the comparison");
    return sides;
}

// "r-..." as it is, "j-..." to its job's result. STATUS_NOT_FOUND, STATUS_CONFLICT for a job that
// has none. `name` is that of the parameter, for a fault.
static Status compare_resolve(App *app, const char *name, const char *id, char result[72],
                              Problem *problem) {
    Job *job = NULL;
    JobView view = {0};
    if (strncmp(id, "j-", 2) != 0) {
        snprintf(result, 72, "%s", id);
        const Status found = db_result_find(app->db, result, problem);
        return found != STATUS_NOT_FOUND
                   ? found
                   : problem_set(problem, found, "there is no result %.80s (\"%s\")", id, name);
    }
    TRY(jobs_find(app->manager, id, &job, problem));
    Status status = job_view(job, &view);
    job_unref(job);
    if (status != STATUS_OK)
        status = problem_set(problem, status, "the job cannot be shown");
    else if (view.row.state != JOB_SUCCESSFUL)
        status =
            problem_set(problem, STATUS_CONFLICT, "the job %s (\"%s\") has no result: it is %s",
                        view.row.id, name, job_state_names[view.row.state]);
    else
        snprintf(result, 72, "%s", view.row.result);
    job_view_clear(&view);
    return status;
}

// Gets the outcomes of `count` results with their series. With *is_waiting the reply is made: the
// request waits or was refused, and `sides` is not the caller's any more. STATUS_GONE as
// jobs_outcome.
static Status compare_outcomes(App *app, const Request *request, Reply *reply, size_t count,
                               char results[][72], CompareSides *sides, bool *is_waiting,
                               Problem *problem) {
    bool is_complete = true;
    for (size_t i = 0; i < count; i++) {
        if (sides->outcomes[i] == NULL)
            TRY(jobs_outcome(app->manager, results[i], request->callback, &sides->outcomes[i],
                             problem));
        is_complete = is_complete && sides->outcomes[i] != NULL;
    }
    *is_waiting = !is_complete;
    return is_complete
               ? STATUS_OK
               : columns_wait(request, reply, sides, compare_free,
                              "the series are still being computed again; retry a little later",
                              problem);
}

// {"pointer": "", "detail": ...}, with a comma before it where one is needed.
static void compare_put_warning(Bytes *bytes, const char *format, ...)
    __attribute__((format(printf, 2, 3)));
static void compare_put_warning(Bytes *bytes, const char *format, ...) {
    char text[300];
    va_list arguments;
    va_start(arguments, format);
    vsnprintf(text, sizeof text, format, arguments);
    va_end(arguments);
    const bool is_first = bytes->count > 0 && bytes->at[bytes->count - 1] == '[';
    bytes_json(bytes, "%p{\"pointer\": \"\", \"detail\": %s}", is_first ? "" : ", ", text);
}

// --- the document ---

static double compare_number(const Field *field, const Summary *summary) {
    const void *member = (const char *)summary + field->offset;
    if (field->kind == FIELD_KIND_REAL)
        return *(const double *)member;
    const uint64_t count = *(const uint64_t *)member;
    return count == COUNT_ABSENT ? (double)NAN : (double)count;
}

// [{"name", "unit", "a", "b", "difference", "relative"}].
static void compare_put_metrics(Bytes *bytes, const Summary *a, const Summary *b) {
    bytes_text(bytes, "[");
    for (const Field *field = summary_fields; field->kind != FIELD_KIND_END; field++) {
        const double x = compare_number(field, a), y = compare_number(field, b);
        bytes_json(bytes,
                   "%p{\"name\": %s, \"unit\": %s, \"a\": %g, \"b\": %g, \"difference\": %g, "
                   "\"relative\": %g}",
                   field == summary_fields ? "" : ", ", field->name, field->unit, x, y, y - x,
                   x != 0   ? (y - x) / fabs(x)
                   : y == x ? 0
                            : (double)NAN);
    }
    bytes_text(bytes, "]");
}

static void compare_put_channel(Bytes *bytes, const char *separator, const Column *column,
                                const Field *fields, const void *item) {
    bytes_json(bytes, "%p{\"channel\": %s, \"unit\": %s, ", separator, column->name, column->unit);
    encode_members(bytes, fields, item, WRITE_REPORT);
    bytes_text(bytes, "}");
}

static Signal compare_signal(const Response *response, const Column *column) {
    return (Signal){column->values, response->count, response->sample_rate, 0};
}

// When the motions part by the first displacement of both; null without one.
static void compare_put_divergence(Bytes *bytes, const char *channel, double parting,
                                   const double horizons[2]) {
    const double horizon = fmin(horizons[0], horizons[1]);
    if (channel == NULL)
        bytes_text(bytes, ", \"divergence\": null");
    else
        bytes_json(bytes,
                   ", \"divergence\": {\"channel\": %s, \"part\": %g, \"time\": %g, \"horizon\": "
                   "%g, \"is_trusted\": %p}",
                   channel, COMPARE_PART, parting, horizon,
                   json_flag(!isnan(parting) && !(parting > horizon)));
}

// The channels that both sampled, as many as a client can wait for, and when the displacements
// part: members "channels" and "divergence". Returns how many channels were too many.
static size_t compare_put_motions(Bytes *bytes, const Response *a, const Response *b,
                                  const double horizons[2]) {
    const char *channel = NULL;
    double parting = (double)NAN;
    size_t compared = 0, left = 0;
    double samples = 0;
    bytes_text(bytes, "\"channels\": [");
    for (size_t i = 0; i < a->series.count; i++) {
        const Column *from = &a->series.at[i], *to = columns_find(&b->series, from->name);
        const bool is_too_much = compared == CHANNELS || samples >= SAMPLES;
        left += to != NULL && is_too_much;
        if (to == NULL || is_too_much)
            continue;
        const Signal x = compare_signal(a, from), y = compare_signal(b, to);
        const SignalComparison comparison = signal_comparison_measure(&x, &y, COMPARE_PART, NULL);
        size_t number;
        if (channel == NULL && channel_find(from->name, &number) == &channels[0]) {
            channel = from->name;
            parting = comparison.parting;
        }
        compare_put_channel(bytes, compared++ > 0 ? ", " : "", from, signal_comparison_fields,
                            &comparison);
        samples += (double)comparison.samples;
    }
    bytes_text(bytes, "]");
    compare_put_divergence(bytes, channel, parting, horizons);
    return left;
}

// The densities that both have. Returns how many were too many.
static size_t compare_put_spectra(Bytes *bytes, const Spectrum *a, const Spectrum *b) {
    size_t compared = 0, left = 0;
    bytes_text(bytes, "[");
    for (size_t i = 0; i < a->densities.count; i++) {
        const Column *from = &a->densities.at[i], *to = columns_find(&b->densities, from->name);
        left += to != NULL && compared == CHANNELS;
        if (to == NULL || compared == CHANNELS)
            continue;
        const SpectrumDistance distance =
            spectrum_distance_measure(a, from->values, b, to->values, (double)NAN, (double)NAN);
        compare_put_channel(bytes, compared++ > 0 ? ", " : "", from, spectrum_distance_fields,
                            &distance);
    }
    bytes_text(bytes, "]");
    return left;
}

static void compare_warn_left(Bytes *bytes, size_t motions, size_t spectra) {
    if (motions > 0)
        compare_put_warning(bytes,
                            "%zu more channels of both are not compared: at most %d are, and no "
                            "more once they have %d samples in all",
                            motions, CHANNELS, SAMPLES);
    if (spectra > 0)
        compare_put_warning(bytes, "%zu more spectra of both are not compared: at most %d are",
                            spectra, CHANNELS);
}

// What differs in how both were sampled.
static void compare_warn(Bytes *bytes, const Response *a, const Response *b,
                         const Spectrum *spectrum_a, const Spectrum *spectrum_b) {
    if (a->count == 0 || b->count == 0)
        return;
    if (a->sample_rate != b->sample_rate)
        compare_put_warning(bytes,
                            "the sample rates differ, %g and %g Hz: motions are compared at the "
                            "samples of the coarser one",
                            a->sample_rate, b->sample_rate);
    const double lasts[2] = {(double)(a->count - 1) / a->sample_rate,
                             (double)(b->count - 1) / b->sample_rate};
    if (fabs(lasts[0] - lasts[1]) * fmin(a->sample_rate, b->sample_rate) > 0.5)
        compare_put_warning(bytes,
                            "the durations differ, %g and %g s: motions are compared over the "
                            "common span, statistics and spectra are each run's own",
                            lasts[0], lasts[1]);
    if (spectrum_a->densities.count > 0 && spectrum_b->densities.count > 0 &&
        (spectrum_a->settings.segment != spectrum_b->settings.segment ||
         spectrum_a->settings.window != spectrum_b->settings.window))
        compare_put_warning(bytes,
                            "the spectra's settings differ, segments of %zu and %zu samples: their "
                            "resolution is not the same",
                            spectrum_a->settings.segment, spectrum_b->settings.segment);
}

static void compare_put_side(Bytes *bytes, const char *name, const ResultRow *row) {
    bytes_json(
        bytes,
        "\"%s\": {\"id\": %s, \"engine\": %s, \"links\": {\"self\": \"%s/v1/results/%s\"}}, ", name,
        row->id, row->engine, base_path(), row->id);
}

// Series and spectra are null where `gone` (not NULL) states why.
static void compare_put_outcomes(Bytes *bytes, Outcome *const outcomes[COMPARE_SIDES],
                                 const char *gone) {
    const double horizons[2] = {outcomes[0]->summary.trust_horizon,
                                outcomes[1]->summary.trust_horizon};
    if (gone != NULL) {
        bytes_text(bytes, ", \"channels\": null, \"divergence\": null, \"psd\": null, "
                          "\"warnings\": [");
        compare_put_warning(bytes, "series and spectra are not compared: %s", gone);
        bytes_text(bytes, "]");
        return;
    }
    const Outcome *a = outcomes[0], *b = outcomes[1];
    bytes_text(bytes, ", ");
    const size_t motions = compare_put_motions(bytes, &a->response, &b->response, horizons);
    bytes_text(bytes, ", \"psd\": ");
    const size_t spectra = compare_put_spectra(bytes, &a->spectrum, &b->spectrum);
    bytes_text(bytes, ", \"warnings\": [");
    compare_warn_left(bytes, motions, spectra);
    compare_warn(bytes, &a->response, &b->response, &a->spectrum, &b->spectrum);
    bytes_text(bytes, "]");
}

static void compare_put(Bytes *bytes, const ResultRow rows[2], const Bytes *inputs,
                        size_t input_count, Outcome *const outcomes[COMPARE_SIDES],
                        const char *gone) {
    bytes_text(bytes, "{");
    compare_put_side(bytes, "a", &rows[0]);
    compare_put_side(bytes, "b", &rows[1]);
    bytes_json(bytes, "\"inputs\": %p, \"more_inputs\": %zu, \"metrics\": ", inputs->at,
               input_count > DIFF_MAX ? input_count - DIFF_MAX : 0);
    compare_put_metrics(bytes, &outcomes[0]->summary, &outcomes[1]->summary);
    compare_put_outcomes(bytes, outcomes, gone);
    bytes_text(bytes, "}\n");
}

static Status compare_show(App *app, char results[2][72], Outcome *outcomes[COMPARE_SIDES],
                           const char *gone, Reply *reply, Problem *problem) {
    static const DiffFormat format = {"a", "b", true};
    ResultRow rows[2] = {{.id = ""}, {.id = ""}};
    Bytes inputs = {.most = app->reply_most}, bytes = {.most = app->reply_most};
    size_t count = 0;
    Status status = STATUS_OK;
    for (int i = 0; i < 2 && status == STATUS_OK; i++) {
        status = db_result_load(app->db, results[i], &rows[i], problem);
        if (status == STATUS_OK && outcomes[i] == NULL)
            status = jobs_outcome_stored(app->manager, results[i], &outcomes[i], problem);
    }
    // A study asks more of a scene; the scenes' own runs are compared.
    if (status == STATUS_OK)
        status =
            json_diff(rows[0].scene, rows[1].scene, "study", &format, &inputs, &count, problem);
    bytes.is_failed = inputs.is_failed && !inputs.is_over;
    if (status == STATUS_OK)
        compare_put(&bytes, rows, &inputs, count, outcomes, gone);
    for (int i = 0; i < 2; i++)
        result_row_clear(&rows[i]);
    bytes_clear(&inputs);
    return reply_json(reply, 200, &bytes, status, problem);
}

static Status compare_both(App *app, const Request *request, CompareSides *sides, bool *is_waiting,
                           Reply *reply, Problem *problem) {
    static const char *const names[2] = {"a", "b"};
    char results[2][72], tag[104];
    for (int i = 0; i < 2; i++) {
        const char *id = request_query(request, names[i]);
        if (id == NULL || *id == '\0')
            return problem_set(problem, STATUS_USAGE,
                               "\"%s\" is missing: /v1/compare?a=ID&b=ID takes two results or "
                               "finished jobs",
                               names[i]);
        TRY(compare_resolve(app, names[i], id, results[i], problem));
    }
    snprintf(tag, sizeof tag, "%.34s-%.34s-compare", results[0], results[1]);
    if (reply_immutable(reply, request, tag))
        return STATUS_OK;
    Problem *fault = calloc(1, sizeof *fault);
    if (fault == NULL)
        return problem_set(problem, STATUS_NO_MEMORY, "no memory for the comparison");
    Status status = compare_outcomes(app, request, reply, 2, results, sides, is_waiting, fault);
    if (status == STATUS_GONE) {
        // Another program may have the series: this answer may change.
        reply->is_immutable = false;
        reply->etag[0] = reply->cache_control[0] = '\0';
        status = compare_show(app, results, sides->outcomes, fault->detail, reply, problem);
    } else if (status != STATUS_OK) {
        (void)problem_set(problem, status, "%s", fault->detail);
    } else if (!*is_waiting) {
        status = compare_show(app, results, sides->outcomes, NULL, reply, problem);
    }
    free(fault);
    return status;
}

Status compare_results(App *app, const Request *request, Reply *reply, Problem *problem) {
    CompareSides *sides = compare_begin(request, problem);
    bool is_waiting = false;
    if (sides == NULL)
        return STATUS_NO_MEMORY;
    const Status status = compare_both(app, request, sides, &is_waiting, reply, problem);
    if (!is_waiting)
        compare_free(sides);
    return status;
}

// A table of accelerations as `impactd import` reads them, and everything else in the query.
static Status measured_read_text(const Request *request, MeasuredRequest *asked, Problem *problem) {
    GroundMotionOptions options = {.interval = (double)NAN, .unit = CHOICE_ABSENT};
    GroundMotionText motion = {0};
    TRY(request_read_fields(request, measured_request_fields, asked, problem));
    TRY(request_read_fields(request, unit_fields, &options, problem));
    TRY(request_number(request, "shift", -1e9, 1e9, 0, &asked->shift, problem));
    TRY(request_number(request, "most_shift", 1e-12, 1e9, (double)NAN, &asked->most_shift,
                       problem));
    TRY(request_flag(request, "densities", &asked->densities, problem));
    TRY(request_number(request, "interval", 1e-9, 1e6, (double)NAN, &options.interval, problem));
    const Status status = records_read_motion(request, &options, &motion, problem);
    asked->measured =
        (Measured){motion.samples, motion.interval, motion.start, asked->measured.quantity};
    motion.samples = (Reals){NULL, 0};
    ground_motion_text_clear(&motion);
    return status;
}

static Status measured_read(const Request *request, MeasuredRequest *asked, Problem *problem) {
    static const char *const texts[] = {"text/csv", "text/plain", NULL};
    bool is_json;
    TRY(request_require_type(request, texts,
                             "application/json, or a table of times and accelerations as text/csv "
                             "or text/plain with ?a=RESULT",
                             "", &is_json, problem));
    if (fields_default(measured_request_fields, asked) != STATUS_OK)
        return problem_set(problem, STATUS_NO_MEMORY, "no memory for the measurement");
    TRY(is_json ? request_read_document(request, measured_request_fields, asked, problem)
                : measured_read_text(request, asked, problem));
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
        if (strcmp(column->unit, quantity_units[asked->measured.quantity]) == 0)
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

// Further members of "psd".
static void measured_put_densities(Bytes *bytes, const Spectrum *spectrum) {
    static const char *const names[] = {"frequency", "a", "measured"};
    const double *const lists[] = {spectrum->frequency, spectrum->densities.at[0].values,
                                   spectrum->densities.at[1].values};
    for (size_t i = 0; i < COUNT(lists); i++) {
        bytes_json(bytes, ", \"%s\": [", names[i]);
        bytes_reals(bytes, lists[i], spectrum->densities.rows);
        bytes_text(bytes, "]");
    }
}

static void measured_write(Bytes *bytes, const char *result, const Column *column,
                           const MeasuredRequest *asked, double shift, const Signal *a,
                           const Signal *b, const Spectrum *spectrum) {
    const SignalComparison comparison = signal_comparison_measure(a, b, COMPARE_PART, NULL);
    const SpectrumDistance distance =
        spectrum_distance_measure(spectrum, spectrum->densities.at[0].values, spectrum,
                                  spectrum->densities.at[1].values, (double)NAN, (double)NAN);
    bytes_json(
        bytes,
        "{\"a\": {\"id\": %s, \"links\": {\"self\": \"%s/v1/results/%s\"}}, \"channel\": %s, "
        "\"unit\": %s, \"align\": %s, \"shift\": %g, \"motion\": ",
        result, base_path(), result, column->name, column->unit, align_names[asked->align], shift);
    encode_item(bytes, signal_comparison_fields, &comparison, WRITE_REPORT);
    bytes_json(bytes, ", \"psd\": {\"segment\": %zu, ", spectrum->settings.segment);
    encode_members(bytes, spectrum_distance_fields, &distance, WRITE_REPORT);
    if (asked->densities)
        measured_put_densities(bytes, spectrum);
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
    CompareSides *sides = compare_begin(request, problem);
    char results[1][72];
    bool is_waiting = false;
    if (sides == NULL)
        return STATUS_NO_MEMORY;
    problem->whose = "comparison";
    Status status = sides->is_read ? STATUS_OK : measured_read(request, &sides->measured, problem);
    sides->is_read = true;
    if (status == STATUS_OK)
        status = compare_resolve(app, "a", sides->measured.a, results[0], problem);
    if (status == STATUS_OK)
        status = compare_outcomes(app, request, reply, 1, results, sides, &is_waiting, problem);
    if (status == STATUS_OK && !is_waiting)
        status =
            measured_compare(app, results[0], &sides->measured, sides->outcomes[0], reply, problem);
    if (!is_waiting)
        compare_free(sides);
    return status;
}
