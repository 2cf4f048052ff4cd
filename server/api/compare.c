// GET /v1/compare: two results side by side. Motions and spectra need the series, which a worker
// may have to compute again. Where another engine made one, the rest is compared without them.
#include "server/api/compare.h"

#include <math.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "core/result/signal_comparison.h"
#include "core/result/spectrum_distance.h"
#include "server/api/columns.h"
#include "server/http/reply.h"
#include "server/json/document.h"
#include "server/json/encode.h"
#include "server/util/base_path.h"

enum { CHANNELS = 64, SAMPLES = 1 << 26 }; // compared, of each kind and in all

Status compare_resolve(App *app, const char *name, const char *id, char result[72],
                       Problem *problem) {
    Job *job = NULL;
    JobView view = {0};
    if (strncmp(id, "j-", 2) != 0) {
        snprintf(result, 72, "%s", id);
        return db_result_exists(app->db, result)
                   ? STATUS_OK
                   : problem_set(problem, STATUS_NOT_FOUND, "there is no result %.80s (\"%s\")", id,
                                 name);
    }
    TRY(jobs_find(app->manager, id, &job, problem));
    Status status = job_view(job, &view);
    job_unref(job);
    if (status != STATUS_OK)
        status = problem_set(problem, status, "the job cannot be shown");
    else if (view.state != JOB_SUCCESSFUL)
        status =
            problem_set(problem, STATUS_CONFLICT, "the job %s (\"%s\") has no result: it is %s",
                        view.id, name, job_state_names[view.state]);
    else
        snprintf(result, 72, "%s", view.result);
    job_view_clear(&view);
    return status;
}

CompareSides compare_begin(const Request *request) {
    CompareSides sides = {{NULL}, NULL, NULL};
    if (request->kept == NULL)
        return sides;
    sides = *(const CompareSides *)request->kept;
    free(request->kept);
    return sides;
}

void compare_end(CompareSides *sides) {
    for (size_t i = 0; i < COMPARE_SIDES; i++)
        outcome_unref(sides->outcomes[i]);
    if (sides->release != NULL)
        sides->release(sides->asked);
    *sides = (CompareSides){{NULL}, NULL, NULL};
}

static void compare_forget(void *kept) {
    compare_end(kept);
    free(kept);
}

Status compare_outcomes(App *app, const Request *request, Reply *reply, size_t count,
                        char results[][72], CompareSides *sides, bool *is_waiting,
                        Problem *problem) {
    *is_waiting = false;
    for (size_t i = 0; i < count; i++) {
        if (sides->outcomes[i] == NULL)
            TRY(jobs_outcome(app->manager, results[i], request->callback, &sides->outcomes[i],
                             problem));
        *is_waiting = *is_waiting || sides->outcomes[i] == NULL;
    }
    if (!*is_waiting)
        return STATUS_OK;
    CompareSides *kept = malloc(sizeof *kept);
    if (kept == NULL)
        return problem_set(problem, STATUS_NO_MEMORY, "no memory to wait for the series");
    *kept = *sides;
    *sides = (CompareSides){{NULL}, NULL, NULL};
    return columns_wait(request, reply, kept, compare_forget,
                        "the series are still being computed anew; ask again a little later",
                        problem);
}

void compare_put_warning(Bytes *bytes, const char *format, ...) {
    char text[300];
    va_list arguments;
    va_start(arguments, format);
    vsnprintf(text, sizeof text, format, arguments);
    va_end(arguments);
    const bool is_first = bytes->count > 0 && bytes->at[bytes->count - 1] == '[';
    bytes_text(bytes, is_first ? "{\"pointer\": \"\", \"detail\": "
                               : ", {\"pointer\": \"\", \"detail\": ");
    bytes_json_string(bytes, text);
    bytes_text(bytes, "}");
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
        const double relative = x != 0 ? (y - x) / fabs(x) : y == x ? 0 : (double)NAN;
        bytes_format(bytes, "%s{\"name\": \"%s\", \"unit\": ", field == summary_fields ? "" : ", ",
                     field->name);
        bytes_json_string(bytes, field->unit);
        bytes_text(bytes, ", \"a\": ");
        bytes_real(bytes, x);
        bytes_text(bytes, ", \"b\": ");
        bytes_real(bytes, y);
        bytes_text(bytes, ", \"difference\": ");
        bytes_real(bytes, y - x);
        bytes_text(bytes, ", \"relative\": ");
        bytes_real(bytes, relative);
        bytes_text(bytes, "}");
    }
    bytes_text(bytes, "]");
}

static void compare_put_channel(Bytes *bytes, const char *name, const char *unit,
                                const Field *fields, const void *item) {
    bytes_text(bytes, "{\"channel\": ");
    bytes_json_string(bytes, name);
    bytes_text(bytes, ", \"unit\": ");
    bytes_json_string(bytes, unit);
    bytes_text(bytes, ", ");
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
    bytes_text(bytes, ", \"divergence\": ");
    if (channel == NULL) {
        bytes_text(bytes, "null");
        return;
    }
    bytes_text(bytes, "{\"channel\": ");
    bytes_json_string(bytes, channel);
    bytes_text(bytes, ", \"part\": ");
    bytes_real(bytes, COMPARE_PART);
    bytes_text(bytes, ", \"time\": ");
    bytes_real(bytes, parting);
    bytes_text(bytes, ", \"horizon\": ");
    bytes_real(bytes, horizon);
    bytes_format(bytes, ", \"is_trusted\": %s}",
                 !isnan(parting) && !(parting > horizon) ? "true" : "false");
}

