// A measured base acceleration: samples * scale, linear between samples, still after the last one.
#include <stdlib.h>
#include <string.h>

#include "core/excitation/recorded_motion.h"

#include "core/base/json_pointer.h"

#define G 9.80665 // [m/s^2]

// clang-format off
static const Field record_fields[] = {
    FIELD_BASE(ExcitationRecord, excitation, excitation_fields),
    FIELD_TEXT(ExcitationRecord, name, RECORD_NAME_SIZE - 1, PRESENCE_OPTIONAL, 0, "an uploaded record (GET /v1/records), in place of samples and interval"),
    FIELD_TEXT(ExcitationRecord, digest, RECORD_DIGEST_SIZE - 1, PRESENCE_OPTIONAL, 0, "SHA-256 of that record's interval and samples; where it is given the record must still be that one"),
    FIELD_REALS(ExcitationRecord, samples, "m/s^2", ANY, RECORD_SAMPLES, PRESENCE_OPTIONAL, "base acceleration from the start on; required without a name"),
    FIELD_REAL(ExcitationRecord, interval, "s", ABOVE(0), OPTIONAL, "time between samples; required with them"),
    FIELD_REAL(ExcitationRecord, scale, NULL, ANY, 1, "factor on the samples"),
    FIELD_TEXT(ExcitationRecord, source, 1000, PRESENCE_OPTIONAL, FIELD_NOTE, "where the samples come from; changes nothing"),
    FIELD_REFCOUNT(ExcitationRecord, named),
    FIELD_END
};
// clang-format on

static void named_record_free(Refcount *shared) {
    NamedRecord *named = (NamedRecord *)(void *)shared;
    free(named->samples.at);
    free(named);
}

NamedRecord *named_record_new(const char *name, const char *digest, double interval,
                              Reals *samples) {
    NamedRecord *named = calloc(1, sizeof *named);
    if (named != NULL) {
        atomic_init(&named->shared.count, 1);
        named->shared.free = named_record_free;
        text_fit(named->name, sizeof named->name, name);
        text_fit(named->digest, sizeof named->digest, digest);
        named->interval = interval;
        named->samples = *samples;
        for (size_t i = 0; i < samples->count; i++)
            named->peak = fmax(named->peak, fabs(samples->at[i]));
    } else {
        free(samples->at);
    }
    *samples = (Reals){NULL, 0};
    return named;
}

bool record_resolve(ExcitationRecord *record, NamedRecord *named) {
    char *digest = strdup(named->digest);
    if (digest == NULL)
        return false;
    free(record->digest);
    record->digest = digest;
    refcount_ref(&named->shared);
    refcount_unref(record->named);
    record->named = &named->shared;
    return true;
}

static const ExcitationRecord *record_of(const Excitation *excitation) {
    return (const ExcitationRecord *)(const void *)excitation;
}

// A fault at pointer/name, unless that place has one.
static Status record_refuse(const char *pointer, const char *name, const char *detail,
                            Problem *problem) {
    return json_pointer_concerns(problem, pointer, name)
               ? STATUS_INVALID
               : json_pointer_fault(problem, pointer, name, "%s", detail);
}

// A name replaces samples. A name that was not found may have its fault from the search.
static Status record_check_named(const ExcitationRecord *record, const char *pointer,
                                 Problem *problem) {
    const NamedRecord *named = record_named(record);
    Status status = STATUS_OK;
    if (record->samples.count > 0)
        status = record_refuse(pointer, "samples", "must not be given with the name of a record",
                               problem);
    if (!isnan(record->interval))
        status = record_refuse(pointer, "interval",
                               "must not be given with the name of a record, which has its own",
                               problem);
    if (named == NULL || strcmp(named->name, record->name) != 0) {
        return json_pointer_concerns(problem, pointer, "digest")
                   ? STATUS_INVALID
                   : record_refuse(pointer, "name", "is not known here", problem);
    }
    if (record->digest == NULL || strcmp(named->digest, record->digest) != 0)
        return record_refuse(pointer, "digest", "is not that of the record", problem);
    return status;
}

static Status record_check(const Excitation *excitation, const char *pointer, Problem *problem) {
    const ExcitationRecord *record = record_of(excitation);
    Status status = STATUS_OK;
    if (record->name != NULL)
        return record_check_named(record, pointer, problem);
    if (record->digest != NULL)
        status = record_refuse(pointer, "digest", "is of a record, whose name is missing", problem);
    if (record->samples.count == 0)
        status =
            record_refuse(pointer, "samples",
                          "is required, with at least one: base acceleration from the start on "
                          "[m/s^2]; or the name of an uploaded record",
                          problem);
    if (isnan(record->interval))
        status =
            record_refuse(pointer, "interval", "is required: time between samples [s]", problem);
    return status;
}

