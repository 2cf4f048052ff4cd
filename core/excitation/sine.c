// A sine of the base, amplitude * sin(2 pi f t), of its acceleration or of its displacement. For
// the latter a_g = -amplitude (2 pi f)^2 sin(2 pi f t).
#include "core/excitation/excitation.h"

#include "core/base/json_pointer.h"

static const char *const quantity_names[] = {
    [SINE_ACCELERATION] = "acceleration", [SINE_DISPLACEMENT] = "displacement", NULL};

// clang-format off
static const Field sine_fields[] = {
    FIELD_BASE(ExcitationSine, excitation, excitation_fields),
    FIELD_REAL(ExcitationSine, frequency, "Hz", ABOVE(0), REQUIRED, "frequency of the base's motion"),
    FIELD_REAL(ExcitationSine, amplitude, "m/s^2 or m", ANY, REQUIRED, "amplitude of the quantity"),
    FIELD_CHOICE(ExcitationSine, quantity, quantity_names, SINE_ACCELERATION, "of the base, what the amplitude is of"),
    FIELD_END
};
// clang-format on

static const ExcitationSine *sine_of(const Excitation *excitation) {
    return (const ExcitationSine *)(const void *)excitation;
}

static double sine_omega(const ExcitationSine *sine) {
    return 2 * 3.14159265358979323846 * sine->frequency;
}

static double sine_amplitude(const ExcitationSine *sine) {
    const double omega = sine_omega(sine);
    return sine->quantity == SINE_DISPLACEMENT ? -sine->amplitude * omega * omega : sine->amplitude;
}

static Status sine_complete(Excitation *excitation, const Span *span, const char *pointer,
                            Problem *problem) {
    (void)span;
    ExcitationSine *sine = (ExcitationSine *)(void *)excitation;
    if (sine->quantity == CHOICE_ABSENT)
        sine->quantity = SINE_ACCELERATION;
    if (!isfinite(sine->frequency) || !isfinite(sine->amplitude))
        return STATUS_OK; // the row adds the fault
    if (!isfinite(sine_omega(sine))) {
        return json_pointer_fault_real(problem, pointer, "frequency", sine->frequency, "Hz",
                                       "is too high to compute with");
    }
    if (!isfinite(sine_amplitude(sine))) {
        return json_pointer_fault_real(
            problem, pointer, "amplitude", sine->amplitude, "m",
            "must give a finite acceleration, amplitude * (2 pi frequency)^2");
    }
    return STATUS_OK;
}

static Base sine_form(const Excitation *excitation) {
    const ExcitationSine *sine = sine_of(excitation);
    return (Base){.form = BASE_SINE, .amplitude = sine_amplitude(sine), .omega = sine_omega(sine)};
}

static double sine_band(const Excitation *excitation, double band[2]) {
    band[0] = band[1] = sine_omega(sine_of(excitation));
    return fabs(sine_amplitude(sine_of(excitation)));
}

static void sine_doubt(const Excitation *excitation, const Span *span, const char *pointer,
                       Problem *doubts) {
    excitation_doubt_frequency(sine_of(excitation)->frequency, span, pointer, "frequency", doubts);
}

const ExcitationKind excitation_sine = {
    .kind = {"sine", "a sine of the base's acceleration or displacement", sine_fields,
             sizeof(ExcitationSine)},
    .complete = sine_complete,
    .band = sine_band,
    .form = sine_form,
    .doubt = sine_doubt,
};
