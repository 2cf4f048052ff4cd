#include "server/api/compare_parts.h"

#include <math.h>
#include <stdarg.h>
#include <stdio.h>
#include <string.h>

#include "server/json/encode.h"

enum { CHANNELS = 64, SAMPLES = 1 << 26 }; // compared, of each kind and in all

static double number_of(const Field *field, const Summary *summary) {
    const void *member = (const char *)summary + field->offset;
    if (field->kind == FIELD_KIND_REAL)
        return *(const double *)member;
    const uint64_t count = *(const uint64_t *)member;
    return count == COUNT_ABSENT ? (double)NAN : (double)count;
}

void compare_put_metrics(Bytes *bytes, const Summary *a, const Summary *b) {
    bytes_text(bytes, "[");
    for (const Field *field = summary_fields; field->kind != FIELD_KIND_END; field++) {
        const double x = number_of(field, a), y = number_of(field, b);
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

static void put_named(Bytes *bytes, const char *name, const char *unit, const Field *fields,
                      const void *item) {
    bytes_text(bytes, "{\"channel\": ");
    bytes_json_string(bytes, name);
    bytes_text(bytes, ", \"unit\": ");
    bytes_json_string(bytes, unit);
    bytes_text(bytes, ", ");
    encode_members(bytes, fields, item, WRITE_REPORT);
    bytes_text(bytes, "}");
}

static Signal signal_of(const Response *response, const Column *column) {
    return (Signal){column->values, response->count, response->sample_rate, 0};
}

// When the motions part by the first displacement of both; null without one.
static void put_divergence(Bytes *bytes, const char *channel, double parting,
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

size_t compare_put_motions(Bytes *bytes, const Response *a, const Response *b,
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
        const Signal x = signal_of(a, from), y = signal_of(b, to);
        const SignalComparison likeness = signal_comparison_measure(&x, &y, COMPARE_PART, NULL);
        size_t number;
        if (channel == NULL && channel_find(from->name, &number) == &channels[0]) {
            channel = from->name;
            parting = likeness.parting;
        }
        bytes_text(bytes, separator);
        put_named(bytes, from->name, from->unit, signal_comparison_fields, &likeness);
        separator = ", ";
        compared++;
        samples += (double)likeness.samples;
    }
    bytes_text(bytes, "]");
    put_divergence(bytes, channel, parting, horizons);
    return left;
}

size_t compare_put_spectra(Bytes *bytes, const Spectrum *a, const Spectrum *b) {
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
        put_named(bytes, from->name, from->unit, spectrum_distance_fields, &distance);
        separator = ", ";
    }
    bytes_text(bytes, "]");
    return left;
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

void compare_warn_left(Bytes *bytes, size_t motions, size_t spectra) {
    if (motions > 0)
        compare_put_warning(bytes,
                            "%zu more channels of both are not compared: at most %d are, and no "
                            "more once they have %d samples in all",
                            motions, CHANNELS, SAMPLES);
    if (spectra > 0)
        compare_put_warning(bytes, "%zu more spectra of both are not compared: at most %d are",
                            spectra, CHANNELS);
}

void compare_warn(Bytes *bytes, const Response *a, const Response *b, const Spectrum *spectrum_a,
                  const Spectrum *spectrum_b) {
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
