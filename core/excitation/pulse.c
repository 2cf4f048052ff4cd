// Single pulses of the base's acceleration: half a sine, a_g = amplitude sin(pi (t - start) /
// length), and a triangle that reaches the amplitude at the middle.
#include "core/excitation/excitation.h"

#include "core/base/json_pointer.h"

// clang-format off
static const Field pulse_fields[] = {
    FIELD_BASE(ExcitationPulse, excitation, excitation_fields),
    FIELD_REAL(ExcitationPulse, amplitude, "m/s^2", ANY,         REQUIRED, "base acceleration at the middle of the pulse"),
    FIELD_REAL(ExcitationPulse, start,     "s",     AT_MIN(0), 0,        "when the pulse begins; the base is still before"),
    FIELD_REAL(ExcitationPulse, length,    "s",     ABOVE(0),    REQUIRED, "how long the pulse lasts; the base moves on evenly after"),
    FIELD_END
};
// clang-format on

static const ExcitationPulse *pulse_of(const Excitation *excitation) {
    return (const ExcitationPulse *)(const void *)excitation;
}

// A pulse shorter than the resolution of time at its end would be lost silently.
static Status pulse_complete(Excitation *excitation, const Span *span, const char *pointer,
                             Problem *problem) {
    (void)span;
    const ExcitationPulse *pulse = pulse_of(excitation);
    if (!isfinite(pulse->amplitude) || !isfinite(pulse->start) || !isfinite(pulse->length) ||
        !(pulse->start >= 0) || !(pulse->length > 0))
        return STATUS_OK; // the row adds the fault
    const double least = fmax(1e-12 * pulse->start, 1e-12);
    if (pulse->length < least)
        return json_pointer_fault_real(
            problem, pointer, "length", pulse->length, "s",
            "must be at least %s s, the resolution of time at that start, is %s",
            real_text(least).at, real_text(pulse->length).at);
    if (isfinite(pulse->start + pulse->length) && isfinite(2 * pulse->amplitude / pulse->length))
        return STATUS_OK;
    return json_pointer_fault_real(problem, pointer, "length", pulse->length, "s",
                                   "must leave the pulse's end and slope finite, is %s",
                                   real_text(pulse->length).at);
}

static void pulse_doubt(const Excitation *excitation, const Span *span, const char *pointer,
                        Problem *doubts) {
    const ExcitationPulse *pulse = pulse_of(excitation);
    if (pulse->start >= span->duration)
        (void)json_pointer_fault(doubts, pointer, "start",
                                 "is %s s: the run ends at %s s, before the pulse begins",
                                 real_text(pulse->start).at, real_text(span->duration).at);
    if (pulse->length * span->sample_rate < 2)
        (void)json_pointer_fault(
            doubts, pointer, "length",
            "is %s s, less than two samples of the output, %.3g s: the motion is "
            "exact, but its samples hardly show the pulse",
            real_text(pulse->length).at, 2 / span->sample_rate);
}

static Base half_sine_form(const Excitation *excitation) {
    const ExcitationPulse *pulse = pulse_of(excitation);
    return (Base){.form = BASE_PIECES,
                  .omega = 3.14159265358979323846 / pulse->length,
                  .pieces = {{.time = pulse->start, .slope = pulse->amplitude},
                             {.time = pulse->start + pulse->length}},
                  .piece_count = 2};
}

static double pulse_band(const Excitation *excitation, double band[2]) {
    band[0] = band[1] = 3.14159265358979323846 / pulse_of(excitation)->length;
    return fabs(pulse_of(excitation)->amplitude);
}

const ExcitationKind excitation_half_sine = {
    .kind = {"half_sine", "half a sine of the base's acceleration, once", pulse_fields,
             sizeof(ExcitationPulse)},
    .complete = pulse_complete,
    .band = pulse_band,
    .form = half_sine_form,
    .doubt = pulse_doubt,
};

static Base triangular_form(const Excitation *excitation) {
    const ExcitationPulse *pulse = pulse_of(excitation);
    const double slope = 2 * pulse->amplitude / pulse->length;
    return (Base){.form = BASE_PIECES,
                  .pieces = {{.time = pulse->start, .slope = slope},
                             {.time = pulse->start + pulse->length / 2,
                              .value = pulse->amplitude,
                              .slope = -slope},
                             {.time = pulse->start + pulse->length}},
                  .piece_count = 3};
}

const ExcitationKind excitation_triangular = {
    .kind = {"triangular", "a triangular pulse of the base's acceleration, once", pulse_fields,
             sizeof(ExcitationPulse)},
    .complete = pulse_complete,
    .band = pulse_band,
    .form = triangular_form,
    .doubt = pulse_doubt,
};
