// A step solves (J' J + damping D) step = -J' r with D the diagonal of J' J (Marquardt 1963), the
// damping by Nielsen's rule (1999). A variable that the step moves beyond a bound is set to the
// bound, and the others are solved for again with this one fixed.
#include "core/math/least_squares.h"

#include <math.h>
#include <string.h>

#include "core/math/linear_system.h"

enum { VARIABLES = LEAST_SQUARES_VARIABLES };

static const double diagonal_min = 1e-12; // of the largest: a variable without effect stays
// Of a unit diagonal: derivatives by finite differences have errors of some 1e-6 of their size,
// which makes eigenvalues of 1e-12 meaningless.
static const double singular = 1e-12;
static const double damping_first = 1e-3, damping_max = 1e12;
static const double gain_min = 1e-4; // decrease of the cost over the predicted one

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

// J' J of variables in units of their effect, `scale`; one without any has a row of its own.
static void least_squares_scale(const NormalEquations *equations, double *A, double *scale) {
    const size_t n = equations->count;
    for (size_t i = 0; i < n; i++)
        scale[i] = sqrt(equations->matrix[i * n + i]);
    for (size_t i = 0; i < n; i++)
        for (size_t k = 0; k < n; k++) {
            const double product = scale[i] * scale[k];
            A[i * n + k] = i == k        ? 1 + singular
                           : product > 0 ? equations->matrix[i * n + k] / product
                                         : 0;
        }
}

void least_squares_covariance(const NormalEquations *equations, double *covariance) {
    double A[VARIABLES * VARIABLES], scale[VARIABLES];
    const size_t n = equations->count;
    least_squares_scale(equations, A, scale);
    for (size_t i = 0; i < n * n; i++)
        covariance[i] = i % (n + 1) == 0;
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
    // J' J = L L' (Cholesky), and the step solves L' step = normal.
    double L[VARIABLES * VARIABLES], scale[VARIABLES];
    const size_t n = equations->count;
    least_squares_scale(equations, L, scale);
    for (size_t i = 0; i < n; i++)
        for (size_t k = 0; k <= i; k++) {
            double sum = L[i * n + k];
            for (size_t j = 0; j < k; j++)
                sum -= L[i * n + j] * L[k * n + j];
            L[i * n + k] = i == k ? sqrt(fmax(sum, singular)) : sum / L[k * n + k];
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

// The step of the variables that are not fixed; those that are have theirs.
static bool least_squares_solve(const NormalEquations *equations, double damping,
                                const bool *is_fixed, double *step) {
    double A[VARIABLES * VARIABLES], largest = 0;
    const size_t n = equations->count;
    for (size_t i = 0; i < n; i++)
        largest = fmax(largest, equations->matrix[i * n + i]);
    for (size_t i = 0; i < n; i++) {
        const double *row = &equations->matrix[i * n];
        for (size_t k = 0; k < n; k++)
            A[i * n + k] = is_fixed[i] ? i == k : row[k];
        if (is_fixed[i])
            continue;
        A[i * n + i] += damping * row[i] + diagonal_min * largest;
        step[i] = -equations->gradient[i];
    }
    return linear_system_solve(A, step, n, 1);
}

void least_squares_begin(LeastSquares *search) {
    search->damping = damping_first;
    search->growth = 2;
}

bool least_squares_step(LeastSquares *search, double tolerance) {
    const NormalEquations *equations = &search->equations;
    const size_t n = equations->count;
    bool is_fixed[VARIABLES] = {false}, is_clipped = true;
    double step[VARIABLES] = {0};
    search->predicted = 0;
    while (is_clipped) {
        is_clipped = false;
        if (!least_squares_solve(equations, search->damping, is_fixed, step))
            return false;
        for (size_t i = 0; i < n; i++) {
            const double moved = search->at[i] + step[i], bounded = fmin(fmax(moved, 0), 1);
            if (is_fixed[i] || moved == bounded)
                continue;
            step[i] = bounded - search->at[i];
            is_fixed[i] = is_clipped = true;
        }
    }
    for (size_t i = 0; i < n; i++) {
        search->trial[i] = fmin(fmax(search->at[i] + step[i], 0), 1);
        search->predicted -= 2 * equations->gradient[i] * step[i];
        for (size_t k = 0; k < n; k++)
            search->predicted -= step[i] * equations->matrix[i * n + k] * step[k];
    }
    return search->predicted > tolerance && search->damping <= damping_max;
}

bool least_squares_move(LeastSquares *search, double cost) {
    const double gain = (search->cost - cost) / search->predicted;
    if (!(gain > gain_min)) {
        search->damping *= search->growth;
        search->growth *= 2;
        return false;
    }
    search->damping *= fmax(1 / 3.0, 1 - pow(2 * gain - 1, 3));
    search->growth = 2;
    search->cost = cost;
    memcpy(search->at, search->trial, sizeof search->at);
    return true;
}
