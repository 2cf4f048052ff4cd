#include "core/solve/solver.h"

// clang-format off
const Field accuracy_fields[] = {
    FIELD_COUNT(Accuracy, modes, NULL, AT_MIN(1), OPTIONAL, "natural modes of a structure with several storeys that move, the slowest; all if absent"),
    FIELD_END
};
// clang-format on
