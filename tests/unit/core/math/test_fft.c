// Transforms against their sums in long double, and the promise that a size always has the same
// bits.
#include "core/math/fft.h"

#include <math.h>
#include <pthread.h>
#include <stdlib.h>
#include <string.h>

#include "core/base/status.h"
#include "tests/support/test.h"

static const size_t sizes[] = {1, 2, 3, 4, 5, 16, 17, 30, 97, 128, 1000};

static double number(size_t i) {
    return sin(1.7 * (double)i * (double)i + 0.3);
}

TEST(forward_is_the_sum_with_a_negative_exponent) {
    for (size_t s = 0; s < COUNT(sizes); s++) {
        const size_t n = sizes[s];
        Fft *fourier = fft_new(n, FFT_FORWARD);
        assert_non_null(fourier);
        for (size_t i = 0; i < n; i++)
            fft_real(fourier)[i] = number(i);
        fft_run(fourier);
        for (size_t k = 0; k <= n / 2; k++) {
            long double re = 0, im = 0;
            for (size_t i = 0; i < n; i++) {
                const long double angle = 2 * acosl(-1) * (long double)(i * k % n) / (long double)n;
                re += number(i) * cosl(angle);
                im -= number(i) * sinl(angle);
            }
            assert_true(fabsl(fft_complex(fourier)[2 * k] - re) < 1e-13L);
            assert_true(fabsl(fft_complex(fourier)[2 * k + 1] - im) < 1e-13L);
        }
        fft_free(fourier);
    }
}

TEST(backward_undoes_forward_up_to_the_size) {
    for (size_t s = 0; s < COUNT(sizes); s++) {
        const size_t n = sizes[s];
        Fft *there = fft_new(n, FFT_FORWARD), *back = fft_new(n, FFT_BACKWARD);
        assert_true(there != NULL && back != NULL);
        for (size_t i = 0; i < n; i++)
            fft_real(there)[i] = number(i);
        fft_run(there);
        memcpy(fft_complex(back), fft_complex(there), (n / 2 + 1) * 2 * sizeof(double));
        fft_run(back);
        for (size_t i = 0; i < n; i++)
            assert_true(fabs(fft_real(back)[i] / (double)n - number(i)) < 1e-15 * 8);
        fft_free(there);
        fft_free(back);
    }
}

// A hash of all the bits of one transform.
static uint64_t transform_bits(size_t n) {
    Fft *fourier = fft_new(n, FFT_FORWARD);
    assert_non_null(fourier);
    for (size_t i = 0; i < n; i++)
        fft_real(fourier)[i] = number(i);
    fft_run(fourier);
    uint64_t hash = UINT64_C(14695981039346656037);
    const unsigned char *bytes = (const unsigned char *)fft_complex(fourier);
    for (size_t i = 0; i < (n / 2 + 1) * 2 * sizeof(double); i++)
        hash = (hash ^ bytes[i]) * UINT64_C(1099511628211);
    fft_free(fourier);
    return hash;
}

TEST(a_transform_has_the_same_bits_whatever_was_planned_before) {
    static const size_t mixed[] = {4096, 1000, 997, 8192, 60, 10001, 3072, 512, 32768, 4095};
    uint64_t first[COUNT(mixed)];
    for (size_t i = 0; i < COUNT(mixed); i++)
        first[i] = transform_bits(mixed[i]);
    for (size_t i = COUNT(mixed); i-- > 0;) {
        void *hole = malloc(24 + 8 * i); // other addresses than before
        fft_free(fft_new(mixed[i], FFT_BACKWARD));
        assert_int_equal(transform_bits(mixed[i]), first[i]);
        free(hole);
    }
}

static void *plan_many(void *bits) {
    for (size_t i = 0; i < 20; i++)
        *(uint64_t *)bits ^= transform_bits(100 + 37 * i);
    return NULL;
}

TEST(several_threads_may_plan_at_once) {
    pthread_t threads[4];
    uint64_t bits[4] = {0};
    for (size_t i = 0; i < 4; i++)
        assert_int_equal(pthread_create(&threads[i], NULL, plan_many, &bits[i]), 0);
    for (size_t i = 0; i < 4; i++)
        pthread_join(threads[i], NULL);
    for (size_t i = 1; i < 4; i++)
        assert_int_equal(bits[i], bits[0]);
}

TEST(what_cannot_be_transformed_is_null) {
    assert_null(fft_new(0, FFT_FORWARD));
    assert_null(fft_new(SIZE_MAX, FFT_FORWARD));
    assert_null(fft_new(((size_t)1 << 30) + 1, FFT_BACKWARD));
    fft_free(NULL);
}

TEST(a_stock_hands_out_what_was_put_into_it) {
    FftCache stock = {0};
    Fft *first = fft_acquire(&stock, 64, FFT_FORWARD);
    assert_non_null(first);
    fft_release(&stock, first);
    Fft *other = fft_acquire(&stock, 64, FFT_BACKWARD);
    assert_non_null(other);
    assert_ptr_not_equal(other, first);
    assert_ptr_equal(fft_acquire(&stock, 64, FFT_FORWARD), first);
    fft_release(&stock, first);
    fft_release(&stock, other);
    // More than it keeps: the oldest goes, the newest stay.
    for (size_t i = 0; i < FFT_CACHE_MAX - 1; i++)
        fft_release(&stock, fft_new(128 + i, FFT_FORWARD));
    assert_ptr_equal(fft_acquire(&stock, 64, FFT_BACKWARD), other);
    fft_release(NULL, other);
    fft_release(&stock, NULL);
    fft_cache_clear(&stock);
    assert_null(stock.at[0]);
}

TEST(cosines_at_equal_steps_are_the_library_s) {
    const double pi = acos(-1);
    static double cosines[5000];
    static const size_t counts[] = {0, 1, 63, 64, 65, 4096, 5000};
    for (size_t c = 0; c < COUNT(counts); c++) {
        const double start = c % 2 == 0 ? 0 : -pi / 2, step = 2 * pi / ((double)counts[c] + 1);
        fft_cosines(start, step, counts[c], cosines);
        for (size_t i = 0; i < counts[c]; i++)
            assert_true(fabs(cosines[i] - cos(start + (double)i * step)) < 1e-15);
    }
}
