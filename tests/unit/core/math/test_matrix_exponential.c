// exp(A h) by precise integration against closed forms.
#include <math.h>
#include <stdlib.h>

#include "core/math/matrix_exponential.h"
#include "tests/support/matrix_forms.h"
#include "tests/support/test.h"

TEST(an_oscillator_turns) {
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

TEST(a_singular_system_is_as_good_as_any) {
    const long double A[9] = {0, 1, 0, 0, 0, 1, 0, 0, 0};
    long double E[9];
    matrix_exponential(A, 3, 100, E);
    assert_true(E[1] == 100 && fabsl(E[2] - 5000) < 1e-14L && E[5] == 100 && E[0] == 1);
}

TEST(a_stiff_system_decays_and_keeps_its_slow_part) {
    const long double A[4] = {-1e12L, 1e12L, 0, -1}; // y1 follows y2
    long double E[4];
    matrix_exponential(A, 2, 1, E);
    assert_true(E[0] < 1e-15L);
    assert_true(fabsl(E[3] - expl(-1)) < 1e-15L);
    assert_true(fabsl(E[1] - expl(-1)) < 1e-11L);
}

TEST(a_form_is_the_integral_of_the_product) {
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
