// Products and sums are of one lane each and none are contracted, so every width of vector gives
// the same bytes.
#include "core/solve/lanes.h"

#include <math.h>
#include <stdbool.h>
#include <stdint.h>
#include <string.h>

#ifdef __x86_64__
#include <immintrin.h>
#endif

#define INLINE static inline __attribute__((always_inline))

// Loops over a vector's lanes, so that the vectors stay in registers.
#ifdef __clang__
#define UNROLL _Pragma("unroll")
#else
#define UNROLL _Pragma("GCC unroll 8")
#endif

// Samples between two bounds of r''.
enum { GROUP = LANES * LANES };

typedef enum BaseKind { STILL, LINEAR, SINE } BaseKind;

INLINE double lanes_greater(double a, double b) {
    return a > b ? a : b;
}

INLINE double lanes_size(double a) {
    return __builtin_fabs(a);
}

// |r''| over `count` samples is not larger [m/s^2]: |v| + Omega |x| grows by the base alone.
INLINE double lanes_push_bound(const Lanes *t, double x, double v, size_t count, double base_max) {
    const double reach =
        lanes_size(v) + t->omega * lanes_size(x) + (double)count * t->interval * base_max;
    return (t->motion.damping + t->omega) * reach;
}

// A sine's b and a from `sample` on.
INLINE Slice lanes_start_sine(const FlightBlock *s, size_t sample, BaseKind kind) {
    Slice slice = {0, 0, 0};
    if (kind == SINE)
        (void)base_cursor_interval(s->base, sample, &slice);
    return slice;
}

INLINE bool lanes_is_inside(const FlightBlock *s, double r, double sag) {
    return r < s->right - sag && r > sag - s->left;
}

