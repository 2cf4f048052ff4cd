// Counter-based random numbers, Philox4x32-10 (Salmon, Moraes, Dror and Shaw, SC11). Number i of a
// seed is a function of i: any part of a sequence can be computed alone, with the same integers on
// every machine.
#ifndef CORE_BASE_PHILOX_H
#define CORE_BASE_PHILOX_H

#include <stdint.h>

// The four random words for a counter of 4 x 32 bits and a key of 2 x 32 bits.
void philox_words(const uint32_t counter[4], const uint32_t key[2], uint32_t out[4]);

// `count` pairs of independent standard normal numbers (Box and Muller), out[2 * count], from
// number `index` of `stream` under `seed`. A pair has the same bits in every call that contains it.
void philox_normal_pairs(uint64_t seed, uint64_t stream, uint64_t index, uint64_t count,
                         double *out);
static inline void philox_normal_pair(uint64_t seed, uint64_t stream, uint64_t index,
                                      double out[2]) {
    philox_normal_pairs(seed, stream, index, 1, out);
}

#endif
