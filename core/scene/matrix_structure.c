// Any linear structure by its matrices. Requirements: M and K symmetric, M positive
// definite, K positive semi-definite, and v'Cv never negative, that is C's symmetric part positive
// semi-definite; C itself need not be symmetric. All are checked to rounding on matrices scaled to
// a unit diagonal, so that units and the ratios of masses have no effect.
#include "core/scene/structure.h"

#include <float.h>
#include <stdlib.h>

#include "core/base/json_pointer.h"
#include "core/math/symmetric_matrix.h"

// How far an entry may be from its mirror, relative to the larger of both and to what the diagonal
// allows; and how far M must be from singular.
static const double symmetry = 1e-12, distance = 1e-12;

// clang-format off
static const Field matrices_fields[] = {
    FIELD_ROWS(MatrixStructure, mass, "kg", ANY, STRUCTURE_STOREYS, PRESENCE_REQUIRED, "mass matrix M, row after row: symmetric, positive definite"),
    FIELD_ROWS(MatrixStructure, stiffness, "N/m", ANY, STRUCTURE_STOREYS, PRESENCE_REQUIRED, "stiffness matrix K: symmetric, positive semi-definite"),
    FIELD_ROWS(MatrixStructure, damping, "N s/m", ANY, STRUCTURE_STOREYS, PRESENCE_OPTIONAL, "damping matrix C: its symmetric part positive semi-definite; 0 if no damping is given"),
    FIELD_REALS(MatrixStructure, influence, NULL, ANY, STRUCTURE_STOREYS, PRESENCE_OPTIONAL, "how far each storey moves, per metre, with the base when nothing bends; all 1 if not given"),
    FIELD_BASE(MatrixStructure, structure, structure_fields),
    FIELD_END
};
// clang-format on

static const MatrixStructure *matrix_of(const Structure *structure) {
    return (const MatrixStructure *)(const void *)structure;
}

static size_t matrices_storeys(const Structure *structure) {
    return matrix_of(structure)->mass.count;
}

static bool matrices_has_damping(const Structure *structure) {
    return matrix_of(structure)->damping.count > 0;
}

typedef struct Checked {
    const Rows *rows;
    const char *name, *unit;
    bool is_symmetric;
    double margin; // of symmetric_matrix_find_indefinite
    const char *wanted;
} Checked;

// As many rows as storeys, and as many numbers in each.
static Status matrix_check_square(const Checked *matrix, size_t storeys, const char *place,
                                  Problem *problem) {
    if (matrix->rows->count != storeys)
        return problem_add(problem, STATUS_INVALID, place,
                           "must have %zu row%s, as many as mass, has %zu", storeys,
                           storeys == 1 ? "" : "s", matrix->rows->count);
    Status status = STATUS_OK;
    for (size_t i = 0; i < storeys; i++) {
        if (matrix->rows->at[i].count == storeys)
            continue;
        const JsonPointer row = json_pointer_at(place, i);
        status = problem_add(problem, STATUS_INVALID, row.at,
                             "must have %zu number%s, one per row of the matrix, has %zu", storeys,
                             storeys == 1 ? "" : "s", matrix->rows->at[i].count);
    }
    return status;
}

static Status matrix_check_symmetry(const Checked *matrix, const char *place, Problem *problem) {
    const Rows *rows = matrix->rows;
    for (size_t i = 1; i < rows->count; i++)
        for (size_t j = 0; j < i; j++) {
            const double is = rows->at[i].at[j], mirror = rows->at[j].at[i];
            const double size = fmax(fmax(fabs(is), fabs(mirror)),
                                     sqrt(fabs(rows->at[i].at[i])) * sqrt(fabs(rows->at[j].at[j])));
            if (fabs(is - mirror) <= symmetry * size)
                continue;
            const JsonPointer row = json_pointer_at(place, i);
            const JsonPointer entry = json_pointer_at(row.at, j);
            return problem_add_real(problem, STATUS_INVALID, entry.at, is, matrix->unit,
                                    "must equal its mirror %s/%zu/%zu, %s: the matrix must be "
                                    "symmetric, is %s",
                                    place, j, i, real_text(mirror).at, real_text(is).at);
        }
    return STATUS_OK;
}

static void matrix_flatten(const Rows *rows, double *matrix) {
    for (size_t i = 0; i < rows->count; i++)
        for (size_t j = 0; j < rows->count; j++)
            matrix[i * rows->count + j] = rows->at[i].at[j];
}

static Status matrix_check_definite(const Checked *matrix, const char *place, Problem *problem) {
    const size_t n = matrix->rows->count;
    double *flat = malloc(n * n * sizeof *flat);
    if (flat == NULL)
        return problem_set(problem, STATUS_NO_MEMORY, "no memory for a matrix");
    matrix_flatten(matrix->rows, flat);
    const int block = symmetric_matrix_find_indefinite(n, flat, matrix->margin);
    free(flat);
    if (block == 0)
        return STATUS_OK;
    if (block < 0)
        return problem_set(problem, STATUS_NO_MEMORY, "no memory for a matrix");
    const JsonPointer row = json_pointer_at(place, (size_t)block - 1);
    const double own = matrix->rows->at[block - 1].at[block - 1];
    return problem_add_real(problem, STATUS_INVALID, row.at, own, matrix->unit,
                            "must keep the matrix %s: with this row the leading %d by %d block is "
                            "not%s",
                            matrix->wanted, block, block,
                            matrix->margin < 0 ? " (or is within 1e-12 of singular)" : "");
}

