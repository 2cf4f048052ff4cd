// The core asks __builtin_cpu_supports wherever it chooses between vector widths, and that reads
// the features which the compiler's run-time library detected. Here they are erased.
#include "tests/support/vectors.h"

const char *const vectors_names[VECTORS_COUNT] = {"avx512", "avx2", "plain"};

#ifdef __x86_64__
// struct __processor_model of libgcc and of compiler-rt, under a name that clang does not know.
extern struct VectorsCpu {
    unsigned vendor, type, subtype, features[1];
} vectors_cpu __asm__("__cpu_model") __attribute__((visibility("hidden")));
enum { FEATURE_AVX2 = 10, FEATURE_AVX512F = 15 };

int __cpu_indicator_init(void);

// No built-in function of the compiler: clang cannot have these and the struct in one file.
bool vectors_set(Vectors vectors) {
    (void)__cpu_indicator_init();
    if (vectors != VECTORS_AVX512)
        vectors_cpu.features[0] &= ~(1u << FEATURE_AVX512F);
    if (vectors == VECTORS_PLAIN)
        vectors_cpu.features[0] &= ~(1u << FEATURE_AVX2);
    const bool has_avx2 = (vectors_cpu.features[0] >> FEATURE_AVX2 & 1) != 0;
    const bool has_avx512 = (vectors_cpu.features[0] >> FEATURE_AVX512F & 1) != 0;
    return has_avx512 == (vectors == VECTORS_AVX512) && has_avx2 == (vectors != VECTORS_PLAIN);
}
#else
bool vectors_set(Vectors vectors) {
    return vectors == VECTORS_PLAIN;
}
#endif
