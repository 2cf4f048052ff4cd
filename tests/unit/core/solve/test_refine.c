

#include <math.h>

#include "core/solve/base_motion_cursor.h"
#include "tests/support/base_at.h"
#include "tests/support/test.h"

static double given[4] = {1, -2, 0.5, 4};
static const Base coarse = {.form = BASE_SAMPLED, .values = given, .count = 4, .interval = 0.005};

TEST(a_refined_base_goes_through_the_same_points) {
    double values[16];
    assert_int_equal(base_cursor_refined_count(&coarse, 1000, 100), 16);
    Base fine;
    assert_int_equal(base_cursor_refine(&coarse, 1000, 16, values, NULL, &fine, NULL), STATUS_OK);
    assert_int_equal(fine.count, 16);
    for (int i = 0; i < 15; i++)
        assert_true(fabs(fine.values[i] - base_at(&coarse, i * 0.001)) < 1e-14);
    for (int i = 0; i < 4; i++)
        assert_true(fine.values[5 * i] == given[i]);
}

TEST(a_short_run_takes_no_more_than_it_sees) {
    double values[9];
    assert_int_equal(base_cursor_refined_count(&coarse, 1000, 7), 9);
    Base fine;
    assert_int_equal(base_cursor_refine(&coarse, 1000, 9, values, NULL, &fine, NULL), STATUS_OK);
    assert_true(fabs(fine.values[8] - base_at(&coarse, 0.008)) < 1e-14);
}

static bool stop_at_third(void *context, double fraction) {
    (void)fraction;
    return ++*(int *)context < 3;
}

// Also within one interval of the base, which may be as long as the run.
TEST(a_long_one_stops_soon_when_it_is_told_to) {
    enum { MANY = 1 << 22 };
    double *values = test_calloc(MANY, sizeof *values);
    assert_non_null(values);
    const double intervals[] = {0.002, 0.005, 1e3, 1e5};
    double *knots = test_calloc(MANY, sizeof *knots);
    assert_non_null(knots);
    for (size_t i = 0; i < sizeof intervals / sizeof *intervals; i++) {
        const Base base = {
            .form = BASE_SAMPLED, .values = knots, .count = MANY, .interval = intervals[i]};
        int looks = 0;
        const Progress progress = {&looks, stop_at_third};
        Base fine;
        values[MANY / 4] = 7;
        assert_int_equal(base_cursor_refine(&base, 1000, MANY, values, &progress, &fine, NULL),
                         STATUS_CANCELLED);
        assert_int_equal(looks, 3);
        assert_true(values[MANY / 4] == 7); // nothing was made that far behind
    }
    test_free(knots);
    test_free(values);
}

TEST(other_grids_are_left_alone) {
    const Base still = {.form = BASE_STILL};
    assert_int_equal(base_cursor_refined_count(&coarse, 200, 100), 0); // the same grid
    assert_int_equal(base_cursor_refined_count(&coarse, 100, 100), 0); // a coarser one
    assert_int_equal(base_cursor_refined_count(&coarse, 300, 100),
                     0); // no whole number of times as fine
    assert_int_equal(base_cursor_refined_count(&still, 1000, 100), 0);
}
