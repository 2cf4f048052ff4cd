// A measured base acceleration: samples * scale, linear between samples, still after the last one.
#include <stdlib.h>
#include <string.h>

#include "core/excite/record.h"

enum { RECORD_SAMPLES = 1 << 22 };

// clang-format off
static const Field record_fields[] = {
    FIELD_BASE(ExcitationRecord, excitation, excitation_fields),
    FIELD_REALS(ExcitationRecord, samples, "m/s^2", ANY, RECORD_SAMPLES, PRESENCE_REQUIRED, "base acceleration from the start on"),
    FIELD_REAL(ExcitationRecord, interval, "s", ABOVE(0), REQUIRED, "time between samples"),
    FIELD_REAL(ExcitationRecord, scale, NULL, ANY, 1, "factor on the samples"),
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

const ExcitationKind excitation_record = {
    .kind = {"record", "a measured base acceleration", record_fields, sizeof(ExcitationRecord)},
    .complete = record_complete,
    .make = record_make,
};
