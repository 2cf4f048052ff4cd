// Transforms against their sums in long double, and the promise that a size always has the same
// bits.
#include "core/math/fft.h"

#include <math.h>
#include <pthread.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stdint.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>

#include "core/base/status.h"

static const size_t sizes[] = {1, 2, 3, 4, 5, 16, 17, 30, 97, 128, 1000};

static double number(size_t i) {
    return sin(1.7 * (double)i * (double)i + 0.3);
}

static void forward_is_the_sum_with_a_negative_exponent(void **state) {
    (void)state;
    for (size_t s = 0; s < COUNT(sizes); s++) {
        const size_t n = sizes[s];
        Fourier *fourier = fourier_new(n, FOURIER_FORWARD);
        assert_non_null(fourier);
        for (size_t i = 0; i < n; i++)
            fourier_real(fourier)[i] = number(i);
        fourier_run(fourier);
        for (size_t k = 0; k <= n / 2; k++) {
            long double re = 0, im = 0;
            for (size_t i = 0; i < n; i++) {
                const long double angle = 2 * acosl(-1) * (long double)(i * k % n) / (long double)n;
                re += number(i) * cosl(angle);
                im -= number(i) * sinl(angle);
            }
            assert_true(fabsl(fourier_complex(fourier)[2 * k] - re) < 1e-13L);
            assert_true(fabsl(fourier_complex(fourier)[2 * k + 1] - im) < 1e-13L);
        }
        fourier_free(fourier);
    }
}

static void backward_undoes_forward_up_to_the_size(void **state) {
    (void)state;
    for (size_t s = 0; s < COUNT(sizes); s++) {
        const size_t n = sizes[s];
        Fourier *there = fourier_new(n, FOURIER_FORWARD), *back = fourier_new(n, FOURIER_BACKWARD);
        assert_true(there != NULL && back != NULL);
        for (size_t i = 0; i < n; i++)
            fourier_real(there)[i] = number(i);
        fourier_run(there);
        memcpy(fourier_complex(back), fourier_complex(there), (n / 2 + 1) * 2 * sizeof(double));
        fourier_run(back);
        for (size_t i = 0; i < n; i++)
            assert_true(fabs(fourier_real(back)[i] / (double)n - number(i)) < 1e-15 * 8);
        fourier_free(there);
        fourier_free(back);
    }
}

// A hash of all the bits of one transform.
static uint64_t transform_bits(size_t n) {
    Fourier *fourier = fourier_new(n, FOURIER_FORWARD);
    assert_non_null(fourier);
    for (size_t i = 0; i < n; i++)
        fourier_real(fourier)[i] = number(i);
    fourier_run(fourier);
    uint64_t hash = UINT64_C(14695981039346656037);
    const unsigned char *bytes = (const unsigned char *)fourier_complex(fourier);
    for (size_t i = 0; i < (n / 2 + 1) * 2 * sizeof(double); i++)
        hash = (hash ^ bytes[i]) * UINT64_C(1099511628211);
    fourier_free(fourier);
    return hash;
}

static void a_transform_has_the_same_bits_whatever_was_planned_before(void **state) {
    (void)state;
    static const size_t mixed[] = {4096, 1000, 997, 8192, 60, 10001, 3072, 512, 32768, 4095};
    uint64_t first[COUNT(mixed)];
    for (size_t i = 0; i < COUNT(mixed); i++)
        first[i] = transform_bits(mixed[i]);
    for (size_t i = COUNT(mixed); i-- > 0;) {
        void *hole = malloc(24 + 8 * i); // other addresses than before
        fourier_free(fourier_new(mixed[i], FOURIER_BACKWARD));
        assert_int_equal(transform_bits(mixed[i]), first[i]);
        free(hole);
    }
}

static void *plan_many(void *bits) {
    for (size_t i = 0; i < 20; i++)
        *(uint64_t *)bits ^= transform_bits(100 + 37 * i);
    return NULL;
}

static void several_threads_may_plan_at_once(void **state) {
    (void)state;
    pthread_t threads[4];
    uint64_t bits[4] = {0};
    for (size_t i = 0; i < 4; i++)
        assert_int_equal(pthread_create(&threads[i], NULL, plan_many, &bits[i]), 0);
    for (size_t i = 0; i < 4; i++)
        pthread_join(threads[i], NULL);
    for (size_t i = 1; i < 4; i++)
        assert_int_equal(bits[i], bits[0]);
}

static void what_cannot_be_transformed_is_null(void **state) {
    (void)state;
    assert_null(fourier_new(0, FOURIER_FORWARD));
    assert_null(fourier_new(SIZE_MAX, FOURIER_FORWARD));
    assert_null(fourier_new(((size_t)1 << 30) + 1, FOURIER_BACKWARD));
    fourier_free(NULL);
}

static void a_stock_hands_out_what_was_put_into_it(void **state) {
    (void)state;
    FourierStock stock = {0};
    Fourier *first = fourier_take(&stock, 64, FOURIER_FORWARD);
    assert_non_null(first);
    fourier_put(&stock, first);
    Fourier *other = fourier_take(&stock, 64, FOURIER_BACKWARD);
    assert_non_null(other);
    assert_ptr_not_equal(other, first);
    assert_ptr_equal(fourier_take(&stock, 64, FOURIER_FORWARD), first);
    fourier_put(&stock, first);
    fourier_put(&stock, other);
    // More than it keeps: the oldest goes, the newest stay.
    for (size_t i = 0; i < FOURIER_KEPT - 1; i++)
        fourier_put(&stock, fourier_new(128 + i, FOURIER_FORWARD));
    assert_ptr_equal(fourier_take(&stock, 64, FOURIER_BACKWARD), other);
    fourier_put(NULL, other);
    fourier_put(&stock, NULL);
    fourier_stock_clear(&stock);
    assert_null(stock.at[0]);
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(forward_is_the_sum_with_a_negative_exponent),
        cmocka_unit_test(backward_undoes_forward_up_to_the_size),
        cmocka_unit_test(a_transform_has_the_same_bits_whatever_was_planned_before),
        cmocka_unit_test(several_threads_may_plan_at_once),
        cmocka_unit_test(what_cannot_be_transformed_is_null),
        cmocka_unit_test(a_stock_hands_out_what_was_put_into_it),
    };
    fourier_start();
    return cmocka_run_group_tests(tests, NULL, NULL);
}
