// The base as the solver meets it: the same function of time on every grid.
#include <math.h>

#include "core/solve/base_motion_cursor.h"
#include "tests/support/base_at.h"
#include "tests/support/test.h"

static double values[] = {0.5, -1, 2, 4, -3};

// Walks 1 s by slices and compares with base_at in the middle of each.
static void walk(const Base *base, double sample_rate) {
    BaseCursor cursor;
    base_cursor_make(&cursor, base, sample_rate);
    for (size_t n = 0; n < (size_t)sample_rate; n++) {
        const double interval = 1 / sample_rate;
        double offset = 0;
        int pieces = 0;
        assert_true(fabs(base_cursor_at(&cursor, n) - base_at(base, (double)n / sample_rate)) <
                    1e-12);
        while (interval - offset > 1e-12) {
            Slice slice;
            const double length =
                fmin(base_cursor_slice(&cursor, n, offset, &slice), interval - offset);
            const double middle = (double)n / sample_rate + offset + length / 2;
            assert_true(length > 0);
            assert_true(fabs(slice_at(&slice, length / 2) - base_at(base, middle)) < 1e-12);
            offset += length;
            assert_true(++pieces < 100);
        }
        Slice whole;
        if (base_cursor_interval(&cursor, n, &whole))
            assert_true(fabs(slice_at(&whole, interval / 3) -
                             base_at(base, ((double)n + 1.0 / 3) / sample_rate)) < 1e-12);
    }
}

TEST(every_slice_is_the_base) {
    const double intervals[] = {0.2, 0.1, 0.05, 0.07, 0.31, 0.013};
    const double rates[] = {10, 20, 33, 100, 1000};
    for (size_t i = 0; i < 6; i++)
        for (size_t j = 0; j < 5; j++)
            walk(
                &(Base){
                    .form = BASE_SAMPLED, .values = values, .count = 5, .interval = intervals[i]},
                rates[j]);
    walk(&(Base){.form = BASE_SINE, .amplitude = 2, .omega = 11}, 100);
    walk(&(Base){.form = BASE_STILL}, 10);
}

TEST(every_slice_of_pieces_is_the_base) {
    const double starts[] = {0, 0.1, 0.103, 0.2999999}, omegas[] = {0, 31};
    const double rates[] = {10, 33, 100, 1000};
    for (size_t i = 0; i < 4; i++)
        for (size_t j = 0; j < 2; j++)
            for (size_t k = 0; k < 4; k++)
                walk(&(Base){.form = BASE_PIECES,
                             .omega = omegas[j],
                             .pieces = {{starts[i], 1, -3}, {starts[i] + 0.25, 2, 5}, {0.8, 0, 0}},
                             .piece_count = 3},
                     rates[k]);
}

TEST(a_piece_on_a_sample_leaves_the_interval_whole) {
    // Sums of starts and lengths are a rounding off the samples' times, to either side.
    for (int side = -1; side <= 1; side++) {
        Base base = {.form = BASE_PIECES, .pieces = {{700.1, 3, 2}, {700.2, 0, 0}}};
        base.piece_count = 2;
        for (size_t i = 0; i < 2 && side != 0; i++)
            base.pieces[i].time = nextafter(base.pieces[i].time, side < 0 ? -1.0 : 1e9);
        BaseCursor cursor;
        Slice slice;
        base_cursor_make(&cursor, &base, 1000);
        for (size_t n = 700050; n < 700250; n++) {
            assert_true(base_cursor_interval(&cursor, n, &slice));
            const bool is_moving = n >= 700100 && n < 700200;
            assert_true(fabs(slice.value - (is_moving ? 3 + 2e-3 * (double)(n - 700100) : 0)) <
                        1e-9);
        }
    }
}

TEST(a_kink_inside_an_interval_forbids_a_whole_step) {
    const Base base = {.form = BASE_SAMPLED, .values = values, .count = 5, .interval = 0.07};
    BaseCursor cursor;
    Slice slice;
    base_cursor_make(&cursor, &base, 10);
    assert_false(base_cursor_interval(&cursor, 0, &slice));
    assert_true(fabs(base_cursor_slice(&cursor, 0, 0, &slice) - 0.07) < 1e-15);
    assert_true(fabs(base_cursor_slice(&cursor, 0, 0.07, &slice) - 0.07) < 1e-15);
}

TEST(a_late_sine_keeps_its_phase) {
    const Base base = {.form = BASE_SINE, .amplitude = 1, .omega = 6.283185307179586};
    BaseCursor cursor;
    Slice slice;
    base_cursor_make(&cursor, &base, 1);
    assert_true(base_cursor_interval(&cursor, 100000000, &slice)); // whole turns of 1 Hz
    assert_true(fabs(slice.value) < 1e-7 && fabs(slice.slope - 1) < 1e-12);
}
