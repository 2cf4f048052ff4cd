// All excitations, the default first, and the rows that each of them begins with.
#include "core/excite/excitation.h"

// clang-format off
const Field excitation_fields[] = {
    FIELD_REAL(Excitation, displacement, "m",   ANY, 0, "of the structure at the start, relative to the base"),
    FIELD_REAL(Excitation, velocity,     "m/s", ANY, 0, "of the structure at the start, relative to the base"),
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

const KindTable excitation_kinds = {"kind", excitation_at};
