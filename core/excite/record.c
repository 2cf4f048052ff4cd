// A measured base acceleration: samples * scale, linear between samples, still after the last one.
#include <stdlib.h>
#include <string.h>

#include "core/excite/record.h"

#define G 9.80665 // [m/s^2]

// clang-format off
static const Field record_fields[] = {
    FIELD_BASE(ExcitationRecord, excitation, excitation_fields),
    FIELD_REALS(ExcitationRecord, samples, "m/s^2", ANY, RECORD_SAMPLES, PRESENCE_REQUIRED, "base acceleration from the start on"),
    FIELD_REAL(ExcitationRecord, interval, "s", ABOVE(0), REQUIRED, "time between samples"),
    FIELD_REAL(ExcitationRecord, scale, NULL, ANY, 1, "factor on the samples"),
    FIELD_TEXT(ExcitationRecord, source, 1000, PRESENCE_OPTIONAL, FIELD_NOTE, "where the samples come from; changes nothing"),
    FIELD_END
};
// clang-format on

static Status record_complete(Excitation *excitation, const Span *span, const char *pointer,
                              Problem *problem) {
    (void)span;
    const ExcitationRecord *record = (const ExcitationRecord *)(const void *)excitation;
    if (!isfinite(record->scale))
        return STATUS_OK; // told by the rows
    for (size_t i = 0; i < record->samples.count; i++) {
        if (isfinite(record->samples.at[i] * record->scale) || !isfinite(record->samples.at[i]))
            continue;
        char place[sizeof((Fault){0}.pointer)];
        pointer_join(place, sizeof place, pointer, "scale");
        return problem_add_real(problem, STATUS_INVALID, place, record->scale, NULL,
                                "must leave every sample finite, sample %zu is not", i);
    }
    return STATUS_OK;
}

static Status record_make(const Excitation *excitation, const Span *span, const Watch *watch,
                          Base *base, Problem *problem) {
    (void)span;
    (void)watch;
    const ExcitationRecord *record = (const ExcitationRecord *)(const void *)excitation;
    memset(base, 0, sizeof *base);
    double *values = malloc(record->samples.count * sizeof *values);
    if (values == NULL)
        return problem_set(problem, STATUS_NO_MEMORY, "no memory for a record of %zu samples",
                           record->samples.count);
    for (size_t i = 0; i < record->samples.count; i++)
        values[i] = record->samples.at[i] * record->scale;
    base->form = BASE_SAMPLED;
    base->values = values;
    base->count = record->samples.count;
    base->interval = record->interval;
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

bool record_drifts(const RecordLook *look) {
    const double lesser = fmin(look->highest, -look->lowest);
    return lesser > 0.1 * fmax(look->highest, -look->lowest) &&
           fabs(look->end_velocity) > 0.3 * look->peak_velocity;
}

static void record_doubt(const Excitation *excitation, const Span *span, const char *pointer,
                         Problem *doubts) {
    (void)span;
    const ExcitationRecord *record = (const ExcitationRecord *)(const void *)excitation;
    const RecordLook look = record_look(&record->samples, record->interval, record->scale);
    const double peak = fmax(look.highest, -look.lowest);
    char place[sizeof((Fault){0}.pointer)];
    pointer_join(place, sizeof place, pointer, "samples");
    if (peak > 5 * G)
        (void)problem_add(doubts, STATUS_INVALID, place,
                          "reach %.3g m/s^2 (sample %zu), more than 5 g: are the samples in m/s^2?",
                          peak, look.peak_at);
    else if (peak < 1e-4)
        (void)problem_add(
            doubts, STATUS_INVALID, place,
            "reach only %.3g m/s^2: m/s^2 are meant; a scale of 9.80665 makes them of "
            "g",
            peak);
    else if (record_drifts(&look))
        (void)problem_add(doubts, STATUS_INVALID, place,
                          "leave the base with %.3g m/s at their end, its peak velocity is %.3g "
                          "m/s: is their baseline corrected?",
                          look.end_velocity, look.peak_velocity);
}

static double record_interval(const Excitation *excitation) {
    return ((const ExcitationRecord *)(const void *)excitation)->interval;
}

static double record_lasts(const Excitation *excitation) {
    const ExcitationRecord *record = (const ExcitationRecord *)(const void *)excitation;
    return record->interval * (double)record->samples.count;
}

const ExcitationKind excitation_record = {
    .kind = {"record", "a measured base acceleration", record_fields, sizeof(ExcitationRecord)},
    .complete = record_complete,
    .interval = record_interval,
    .lasts = record_lasts,
    .effort = 0.05,
    .make = record_make,
    .doubt = record_doubt,
};
