// The functions that all kinds of structure share.
#include "core/scene/structure.h"

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

// The square of the first frequency by Rayleigh's quotient of the shape x that the load M r bends
// the structure to, x'Kx / x'Mx; 0 where K is singular.
static Status structure_slowest_square(size_t n, const StructureMatrices *all, double *load,
                                       double *square) {
    double *shape = load + n, above = 0, below = 0;
    *square = 0;
    if (symmetric_matrix_find_indefinite(n, all->stiffness, 0) != 0)
        return STATUS_OK;
    for (size_t i = 0; i < n; i++)
        for (size_t j = 0; j < n; j++)
            load[i] += all->mass[i * n + j] * all->influence[j];
    TRY(symmetric_matrix_solve(n, all->stiffness, load, shape));
    for (size_t i = 0; i < n; i++) {
        above += shape[i] * load[i];
        for (size_t j = 0; j < n; j++)
            below += shape[i] * all->mass[i * n + j] * shape[j];
    }
    *square = below > 0 ? above / below : 0;
    return STATUS_OK;
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

static Status structure_find_rates(const Structure *structure, size_t n, double *room,
                                   StructureRates *rates) {
    const StructureMatrices all = {room, room + n * n, room + 2 * n * n, room + 3 * n * n};
    structure_assemble(structure, &all);
    double square = n == 1 ? all.stiffness[0] / all.mass[0] : 0;
    Status status = STATUS_OK;
    if (n > 1)
        status = structure_slowest_square(n, &all, room + 3 * n * n + n, &square);
    const double own = sqrt(structure_largest_circle(n, all.mass, all.stiffness));
    double decay = structure_largest_circle(n, all.mass, all.damping);
    if (!isnan(structure->damping_ratio))
        decay = 2 * structure->damping_ratio * own;
    *rates = (StructureRates){sqrt(square), fmax(own, decay)};
    return status == STATUS_NO_MEMORY ? status : STATUS_OK;
}

Status structure_rates(const Structure *structure, StructureRates *rates) {
    const size_t n = structure_storeys(structure);
    if (n == 1) {
        double room[4] = {0};
        return structure_find_rates(structure, n, room, rates);
    }
    double *room = calloc(n, (3 * n + 3) * sizeof *room);
    *rates = (StructureRates){0, 0};
    if (room == NULL)
        return STATUS_NO_MEMORY;
    const Status status = structure_find_rates(structure, n, room, rates);
    free(room);
    return status;
}

// How many squares of natural frequencies are below one: as many as K - square M has negative
// pivots (Sylvester). `room` is as large as K.
static size_t structure_count_below(size_t n, const StructureMatrices *all, double square,
                                    double *room) {
    size_t count = 0;
    for (size_t i = 0; i < n * n; i++)
        room[i] = all->stiffness[i] - square * all->mass[i];
    for (size_t k = 0; k < n; k++) {
        const double pivot = room[k * n + k];
        count += pivot < 0;
        for (size_t i = k + 1; i < n; i++) {
            const double factor = room[i * n + k] / pivot;
            if (factor == 0 || !isfinite(factor))
                continue;
            for (size_t j = k + 1; j < n; j++)
                room[i * n + j] -= factor * room[k * n + j];
        }
    }
    return count;
}

Status structure_rates_of(const Structure *structure, size_t modes, StructureRates *rates) {
    enum { HALVINGS = 8 };
    const size_t n = structure_storeys(structure);
    TRY(structure_rates(structure, rates));
    if (modes >= n || !(rates->fastest > 0))
        return STATUS_OK;
    double *room = calloc(n, (4 * n + 1) * sizeof *room);
    if (room == NULL)
        return STATUS_NO_MEMORY;
    const StructureMatrices all = {room, room + n * n, room + 2 * n * n, room + 3 * n * n};
    structure_assemble(structure, &all);
    // Of the logarithm of a part of the fastest.
    double least = -10, most = 0;
    for (int i = 0; i < HALVINGS; i++) {
        const double middle = (least + most) / 2, rate = rates->fastest * exp(middle);
        if (structure_count_below(n, &all, rate * rate, room + 3 * n * n + n) >= modes)
            most = middle;
        else
            least = middle;
    }
    rates->fastest *= exp(most);
    free(room);
    return STATUS_OK;
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
