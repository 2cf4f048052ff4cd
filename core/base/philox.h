// Counter-based random numbers: Philox4x32-10 (Salmon, Moraes, Dror, Shaw, SC11). Number i of a
// seed is computed from i, so any part of a sequence can be made alone and every machine has the
// same integers. Used by excite/random.c and studies.
#ifndef CORE_BASE_PHILOX_H
#define CORE_BASE_PHILOX_H

#include <stdint.h>

// The four words of counter (4 x 32 bits) under key (2 x 32 bits).
void noise_philox(const uint32_t counter[4], const uint32_t key[2], uint32_t out[4]);

// Pairs of independent standard normal numbers, number `index` of `stream` under `seed` and the
// `count` - 1 after it (Box and Muller); each has the same bits wherever in a row it is made.
void noise_normal_pairs(uint64_t seed, uint64_t stream, uint64_t index, uint64_t count,
                        double *out);
static inline void noise_normal_pair(uint64_t seed, uint64_t stream, uint64_t index,
                                     double out[2]) {
    noise_normal_pairs(seed, stream, index, 1, out);
}

#endif
