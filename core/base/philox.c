// Philox4x32-10: ten rounds of two 32 x 32 bit multiplications over a 128-bit counter, under a
// 64-bit key that grows by a constant each round. Salmon, Moraes, Dror and Shaw, "Parallel random
// numbers: as easy as 1, 2, 3", SC11.
//
// Normal numbers are computed in rows, each from its own counter by the same operations in the same
// order. The loops have no branches, so that compilers vectorise them, and no C library functions,
// whose results differ between machines.
#include "core/base/philox.h"

#include <math.h>
#include <string.h>

#define INLINE static inline __attribute__((always_inline))

enum { ROW = 32 };

INLINE double philox_double_of_bits(uint64_t bits) {
    double value;
    memcpy(&value, &bits, sizeof value);
    return value;
}

INLINE uint64_t philox_bits_of_double(double value) {
    uint64_t bits;
    memcpy(&bits, &value, sizeof bits);
    return bits;
}

// Conversion of an integer below 2^51, through the last digits of 1.5 * 2^52.
INLINE double philox_double_of_integer(uint64_t integer) {
    return philox_double_of_bits(UINT64_C(0x4338000000000000) + integer) - 0x1.8p52;
}

// The upper 53 bits of two words, as an integer that a double holds exactly.
INLINE double philox_bits53(uint64_t high, uint64_t low) {
    const uint64_t bits = (high << 32 | low) >> 11;
    return 4 * philox_double_of_integer(bits >> 2) + philox_double_of_integer(bits & 3);
}

// Ten rounds on words of 64 bits, of which the lower 32 are used.
INLINE void philox_rounds(uint64_t seed, uint64_t stream, uint64_t index, uint64_t *word0,
                          uint64_t *word1, uint64_t *word2, uint64_t *word3) {
    const uint64_t low = 0xffffffff;
    uint64_t c0 = index & low, c1 = index >> 32, c2 = stream & low, c3 = stream >> 32;
    uint64_t k0 = seed & low, k1 = seed >> 32;
    for (int round = 0; round < 10; round++) {
        const uint64_t a = UINT64_C(0xD2511F53) * c0;
        const uint64_t b = UINT64_C(0xCD9E8D57) * c2;
        c0 = (b >> 32) ^ c1 ^ k0;
        c1 = b & low;
        c2 = (a >> 32) ^ c3 ^ k1;
        c3 = a & low;
        k0 = (k0 + 0x9E3779B9u) & low;
        k1 = (k1 + 0xBB67AE85u) & low;
    }
    *word0 = c0;
    *word1 = c1;
    *word2 = c2;
    *word3 = c3;
}

void philox_words(const uint32_t counter[4], const uint32_t key[2], uint32_t out[4]) {
    uint64_t word[4];
    philox_rounds((uint64_t)key[1] << 32 | key[0], (uint64_t)counter[3] << 32 | counter[2],
                  (uint64_t)counter[1] << 32 | counter[0], &word[0], &word[1], &word[2], &word[3]);
    for (int i = 0; i < 4; i++)
        out[i] = (uint32_t)word[i];
}

// -2 log(u), 2^-53 <= u <= 1. u = 2^e z with z within sqrt(1/2) and sqrt(2), and log z = 2 atanh s,
// s = (z - 1) / (z + 1).
INLINE double philox_minus_two_log(double u) {
    const uint64_t half = UINT64_C(0x3fe6a09e667f3bcd), bits = philox_bits_of_double(u);
    const uint64_t up = (bits - half + (UINT64_C(1024) << 52)) >> 52; // e + 1024
    const double e = philox_double_of_integer(up) - 1024;
    const double z = philox_double_of_bits(bits - ((up - 1024) << 52));
    const double f = z - 1, s = f / (z + 1), t = s * s;
    const double low = 1.0 / 3 + t * (1.0 / 5 + t * (1.0 / 7 + t * (1.0 / 9 + t * (1.0 / 11))));
    const double high =
        1.0 / 13 + t * (1.0 / 15 + t * (1.0 / 17 + t * (1.0 / 19 + t * (1.0 / 21 + t / 23))));
    const double t2 = t * t, t5 = t2 * t2 * t;
    // log 2 in two parts; e times the first is exact.
    const double rest = 2 * s * t * (low + t5 * high) + e * 1.90821492927058770002e-10;
    return -2 * (e * 6.93147180369123816490e-01 + (2 * s + rest));
}

