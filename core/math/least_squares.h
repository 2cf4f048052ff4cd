// Bounded non-linear least squares by Levenberg and Marquardt's method, from the normal equations
// of each point, and the covariance of the result. The caller makes the residuals.
#ifndef CORE_MATH_LEAST_SQUARES_H
#define CORE_MATH_LEAST_SQUARES_H

#include <stdbool.h>
#include <stddef.h>

enum { LEAST_SQUARES_VARIABLES = 16 };

// Of the residuals r and their Jacobian matrix J at a point. Every variable lies in [0, 1].
typedef struct NormalEquations {
    size_t count;                                                     // variables
    double matrix[LEAST_SQUARES_VARIABLES * LEAST_SQUARES_VARIABLES]; // J' J, row after row
    double gradient[LEAST_SQUARES_VARIABLES];                         // J' r
} NormalEquations;

// columns[i] is the derivative of the `rows` residuals by variable i.
void normal_equations_make(const double *const *columns, size_t count, const double *residual,
                           size_t rows, NormalEquations *equations);

// The inverse of J' J: covariance of the variables for residuals of unit variance. Directions that
// do not change the residuals have variances that are huge, not infinite; that of a variable
// without any effect is INFINITY and its covariances are 0. `covariance`: count x count, row after
// row.
void least_squares_covariance(const NormalEquations *equations, double *covariance);

// The step whose covariance is the inverse of J' J, from independent standard normal numbers.
// Directions that do not change the residuals get steps of about 1e6. `normal` and `step` have
// `count` numbers.
void least_squares_draw(const NormalEquations *equations, const double *normal, double *step);

// A search: the caller makes the equations of a point, asks for a step and reports its cost.
typedef struct LeastSquares {
    double at[LEAST_SQUARES_VARIABLES], cost; // the best point and its sum of squares
    NormalEquations equations;                // of this point
    double trial[LEAST_SQUARES_VARIABLES];    // the step
    double predicted;                         // decrease of the cost that the linear model predicts
    double damping, growth;
} LeastSquares;

// Begins at a point whose `at` and `cost` are set.
void least_squares_begin(LeastSquares *search);

// Sets the damped step, within the bounds. False: none would decrease the cost by more than
// `tolerance`, or the damping is at its limit.
bool least_squares_step(LeastSquares *search, double tolerance);

// Moves to the step if its cost is less, and adapts the damping. False: it is not.
bool least_squares_move(LeastSquares *search, double cost);

#endif
