// exp(A h) by precise integration against closed forms.
#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdlib.h>

#include <cmocka.h>

#include "core/math/matrix_exponential.h"

static void an_oscillator_turns(void **state) {
    (void)state;
    for (long double h = 1e-6L; h < 1e3L; h *= 9) {
        const long double w = 7, A[4] = {0, 1, -w * w, 0};
        long double E[4];
        matrix_exponential(A, 2, h, E);
        const long double most = 1e-17L * (10 + w * h);
        assert_true(fabsl(E[0] - cosl(w * h)) < most);
        assert_true(fabsl(E[1] * w - sinl(w * h)) < most);
        assert_true(fabsl(E[2] / w + sinl(w * h)) < most);
    }
}

static void a_singular_system_is_as_good_as_any(void **state) {
    (void)state;
    const long double A[9] = {0, 1, 0, 0, 0, 1, 0, 0, 0};
    long double E[9];
    matrix_exponential(A, 3, 100, E);
    assert_true(E[1] == 100 && fabsl(E[2] - 5000) < 1e-14L && E[5] == 100 && E[0] == 1);
}

static void a_stiff_system_decays_and_keeps_its_slow_part(void **state) {
    (void)state;
    const long double A[4] = {-1e12L, 1e12L, 0, -1}; // y1 follows y2
    long double E[4];
    matrix_exponential(A, 2, 1, E);
    assert_true(E[0] < 1e-15L);
    assert_true(fabsl(E[3] - expl(-1)) < 1e-15L);
    assert_true(fabsl(E[1] - expl(-1)) < 1e-11L);
}

static void a_form_is_the_integral_of_the_product(void **state) {
    (void)state;
    // y = (cos t, -sin t) from (1, 0): the integral of y1 y1 over 0..h is h/2 + sin(2h)/4, of y1 y2
    // -sin(h)^2/2.
    const long double A[4] = {0, 1, -1, 0}, one[2] = {1, 0}, two[2] = {0, 1};
    for (long double h = 1e-3L; h < 100; h *= 3) {
        long double form[4];
        matrix_exponential_forms(A, 2, h, 1, (const long double *const[1][2]){{one, one}}, form);
        assert_true(fabsl(form[0] - (h / 2 + sinl(2 * h) / 4)) < 1e-17L * (10 + h * h));
        matrix_exponential_forms(A, 2, h, 1, (const long double *const[1][2]){{one, two}}, form);
        assert_true(fabsl(form[0] + sinl(h) * sinl(h) / 2) < 1e-17L * (10 + h * h));
    }
}

static void doublings_in_double_are_as_good_as_double(void **state) {
    (void)state;
    double out[9], scratch[18];
    for (double h = 1e-6; h < 1e3; h *= 9) {
        const double w = 7, A[4] = {0, 1, -w * w, 0}, most = 1e-14 * (10 + w * h);
        assert_true(matrix_exponential_doublings(A, 2, h, out, scratch, NULL, 0));
        assert_true(fabs(out[0] + 1 - cos(w * h)) < most);
        assert_true(fabs(out[1] * w - sin(w * h)) < most);
        assert_true(fabs(out[2] / w + sin(w * h)) < most);
    }
    // Nothing is lost to the identity.
    const double slow[1] = {-1e-9};
    assert_true(matrix_exponential_doublings(slow, 1, 1e-6, out, scratch, NULL, 0));
    assert_true(fabs(out[0] + 1e-15) < 1e-28);
    const double chain[9] = {0, 1, 0, 0, 0, 1, 0, 0, 0};
    assert_true(matrix_exponential_doublings(chain, 3, 100, out, scratch, NULL, 0));
    assert_true(out[1] == 100 && fabs(out[2] - 5000) < 1e-9 && out[0] == 0 && out[3] == 0);
    const double stiff[4] = {-1e12, 1e12, 0, -1}; // y1 follows y2
    assert_true(matrix_exponential_doublings(stiff, 2, 1, out, scratch, NULL, 0));
    assert_true(fabs(out[0] + 1) < 1e-12);
    assert_true(fabs(out[3] + 1 - exp(-1)) < 1e-12 && fabs(out[1] - exp(-1)) < 1e-11);
}

static bool refuse(void *context, double fraction) {
    assert_true(fraction == 0.25);
    ++*(int *)context;
    return false;
}

static void a_long_doubling_stops_when_told(void **state) {
    (void)state;
    enum { SIZE = 120 };
    double *room = calloc(4 * SIZE * SIZE, sizeof *room);
    assert_non_null(room);
    for (size_t i = 0; i < SIZE * SIZE; i++)
        room[i] = 1e-3 * sin((double)i);
    int asked = 0;
    const Progress progress = {&asked, refuse};
    assert_false(matrix_exponential_doublings(room, SIZE, 1, room + SIZE * SIZE,
                                              room + 2 * SIZE * SIZE, &progress, 0.25));
    assert_int_equal(asked, 1);
    free(room);
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(an_oscillator_turns),
        cmocka_unit_test(a_long_doubling_stops_when_told),
        cmocka_unit_test(doublings_in_double_are_as_good_as_double),
        cmocka_unit_test(a_singular_system_is_as_good_as_any),
        cmocka_unit_test(a_stiff_system_decays_and_keeps_its_slow_part),
        cmocka_unit_test(a_form_is_the_integral_of_the_product),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
