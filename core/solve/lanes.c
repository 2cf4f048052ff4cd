// Products and sums are of one lane each and none are contracted, so every width of vector gives
// the same bytes.
#include "core/solve/lanes.h"

#include <math.h>
#include <stdint.h>
#include <string.h>

#ifdef __x86_64__
#include <immintrin.h>
#endif

#include "core/solve/lanes_make.h"

#define INLINE static inline __attribute__((always_inline))

// Loops over a vector's lanes, so that the vectors stay in registers.
#ifdef __clang__
#define UNROLL _Pragma("unroll")
#else
#define UNROLL _Pragma("GCC unroll 8")
#endif

// So many samples go at once: LANES blocks of LANES samples.
enum { GROUP = LANES * LANES };

typedef enum BaseKind { STILL, LINEAR, SINE } BaseKind;

// The state before or after each block of a group; under a sine its b and a too.
enum { PART_X, PART_V, PART_R, PART_Z, PART_B, PART_A, PARTS };
typedef struct Ends {
    _Alignas(64) double of[PARTS][LANES];
} Ends;

INLINE double larger(double a, double b) {
    return a > b ? a : b;
}

INLINE double size(double a) {
    return __builtin_fabs(a);
}

// |r''| over `count` samples is not larger [m/s^2]: |v| + Omega |x| grows by the base alone.
INLINE double push_bound(const Lanes *t, double x, double v, size_t count, double base_max) {
    const double reach = size(v) + t->omega * size(x) + (double)count * t->interval * base_max;
    return (t->damping + t->omega) * reach;
}

// A sine's b and a from `sample` on.
INLINE Slice start_sine(const Stretch *s, size_t sample, BaseKind kind) {
    Slice slice = {0, 0, 0};
    if (kind == SINE)
        (void)base_cursor_interval(s->base, sample, &slice);
    return slice;
}

INLINE bool is_inside(const Stretch *s, double r, double sag) {
    return r < s->right - sag && r > sag - s->left;
}

#define WIDTH 2
#define NAME(name) name##_plain
#define TARGET
#include "core/solve/lanes_run.inc"

#ifdef __x86_64__
#define WIDTH 4
#define NAME(name) name##_avx2
#define TARGET __attribute__((target("avx2")))
#include "core/solve/lanes_run.inc"

#define WIDTH 8
#define NAME(name) name##_avx512
#define TARGET __attribute__((target("avx512f,avx512dq")))
#include "core/solve/lanes_run.inc"
#endif

LanesWidth lanes_widest(void) {
#ifdef __x86_64__
    if (__builtin_cpu_supports("avx512f") && __builtin_cpu_supports("avx512dq"))
        return LANES_AVX512;
    if (__builtin_cpu_supports("avx2"))
        return LANES_AVX2;
#endif
    return LANES_PLAIN;
}

static LanesRun *run_of(LanesWidth width) {
#ifdef __x86_64__
    if (width == LANES_AVX512)
        return run_avx512;
    if (width == LANES_AVX2)
        return run_avx2;
#endif
    (void)width;
    return run_plain;
}

void lanes_make(Lanes *lanes, const Motion *flying, double base_omega, double interval,
                LanesWidth width) {
    memset(lanes, 0, sizeof *lanes);
    const double omega = sqrt(flying->omega2);
    if (!(LANES * interval * larger(larger(omega, flying->damping), base_omega) <= 1))
        return;
    lanes->base_omega = base_omega;
    lanes->interval = interval;
    lanes->per_interval = 1 / interval;
    lanes->omega2 = flying->omega2;
    lanes->damping = flying->damping;
    lanes->omega = omega;
    lanes_make_tables(lanes);
    lanes->width = width;
    lanes->run = run_of(width);
}

void lanes_take_sums(Stretch *stretch, double sums[LANE_SUMS]) {
    for (int i = 0; i < LANE_SUMS; i++) {
        const double *s = stretch->sums[i];
        sums[i] = ((s[0] + s[4]) + (s[2] + s[6])) + ((s[1] + s[5]) + (s[3] + s[7]));
    }
    memset(stretch->sums, 0, sizeof stretch->sums);
}

double lanes_take_peak(Stretch *stretch, LanePeak which) {
    double most = 0;
    for (int i = 0; i < LANES; i++)
        most = larger(stretch->most[which][i], most);
    memset(stretch->most[which], 0, sizeof stretch->most[which]);
    return most;
}
