// A step solves (J' J + damping D) step = -J' r with D the diagonal of J' J (Marquardt 1963). A
// variable that the step moves beyond a bound is set to the bound, and the others are solved for
// again with this one fixed.
#include "core/math/least_squares.h"

#include <math.h>

#include "core/math/linear_system.h"

enum { VARIABLES = LEAST_SQUARES_VARIABLES };

static const double diagonal_min = 1e-12; // of the largest: a variable without effect stays
// Of a unit diagonal: derivatives by finite differences have errors of some 1e-6 of their size,
// which makes eigenvalues of 1e-12 meaningless.
static const double singular = 1e-12;

void normal_equations_make(const double *const *columns, size_t count, const double *residual,
                           size_t rows, NormalEquations *equations) {
    equations->count = count;
    for (size_t i = 0; i < count; i++) {
        for (size_t k = 0; k <= i; k++) {
            double sum = 0;
            for (size_t j = 0; j < rows; j++)
                sum += columns[i][j] * columns[k][j];
            equations->matrix[i * count + k] = equations->matrix[k * count + i] = sum;
        }
        double sum = 0;
        for (size_t j = 0; j < rows; j++)
            sum += columns[i][j] * residual[j];
        equations->gradient[i] = sum;
    }
}

// The step of the variables that are not fixed; those that are have theirs.
static bool least_squares_solve(const NormalEquations *equations, double damping,
                                const bool *is_fixed, double *step) {
    double A[VARIABLES * VARIABLES], b[VARIABLES], largest = 0;
    const size_t n = equations->count;
    size_t free_count = 0, place[VARIABLES];
    for (size_t i = 0; i < n; i++) {
        largest = fmax(largest, equations->matrix[i * n + i]);
        if (!is_fixed[i])
            place[free_count++] = i;
    }
    for (size_t i = 0; i < free_count; i++) {
        const double *row = &equations->matrix[place[i] * n];
        b[i] = -equations->gradient[place[i]];
        for (size_t k = 0; k < n; k++)
            b[i] -= is_fixed[k] ? row[k] * step[k] : 0;
        for (size_t k = 0; k < free_count; k++)
            A[i * free_count + k] = row[place[k]];
        A[i * free_count + i] += damping * row[place[i]] + diagonal_min * largest;
    }
    if (!linear_system_solve(A, b, free_count, 1))
        return false;
    for (size_t i = 0; i < free_count; i++)
        step[place[i]] = b[i];
    return true;
}

double least_squares_step(const NormalEquations *equations, double damping, const double *at,
                          double *to) {
    const size_t n = equations->count;
    bool is_fixed[VARIABLES] = {false}, is_clipped = true;
    double step[VARIABLES] = {0}, decrease = 0;
    while (is_clipped) {
        is_clipped = false;
        if (!least_squares_solve(equations, damping, is_fixed, step))
            return 0;
        for (size_t i = 0; i < n; i++) {
            const double moved = at[i] + step[i], bounded = fmin(fmax(moved, 0), 1);
            if (is_fixed[i] || moved == bounded)
                continue;
            step[i] = bounded - at[i];
            is_fixed[i] = is_clipped = true;
        }
    }
    for (size_t i = 0; i < n; i++) {
        to[i] = fmin(fmax(at[i] + step[i], 0), 1);
        decrease -= 2 * equations->gradient[i] * step[i];
        for (size_t k = 0; k < n; k++)
            decrease -= step[i] * equations->matrix[i * n + k] * step[k];
    }
    return decrease > 0 ? decrease : 0;
}

void least_squares_covariance(const NormalEquations *equations, double *covariance) {
    double A[VARIABLES * VARIABLES], scale[VARIABLES];
    const size_t n = equations->count;
    for (size_t i = 0; i < n; i++)
        scale[i] = sqrt(equations->matrix[i * n + i]);
    for (size_t i = 0; i < n; i++)
        for (size_t k = 0; k < n; k++) {
            const double product = scale[i] * scale[k];
            A[i * n + k] = product > 0 ? equations->matrix[i * n + k] / product : 0;
            if (i == k)
                A[i * n + k] = 1 + singular;
            covariance[i * n + k] = i == k;
        }
    const bool is_solved = linear_system_solve(A, covariance, n, n);
    for (size_t i = 0; i < n; i++)
        for (size_t k = 0; k < n; k++) {
            double *value = &covariance[i * n + k];
            if (!is_solved || !(scale[i] > 0) || !(scale[k] > 0))
                *value = i == k ? (double)INFINITY : 0;
            else
                *value /= scale[i] * scale[k];
        }
}

void least_squares_draw(const NormalEquations *equations, const double *normal, double *step) {
    // J' J = L L' (Cholesky), and the step solves L' step = normal, with variables of unit effect.
    double L[VARIABLES * VARIABLES], scale[VARIABLES];
    const size_t n = equations->count;
    for (size_t i = 0; i < n; i++)
        scale[i] = sqrt(equations->matrix[i * n + i]);
    for (size_t i = 0; i < n; i++)
        for (size_t k = 0; k <= i; k++) {
            const double product = scale[i] * scale[k];
            double sum = product > 0 ? equations->matrix[i * n + k] / product : 0;
            for (size_t j = 0; j < k; j++)
                sum -= L[i * n + j] * L[k * n + j];
            L[i * n + k] =
                i == k ? sqrt(fmax(sum + (product > 0 ? 0 : 1), singular)) : sum / L[k * n + k];
        }
    for (size_t i = n; i-- > 0;) {
        step[i] = normal[i];
        for (size_t k = i + 1; k < n; k++)
            step[i] -= L[k * n + i] * step[k];
        step[i] /= L[i * n + i];
    }
    for (size_t i = 0; i < n; i++)
        step[i] = scale[i] > 0 ? step[i] / scale[i] : 1e6 * normal[i];
}
