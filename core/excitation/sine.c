// A sine of the base, amplitude * sin(2 pi f t), given as its acceleration or as its displacement;
// of the latter the acceleration is a_g = -amplitude (2 pi f)^2 sin(2 pi f t).
#include <string.h>

#include "core/excitation/sine.h"

static const char *const statistic_names[] = {
    [SINE_ACCELERATION] = "acceleration", [SINE_DISPLACEMENT] = "displacement", NULL};

// clang-format off
static const Field sine_fields[] = {
    FIELD_BASE(ExcitationSine, excitation, excitation_fields),
    FIELD_REAL(ExcitationSine, frequency, "Hz", ABOVE(0), REQUIRED, "frequency of the base's motion"),
    FIELD_REAL(ExcitationSine, amplitude, "m/s^2 or m", ANY, REQUIRED, "amplitude of the quantity"),
    FIELD_CHOICE(ExcitationSine, quantity, statistic_names, SINE_ACCELERATION, "of the base, what the amplitude is of"),
    FIELD_END
};
// clang-format on

static double omega_of(const ExcitationSine *sine) {
    return 2 * 3.14159265358979323846 * sine->frequency;
}

static double amplitude_of(const ExcitationSine *sine) {
    const double omega = omega_of(sine);
    return sine->quantity == SINE_DISPLACEMENT ? -sine->amplitude * omega * omega : sine->amplitude;
}

static Status sine_complete(Excitation *excitation, const Span *span, const char *pointer,
                            Problem *problem) {
    (void)span;
    ExcitationSine *sine = (ExcitationSine *)(void *)excitation;
    if (sine->quantity == CHOICE_ABSENT)
        sine->quantity = SINE_ACCELERATION;
    if (!isfinite(sine->frequency) || !isfinite(sine->amplitude))
        return STATUS_OK; // told by the rows
    char place[sizeof((Fault){0}.pointer)];
    if (!isfinite(omega_of(sine))) {
        pointer_join(place, sizeof place, pointer, "frequency");
        return problem_add_real(problem, STATUS_INVALID, place, sine->frequency, "Hz",
                                "is too high to compute with");
    }
    if (!isfinite(amplitude_of(sine))) {
        pointer_join(place, sizeof place, pointer, "amplitude");
        return problem_add_real(problem, STATUS_INVALID, place, sine->amplitude, "m",
                                "must give a finite acceleration, amplitude * (2 pi frequency)^2");
    }
    return STATUS_OK;
}

static Status sine_make(const Excitation *excitation, const Span *span, const Progress *progress,
                        Base *base, Problem *problem) {
    (void)span;
    (void)progress;
    (void)problem;
    const ExcitationSine *sine = (const ExcitationSine *)(const void *)excitation;
    memset(base, 0, sizeof *base);
    base->form = BASE_SINE;
    base->amplitude = amplitude_of(sine);
    base->omega = omega_of(sine);
    return STATUS_OK;
}

static double sine_fastest(const Excitation *excitation) {
    return omega_of((const ExcitationSine *)(const void *)excitation);
}

static void sine_doubt(const Excitation *excitation, const Span *span, const char *pointer,
                       Problem *doubts) {
    excitation_doubt_frequency(((const ExcitationSine *)(const void *)excitation)->frequency, span,
                               pointer, "frequency", doubts);
}

const ExcitationKind excitation_sine = {
    .kind = {"sine", "a sine of the base's acceleration or displacement", sine_fields,
             sizeof(ExcitationSine)},
    .complete = sine_complete,
    .fastest = sine_fastest,
    .make = sine_make,
    .doubt = sine_doubt,
};
