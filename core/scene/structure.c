// Functions shared by all kinds of structure, and the kind with one mass, M x'' + C x' + K x =
// -M a_g + N.
#include "core/scene/structure.h"

#include <float.h>
#include <stdlib.h>

#include "core/base/json_pointer.h"
#include "core/math/symmetric_matrix.h"

// clang-format off
const Field structure_fields[] = {
    FIELD_REAL(Structure, damping_ratio, NULL, AT_MIN(0), OPTIONAL, "damping ratio xi of every mode, in place of C; of one mass C = 2 xi sqrt(K M)"),
    FIELD_END
};
// clang-format on

size_t structure_storeys(const Structure *structure) {
    return structure_kind(structure)->storeys(structure);
}

Status structure_complete(Structure *structure, const char *pointer, Problem *problem) {
    const StructureKind *kind = structure_kind(structure);
    Status status = STATUS_OK;
    if (!isnan(structure->damping_ratio) && kind->has_damping(structure)) {
        status =
            json_pointer_fault_real(problem, pointer, "damping_ratio", structure->damping_ratio,
                                    NULL, "excludes %s: give one of the two", kind->damping_name);
    }
    const Status own = kind->complete(structure, pointer, problem);
    return own != STATUS_OK ? own : status;
}

void structure_assemble(const Structure *structure, const StructureMatrices *matrices) {
    structure_kind(structure)->assemble(structure, matrices);
    // Two roots: the product of K and M may be beyond a double where neither is.
    if (!isnan(structure->damping_ratio) && structure_storeys(structure) == 1)
        matrices->damping[0] =
            2 * structure->damping_ratio * sqrt(matrices->stiffness[0]) * sqrt(matrices->mass[0]);
}

// Gershgorin's circles of a matrix, scaled by M's diagonal.
static double structure_largest_circle(size_t n, const double *mass, const double *matrix) {
    double most = 0;
    for (size_t i = 0; i < n; i++) {
        double sum = 0;
        for (size_t j = 0; j < n; j++)
            sum += fabs(matrix[i * n + j]) / sqrt(mass[j * n + j]);
        most = fmax(most, sum / sqrt(mass[i * n + i]));
    }
    return most;
}

Status structure_rates(const Structure *structure, size_t modes, StructureRates *rates) {
    const size_t n = structure_storeys(structure);
    double *room = calloc(n, (3 * n + 2) * sizeof *room);
    *rates = (StructureRates){0};
    if (room == NULL)
        return STATUS_NO_MEMORY;
    const StructureMatrices all = {room, room + n * n, room + 2 * n * n, room + 3 * n * n};
    double *squares = all.influence + n;
    structure_assemble(structure, &all);
    const Status status = symmetric_matrix_eigenvalues(n, all.mass, all.stiffness, squares);
    if (status == STATUS_OK) {
        const bool has_slowest = squares[0] > 4 * DBL_EPSILON * (double)n * squares[n - 1];
        const double own = sqrt(fmax(squares[modes < n ? modes - 1 : n - 1], 0));
        const double decay = !isnan(structure->damping_ratio) ? 2 * structure->damping_ratio * own
                             : modes < n                      ? 0
                                         : structure_largest_circle(n, all.mass, all.damping);
        const double slowest = has_slowest ? sqrt(squares[0]) : 0;
        const double ratio = !isnan(structure->damping_ratio) ? structure->damping_ratio
                             : n == 1 && slowest > 0 ? all.damping[0] / all.mass[0] / 2 / slowest
                                                     : 0;
        *rates = (StructureRates){slowest, fmax(own, decay), ratio};
    }
    free(room);
    return status == STATUS_NO_MEMORY ? status : STATUS_OK;
}

Status structure_zeros(Reals *reals, size_t count, Problem *problem) {
    double *at = calloc(count, sizeof *at);
    if (at == NULL)
        return problem_set(problem, STATUS_NO_MEMORY, "no memory for a scene");
    free(reals->at);
    *reals = (Reals){at, count};
    return STATUS_OK;
}

Status structure_validate_count(const Reals *reals, size_t storeys, const char *pointer,
                                const char *name, Problem *problem) {
    if (reals->count == storeys || json_pointer_concerns(problem, pointer, name))
        return STATUS_OK;
    return json_pointer_fault(problem, pointer, name,
                              "must have %zu number%s, one per storey, has %zu", storeys,
                              storeys == 1 ? "" : "s", reals->count);
}

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
