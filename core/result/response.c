// The rows of the ledgers, in the order in which people read them.
#include "core/result/response.h"

#include <stdlib.h>
#include <string.h>

const char *const side_names[] = {[SIDE_LEFT] = "left", [SIDE_RIGHT] = "right", NULL};
const char *const impact_kind_names[] = {
    [IMPACT_IMPACT] = "impact", [IMPACT_RESTING] = "resting", NULL};

const char *const metric_names[] = {
    "displacement",     "mean_acceleration", "peak_force",      "impacts", "psd",
    "rms_displacement", "peak_storey_drift", "peak_base_shear", NULL,
};
const char *const metric_units[] = {"", "", "", "", " dB", "", "", "", NULL};

// clang-format off
const Field impact_fields[] = {
    FIELD_CHOICE(Impact, kind, impact_kind_names, IMPACT_IMPACT, "an impact, or an interval of persistent contact"),
    FIELD_REAL(Impact, start, "s", ANY, OPTIONAL, "when the contact begins"),
    FIELD_REAL(Impact, end, "s", ANY, OPTIONAL, "when it ends; unknown where it is open at the end of the run"),
    FIELD_COUNT(Impact, damper, NULL, AT_MIN(1), OPTIONAL, "number of the damper"),
    FIELD_CHOICE(Impact, side, side_names, OPTIONAL, "the stop that was met"),
    FIELD_REAL(Impact, approach_speed, "m/s", ANY, OPTIONAL, "relative speed at the start"),
    FIELD_REAL(Impact, separation_speed, "m/s", ANY, OPTIONAL, "relative speed at the end"),
    FIELD_REAL(Impact, restitution, NULL, ANY, OPTIONAL, "separation speed over approach speed"),
    FIELD_REAL(Impact, duration, "s", ANY, OPTIONAL, "from start to end"),
    FIELD_REAL(Impact, peak_force, "N", ANY, OPTIONAL, "largest |N| of the contact"),
    FIELD_REAL(Impact, impulse, "N s", ANY, OPTIONAL, "|integral of N|"),
    FIELD_REAL(Impact, energy_lost, "J", ANY, OPTIONAL, "work of the contact's dissipative part"),
    FIELD_END
};

const Field energy_fields[] = {
    FIELD_REAL(Energy, initial, "J", ANY, OPTIONAL, "kinetic and of the springs at the start"),
    FIELD_REAL(Energy, input, "J", ANY, OPTIONAL, "work of the base's motion"),
    FIELD_REAL(Energy, structural_damping, "J", ANY, OPTIONAL, "lost in the structure's damping"),
    FIELD_REAL(Energy, contact, "J", ANY, OPTIONAL, "lost in contacts"),
    FIELD_REAL(Energy, kinetic, "J", ANY, OPTIONAL, "of the structure and the free masses at the end"),
    FIELD_REAL(Energy, strain, "J", ANY, OPTIONAL, "of the structure's and the contact springs at the end"),
    FIELD_REAL(Energy, residual, NULL, ANY, OPTIONAL, "largest |balance| over the largest energy"),
    FIELD_END
};

// In the order in which a run does these things.
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

void response_clear(Response *response) {
    if (response == NULL)
        return;
    columns_clear(&response->series);
    free(response->impacts.at);
    free(response->approaches);
    memset(response, 0, sizeof *response);
}

void work_counters_add(WorkCounters *work, const WorkCounters *other) {
    for (const Field *field = work_counters_fields; field->kind != FIELD_KIND_END; field++)
        *(uint64_t *)(void *)((char *)work + field->offset) +=
            *(const uint64_t *)(const void *)((const char *)other + field->offset);
}
