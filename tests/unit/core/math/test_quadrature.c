#include <math.h>

#include "core/math/quadrature.h"
#include "tests/support/test.h"

static double power(const void *context, double u, double rest) {
    (void)rest;
    return pow(u, *(const double *)context);
}

static double from_the_far_end(const void *context, double u, double rest) {
    (void)u;
    return pow(rest, *(const double *)context);
}

static double smooth(const void *context, double u, double rest) {
    (void)context, (void)rest;
    return 1 / (1 + u * u);
}

TEST(powers_are_right_at_either_end) {
    static const double exponents[] = {0, 0.25, 1, 1.5, 2.5, 7};
    for (size_t i = 0; i < sizeof exponents / sizeof *exponents; i++) {
        const double known = 1 / (1 + exponents[i]);
        assert_true(fabs(quadrature_unit(power, &exponents[i]) / known - 1) < 4e-15);
        assert_true(fabs(quadrature_unit(from_the_far_end, &exponents[i]) / known - 1) < 4e-15);
    }
}

TEST(a_mild_singularity_is_no_trouble) {
    const double exponent = -0.25;
    assert_true(fabs(quadrature_unit(power, &exponent) * 0.75 - 1) < 1e-12);
    assert_true(fabs(quadrature_unit(from_the_far_end, &exponent) * 0.75 - 1) < 1e-12);
}

TEST(smooth_functions_are_right_to_rounding) {
    assert_true(fabs(quadrature_unit(smooth, NULL) - atan(1)) < 1e-15);
}