static Status record_complete(Excitation *excitation, const Span *span, const char *pointer,
                              Problem *problem) {
    (void)span;
    const ExcitationRecord *record = record_of(excitation);
    const Reals *samples = record_samples(record);
    if (!isfinite(record->scale))
        return STATUS_OK; // the row adds the fault
    // Fast, because every point of a sweep is completed.
    if (record->named != NULL && isfinite(record_named(record)->peak * record->scale))
        return STATUS_OK;
    for (size_t i = 0; i < samples->count; i++) {
        if (isfinite(samples->at[i] * record->scale) || !isfinite(samples->at[i]))
            continue;
        return json_pointer_fault_real(problem, pointer, "scale", record->scale, NULL,
                                       "must leave every sample finite, sample %zu is not", i);
    }
    return STATUS_OK;
}

static Status record_make(const Excitation *excitation, const Span *span, const Progress *progress,
                          Base *base, Problem *problem) {
    (void)span;
    (void)progress;
    const ExcitationRecord *record = record_of(excitation);
    const Reals *samples = record_samples(record);
    double *values = malloc(samples->count * sizeof *values);
    if (values == NULL)
        return problem_set(problem, STATUS_NO_MEMORY, "no memory for a record of %zu samples",
                           samples->count);
    for (size_t i = 0; i < samples->count; i++)
        values[i] = samples->at[i] * record->scale;
    *base = (Base){.form = BASE_SAMPLED,
                   .values = values,
                   .count = samples->count,
                   .interval = record_interval(record)};
    return STATUS_OK;
}

RecordLook record_look(const Reals *samples, double interval, double scale) {
    RecordLook look = {0};
    double velocity = 0, before = 0, peak = -1;
    for (size_t i = 0; i < samples->count; i++) {
        const double value = samples->at[i] * scale;
        if (i > 0)
            velocity += (before + value) / 2 * interval;
        before = value;
        if (fabs(value) > peak) {
            peak = fabs(value);
            look.peak_at = i;
        }
        look.highest = fmax(look.highest, value);
        look.lowest = fmin(look.lowest, value);
        look.peak_velocity = fmax(look.peak_velocity, fabs(velocity));
    }
    look.end_velocity = velocity;
    return look;
}

// Whether the acceleration has both signs and yet leaves the base with a velocity: its baseline is
// not corrected.
static bool record_drifts(const RecordLook *look) {
    const double lesser = fmin(look->highest, -look->lowest);
    return lesser > 0.1 * fmax(look->highest, -look->lowest) &&
           fabs(look->end_velocity) > 0.3 * look->peak_velocity;
}

void record_look_doubt(const RecordLook *look, const char *before, const char *place,
                       Problem *doubts) {
    const double peak = fmax(look->highest, -look->lowest);
    if (peak > 5 * G)
        (void)problem_add(doubts, STATUS_INVALID, place,
                          "%sreach %.3g m/s^2 (sample %zu), more than 5 g: are the samples in "
                          "m/s^2?",
                          before, peak, look->peak_at);
    else if (peak < 1e-4)
        (void)problem_add(doubts, STATUS_INVALID, place,
                          "%sreach only %.3g m/s^2: the unit is m/s^2; a scale of 9.80665 makes "
                          "them of g",
                          before, peak);
    else if (record_drifts(look))
        (void)problem_add(doubts, STATUS_INVALID, place,
                          "%sleave the base with %.3g m/s at their end, its peak velocity is %.3g "
                          "m/s: is their baseline corrected?",
                          before, look->end_velocity, look->peak_velocity);
}

// The doubt about a named record is at its name.
static void record_doubt(const Excitation *excitation, const Span *span, const char *pointer,
                         Problem *doubts) {
    (void)span;
    const ExcitationRecord *record = record_of(excitation);
    const RecordLook look =
        record_look(record_samples(record), record_interval(record), record->scale);
    const JsonPointer place = json_pointer_of(pointer, record->named != NULL ? "name" : "samples");
    record_look_doubt(&look, record->named != NULL ? "represents samples that " : "", place.at,
                      doubts);
}

static double record_interval_of(const Excitation *excitation) {
    return record_interval(record_of(excitation));
}

static double record_lasts(const Excitation *excitation) {
    const ExcitationRecord *record = record_of(excitation);
    return record_interval(record) * (double)record_samples(record)->count;
}

// The rate of a sine whose samples differ as much from each other as these do.
static double record_band(const Excitation *excitation, double band[2]) {
    const ExcitationRecord *record = record_of(excitation);
    const Reals *samples = record_samples(record);
    double peak = 0, squares = 0, changes = 0;
    for (size_t i = 0; i < samples->count; i++)
        peak = fmax(peak, fabs(samples->at[i]));
    for (size_t i = 0; i < samples->count && peak > 0; i++) {
        const double now = samples->at[i] / peak;
        const double change = now - (i > 0 ? samples->at[i - 1] / peak : 0);
        squares += now * now;
        changes += change * change;
    }
    band[0] = 0;
    band[1] = peak > 0 ? sqrt(3 * changes / squares) / record_interval(record) : 0;
    return peak > 0 ? fabs(record->scale) * peak * sqrt(squares / (double)samples->count) : 0;
}

const ExcitationKind excitation_record = {
    .kind = {"record", "a measured base acceleration", record_fields, sizeof(ExcitationRecord)},
    .check = record_check,
    .complete = record_complete,
    .interval = record_interval_of,
    .band = record_band,
    .lasts = record_lasts,
    .effort = 0.05,
    .make = record_make,
    .doubt = record_doubt,
};
