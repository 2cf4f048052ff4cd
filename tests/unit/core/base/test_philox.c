// The generator's integers are published; its normal numbers are judged by their moments.
#include "core/base/philox.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "core/base/status.h"
#include "tests/support/test.h"

// Of Random123's kat_vectors: counter, key, result.
static const struct {
    uint32_t counter[4], key[2], result[4];
} known[] = {
    {{0, 0, 0, 0}, {0, 0}, {0x6627e8d5, 0xe169c58d, 0xbc57ac4c, 0x9b00dbd8}},
    {{0xffffffff, 0xffffffff, 0xffffffff, 0xffffffff},
     {0xffffffff, 0xffffffff},
     {0x408f276d, 0x41c83b0e, 0xa20bc7c6, 0x6d5451fd}},
    {{0x243f6a88, 0x85a308d3, 0x13198a2e, 0x03707344},
     {0xa4093822, 0x299f31d0},
     {0xd16cfe09, 0x94fdcceb, 0x5001e420, 0x24126ea1}},
};

TEST(the_generator_gives_the_published_integers) {
    for (size_t i = 0; i < COUNT(known); i++) {
        uint32_t out[4];
        philox_words(known[i].counter, known[i].key, out);
        assert_memory_equal(out, known[i].result, sizeof out);
    }
}

TEST(a_pair_is_box_and_mullers_of_the_counters_words) {
    const uint32_t counter[4] = {7, 1, 9, 2}, key[2] = {11, 3};
    uint32_t word[4];
    philox_words(counter, key, word);
    const uint64_t a = (uint64_t)word[1] << 32 | word[0], b = (uint64_t)word[3] << 32 | word[2];
    const long double u = ldexpl((long double)(a >> 11) + 1, -53);
    const long double v = ldexpl((long double)(b >> 11), -53);
    const long double radius = sqrtl(-2 * logl(u)), angle = 2 * acosl(-1) * v;
    double pair[2];
    philox_normal_pair(UINT64_C(3) << 32 | 11, UINT64_C(2) << 32 | 9, UINT64_C(1) << 32 | 7, pair);
    assert_true(fabsl(pair[0] - radius * cosl(angle)) < 1e-15L * radius);
    assert_true(fabsl(pair[1] - radius * sinl(angle)) < 1e-15L * radius);
}

TEST(rows_are_as_good_as_the_c_library_in_long_double) {
    enum { PAIRS = 100000 };
    double *pairs = malloc(2 * PAIRS * sizeof *pairs);
    assert_non_null(pairs);
    philox_normal_pairs(17, 4, 3, PAIRS, pairs);
    for (uint32_t i = 0; i < PAIRS; i++) {
        const uint32_t counter[4] = {3 + i, 0, 4, 0}, key[2] = {17, 0};
        uint32_t word[4];
        philox_words(counter, key, word);
        const uint64_t a = (uint64_t)word[1] << 32 | word[0];
        const uint64_t b = (uint64_t)word[3] << 32 | word[2];
        const long double u = ldexpl((long double)(a >> 11) + 1, -53);
        const long double angle = 2 * acosl(-1) * ldexpl((long double)(b >> 11), -53);
        const long double radius = sqrtl(-2 * logl(u));
        assert_true(fabsl(pairs[2 * i] - radius * cosl(angle)) <= 8e-16L * radius);
        assert_true(fabsl(pairs[2 * i + 1] - radius * sinl(angle)) <= 8e-16L * radius);
    }
    free(pairs);
}

TEST(a_row_has_the_bits_of_its_pairs) {
    enum { MOST = 100 };
    double row[2 * MOST + 1];
    for (uint64_t count = 0; count <= MOST; count++) {
        // Across the 32nd bit of the index.
        const uint64_t first = UINT64_C(0xffffffff) - count / 2;
        row[2 * count] = 7;
        philox_normal_pairs(1, 2, first, count, row);
        assert_true(row[2 * count] == 7);
        for (uint64_t i = 0; i < count; i++) {
            double pair[2];
            philox_normal_pair(1, 2, first + i, pair);
            assert_memory_equal(pair, row + 2 * i, sizeof pair);
        }
    }
}

static uint32_t inverse(uint32_t odd) {
    uint32_t x = odd; // right in its 3 lowest bits; each step doubles them
    for (int i = 0; i < 4; i++)
        x *= 2 - odd * x;
    return x;
}

