// Four numbers side by side, and functions compiled for processors that hold them in one register.
// Not wider ones (lanes.h) and no fused operations: the bytes are the same everywhere. Used by
// trust.c, exact_press.c and exact_stride.c.
#ifndef CORE_SOLVE_WIDE_H
#define CORE_SOLVE_WIDE_H

#include <stdbool.h>

#define INLINE static inline __attribute__((always_inline))

typedef double Four __attribute__((vector_size(32), aligned(8), may_alias)); // anywhere
#define FOUR(values) (*(const Four *)(values))
#define PUT_FOUR(values, four) (*(Four *)(values) = (four))

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
