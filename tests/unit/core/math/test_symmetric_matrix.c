// Definiteness, solution and eigenpairs of small symmetric matrices.
#include <math.h>
#include <stdlib.h>

#include "core/math/symmetric_matrix.h"
#include "tests/support/test.h"

TEST(the_first_leading_block_that_is_not_definite_is_named) {
    const double good[] = {2, -1, 0, -1, 2, -1, 0, -1, 2}, bad[] = {2, -1, 0, -1, 2, 3, 0, 3, 2},
                 worse[] = {-1, 0, 0, 1}, zero[] = {0, 0, 0, 1}, coupled_zero[] = {0, 1, 1, 1};
    assert_int_equal(symmetric_matrix_find_indefinite(3, good, 0), 0);
    assert_int_equal(symmetric_matrix_find_indefinite(3, bad, 0), 3);
    assert_int_equal(symmetric_matrix_find_indefinite(2, worse, 0), 1);
    assert_int_equal(symmetric_matrix_find_indefinite(2, zero, 0), 1);
    assert_int_equal(symmetric_matrix_find_indefinite(2, zero, 1e-14), 0);
    assert_int_equal(symmetric_matrix_find_indefinite(2, coupled_zero, 1e-14), 2);
}

TEST(a_margin_passes_singular_matrices_or_keeps_away_from_them) {
    const double singular[] = {1, -1, -1, 1}, nearly[] = {1, 1 - 1e-13, 1 - 1e-13, 1};
    assert_int_equal(symmetric_matrix_find_indefinite(2, singular, 0), 2);
    assert_int_equal(symmetric_matrix_find_indefinite(2, singular, 1e-14), 0);
    assert_int_equal(symmetric_matrix_find_indefinite(2, nearly, 0), 0);
    assert_int_equal(symmetric_matrix_find_indefinite(2, nearly, -1e-12), 2);
    // Units change nothing.
    const double wide[] = {1e300, 1e-10, 1e-10, 1e-300};
    assert_int_equal(symmetric_matrix_find_indefinite(2, wide, 0), 0);
}

TEST(a_system_is_solved_whatever_its_units) {
    const double A[] = {4e200, 1, 1, 1e-200}, b[] = {7e200, 4}; // as 4 1, 1 1 with 7, 4
    double x[2];
    assert_int_equal(symmetric_matrix_solve(2, A, b, x), STATUS_OK);
    assert_true(fabs(x[0] - 1) < 1e-15 && fabs(x[1] / 3e200 - 1) < 1e-15);
    const double B[] = {2, 1, 1, 2}, c[] = {3, 3};
    assert_int_equal(symmetric_matrix_solve(2, B, c, x), STATUS_OK);
    assert_true(fabs(x[0] - 1) < 1e-15 && fabs(x[1] - 1) < 1e-15);
}

TEST(small_eigenvalues_are_as_right_as_large_ones) {
    // A chain of equal springs and masses: 4 sin((2 k - 1) pi / (2 (2 n + 1)))^2.
    enum { N = 60 };
    double *M = calloc(N * N, sizeof *M), *K = calloc(N * N, sizeof *K);
    long double *values = calloc(N, sizeof *values), *Y = calloc(N * N, sizeof *Y);
    for (size_t i = 0; i < N; i++) {
        M[i * N + i] = 3;
        K[i * N + i] = i + 1 < N ? 6 : 3;
        if (i > 0)
            K[i * N + i - 1] = K[(i - 1) * N + i] = -3;
    }
    assert_int_equal(symmetric_matrix_eigen(N, M, K, values, Y), STATUS_OK);
    const long double pi = 3.14159265358979323846264338328L;
    for (size_t k = 0; k < N; k++) {
        const long double half = sinl((2 * k + 1) * pi / (2 * (2 * N + 1)));
        assert_true(fabsl(values[k] / (4 * half * half) - 1) < 1e-15L);
        for (size_t j = 0; j <= k; j++) {
            long double product = 0;
            for (size_t i = 0; i < N; i++)
                product += 3 * Y[k * N + i] * Y[j * N + i];
            assert_true(fabsl(product - (j == k)) < 1e-17L);
        }
    }
    free(M);
    free(K);
    free(values);
    free(Y);
}

TEST(equal_eigenvalues_have_orthogonal_vectors) {
    // Two equal oscillators beside a coupled pair with one of the same value.
    const double M[] = {1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, .5, 0, 0, .5, 1},
                 K[] = {3, 0, 0, 0, 0, 3, 0, 0, 0, 0, 3, 1.5, 0, 0, 1.5, 3};
    long double values[4], Y[16];
    assert_int_equal(symmetric_matrix_eigen(4, M, K, values, Y), STATUS_OK);
    for (size_t i = 0; i < 4; i++) {
        assert_true(fabsl(values[i] - 3) < 1e-17L);
        for (size_t j = 0; j < 4; j++) {
            long double product = 0;
            for (size_t a = 0; a < 4; a++)
                for (size_t b = 0; b < 4; b++)
                    product += Y[i * 4 + a] * M[a * 4 + b] * Y[j * 4 + b];
            assert_true(fabsl(product - (i == j)) < 1e-17L);
        }
    }
}

TEST(an_indefinite_mass_has_no_eigenvalues) {
    const double M[] = {1, 2, 2, 1}, negative[] = {-1, 0, 0, 1}, K[] = {1, 0, 0, 1};
    long double values[2], Y[4];
    assert_int_equal(symmetric_matrix_eigen(2, M, K, values, Y), STATUS_INVALID);
    assert_int_equal(symmetric_matrix_eigen(2, negative, K, values, Y), STATUS_INVALID);
}
