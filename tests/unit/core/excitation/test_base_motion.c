#include <math.h>
#include <stdlib.h>

#include "core/excitation/base_motion.h"
#include "tests/support/base_at.h"
#include "tests/support/test.h"

TEST(a_still_base_stays_still) {
    Base base = {0};
    assert_true(base_at(&base, 0) == 0 && base_at(&base, 1e9) == 0);
    base_clear(&base);
    base_clear(NULL);
}

TEST(samples_are_joined_by_lines_and_followed_by_stillness) {
    Base base = {.form = BASE_SAMPLED, .count = 3, .interval = 0.5};
    base.values = malloc(3 * sizeof *base.values);
    base.values[0] = 1;
    base.values[1] = 3;
    base.values[2] = -4;
    assert_true(base_at(&base, 0) == 1);
    assert_true(base_at(&base, 0.125) == 1.5);
    assert_true(base_at(&base, 0.5) == 3);
    assert_true(base_at(&base, 0.75) == -0.5);
    // Right-continuous: the last sample ends the line to it, and the base is still from there on.
    assert_true(fabs(base_at(&base, 1 - 1e-12) + 4) < 1e-10);
    assert_true(base_at(&base, 1) == 0);
    assert_true(base_at(&base, 1e300) == 0);
    base_clear(&base);
    assert_null(base.values);
    assert_int_equal(base.form, BASE_STILL);
}

TEST(one_sample_or_none_moves_nothing) {
    double value = 5;
    const Base one = {.form = BASE_SAMPLED, .values = &value, .count = 1, .interval = 1};
    const Base none = {.form = BASE_SAMPLED, .interval = 1};
    assert_true(base_at(&one, 0) == 0);
    assert_true(base_at(&none, 0) == 0);
}

TEST(a_sine_is_a_sine) {
    const Base base = {.form = BASE_SINE, .amplitude = 2, .omega = 3};
    assert_true(base_at(&base, 0) == 0);
    assert_true(base_at(&base, 0.7) == 2 * sin(3 * 0.7));
}
