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
