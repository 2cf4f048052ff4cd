// A half-sine pulse of the base: a_g = amplitude * sin(pi (t - start) / length) while it lasts.
#include "core/excitation/pulse_common.h"

static Status half_sine_make(const Excitation *excitation, const Span *span,
                             const Progress *progress, Base *base, Problem *problem) {
    (void)span;
    (void)progress;
    (void)problem;
    const ExcitationPulse *pulse = pulse_of(excitation);
    *base = (Base){.form = BASE_PIECES,
                   .omega = 3.14159265358979323846 / pulse->length,
                   .pieces = {{.time = pulse->start, .slope = pulse->amplitude},
                              {.time = pulse->start + pulse->length}},
                   .piece_count = 2};
    return STATUS_OK;
}

const ExcitationKind excitation_half_sine = {
    .kind = {"half_sine", "half a sine of the base's acceleration, once", pulse_fields,
             sizeof(ExcitationPulse)},
    .complete = pulse_complete,
    .make = half_sine_make,
    .doubt = pulse_doubt,
};
