// Functions shared by all kinds, and the kind without motion of the base: free vibration from the
// initial state.
#include "core/excitation/excitation.h"

#include "core/base/json_pointer.h"

enum { STOREYS_MAX = 200 };

// clang-format off
const Field excitation_fields[] = {
    FIELD_LONE_REALS(Excitation, displacement, "m",   ANY, STOREYS_MAX, PRESENCE_OPTIONAL, "of the structure at the start, relative to the base; of several storeys a list of each; 0 if not given"),
    FIELD_LONE_REALS(Excitation, velocity,     "m/s", ANY, STOREYS_MAX, PRESENCE_OPTIONAL, "of the structure at the start, relative to the base; of several storeys a list of each; 0 if not given"),
    FIELD_END
};
// clang-format on

void excitation_doubt_frequency(double frequency, const Span *span, const char *pointer,
                                const char *name, Problem *doubts) {
    if (!(frequency > span->sample_rate / 2))
        return;
    (void)json_pointer_fault(
        doubts, pointer, name,
        "is %s Hz, above half the sample rate, %s Hz: the output's samples do not show "
        "the motion",
        real_text(frequency).at, real_text(span->sample_rate / 2).at);
}

Status excitation_make(const Excitation *excitation, const Span *span, const Progress *progress,
                       Base *base, Problem *problem) {
    const ExcitationKind *kind = excitation_kind(excitation);
    *base = (Base){0};
    if (kind->make != NULL)
        return kind->make(excitation, span, progress, base, problem);
    if (kind->form != NULL)
        *base = kind->form(excitation);
    return STATUS_OK;
}

const ExcitationKind excitation_free = {
    .kind = {"free", "free vibration from the initial state", excitation_fields,
             sizeof(Excitation)},
};
