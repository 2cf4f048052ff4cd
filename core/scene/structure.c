// Kinds of structure: one so far.
#include "core/scene/structure.h"

// clang-format off
static const Field sdof_fields[] = {
    FIELD_REAL(StructureSdof, mass, "kg", ABOVE(0), REQUIRED, "mass M"),
    FIELD_REAL(StructureSdof, stiffness, "N/m", AT_LEAST(0), REQUIRED, "stiffness K"),
    FIELD_REAL(StructureSdof, damping, "N s/m", AT_LEAST(0), OPTIONAL, "damping C; 0 if no damping is given"),
    FIELD_REAL(StructureSdof, damping_ratio, NULL, AT_LEAST(0), OPTIONAL, "damping ratio xi, in place of C = 2 xi sqrt(K M)"),
    FIELD_END
};
// clang-format on

const Kind structure_sdof = {"sdof", "one mass on a spring and a damper", sdof_fields,
                             sizeof(StructureSdof)};

static const Kind *structure_at(size_t index) {
    return index == 0 ? &structure_sdof : NULL;
}

const KindTable structure_kinds = {"kind", structure_at};

double structure_damping(const StructureSdof *structure) {
    if (isnan(structure->damping_ratio))
        return isnan(structure->damping) ? 0 : structure->damping;
    // Two roots: the product of K and M may be beyond a double where neither is.
    return 2 * structure->damping_ratio * sqrt(structure->stiffness) * sqrt(structure->mass);
}

Status structure_complete(Structure *structure, const char *pointer, Problem *problem) {
    StructureSdof *sdof = (StructureSdof *)(void *)structure;
    if (isnan(sdof->damping_ratio)) {
        if (isnan(sdof->damping))
            sdof->damping = 0;
        return STATUS_OK;
    }
    if (isnan(sdof->damping))
        return STATUS_OK;
    char place[sizeof((Fault){0}.pointer)];
    pointer_join(place, sizeof place, pointer, "damping_ratio");
    return problem_add_real(problem, STATUS_INVALID, place, sdof->damping_ratio, NULL,
                            "excludes damping: give one of the two");
}