// Cosine and sine of 2 pi u, 0 <= u < 1, reduced to the nearest quarter turn.
INLINE void philox_cos_sin(double u, double *cosine, double *sine) {
    const double quarters = (4 * u + 0x1.8p52) - 0x1.8p52;
    const uint64_t quarter = philox_bits_of_double(4 * u + 0x1.8p52);
    const double x = (4 * u - quarters) * 1.57079632679489661923132169164, t = x * x;
    const double s =
        x + x * t *
                (-1.0 / 6 +
                 t * (1.0 / 120 +
                      t * (-1.0 / 5040 +
                           t * (1.0 / 362880 +
                                t * (-1.0 / 39916800 + t * (1.0 / 6227020800 +
                                                            t * (-1.0 / 1307674368000 +
                                                                 t * (1.0 / 355687428096000))))))));
    const double c =
        1 - (t / 2 - t * t *
                         (1.0 / 24 +
                          t * (-1.0 / 720 +
                               t * (1.0 / 40320 + t * (-1.0 / 3628800 +
                                                       t * (1.0 / 479001600 +
                                                            t * (-1.0 / 87178291200 +
                                                                 t * (1.0 / 20922789888000))))))));
    // Odd quarters swap the two; two of four quarters change each sign.
    const uint64_t odd = 0 - (quarter & 1);
    const uint64_t one = (philox_bits_of_double(s) & odd) | (philox_bits_of_double(c) & ~odd);
    const uint64_t other = (philox_bits_of_double(c) & odd) | (philox_bits_of_double(s) & ~odd);
    *cosine = philox_double_of_bits(one ^ ((quarter + 1) >> 1 & 1) << 63);
    *sine = philox_double_of_bits(other ^ (quarter >> 1 & 1) << 63);
}

INLINE void philox_row(uint64_t seed, uint64_t stream, uint64_t index, double *out) {
    double u[ROW], v[ROW], cosine[ROW], sine[ROW];
    for (uint64_t i = 0; i < ROW; i++) {
        uint64_t word[4];
        philox_rounds(seed, stream, index + i, &word[0], &word[1], &word[2], &word[3]);
        // Adding 1 puts the argument of the logarithm in (0, 1].
        u[i] = (philox_bits53(word[1], word[0]) + 1) * 0x1p-53;
        v[i] = philox_bits53(word[3], word[2]) * 0x1p-53;
    }
    for (int i = 0; i < ROW; i++)
        u[i] = philox_minus_two_log(u[i]);
    for (int i = 0; i < ROW; i++)
        philox_cos_sin(v[i], &cosine[i], &sine[i]);
    for (int i = 0; i < ROW; i++) { // Box and Muller
        const double radius = sqrt(u[i]);
        out[2 * i] = radius * cosine[i];
        out[2 * i + 1] = radius * sine[i];
    }
}

INLINE void philox_pairs(uint64_t seed, uint64_t stream, uint64_t index, uint64_t count,
                         double *out) {
    double row[2 * ROW];
    for (; count >= ROW; count -= ROW, index += ROW, out += 2 * ROW)
        philox_row(seed, stream, index, out);
    if (count == 0)
        return;
    philox_row(seed, stream, index, row);
    memcpy(out, row, 2 * count * sizeof *out);
}

#ifdef __x86_64__
static __attribute__((target("avx512f,avx512dq"))) void
philox_pairs_avx512(uint64_t seed, uint64_t stream, uint64_t index, uint64_t count, double *out) {
    philox_pairs(seed, stream, index, count, out);
}

static __attribute__((target("avx2"))) void
philox_pairs_avx2(uint64_t seed, uint64_t stream, uint64_t index, uint64_t count, double *out) {
    philox_pairs(seed, stream, index, count, out);
}
#endif

void philox_normal_pairs(uint64_t seed, uint64_t stream, uint64_t index, uint64_t count,
                         double *out) {
#ifdef __x86_64__
    if (__builtin_cpu_supports("avx512f") && __builtin_cpu_supports("avx512dq")) {
        philox_pairs_avx512(seed, stream, index, count, out);
        return;
    }
    if (__builtin_cpu_supports("avx2")) {
        philox_pairs_avx2(seed, stream, index, count, out);
        return;
    }
#endif
    philox_pairs(seed, stream, index, count, out);
}