// The channels that both sampled, as many as a client can wait for, and when the displacements
// part: members "channels" and "divergence". Returns how many channels were too many.
static size_t compare_put_motions(Bytes *bytes, const Response *a, const Response *b,
                                  const double horizons[2]) {
    const char *channel = NULL, *separator = "";
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
        bytes_text(bytes, separator);
        compare_put_channel(bytes, from->name, from->unit, signal_comparison_fields, &comparison);
        separator = ", ";
        compared++;
        samples += (double)comparison.samples;
    }
    bytes_text(bytes, "]");
    compare_put_divergence(bytes, channel, parting, horizons);
    return left;
}

// The densities that both have. Returns how many were too many.
static size_t compare_put_spectra(Bytes *bytes, const Spectrum *a, const Spectrum *b) {
    const char *separator = "";
    size_t compared = 0, left = 0;
    bytes_text(bytes, "[");
    for (size_t i = 0; i < a->densities.count; i++) {
        const Column *from = &a->densities.at[i], *to = columns_find(&b->densities, from->name);
        left += to != NULL && compared == CHANNELS;
        if (to == NULL || compared == CHANNELS)
            continue;
        compared++;
        const SpectrumDistance distance =
            spectrum_distance_measure(a, from->values, b, to->values, (double)NAN, (double)NAN);
        bytes_text(bytes, separator);
        compare_put_channel(bytes, from->name, from->unit, spectrum_distance_fields, &distance);
        separator = ", ";
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
    bytes_format(bytes, "\"%s\": {\"id\": \"%s\", \"engine\": ", name, row->id);
    bytes_json_string(bytes, row->engine);
    bytes_format(bytes, ", \"links\": {\"self\": \"%s/v1/results/%s\"}}", base_path(), row->id);
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

static Status compare_reply(App *app, const ResultRow rows[2],
                            Outcome *const outcomes[COMPARE_SIDES], const char *gone, Reply *reply,
                            Problem *problem) {
    static const DiffFormat format = {"a", "b", true};
    size_t inputs = 0;
    Bytes bytes = {.most = app->reply_most};
    bytes_text(&bytes, "{");
    compare_put_side(&bytes, "a", &rows[0]);
    bytes_text(&bytes, ", ");
    compare_put_side(&bytes, "b", &rows[1]);
    bytes_text(&bytes, ", \"inputs\": ");
    // A study asks more of a scene; the scenes' own runs are compared.
    Status status =
        json_diff(rows[0].scene, rows[1].scene, "study", &format, &bytes, &inputs, problem);
    if (status == STATUS_OK) {
        bytes_format(&bytes, ", \"more_inputs\": %zu, \"metrics\": ",
                     inputs > DIFF_MAX ? inputs - DIFF_MAX : 0);
        compare_put_metrics(&bytes, &outcomes[0]->summary, &outcomes[1]->summary);
        compare_put_outcomes(&bytes, outcomes, gone);
        bytes_text(&bytes, "}\n");
        status = reply_bytes(reply, 200, type_json, &bytes, problem);
    }
    bytes_clear(&bytes);
    return status;
}

static Status compare_show(App *app, char results[2][72], Outcome *outcomes[COMPARE_SIDES],
                           const char *gone, Reply *reply, Problem *problem) {
    ResultRow rows[2] = {{.id = ""}, {.id = ""}};
    Status status = STATUS_OK;
    for (int i = 0; i < 2 && status == STATUS_OK; i++) {
        status = db_result_load(app->db, results[i], &rows[i], problem);
        if (status == STATUS_OK && outcomes[i] == NULL)
            status = jobs_outcome_stored(app->manager, results[i], &outcomes[i], problem);
    }
    if (status == STATUS_OK)
        status = compare_reply(app, rows, outcomes, gone, reply, problem);
    for (int i = 0; i < 2; i++)
        result_row_clear(&rows[i]);
    return status;
}

static Status compare_both(App *app, const Request *request, CompareSides *sides, Reply *reply,
                           Problem *problem) {
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
    bool is_waiting;
    Problem *fault = calloc(1, sizeof *fault);
    if (fault == NULL)
        return problem_set(problem, STATUS_NO_MEMORY, "no memory for the comparison");
    Status status = compare_outcomes(app, request, reply, 2, results, sides, &is_waiting, fault);
    if (status == STATUS_GONE) {
        // Another program may have the series: this answer may change.
        reply->is_immutable = false;
        reply->etag[0] = reply->cache_control[0] = '\0';
        status = compare_show(app, results, sides->outcomes, fault->detail, reply, problem);
    } else if (status != STATUS_OK) {
        (void)problem_set(problem, status, "%s", fault->detail);
    } else if (!is_waiting) {
        status = compare_show(app, results, sides->outcomes, NULL, reply, problem);
    }
    free(fault);
    return status;
}

Status compare_results(App *app, const Request *request, Reply *reply, Problem *problem) {
    CompareSides sides = compare_begin(request);
    const Status status = compare_both(app, request, &sides, reply, problem);
    compare_end(&sides);
    return status;
}
