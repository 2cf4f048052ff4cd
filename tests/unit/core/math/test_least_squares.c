#include <math.h>
#include <stdint.h>

#include "core/math/least_squares.h"
#include "tests/support/test.h"

// Residuals (2, 1)' + J (u, v)', J of two columns.
static const double first[] = {1, 1, 0}, second[] = {0, 1, 2};
static const double *const columns[] = {first, second};

static NormalEquations equations_of(const double residual[3]) {
    NormalEquations equations;
    normal_equations_make(columns, 2, residual, 3, &equations);
    return equations;
}

TEST(an_undamped_step_solves_a_linear_problem) {
    // r = J (at - (0.6, 0.3)).
    const double residual[] = {-0.6, -0.9, -0.6}, at[] = {0, 0};
    double to[2];
    const NormalEquations equations = equations_of(residual);
    const double decrease = least_squares_step(&equations, 0, at, to);
    assert_true(fabs(to[0] - 0.6) < 1e-9 && fabs(to[1] - 0.3) < 1e-9);
    assert_true(fabs(decrease - (0.36 + 0.81 + 0.36)) < 1e-9);
}

TEST(a_step_stays_within_the_bounds_and_is_the_best_one_there) {
    // r = J (at - (2, 0.3)): u is at most 1, and then v is best at 0.3 + 1 / 5.
    const double residual[] = {-2, -2.3, -0.6}, at[] = {0, 0};
    double to[2];
    const NormalEquations equations = equations_of(residual);
    assert_true(least_squares_step(&equations, 0, at, to) > 0);
    assert_true(to[0] == 1 && fabs(to[1] - 0.5) < 1e-9);
    const double bound[] = {1, 0.5}, at_bound[] = {-1, -0.8, 0.4};
    const NormalEquations there = equations_of(at_bound);
    assert_true(least_squares_step(&there, 0, bound, to) < 1e-9);
}

TEST(the_covariance_is_the_inverse_and_drawn_steps_have_it) {
    const double residual[] = {0, 0, 0};
    const NormalEquations equations = equations_of(residual);
    double covariance[4], sums[3] = {0};
    least_squares_covariance(&equations, covariance);
    // J' J = (2 1; 1 5).
    assert_true(fabs(covariance[0] - 5 / 9.0) < 1e-9 && fabs(covariance[1] + 1 / 9.0) < 1e-9 &&
                fabs(covariance[3] - 2 / 9.0) < 1e-9);
    // Normal numbers at four points of a circle of radius sqrt(2) have unit covariance.
    for (int i = 0; i < 4; i++) {
        const double normal[] = {sqrt(2) * cos(i * 1.5707963267948966 + 0.3),
                                 sqrt(2) * sin(i * 1.5707963267948966 + 0.3)};
        double step[2];
        least_squares_draw(&equations, normal, step);
        sums[0] += step[0] * step[0] / 4;
        sums[1] += step[0] * step[1] / 4;
        sums[2] += step[1] * step[1] / 4;
    }
    assert_true(fabs(sums[0] - covariance[0]) < 1e-9 && fabs(sums[1] - covariance[1]) < 1e-9 &&
                fabs(sums[2] - covariance[3]) < 1e-9);
}

TEST(a_variable_without_effect_has_an_infinite_variance_and_others_are_not_disturbed) {
    static const double none[] = {0, 0, 0};
    const double *const both[] = {first, none};
    const double residual[] = {-0.5, -0.5, 0}, at[] = {0, 0.25};
    NormalEquations equations;
    double covariance[4], to[2];
    normal_equations_make(both, 2, residual, 3, &equations);
    least_squares_covariance(&equations, covariance);
    assert_true(isinf(covariance[3]) && fabs(covariance[0] - 0.5) < 1e-9);
    assert_true(least_squares_step(&equations, 1e-9, at, to) > 0);
    assert_true(fabs(to[0] - 0.5) < 1e-6 && to[1] == 0.25);
}
