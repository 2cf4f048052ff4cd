#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>

#include <cmocka.h>

#include <math.h>

#include "core/solve/refine.h"
#include "tests/support/base_at.h"

static double given[4] = {1, -2, 0.5, 4};
static const Base coarse = {.form = BASE_SAMPLED, .values = given, .count = 4, .interval = 0.005};

static void a_refined_base_goes_through_the_same_points(void **state) {
    (void)state;
    double values[16];
    assert_int_equal(refine_count(&coarse, 1000, 100), 16);
    const Base fine = refine_base(&coarse, 1000, 16, values);
    assert_int_equal(fine.count, 16);
    for (int i = 0; i < 15; i++)
        assert_true(fabs(fine.values[i] - base_at(&coarse, i * 0.001)) < 1e-14);
    for (int i = 0; i < 4; i++)
        assert_true(fine.values[5 * i] == given[i]);
}

static void a_short_run_takes_no_more_than_it_sees(void **state) {
    (void)state;
    double values[9];
    assert_int_equal(refine_count(&coarse, 1000, 7), 9);
    const Base fine = refine_base(&coarse, 1000, 9, values);
    assert_true(fabs(fine.values[8] - base_at(&coarse, 0.008)) < 1e-14);
}

static void other_grids_are_left_alone(void **state) {
    (void)state;
    const Base still = {.form = BASE_STILL};
    assert_int_equal(refine_count(&coarse, 200, 100), 0); // the same grid
    assert_int_equal(refine_count(&coarse, 100, 100), 0); // a coarser one
    assert_int_equal(refine_count(&coarse, 300, 100), 0); // no whole number of times as fine
    assert_int_equal(refine_count(&still, 1000, 100), 0);
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(a_refined_base_goes_through_the_same_points),
        cmocka_unit_test(a_short_run_takes_no_more_than_it_sees),
        cmocka_unit_test(other_grids_are_left_alone),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
