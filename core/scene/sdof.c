// One mass: M x'' + C x' + K x = -M a_g + N.
#include "core/scene/structure.h"

// clang-format off
static const Field sdof_fields[] = {
    FIELD_REAL(SdofStructure, mass, "kg", ABOVE(0), REQUIRED, "mass M"),
    FIELD_REAL(SdofStructure, stiffness, "N/m", AT_MIN(0), REQUIRED, "stiffness K"),
    FIELD_REAL(SdofStructure, damping, "N s/m", AT_MIN(0), OPTIONAL, "damping C; 0 if no damping is given"),
    FIELD_BASE(SdofStructure, structure, structure_fields),
    FIELD_END
};
// clang-format on

static const SdofStructure *sdof_of(const Structure *structure) {
    return (const SdofStructure *)(const void *)structure;
}

static size_t sdof_storeys(const Structure *structure) {
    (void)structure;
    return 1;
}

static bool sdof_has_damping(const Structure *structure) {
    return !isnan(sdof_of(structure)->damping);
}

static Status sdof_complete(Structure *structure, const char *pointer, Problem *problem) {
    (void)pointer;
    (void)problem;
    SdofStructure *sdof = (SdofStructure *)(void *)structure;
    if (isnan(structure->damping_ratio) && isnan(sdof->damping))
        sdof->damping = 0;
    return STATUS_OK;
}

static void sdof_fill(const Structure *structure, const StructureMatrices *matrices) {
    const SdofStructure *sdof = sdof_of(structure);
    matrices->mass[0] = sdof->mass;
    matrices->stiffness[0] = sdof->stiffness;
    matrices->damping[0] = isnan(sdof->damping) ? 0 : sdof->damping;
    matrices->influence[0] = 1;
}

static Status sdof_moved_mass(const Structure *structure, size_t storey, double *mass) {
    (void)storey;
    *mass = sdof_of(structure)->mass;
    return STATUS_OK;
}

const StructureKind structure_sdof = {
    .kind = {"sdof", "one mass on a spring and a damper", sdof_fields, sizeof(SdofStructure)},
    .damping_name = "damping",
    .storeys = sdof_storeys,
    .has_damping = sdof_has_damping,
    .complete = sdof_complete,
    .assemble = sdof_fill,
    .moved_mass = sdof_moved_mass,
};