// The counter whose result is `out`: every round can be undone.
static void unphilox(const uint32_t out[4], const uint32_t key[2], uint32_t counter[4]) {
    uint32_t c[4];
    memcpy(c, out, sizeof c);
    for (uint32_t round = 10; round-- > 0;) {
        const uint32_t c0 = c[3] * inverse(0xD2511F53), c2 = c[1] * inverse(0xCD9E8D57);
        const uint64_t a = UINT64_C(0xD2511F53) * c0, b = UINT64_C(0xCD9E8D57) * c2;
        const uint32_t c1 = c[0] ^ (uint32_t)(b >> 32) ^ (key[0] + round * 0x9E3779B9u);
        const uint32_t c3 = c[2] ^ (uint32_t)(a >> 32) ^ (key[1] + round * 0xBB67AE85u);
        memcpy(c, (const uint32_t[]){c0, c1, c2, c3}, sizeof c);
    }
    memcpy(counter, c, sizeof c);
}

TEST(even_the_rarest_words_make_finite_numbers) {
    const uint32_t key[2] = {0, 0}, least[4] = {0, 0, 0, 0}, most[4] = {~0u, ~0u, ~0u, ~0u};
    uint32_t c[4], back[4];
    double pair[2];
    unphilox(least, key, c);
    philox_words(c, key, back);
    assert_memory_equal(back, least, sizeof back);
    philox_normal_pair(0, (uint64_t)c[3] << 32 | c[2], (uint64_t)c[1] << 32 | c[0], pair);
    assert_true(fabs(pair[0] - sqrt(2 * 53 * log(2))) < 1e-14); // 8.57
    assert_true(pair[1] == 0);
    unphilox(most, key, c);
    philox_normal_pair(0, (uint64_t)c[3] << 32 | c[2], (uint64_t)c[1] << 32 | c[0], pair);
    assert_true(pair[0] == 0 && pair[1] == 0);
}

TEST(the_normal_numbers_have_a_normal_distributions_moments) {
    enum { PAIRS = 1000000 };
    double sums[2][5] = {0}, product = 0, neighbours = 0, last = 0, largest = 0;
    for (uint64_t i = 0; i < PAIRS; i++) {
        double pair[2];
        philox_normal_pair(5, 3, i, pair);
        for (int j = 0; j < 2; j++) {
            assert_true(isfinite(pair[j]));
            for (int power = 1; power < 5; power++)
                sums[j][power] += pow(pair[j], power);
            largest = fmax(largest, fabs(pair[j]));
        }
        product += pair[0] * pair[1];
        neighbours += last * pair[0];
        last = pair[1];
    }
    // Four standard errors each.
    for (int j = 0; j < 2; j++) {
        assert_true(fabs(sums[j][1] / PAIRS) < 4 * sqrt(1.0 / PAIRS));
        assert_true(fabs(sums[j][2] / PAIRS - 1) < 4 * sqrt(2.0 / PAIRS));
        assert_true(fabs(sums[j][3] / PAIRS) < 4 * sqrt(15.0 / PAIRS));
        assert_true(fabs(sums[j][4] / PAIRS - 3) < 4 * sqrt(96.0 / PAIRS));
    }
    assert_true(fabs(product / PAIRS) < 4 * sqrt(1.0 / PAIRS));
    assert_true(fabs(neighbours / PAIRS) < 4 * sqrt(1.0 / PAIRS));
    // Of two million the largest lies between 4.4 and 6.5 all but surely.
    assert_true(largest > 4.4 && largest < 6.5);
}

TEST(seed_stream_and_index_each_matter_in_both_halves) {
    const uint64_t high = UINT64_C(1) << 40;
    const uint64_t at[7][3] = {{0, 0, 0},    {1, 0, 0},    {0, 1, 0},   {0, 0, 1},
                               {high, 0, 0}, {0, high, 0}, {0, 0, high}};
    double pair[7][2];
    for (size_t i = 0; i < 7; i++)
        philox_normal_pair(at[i][0], at[i][1], at[i][2], pair[i]);
    for (size_t i = 0; i < 7; i++)
        for (size_t j = 0; j < i; j++)
            assert_true(pair[i][0] != pair[j][0] && pair[i][1] != pair[j][1]);
}
