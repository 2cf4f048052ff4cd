// The core asks __builtin_cpu_supports wherever it chooses between vector widths, and that reads
// the features which the compiler's run-time library detected. Here they are erased.
#include "tests/support/vectors.h"

const char *const vectors_names[VECTORS_COUNT] = {"avx512", "avx2", "plain"};

#ifdef __x86_64__
// struct __processor_model of libgcc and of compiler-rt.
extern struct {
    unsigned vendor, type, subtype, features[1];
} __cpu_model __attribute__((visibility("hidden")));
enum { FEATURE_AVX2 = 10, FEATURE_AVX512F = 15 };

bool vectors_set(Vectors vectors) {
    __builtin_cpu_init();
    if (vectors != VECTORS_AVX512)
        __cpu_model.features[0] &= ~(1u << FEATURE_AVX512F);
    if (vectors == VECTORS_PLAIN)
        __cpu_model.features[0] &= ~(1u << FEATURE_AVX2);
    const bool has_avx2 = __builtin_cpu_supports("avx2");
    const bool has_avx512 = __builtin_cpu_supports("avx512f") && __builtin_cpu_supports("avx512dq");
    return has_avx512 == (vectors == VECTORS_AVX512) && has_avx2 == (vectors != VECTORS_PLAIN);
}
#else
bool vectors_set(Vectors vectors) {
    return vectors == VECTORS_PLAIN;
}
#endif