static Status matrix_check(const Checked *matrix, size_t storeys, const char *pointer,
                           Problem *problem) {
    const JsonPointer place = json_pointer_of(pointer, matrix->name);
    if (problem_concerns(problem, place.at))
        return STATUS_OK; // reported by the rows
    TRY(matrix_check_square(matrix, storeys, place.at, problem));
    if (matrix->is_symmetric)
        TRY(matrix_check_symmetry(matrix, place.at, problem));
    return matrix_check_definite(matrix, place.at, problem);
}

static Status matrices_fill_influence(Reals *influence, size_t storeys, Problem *problem) {
    TRY(structure_zeros(influence, storeys, problem));
    for (size_t i = 0; i < storeys; i++)
        influence->at[i] = 1;
    return STATUS_OK;
}

static Status matrices_fill_damping(Rows *damping, size_t storeys, Problem *problem) {
    damping->at = calloc(storeys, sizeof *damping->at);
    if (damping->at == NULL)
        return problem_set(problem, STATUS_NO_MEMORY, "no memory for a scene");
    for (; damping->count < storeys; damping->count++)
        TRY(structure_zeros(&damping->at[damping->count], storeys, problem));
    return STATUS_OK;
}

static Status matrices_complete(Structure *structure, const char *pointer, Problem *problem) {
    MatrixStructure *matrix = (MatrixStructure *)(void *)structure;
    const size_t n = matrix->mass.count;
    const double rounding = 8 * DBL_EPSILON * (double)n;
    if (n == 0 || n > STRUCTURE_STOREYS)
        return STATUS_OK; // reported by the rows
    const Checked checked[] = {
        {&matrix->mass, "mass", "kg", true, -distance, "positive definite"},
        {&matrix->stiffness, "stiffness", "N/m", true, rounding, "positive semi-definite"},
        {&matrix->damping, "damping", "N s/m", false, rounding,
         "dissipative (its symmetric part positive semi-definite)"},
    };
    Status status = STATUS_OK;
    for (size_t i = 0; i < COUNT(checked); i++) {
        const Status found = checked[i].rows->count == 0
                                 ? STATUS_OK // missing: reported by the rows
                                 : matrix_check(&checked[i], n, pointer, problem);
        status = found != STATUS_OK ? found : status;
    }
    if (matrix->influence.count == 0)
        TRY(matrices_fill_influence(&matrix->influence, n, problem));
    if (matrix->damping.count == 0 && isnan(structure->damping_ratio))
        TRY(matrices_fill_damping(&matrix->damping, n, problem));
    TRY(structure_validate_count(&matrix->influence, n, pointer, "influence", problem));
    return status;
}

static void matrices_fill(const Structure *structure, const StructureMatrices *matrices) {
    const MatrixStructure *matrix = matrix_of(structure);
    const size_t n = matrix->mass.count;
    matrix_flatten(&matrix->mass, matrices->mass);
    matrix_flatten(&matrix->stiffness, matrices->stiffness);
    matrix_flatten(&matrix->damping, matrices->damping);
    for (size_t i = 0; i < n; i++) {
        matrices->influence[i] = matrix->influence.at[i];
        for (size_t j = 0; j < i; j++) {
            const size_t is = i * n + j, mirror = j * n + i;
            double *M = matrices->mass, *K = matrices->stiffness;
            M[is] = M[mirror] = M[is] / 2 + M[mirror] / 2;
            K[is] = K[mirror] = K[is] / 2 + K[mirror] / 2;
        }
    }
}

static Status matrices_moved_mass(const Structure *structure, size_t storey, double *mass) {
    const Rows *rows = &matrix_of(structure)->mass;
    const size_t n = rows->count;
    double *room = calloc(n, (n + 2) * sizeof *room);
    if (room == NULL)
        return STATUS_NO_MEMORY;
    double *force = room + n * n, *moved = force + n;
    matrix_flatten(rows, room);
    force[storey] = 1;
    const Status status = symmetric_matrix_solve(n, room, force, moved);
    *mass = 1 / moved[storey];
    free(room);
    return status;
}

const StructureKind structure_matrix = {
    .kind = {"matrices", "any linear structure, by its matrices", matrices_fields,
             sizeof(MatrixStructure)},
    .damping_name = "damping",
    .storeys = matrices_storeys,
    .has_damping = matrices_has_damping,
    .complete = matrices_complete,
    .assemble = matrices_fill,
    .moved_mass = matrices_moved_mass,
};
