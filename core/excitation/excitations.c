// All kinds of excitation, the default first.
#include "core/excitation/excitation.h"

const ExcitationKind *const excitations[] = {
    &excitation_free,  &excitation_random,    &excitation_sine,       &excitation_record,
    &excitation_chirp, &excitation_half_sine, &excitation_triangular, NULL,
};

static const Kind *excitations_at(size_t index) {
    return index < COUNT(excitations) - 1 ? &excitations[index]->kind : NULL;
}

const KindTable excitation_kinds = {"kind", excitations_at, false};
