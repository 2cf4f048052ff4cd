// The rows in the order in which a run does these things.
#include "core/result/work_counters.h"

// clang-format off
const Field work_counters_fields[] = {
    FIELD_COUNT(WorkCounters, base_samples, "samples", AT_MIN(0), 0, "of the base's motion, made"),
    FIELD_COUNT(WorkCounters, flight_samples, "samples", AT_MIN(0), 0, "passed in flight over whole intervals, under a moving base"),
    FIELD_COUNT(WorkCounters, unforced_samples, "samples", AT_MIN(0), 0, "the same where the base is still: in closed form"),
    FIELD_COUNT(WorkCounters, mode_samples, NULL, AT_MIN(0), 0, "modes times samples, where a structure is followed by its modes"),
    FIELD_COUNT(WorkCounters, arcs, NULL, AT_MIN(0), 0, "stretches of motion followed by their series"),
    FIELD_COUNT(WorkCounters, steps, "steps", AT_MIN(0), 0, "of a solver that steps, or of contacts under a power law"),
    FIELD_COUNT(WorkCounters, stop_searches, NULL, AT_MIN(0), 0, "stretches of flight searched for a stop"),
    FIELD_COUNT(WorkCounters, contacts, NULL, AT_MIN(0), 0, "contacts that have a length, followed from touch to release"),
    FIELD_COUNT(WorkCounters, bounces, NULL, AT_MIN(0), 0, "impacts without a length"),
    FIELD_COUNT(WorkCounters, rests, NULL, AT_MIN(0), 0, "intervals of a mass at rest at its stop"),
    FIELD_COUNT(WorkCounters, neighbour_samples, "samples", AT_MIN(0), 0, "of the companion run that estimates the error"),
    FIELD_COUNT(WorkCounters, ledger_rows, NULL, AT_MIN(0), 0, "rows kept in the ledger of impacts"),
    FIELD_COUNT(WorkCounters, channel_values, NULL, AT_MIN(0), 0, "values written into channels, those for spectra included"),
    FIELD_COUNT(WorkCounters, spectrum_segments, NULL, AT_MIN(0), 0, "segments transformed for spectra"),
    FIELD_END
};
// clang-format on

void work_counters_add(WorkCounters *work, const WorkCounters *other) {
    for (const Field *field = work_counters_fields; field->kind != FIELD_KIND_END; field++)
        *(uint64_t *)(void *)((char *)work + field->offset) +=
            *(const uint64_t *)(const void *)((const char *)other + field->offset);
}
