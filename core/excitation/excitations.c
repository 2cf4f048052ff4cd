// All excitations, the default first, and what several of them share.
#include "core/excitation/excitation.h"

enum { START_NUMBERS = 200 }; // as many as storeys, at most

// clang-format off
const Field excitation_fields[] = {
    FIELD_LONE_REALS(Excitation, displacement, "m",   ANY, START_NUMBERS, PRESENCE_OPTIONAL, "of the structure at the start, relative to the base; of several storeys a list of each; 0 if not given"),
    FIELD_LONE_REALS(Excitation, velocity,     "m/s", ANY, START_NUMBERS, PRESENCE_OPTIONAL, "of the structure at the start, relative to the base; of several storeys a list of each; 0 if not given"),
    FIELD_END
};
// clang-format on

const ExcitationKind *const excitations[] = {
    &excitation_free,  &excitation_random,    &excitation_sine,       &excitation_record,
    &excitation_chirp, &excitation_half_sine, &excitation_triangular, NULL,
};

static const Kind *excitation_at(size_t index) {
    return index < COUNT(excitations) - 1 ? &excitations[index]->kind : NULL;
}

const KindTable excitation_kinds = {"kind", excitation_at, false};

void excitation_doubt_frequency(double frequency, const Span *span, const char *pointer,
                                const char *name, Problem *doubts) {
    if (!(frequency > span->sample_rate / 2))
        return;
    char place[sizeof((Fault){0}.pointer)], is[32], limit[32];
    pointer_join(place, sizeof place, pointer, name);
    (void)problem_add(
        doubts, STATUS_INVALID, place,
        "is %s Hz, above half the sample rate, %s Hz: the output's samples do not show "
        "the motion",
        text_real(is, frequency), text_real(limit, span->sample_rate / 2));
}
