// A shear frame: storey i stands on spring k_i and damper c_i, the first on the ground.
//
//   M = diag(m_1 ... m_n),  K_ii = k_i + k_i+1,  K_i,i+1 = K_i+1,i = -k_i+1,  C likewise,  r = 1
//
// Such a K is positive semi-definite if no spring is negative.
#include "core/scene/structure.h"

#include "core/base/json_pointer.h"

// clang-format off
static const Field frame_fields[] = {
    FIELD_REALS(ShearFrame, masses, "kg", ABOVE(0), STRUCTURE_STOREYS, PRESENCE_REQUIRED, "of the storeys, from the ground up"),
    FIELD_REALS(ShearFrame, stiffnesses, "N/m", AT_MIN(0), STRUCTURE_STOREYS, PRESENCE_REQUIRED, "of the springs below the storeys, from the ground up"),
    FIELD_REALS(ShearFrame, dampings, "N s/m", AT_MIN(0), STRUCTURE_STOREYS, PRESENCE_OPTIONAL, "of the dampers parallel to those springs; 0 if no damping is given"),
    FIELD_BASE(ShearFrame, structure, structure_fields),
    FIELD_END
};
// clang-format on

static const ShearFrame *frame_of(const Structure *structure) {
    return (const ShearFrame *)(const void *)structure;
}

static size_t frame_storeys(const Structure *structure) {
    return frame_of(structure)->masses.count;
}

static bool frame_has_damping(const Structure *structure) {
    return frame_of(structure)->dampings.count > 0;
}

// A sum of finite numbers may not be finite.
static Status frame_check_sums(const Reals *links, const char *unit, const char *pointer,
                               const char *name, Problem *problem) {
    for (size_t i = 1; i < links->count; i++) {
        if (!isfinite(links->at[i]) || !isfinite(links->at[i - 1]) ||
            isfinite(links->at[i] + links->at[i - 1]))
            continue;
        const JsonPointer list = json_pointer_of(pointer, name);
        const JsonPointer place = json_pointer_at(list.at, i);
        return problem_add_real(problem, STATUS_INVALID, place.at, links->at[i], unit,
                                "and the one below must have a sum that numbers can hold");
    }
    return STATUS_OK;
}

static Status frame_complete(Structure *structure, const char *pointer, Problem *problem) {
    ShearFrame *frame = (ShearFrame *)(void *)structure;
    const size_t storeys = frame->masses.count;
    if (storeys == 0 || storeys > STRUCTURE_STOREYS ||
        json_pointer_concerns(problem, pointer, "masses"))
        return STATUS_OK; // reported by the rows
    if (frame->dampings.count == 0 && isnan(structure->damping_ratio))
        TRY(structure_zeros(&frame->dampings, storeys, problem));
    const Status faults[] = {
        structure_validate_count(&frame->stiffnesses, storeys, pointer, "stiffnesses", problem),
        frame->dampings.count == 0
            ? STATUS_OK
            : structure_validate_count(&frame->dampings, storeys, pointer, "dampings", problem),
        frame_check_sums(&frame->stiffnesses, "N/m", pointer, "stiffnesses", problem),
        frame_check_sums(&frame->dampings, "N s/m", pointer, "dampings", problem),
    };
    return status_first(faults, COUNT(faults));
}

static void frame_fill_links(const Reals *links, size_t n, double *matrix) {
    for (size_t i = 0; i < links->count; i++) {
        matrix[i * n + i] += links->at[i];
        if (i == 0)
            continue;
        matrix[(i - 1) * n + i - 1] += links->at[i];
        matrix[i * n + i - 1] = matrix[(i - 1) * n + i] = -links->at[i];
    }
}

static void frame_fill(const Structure *structure, const StructureMatrices *matrices) {
    const ShearFrame *frame = frame_of(structure);
    const size_t n = frame->masses.count;
    for (size_t i = 0; i < n; i++) {
        matrices->mass[i * n + i] = frame->masses.at[i];
        matrices->influence[i] = 1;
    }
    frame_fill_links(&frame->stiffnesses, n, matrices->stiffness);
    frame_fill_links(&frame->dampings, n, matrices->damping);
}

static Status frame_moved_mass(const Structure *structure, size_t storey, double *mass) {
    *mass = frame_of(structure)->masses.at[storey];
    return STATUS_OK;
}

const StructureKind structure_shear_frame = {
    .kind = {"frame", "a shear frame: storeys on top of each other, the first on the ground",
             frame_fields, sizeof(ShearFrame)},
    .damping_name = "dampings",
    .has_drifts = true,
    .storeys = frame_storeys,
    .has_damping = frame_has_damping,
    .complete = frame_complete,
    .assemble = frame_fill,
    .moved_mass = frame_moved_mass,
};
