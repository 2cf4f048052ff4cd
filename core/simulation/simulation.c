// The version of the engine, and the result of a run: its fields and its reference count.
#include "core/simulation/simulation.h"

#include <stdatomic.h>
#include <stdlib.h>

const char engine_version[] = "impactd-5";

// clang-format off
const Field summary_fields[] = {
    FIELD_REAL(Summary, peak_displacement, "m", ANY, OPTIONAL, "largest |displacement| over samples and events, of all storeys"),
    FIELD_REAL(Summary, rms_displacement, "m", ANY, OPTIONAL, "root mean square over samples, the largest of all storeys"),
    FIELD_REAL(Summary, peak_acceleration, "m/s^2", ANY, OPTIONAL, "largest |acceleration| over samples and events, of all storeys"),
    FIELD_REAL(Summary, rms_acceleration, "m/s^2", ANY, OPTIONAL, "root mean square over samples, the largest of all storeys"),
    FIELD_COUNT(Summary, impacts, NULL, AT_MIN(0), OPTIONAL, "number of impacts"),
    FIELD_REAL(Summary, peak_contact_force, "N", ANY, OPTIONAL, "largest |contact force| over events, of all dampers"),
    FIELD_REAL(Summary, energy_residual, NULL, ANY, OPTIONAL, "largest |balance| over the largest energy"),
    FIELD_REAL(Summary, error_estimate, NULL, ANY, OPTIONAL, "estimated largest error of displacement over its largest value, at most 1; unknown if the solver makes no estimate"),
    FIELD_REAL(Summary, trust_horizon, "s", ANY, OPTIONAL, "end of the predictable trajectory: here rounding, or the error of the solver's steps, reaches 1e-6 of the largest displacement, and beyond it only statistics are valid; null with an error_estimate: not within the run"),
    FIELD_END
};

const Field reduction_fields[] = {
    FIELD_REAL(Reduction, peak_displacement_reduction, NULL, ANY, OPTIONAL, "1 - peak_displacement over that without dampers"),
    FIELD_REAL(Reduction, rms_displacement_reduction, NULL, ANY, OPTIONAL, "1 - rms_displacement over that without dampers"),
    FIELD_REAL(Reduction, peak_acceleration_reduction, NULL, ANY, OPTIONAL, "1 - peak_acceleration over that without dampers"),
    FIELD_REAL(Reduction, rms_acceleration_reduction, NULL, ANY, OPTIONAL, "1 - rms_acceleration over that without dampers"),
    FIELD_END
};
// clang-format on

typedef struct OutcomeRef {
    Outcome outcome; // first, so that both have the same address
    atomic_size_t count;
} OutcomeRef;

Outcome *outcome_new(void) {
    OutcomeRef *ref = calloc(1, sizeof *ref);
    if (ref == NULL)
        return NULL;
    atomic_init(&ref->count, 1);
    return &ref->outcome;
}

Outcome *outcome_ref(Outcome *outcome) {
    atomic_fetch_add(&((OutcomeRef *)outcome)->count, 1);
    return outcome;
}

void outcome_unref(Outcome *outcome) {
    if (outcome == NULL || atomic_fetch_sub(&((OutcomeRef *)outcome)->count, 1) != 1)
        return;
    fields_clear(plan_report_fields, &outcome->plan);
    response_clear(&outcome->response);
    spectrum_clear(&outcome->spectrum);
    warnings_clear(&outcome->warnings);
    free(outcome);
}

size_t outcome_bytes(const Outcome *outcome) {
    const Columns *series = &outcome->response.series, *densities = &outcome->spectrum.densities;
    return sizeof(OutcomeRef) +
           sizeof(double) *
               (series->count * series->rows + (densities->count + 1) * densities->rows) +
           outcome->response.impacts.count * sizeof(Impact);
}
