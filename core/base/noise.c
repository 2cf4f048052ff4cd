// Philox4x32-10: ten rounds of two 32 x 32 bit multiplications over a 128-bit counter, under a
// 64-bit key that grows by a constant each round. Salmon, Moraes, Dror and Shaw, "Parallel random
// numbers: as easy as 1, 2, 3", SC11.
#include "core/base/noise.h"

#include <math.h>

// 2 pi, rounded to double.
#define TURN 6.283185307179586476925286766559

void noise_philox(const uint32_t counter[4], const uint32_t key[2], uint32_t out[4]) {
    uint32_t c0 = counter[0], c1 = counter[1], c2 = counter[2], c3 = counter[3];
    uint32_t k0 = key[0], k1 = key[1];
    for (int round = 0; round < 10; round++) {
        const uint64_t a = UINT64_C(0xD2511F53) * c0;
        const uint64_t b = UINT64_C(0xCD9E8D57) * c2;
        c0 = (uint32_t)(b >> 32) ^ c1 ^ k0;
        c1 = (uint32_t)b;
        c2 = (uint32_t)(a >> 32) ^ c3 ^ k1;
        c3 = (uint32_t)a;
        k0 += 0x9E3779B9u;
        k1 += 0xBB67AE85u;
    }
    out[0] = c0;
    out[1] = c1;
    out[2] = c2;
    out[3] = c3;
}

// The upper 53 bits of two words, as an integer that a double holds exactly.
static double bits53(uint32_t high, uint32_t low) {
    return (double)(((uint64_t)high << 32 | low) >> 11);
}

void noise_normal_pair(uint64_t seed, uint64_t stream, uint64_t index, double out[2]) {
    const uint32_t counter[4] = {(uint32_t)index, (uint32_t)(index >> 32), (uint32_t)stream,
                                 (uint32_t)(stream >> 32)};
    const uint32_t key[2] = {(uint32_t)seed, (uint32_t)(seed >> 32)};
    uint32_t word[4];
    noise_philox(counter, key, word);
    // Box and Muller. One is added so that the logarithm's argument is in (0, 1], never 0.
    const double radius = sqrt(-2 * log((bits53(word[1], word[0]) + 1) * 0x1p-53));
    const double angle = TURN * (bits53(word[3], word[2]) * 0x1p-53);
    out[0] = radius * cos(angle);
    out[1] = radius * sin(angle);
}
