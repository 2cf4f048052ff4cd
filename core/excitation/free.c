// Free vibration from the initial state: the base is still.
#include <string.h>

#include "core/excitation/excitation.h"

static Status free_make(const Excitation *excitation, const Span *span, const Progress *progress,
                        Base *base, Problem *problem) {
    (void)excitation;
    (void)span;
    (void)progress;
    (void)problem;
    memset(base, 0, sizeof *base);
    return STATUS_OK;
}

const ExcitationKind excitation_free = {
    .kind = {"free", "free vibration from the initial state", excitation_fields,
             sizeof(Excitation)},
    .make = free_make,
};
