// All excitations, the default first, and the rows that each of them begins with.
#include "core/excite/excitation.h"

enum { START_NUMBERS = 200 }; // as many as storeys, at most

// clang-format off
const Field excitation_fields[] = {
    FIELD_LONE_REALS(Excitation, displacement, "m",   ANY, START_NUMBERS, PRESENCE_OPTIONAL, "of the structure at the start, relative to the base; of several storeys a list of each; 0 if not given"),
    FIELD_LONE_REALS(Excitation, velocity,     "m/s", ANY, START_NUMBERS, PRESENCE_OPTIONAL, "of the structure at the start, relative to the base; of several storeys a list of each; 0 if not given"),
    FIELD_END
};
// clang-format on

const ExcitationKind *const excitations[] = {&excitation_free, &excitation_random, &excitation_sine,
                                             &excitation_record, NULL};

static const Kind *excitation_at(size_t index) {
    return index < COUNT(excitations) - 1 ? &excitations[index]->kind : NULL;
}

const KindTable excitation_kinds = {"kind", excitation_at};
