// The first crossing: never stepped over, never invented.
#include <float.h>
#include <math.h>
#include <stdlib.h>

#include "core/math/polynomial_root.h"
#include "tests/support/test.h"

// (roots[0] - s) (roots[1] - s) ... times `scale`.
static void product(const double *roots, size_t count, double scale, double *c) {
    for (size_t i = 0; i <= count; i++)
        c[i] = 0;
    c[0] = scale;
    for (size_t n = 0; n < count; n++)
        for (size_t i = n + 2; i-- > 0;)
            c[i] = (i <= n ? roots[n] * c[i] : 0) - (i > 0 ? c[i - 1] : 0);
}

TEST(a_simple_root_is_found_to_rounding) {
    for (int i = 1; i < 1000; i++) {
        const double root = i / 1000.0, roots[3] = {root, 1.5 + root, 3};
        double c[4], s = -1;
        product(roots, 3, 1e-7, c);
        assert_true(polynomial_root_first(c, 3, &s));
        assert_true(fabs(s - root) <= 8 * DBL_EPSILON);
    }
}

TEST(the_first_of_two_close_roots_is_taken) {
    for (int power = 1; power <= 6; power++) {
        const double width = pow(10, -power), roots[2] = {0.4, 0.4 + width};
        double c[3], s = -1;
        product(roots, 2, 1, c);
        assert_true(polynomial_root_first(c, 2, &s));
        assert_true(fabs(s - 0.4) <= 4 * DBL_EPSILON / width);
    }
}

TEST(a_near_miss_is_not_a_crossing) {
    for (int power = 1; power <= 14; power++) {
        const double miss = pow(10, -power);
        const double c[3] = {0.16 + miss, -0.8, 1}; // (s - 0.4)^2 + miss
        double s;
        assert_false(polynomial_root_first(c, 2, &s));
    }
}

TEST(a_root_at_the_start_does_not_count) {
    double s = -1;
    const double leaves[4] = {0, 1, -2, 0}, turns_at_once[3] = {0, 0, -1}, opens[4] = {0, 0, 0, 1};
    assert_true(polynomial_root_first(leaves, 3, &s));
    assert_true(fabs(s - 0.5) <= DBL_EPSILON);
    assert_true(polynomial_root_first(turns_at_once, 2, &s));
    assert_true(s == 0);
    assert_false(polynomial_root_first(opens, 3, &s));
    const double nothing[2] = {0, 0};
    assert_false(polynomial_root_first(nothing, 1, &s));
}

// Against a scan so fine that a root of these low degrees cannot hide from it.
// Motion that has left what doubles hold: the caller is told of no crossing, and not in 2^52 steps.
TEST(coefficients_that_are_no_numbers_end_the_search) {
    double s;
    const double lost[][4] = {{1, NAN, 0, 0}, {1, -2, NAN, 1}, {NAN, -1, 0, 0}};
    for (size_t i = 0; i < sizeof lost / sizeof *lost; i++)
        assert_false(polynomial_root_first(lost[i], 3, &s));
}

TEST(random_polynomials_agree_with_a_scan) {
    srand(7);
    int crossings = 0;
    for (int trial = 0; trial < 20000; trial++) {
        double c[9];
        const size_t degree = 2 + (size_t)(rand() % 7);
        for (size_t i = 0; i <= degree; i++)
            c[i] = ((double)rand() / RAND_MAX * 2 - 1) * pow(4, (int)(i % 4));
        c[0] = fabs(c[0]) + 1e-3;
        double s = 2, seen = 2;
        const bool is_found = polynomial_root_first(c, degree, &s);
        for (int i = 0; i <= 2000 && seen > 1; i++)
            if (polynomial_value(c, degree, i / 2000.0) < -1e-12)
                seen = i / 2000.0;
        if (seen <= 1)
            assert_true(is_found);
        if (is_found) {
            crossings++;
            assert_true(s <= seen + 1e-15);
            assert_true(fabs(polynomial_value(c, degree, s)) < 1e-12);
        }
    }
    assert_true(crossings > 1000);
}
