// Damping is classical, C = M sum_k d_k phi_k phi_k' M, where phi_i' C phi_j = 0 for i != j. C is
// rounded to doubles, so that values within its own rounding,
//
//   |phi_i' C phi_j| <= ROUNDINGS eps |phi_i|' |C| |phi_j|,
//
// count as 0 and are set to 0.
#include "core/plan/modes.h"

#include <float.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "core/math/symmetric_matrix.h"

enum { ROUNDINGS = 8 };

// phi_i' C phi_j of all pairs and whether all with i != j are within rounding of 0.
static void modes_damp(Modes *modes, const double *damping, long double *work) {
    const size_t n = modes->count;
    modes->is_classical = true;
    long double *carried = work, *magnitude = work + n;
    for (size_t j = 0; j < n; j++) {
        for (size_t a = 0; a < n; a++) {
            carried[a] = magnitude[a] = 0;
            for (size_t b = 0; b < n; b++) {
                if (damping[a * n + b] == 0)
                    continue;
                const long double term = (long double)damping[a * n + b] * modes->shapes[b * n + j];
                carried[a] += term;
                magnitude[a] += fabsl(term);
            }
        }
        for (size_t i = 0; i < n; i++) {
            long double sum = 0, most = 0;
            for (size_t a = 0; a < n; a++) {
                sum += modes->shapes[a * n + i] * carried[a];
                most += fabsl(modes->shapes[a * n + i]) * magnitude[a];
            }
            modes->damping[i * n + j] = (double)sum;
            if (i != j && !(fabsl(sum) <= ROUNDINGS * DBL_EPSILON * most))
                modes->is_classical = false;
        }
    }
    for (size_t i = 0; i < n * n && modes->is_classical; i++)
        if (i % (n + 1) != 0)
            modes->damping[i] = 0;
}

static bool modes_are_finite(const double *values, size_t count) {
    for (size_t i = 0; i < count; i++)
        if (!isfinite(values[i]))
            return false;
    return true;
}

static Status modes_fill(Modes *modes, size_t storeys, const double *mass, const double *stiffness,
                         const double *damping, const double *influence, long double *work) {
    const size_t n = storeys;
    long double *values = work, *vectors = work + n;
    TRY(symmetric_matrix_eigen(n, mass, stiffness, values, vectors));
    // omega and its square are to be doubles.
    if (!isfinite((double)values[n - 1]))
        return STATUS_INVALID;
    const long double nothing = 4 * DBL_EPSILON * fabsl(values[n - 1]);
    for (size_t k = 0; k < n; k++) {
        if (values[k] < -nothing * (long double)n)
            return STATUS_INVALID;
        modes->omega[k] = values[k] > nothing ? (double)sqrtl(values[k]) : 0;
        long double share = 0;
        for (size_t i = 0; i < n; i++) {
            modes->shapes[i * n + k] = (double)vectors[k * n + i];
            long double carried = 0;
            for (size_t j = 0; j < n; j++)
                carried += (long double)mass[i * n + j] * influence[j];
            share += vectors[k * n + i] * carried;
        }
        modes->participation[k] = (double)share;
    }
    modes_damp(modes, damping, work);
    return modes_are_finite(modes->omega, n) && modes_are_finite(modes->shapes, n * n) &&
                   modes_are_finite(modes->damping, n * n) &&
                   modes_are_finite(modes->participation, n)
               ? STATUS_OK
               : STATUS_INVALID;
}

Status modes_make(Modes *modes, size_t storeys, const double *mass, const double *stiffness,
                  const double *damping, const double *influence, Problem *problem) {
    const size_t n = storeys;
    memset(modes, 0, sizeof *modes);
    // One block; omega is its start. The rows of `vectors` come before the two of modes_damp().
    modes->omega = calloc(n, (2 * n + 2) * sizeof *modes->omega);
    long double *work = calloc(n, (n + 2) * sizeof *work);
    if (modes->omega == NULL || work == NULL) {
        free(work);
        modes_clear(modes);
        return problem_set(problem, STATUS_NO_MEMORY, "no memory for the modes");
    }
    modes->count = n;
    modes->shapes = modes->omega + n;
    modes->damping = modes->shapes + n * n;
    modes->participation = modes->damping + n * n;
    Status status = modes_fill(modes, n, mass, stiffness, damping, influence, work);
    free(work);
    if (status == STATUS_OK)
        return STATUS_OK;
    modes_clear(modes);
    return status == STATUS_NO_MEMORY
               ? problem_set(problem, status, "no memory for the modes")
               : problem_set(problem, STATUS_UNSTABLE,
                             "the structure has no modes that double precision can hold: its "
                             "masses and stiffnesses are too far apart, or not positive definite");
}

void modes_coordinates(const Modes *modes, size_t storeys, const double *mass, const double *v,
                       double *coordinates) {
    memset(coordinates, 0, modes->count * sizeof *coordinates);
    for (size_t j = 0; j < storeys; j++) {
        double carried = 0;
        for (size_t l = 0; l < storeys; l++)
            carried += mass[j * storeys + l] * v[l];
        for (size_t k = 0; k < modes->count && carried != 0; k++)
            coordinates[k] += modes->shapes[j * modes->count + k] * carried;
    }
}

// Entries move forward in their arrays, never past entries that are still to be read.
void modes_keep(Modes *modes, size_t storeys, const size_t *list, size_t count) {
    const size_t all = modes->count;
    for (size_t i = 0; i < count; i++) {
        modes->omega[i] = modes->omega[list[i]];
        modes->participation[i] = modes->participation[list[i]];
    }
    for (size_t j = 0; j < storeys; j++)
        for (size_t i = 0; i < count; i++)
            modes->shapes[j * count + i] = modes->shapes[j * all + list[i]];
    for (size_t k = 0; k < count; k++)
        for (size_t i = 0; i < count; i++)
            modes->damping[k * count + i] = modes->damping[list[k] * all + list[i]];
    modes->count = count;
    modes->is_classical = modes->is_classical || count == 1;
}

void modes_clear(Modes *modes) {
    if (modes == NULL)
        return;
    free(modes->omega);
    memset(modes, 0, sizeof *modes);
}
