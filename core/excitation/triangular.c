// A triangular pulse of the base: a_g rises evenly to the amplitude at the middle and falls back.
#include "core/excitation/pulse_common.h"

static Status triangular_make(const Excitation *excitation, const Span *span,
                              const Progress *progress, Base *base, Problem *problem) {
    (void)span;
    (void)progress;
    (void)problem;
    const ExcitationPulse *pulse = pulse_of(excitation);
    const double slope = 2 * pulse->amplitude / pulse->length;
    *base = (Base){.form = BASE_PIECES,
                   .pieces = {{.time = pulse->start, .slope = slope},
                              {.time = pulse->start + pulse->length / 2,
                               .value = pulse->amplitude,
                               .slope = -slope},
                              {.time = pulse->start + pulse->length}},
                   .piece_count = 3};
    return STATUS_OK;
}

const ExcitationKind excitation_triangular = {
    .kind = {"triangular", "a triangular pulse of the base's acceleration, once", pulse_fields,
             sizeof(ExcitationPulse)},
    .complete = pulse_complete,
    .make = triangular_make,
    .doubt = pulse_doubt,
};
