// Modes of structures: frequencies, shapes, damping and participation.
#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "core/plan/modes.h"
#include "tests/support/test.h"

enum { MOST = 12 };

typedef struct Chain {
    size_t n;
    double M[MOST * MOST], K[MOST * MOST], C[MOST * MOST], r[MOST];
} Chain;

// Equal storeys with a damper in each, fixed to the ground by the spring `ground`.
static Chain chain(size_t n, double ground, double c) {
    Chain all = {.n = n};
    for (size_t i = 0; i < n; i++) {
        const double k[] = {i == 0 ? ground : 2000, i + 1 < n ? 2000 : 0};
        all.r[i] = 1;
        all.M[i * n + i] = 5;
        all.K[i * n + i] = k[0] + k[1];
        all.C[i * n + i] = (k[0] + k[1]) * c;
        if (i > 0) {
            all.K[i * n + i - 1] = all.K[(i - 1) * n + i] = -2000;
            all.C[i * n + i - 1] = all.C[(i - 1) * n + i] = -2000 * c;
        }
    }
    return all;
}

static Status make(Modes *modes, const Chain *all) {
    return modes_make(modes, all->n, all->M, all->K, all->C, all->r, NULL);
}

TEST(a_chain_has_its_frequencies_and_modes_are_normal) {
    const Chain all = chain(10, 2000, 1e-3);
    Modes modes;
    assert_int_equal(make(&modes, &all), STATUS_OK);
    assert_int_equal(modes.count, 10);
    double mass = 0;
    for (size_t k = 0; k < 10; k++) {
        const double half = sin((double)(2 * k + 1) * acos(-1) / 42), omega = 2 * sqrt(400) * half;
        assert_true(fabs(modes.omega[k] / omega - 1) < 1e-15);
        for (size_t j = 0; j < 10; j++) {
            double product = 0;
            for (size_t i = 0; i < 10; i++)
                product += 5 * modes.shapes[i * 10 + j] * modes.shapes[i * 10 + k];
            assert_true(fabs(product - (j == k)) < 1e-15);
        }
        mass += modes.participation[k] * modes.participation[k];
    }
    assert_true(fabs(mass / 50 - 1) < 1e-15); // all of the mass takes part in some mode
    modes_clear(&modes);
}

TEST(proportional_damping_is_classical_and_one_odd_damper_is_not) {
    Chain all = chain(10, 2000, 0.3e-3);
    for (size_t i = 0; i < 10; i++)
        all.C[i * 11] += 0.7 * all.M[i * 11];
    Modes modes;
    assert_int_equal(make(&modes, &all), STATUS_OK);
    assert_true(modes.is_classical);
    for (size_t j = 0; j < 10; j++)
        for (size_t k = 0; k < 10; k++) {
            const double is = modes.damping[j * 10 + k], omega = modes.omega[k];
            assert_true(j == k ? fabs(is / (0.7 + 0.3e-3 * omega * omega) - 1) < 1e-14 : is == 0);
        }
    modes_clear(&modes);
    all.C[0] += 1e-9;
    assert_int_equal(make(&modes, &all), STATUS_OK);
    assert_false(modes.is_classical);
    modes_clear(&modes);
}

TEST(a_free_chain_moves_as_one_at_frequency_zero) {
    const Chain all = chain(7, 0, 0);
    Modes modes;
    assert_int_equal(make(&modes, &all), STATUS_OK);
    assert_true(modes.omega[0] == 0 && modes.omega[1] > 1);
    for (size_t i = 0; i < 7; i++)
        assert_true(fabs(modes.shapes[i * 7] * sqrt(35) - 1) < 1e-15);
    modes_clear(&modes);
}

TEST(springs_that_push_have_no_modes) {
    const Chain all = chain(3, -3000, 0);
    Modes modes;
    assert_int_equal(make(&modes, &all), STATUS_UNSTABLE);
    assert_null(modes.omega);
}

TEST(numbers_too_far_apart_are_refused) {
    for (int way = 0; way < 3; way++) {
        Chain all = chain(2, 2000, 1e-3);
        if (way == 0)
            all.K[0] = 1e308, all.M[0] = 1e-308;
        else if (way == 1)
            all.M[0] = 0;
        else
            all.C[0] = 1e308, all.M[0] = 1e-20;
        Modes modes;
        assert_int_equal(make(&modes, &all), STATUS_UNSTABLE);
        assert_int_equal(modes.count, 0);
    }
}
