#include <math.h>

#include "core/math/linear_system.h"
#include "tests/support/test.h"

TEST(a_system_that_needs_pivots_is_solved) {
    double A[] = {0, 1, 4, 2, 0, 1, 1, 3, 0};
    double B[] = {14, 0, 5, 2, 7, 1}; // A times (1, 2, 3), and its first column
    assert_true(linear_system_solve(A, B, 3, 2));
    const double X[] = {1, 1, 2, 0, 3, 0};
    for (size_t i = 0; i < 6; i++)
        assert_true(fabs(B[i] - X[i]) < 1e-14);
}

TEST(singular_and_infinite_systems_are_refused) {
    double singular[] = {1, 2, 2, 4}, infinite[] = {1, 0, 0, (double)INFINITY * 0};
    double B[] = {1, 1};
    assert_false(linear_system_solve(singular, B, 2, 1));
    assert_false(linear_system_solve(infinite, B, 2, 1));
}

TEST(eigenvalues_come_in_descending_magnitude_and_pairs_together) {
    // Blocks [[0.3, 0.4], [-0.4, 0.3]], -0.75 and 0.1.
    double A[] = {0.1, 0, 0, 0, 0, 0.3, 0.4, 0, 0, -0.4, 0.3, 0, 0, 0, 0, -0.75};
    double real[4], imaginary[4];
    assert_int_equal(linear_system_eigenvalues(4, A, real, imaginary), STATUS_OK);
    const double wanted[] = {-0.75, 0.3, 0.3, 0.1}, parts[] = {0, 0.4, -0.4, 0};
    for (size_t i = 0; i < 4; i++)
        assert_true(fabs(real[i] - wanted[i]) + fabs(imaginary[i] - parts[i]) < 1e-15);
}

TEST(a_matrix_that_is_not_finite_has_no_eigenvalues) {
    double A[] = {1, (double)NAN, 0, 1}, real[2], imaginary[2];
    assert_int_equal(linear_system_eigenvalues(2, A, real, imaginary), STATUS_INVALID);
}
