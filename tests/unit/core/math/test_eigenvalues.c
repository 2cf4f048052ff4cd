#include <math.h>

#include "core/math/eigenvalues.h"
#include "tests/support/test.h"

TEST(eigenvalues_come_in_descending_magnitude_and_pairs_together) {
    // Blocks [[0.3, 0.4], [-0.4, 0.3]], -0.75 and 0.1.
    double A[] = {0.1, 0, 0, 0, 0, 0.3, 0.4, 0, 0, -0.4, 0.3, 0, 0, 0, 0, -0.75};
    double real[4], imaginary[4];
    assert_int_equal(eigenvalues_find(4, A, real, imaginary), STATUS_OK);
    const double wanted[] = {-0.75, 0.3, 0.3, 0.1}, parts[] = {0, 0.4, -0.4, 0};
    for (size_t i = 0; i < 4; i++)
        assert_true(fabs(real[i] - wanted[i]) + fabs(imaginary[i] - parts[i]) < 1e-15);
}

TEST(a_matrix_that_is_not_finite_has_no_eigenvalues) {
    double A[] = {1, (double)NAN, 0, 1}, real[2], imaginary[2];
    assert_int_equal(eigenvalues_find(2, A, real, imaginary), STATUS_INVALID);
}
