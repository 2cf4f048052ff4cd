// All kinds of structure, the default first.
#include "core/scene/structure.h"

const StructureKind *const structures[] = {&structure_sdof, &structure_shear_frame,
                                           &structure_matrix, NULL};

static const Kind *structure_at(size_t index) {
    return index < COUNT(structures) - 1 ? &structures[index]->kind : NULL;
}

const KindTable structure_kinds = {"kind", structure_at, false};