INLINE void lanes_add_ends(FlightBlock *s, double sign, double base) {
    s->ends[0] += sign * (s->x * base);
    s->ends[1] += sign * (s->v * base);
    s->ends[2] += sign * (base * base);
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

static LanesRun *lanes_run_of(LanesWidth width) {
#ifdef __x86_64__
    if (width == LANES_AVX512)
        return lanes_run_avx512;
    if (width == LANES_AVX2)
        return lanes_run_avx2;
#endif
    (void)width;
    return lanes_run_plain;
}

// One interval more from `at` = (x, v, r, w), under the base that a Slice describes.
static void lanes_step(const MotionTable *one, long double value, long double slope,
                       long double at[4]) {
    long double next[4];
    for (int c = 0; c < 4; c++) {
        next[c] = at[c] + (one->gain[4][c] * value + one->gain[5][c] * slope);
        for (int i = 0; i < 4; i++)
            next[c] += one->gain[i][c] * at[i];
    }
    memcpy(at, next, sizeof next);
}

// Powers 1 to 8, less the identity, of a step of `length` that gives x and v `one`, less the
// identity, from x and v.
static void lanes_make_map(LanesMap *map, const long double one[2][2], long double length) {
    long double step[2][2] = {{one[0][0], one[0][1]}, {one[1][0], one[1][1]}};
    for (int j = 0; j < LANES; j++) {
        for (int c = 0; c < 2 && j > 0; c++) {
            const long double x = step[0][c], v = step[1][c];
            step[0][c] += one[0][c] + (one[0][0] * x + one[0][1] * v);
            step[1][c] += one[1][c] + (one[1][0] * x + one[1][1] * v);
        }
        map->x_x[j] = (double)step[0][0];
        map->x_v[j] = (double)step[0][1];
        map->v_x[j] = (double)step[1][0];
        map->v_v[j] = (double)step[1][1];
        map->time[j] = (double)((j + 1) * length);
    }
}

// What the halves of a sine at the start give after 1 to 8 samples.
static void lanes_make_sine(Lanes *lanes, const MotionTable *one) {
    const long double angle = (long double)lanes->base_omega * lanes->interval;
    for (int half = 0; half < 2; half++) {
        long double at[4] = {0}, cosine = 1, sine = 0;
        for (int j = 0; j < LANES; j++) {
            LanesMap *map = &lanes->sample;
            lanes_step(one, half == 0 ? cosine : sine, half == 0 ? -sine : cosine, at);
            cosine = cosl((j + 1) * angle);
            sine = sinl((j + 1) * angle);
            map->x_s[half][j] = (double)at[0];
            map->v_s[half][j] = (double)at[1];
            map->z_s[half][j] = (double)(at[0] + at[2]);
            map->speed_s[half][j] = (double)(at[1] + at[3]);
            map->turn[half][j] = (double)(half == 0 ? cosine : sine);
        }
    }
}

// What the base's samples give.
static void lanes_make_base(Lanes *lanes, const MotionTable *one) {
    for (int i = 0; i <= LANES; i++) {
        long double at[4] = {0};
        for (int j = 0; j < LANES; j++) {
            lanes_step(one, j == i, ((j + 1 == i) - (j == i)) / (long double)lanes->interval, at);
            lanes->x_a[i][j] = (double)at[0];
            lanes->v_a[i][j] = (double)at[1];
            lanes->z_a[i][j] = (double)(at[0] + at[2]);
            lanes->speed_a[i][j] = (double)(at[1] + at[3]);
        }
    }
}

// Integrals over an interval in terms of its end: time runs backwards, and damping drives.
static void lanes_make_forms(Lanes *lanes, const Motion *flying) {
    static const int part[START_SIZE] = {0, 1, -1, -1, 2, 3};
    static const LaneSum sum[4][4] = {
        {XX, XV, XB, XA}, {XV, VV, VB, VA}, {XB, VB, BB, AB}, {XA, VA, AB, AA}};
    const double per_interval = lanes->per_interval;
    const bool is_sine = lanes->base_omega > 0;
    // The table's x, v, value and slope from the x, v, b and a of the end.
    const double from_end[4][4] = {
        {1, 0, 0, 0},
        {0, -1, 0, 0},
        {0, 0, 1, 0},
        {0, 0, is_sine ? 0 : -per_interval, is_sine ? -1 : per_interval}};
    Motion back = *flying;
    back.damping = -flying->damping;
    MotionTable table;
    motion_table_make(&table, &back, lanes->base_omega, lanes->interval);
    motion_table_make_forms(&table);
    for (int pair = 0; pair < FORM_PAIRS; pair++) {
        const int i = part[form_pairs[pair][0]], j = part[form_pairs[pair][1]];
        for (int k = 0; k < 16 && i >= 0 && j >= 0; k++) {
            const double both = from_end[i][k / 4] * from_end[j][k % 4];
            lanes->vv[sum[k / 4][k % 4]] += both * table.forms[FORM_VV][pair];
            lanes->av[sum[k / 4][k % 4]] -= both * table.forms[FORM_AV][pair];
        }
    }
}

bool lanes_are_for(const Motion *flying, double base_omega, double interval) {
    const double own = lanes_greater(sqrt(flying->omega2), flying->damping);
    return LANES * interval * lanes_greater(own, base_omega) <= 1;
}

void lanes_make(Lanes *lanes, const MotionTable *one, bool is_sampled, LanesWidth width) {
    const Motion *flying = &one->motion;
    const double interval = one->length;
    if (lanes->run == lanes_run_of(width) && lanes->is_sampled == is_sampled &&
        lanes->interval == interval && lanes->base_omega == one->base_omega &&
        motion_is_same(&lanes->motion, flying))
        return;
    memset(lanes, 0, sizeof *lanes);
    if (!lanes_are_for(flying, one->base_omega, interval))
        return;
    lanes->motion = *flying;
    lanes->is_sampled = is_sampled;
    lanes->base_omega = one->base_omega;
    lanes->interval = interval;
    lanes->per_interval = 1 / interval;
    lanes->omega = sqrt(flying->omega2);
    const long double step[2][2] = {{one->gain[0][0], one->gain[1][0]},
                                    {one->gain[0][1], one->gain[1][1]}};
    lanes_make_map(&lanes->sample, step, interval);
    if (one->base_omega > 0)
        lanes_make_sine(lanes, one);
    else if (is_sampled)
        lanes_make_base(lanes, one);
    lanes_make_forms(lanes, flying);
    lanes->width = width;
    lanes->run = lanes_run_of(width);
}

// A is the B of the sample before, and x and v follow from those of that sample: the sums with A
// are those over the samples before, which differ from the others by the ends alone.
void lanes_take_sums(const Lanes *lanes, FlightBlock *stretch, double sums[LANE_SUMS]) {
    for (int i = 0; i < LANE_SUMS; i++) {
        const double *s = stretch->sums[i];
        sums[i] = (s[0] + s[2]) + (s[1] + s[3]);
    }
    if (lanes->base_omega == 0) {
        const LanesMap *m = &lanes->sample;
        const double x = sums[XB] + stretch->ends[0], v = sums[VB] + stretch->ends[1];
        sums[AA] = sums[BB] + stretch->ends[2];
        sums[XA] = (x + (m->x_x[0] * x + m->x_v[0] * v)) +
                   (lanes->x_a[0][0] * sums[AA] + lanes->x_a[1][0] * sums[AB]);
        sums[VA] = (v + (m->v_x[0] * x + m->v_v[0] * v)) +
                   (lanes->v_a[0][0] * sums[AA] + lanes->v_a[1][0] * sums[AB]);
    }
    memset(stretch->sums, 0, sizeof stretch->sums);
    memset(stretch->ends, 0, sizeof stretch->ends);
}

double lanes_take_peak(FlightBlock *stretch, LanePeak which) {
    double most = 0;
    for (int i = 0; i < LANES; i++)
        most = lanes_greater(stretch->most[which][i], most);
    memset(stretch->most[which], 0, sizeof stretch->most[which]);
    return most;
}
