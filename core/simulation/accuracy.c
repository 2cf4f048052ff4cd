// All kinds of accuracy, the default first. Neither has settings of its own.
#include "core/simulation/accuracy.h"

#include "core/simulation/simulation.h"

static const Field accuracy_fields[] = {FIELD_END};

const Kind accuracy_auto = {"auto", "the cheapest solver that is right to rounding",
                            accuracy_fields, sizeof(Accuracy)};
const Kind accuracy_exact = {"exact", "each contact state propagated exactly, events located",
                             accuracy_fields, sizeof(Accuracy)};

static const Kind *accuracy_at(size_t index) {
    static const Kind *const all[] = {&accuracy_auto, &accuracy_exact};
    return index < COUNT(all) ? all[index] : NULL;
}

const KindTable accuracy_kinds = {"solver", accuracy_at};
