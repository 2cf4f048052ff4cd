

#include <math.h>

#include "core/study/statistics.h"
#include "tests/support/test.h"

// The numbers are computed apart, with scipy.stats.
static void assert_near(double is, double should, double most) {
    if (!(fabs(is / should - 1) <= most))
        fail_msg("is %.17g, should be %.17g", is, should);
}

TEST(the_error_is_students_and_vanishes_where_all_are_made) {
    RunSpread spread = {.count = 8, .relative = 0.2, .freedom = 1};
    assert_near(stopping_rule_error(&spread, 8, 1000), 0.2464590461075396, 1e-10);
    assert_true(stopping_rule_error(&spread, 1000, 1000) == 0 &&
                stopping_rule_error(&spread, 3, 2) == 0);
    assert_true(isinf(stopping_rule_error(&spread, 1, 1000)));
    for (size_t n = 2; n < 1000; n++)
        assert_true(stopping_rule_error(&spread, n, 1000) >
                    stopping_rule_error(&spread, n + 1, 1000));
}

TEST(skewed_runs_and_spectra_have_their_own_quantiles) {
    RunSpread skewed = {.count = 20, .relative = 0.2, .skewness = -0.7, .freedom = 1};
    assert_near(stopping_rule_error(&skewed, 20, 50), 0.11480278729943294, 1e-10);
    skewed.skewness = 0.7;
    assert_near(stopping_rule_error(&skewed, 20, 50), 0.11480278729943294, 1e-10);
    const RunSpread spectra = {.count = 16, .relative = 0.5, .freedom = 6};
    assert_near(stopping_rule_error(&spectra, 16, 100), 0.22040512916089305, 1e-10);
}

TEST(the_fewest_runs_that_keep_a_target_are_predicted) {
    const RunSpread spread = {.count = 8, .relative = 0.2, .freedom = 1};
    assert_int_equal(stopping_rule_predict(&spread, 1000, 0.01), 728);
    assert_int_equal(stopping_rule_predict(&spread, 1000, 1e-9), 1000);
    assert_int_equal(stopping_rule_predict(&spread, 1000, 10), 8); // those made are enough
    const RunSpread unknown = {.count = 8, .relative = INFINITY, .freedom = 1};
    assert_int_equal(stopping_rule_predict(&unknown, 1000, 0.5), 1000);
}

TEST(one_looks_at_eight_runs_and_at_a_quarter_more_each_time) {
    static const size_t looks[] = {8, 10, 13, 17, 22, 28, 35};
    size_t at = stopping_rule_next_check(0);
    for (size_t i = 0; i < sizeof looks / sizeof *looks; i++, at = stopping_rule_next_check(at))
        assert_int_equal(at, looks[i]);
}
