// Products and sums are never contracted, and sums over lanes have one order, so every width of
// vector gives the same bytes.
#include "core/solve/simd_kernels.h"

#include <stdint.h>
#include <stdlib.h>

#ifdef __x86_64__
#include <immintrin.h>
#endif

#include "core/solve/lanes.h"

enum { LARGE = 4096 };
_Static_assert((int)LANES == (int)SIMD_WIDTH, "one width for both");

static inline double simd_kernels_total(const double s[LANES]) {
    return ((s[0] + s[4]) + (s[2] + s[6])) + ((s[1] + s[5]) + (s[3] + s[7]));
}

// clang-format off
#define KIND(name)                                                                                 \
    {.fly = fly_##name, .sum = sum_##name, .mix = mix_##name, .dot = dot_##name,                   \
     .weigh = weigh_##name, .order = order_##name, .series = series_##name,                        \
     .weighted_abs = weighted_abs_##name, .largest = largest_##name, .square = square_##name, .multiply = multiply_##name, .multiply_four = multiply_four_##name}
// clang-format on

#define WIDTH 2
#define NAME(name) name##_plain
#define TARGET
#include "core/solve/simd_kernels.inc"

#ifdef __x86_64__
#define WIDTH 4
#define NAME(name) name##_avx2
#define TARGET __attribute__((target("avx2")))
#include "core/solve/simd_kernels.inc"

#define WIDTH 8
#define NAME(name) name##_avx512
#define TARGET __attribute__((target("avx512f,avx512dq")))
#include "core/solve/simd_kernels.inc"

const SimdKernels simd_kernels_kinds[SIMD_KINDS] = {KIND(plain), KIND(avx2), KIND(avx512)};
#else
const SimdKernels simd_kernels_kinds[SIMD_KINDS] = {KIND(plain), KIND(plain), KIND(plain)};
#endif

double *simd_kernels_allocate(const SimdArray *arrays, size_t count) {
    const size_t line = SIMD_WIDTH * sizeof(double);
    size_t total = SIMD_WIDTH;
    for (size_t i = 0; i < count; i++)
        total += arrays[i].size;
    double *const block = calloc(total, sizeof *block);
    if (block == NULL)
        return NULL;
    double *at = block + (line - (uintptr_t)block % line) % line / sizeof *block;
    for (size_t i = 0; i < count; at += arrays[i++].size)
        *arrays[i].values = at;
    return block;
}

size_t simd_kernels_widest(void) {
    return (size_t)lanes_widest();
}
