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

// A search without damping at a point, where the sum of squares is `cost`.
static LeastSquares search_of(const double residual[3], const double at[2], double cost) {
    LeastSquares search = {.at = {at[0], at[1]}, .cost = cost, .equations = equations_of(residual)};
    least_squares_begin(&search);
    search.damping = 0;
    return search;
}

TEST(an_undamped_step_solves_a_linear_problem) {
    // r = J (at - (0.6, 0.3)).
    const double residual[] = {-0.6, -0.9, -0.6}, at[] = {0, 0}, cost = 0.36 + 0.81 + 0.36;
    LeastSquares search = search_of(residual, at, cost);
    assert_true(least_squares_step(&search, 0));
    assert_true(fabs(search.trial[0] - 0.6) < 1e-9 && fabs(search.trial[1] - 0.3) < 1e-9);
    assert_true(fabs(search.predicted - cost) < 1e-9);
}

TEST(a_step_stays_within_the_bounds_and_is_the_best_one_there) {
    // r = J (at - (2, 0.3)): u is at most 1, and then v is best at 0.3 + 1 / 5.
    const double residual[] = {-2, -2.3, -0.6}, at[] = {0, 0};
    LeastSquares search = search_of(residual, at, 10);
    assert_true(least_squares_step(&search, 0));
    assert_true(search.trial[0] == 1 && fabs(search.trial[1] - 0.5) < 1e-9);
    const double bound[] = {1, 0.5}, at_bound[] = {-1, -0.8, 0.4};
    LeastSquares there = search_of(at_bound, bound, 2);
    assert_false(least_squares_step(&there, 1e-9));
}

TEST(a_search_moves_to_better_points_alone_and_damps_the_steps_after_worse_ones) {
    const double residual[] = {-0.6, -0.9, -0.6}, at[] = {0, 0};
    LeastSquares search = search_of(residual, at, 1.53);
    least_squares_begin(&search);
    assert_true(least_squares_step(&search, 0));
    const double first_step = search.trial[0], damping = search.damping;
    assert_false(least_squares_move(&search, 2));
    assert_false(least_squares_move(&search, (double)NAN));
    assert_true(search.at[0] == 0 && search.cost == 1.53 && search.damping > 4 * damping);
    search.damping = 1;
    assert_true(least_squares_step(&search, 0) && search.trial[0] < 0.9 * first_step);
    assert_true(least_squares_move(&search, 0.1));
    assert_true(search.at[0] == search.trial[0] && search.cost == 0.1 && search.damping < 1.01);
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
    LeastSquares search = search_of(residual, at, 0.5);
    double covariance[4];
    normal_equations_make(both, 2, residual, 3, &search.equations);
    least_squares_covariance(&search.equations, covariance);
    assert_true(isinf(covariance[3]) && fabs(covariance[0] - 0.5) < 1e-9);
    assert_true(least_squares_step(&search, 0));
    assert_true(fabs(search.trial[0] - 0.5) < 1e-6 && search.trial[1] == 0.25);
}
