// Four numbers side by side, and functions compiled for processors that hold them in one
// register. Not wider ones (lanes.h) and no fused operations: the bytes are the same everywhere.
#ifndef CORE_SOLVE_WIDE_H
#define CORE_SOLVE_WIDE_H

#include <stdbool.h>

#define INLINE static inline __attribute__((always_inline))

typedef double Four __attribute__((vector_size(32), aligned(8), may_alias)); // anywhere
#define FOUR(values) (*(const Four *)(values))
#define PUT_FOUR(values, four) (*(Four *)(values) = (four))

// Their sizes.
INLINE void wide_size(const Four *a, Four *size) {
    typedef long long Bits __attribute__((vector_size(32)));
    const long long mask = 0x7fffffffffffffff;
    *size = (Four)((Bits)*a & (Bits){mask, mask, mask, mask});
}

// The larger and the smaller ones of two, like a > b ? a : b and a < b ? a : b.
INLINE void wide_larger(const Four *a, const Four *b, Four *larger) {
    typedef long long Bits __attribute__((vector_size(32)));
    const Bits is_larger = *a > *b;
    *larger = (Four)((is_larger & (Bits)*a) | (~is_larger & (Bits)*b));
}
INLINE void wide_smaller(const Four *a, const Four *b, Four *smaller) {
    typedef long long Bits __attribute__((vector_size(32)));
    const Bits is_smaller = *a < *b;
    *smaller = (Four)((is_smaller & (Bits)*a) | (~is_smaller & (Bits)*b));
}

// The sums of four of them, side by side.
INLINE void wide_sum(const Four *a, const Four *b, const Four *c, const Four *d, Four *sum) {
    const Four first =
        __builtin_shufflevector(*a, *b, 0, 4, 2, 6) + __builtin_shufflevector(*a, *b, 1, 5, 3, 7);
    const Four last =
        __builtin_shufflevector(*c, *d, 0, 4, 2, 6) + __builtin_shufflevector(*c, *d, 1, 5, 3, 7);
    *sum = __builtin_shufflevector(first, last, 0, 1, 4, 5) +
           __builtin_shufflevector(first, last, 2, 3, 6, 7);
}

// A function of its own for such processors; what it calls must be INLINE to profit.
#ifdef __x86_64__
#define WIDE __attribute__((target("avx2")))
static inline bool wide_is_at_hand(void) {
    return __builtin_cpu_supports("avx2");
}
#else
#define WIDE
static inline bool wide_is_at_hand(void) {
    return false;
}
#endif

#endif
