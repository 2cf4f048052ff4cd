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

// So many samples go at once: LANES blocks of LANES samples.
enum { GROUP = LANES * LANES };

typedef enum BaseKind { STILL, LINEAR, SINE } BaseKind;

// The state before or after each block of a group; under a sine its b and a too.
enum { PART_X, PART_V, PART_R, PART_Z, PART_B, PART_A, PARTS };
typedef struct Ends {
    _Alignas(64) double of[PARTS][LANES];
} Ends;

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
    return (t->damping + t->omega) * reach;
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

// With S the structure's response to a unit impulse and I1, I2 its integrals, a base of a + s t
// moves it over t as
//   x(t) = (1 - W I1) x + S v - I1 a - I2 s,   v(t) = -W S x + (1 - D S - W I1) v - S a - I1 s.
// Powers of that one-interval map give the state after 1 to 8 samples, and of its eighth power that
// after 1 to 8 blocks.
enum { SERIES = 24 };

typedef struct Impulse {
    long double S, I1, I2;
} Impulse;

// Of y'' + damping y' + omega2 y = 0 at time t.
static Impulse lanes_impulse(long double omega2, long double damping, long double t) {
    Impulse out = {0, 0, 0};
    long double before = 0, term = t; // c_k t^k
    for (int k = 1; k < SERIES && fabsl(term) + fabsl(before * t) > 1e-23L * t; k++) {
        out.S += term;
        out.I1 += term * t / (k + 1);
        out.I2 += term * t * t / ((k + 1) * (k + 2));
        const long double next =
            -(damping * k * term * t + omega2 * before * t * t) / (k * (k + 1));
        before = term;
        term = next;
    }
    return out;
}

// One-interval map less the identity.
static void lanes_make_step(long double omega2, long double damping, long double h,
                            long double step[2][2]) {
    const Impulse one = lanes_impulse(omega2, damping, h);
    step[0][0] = -omega2 * one.I1;
    step[0][1] = one.S;
    step[1][0] = -omega2 * one.S;
    step[1][1] = -damping * one.S - omega2 * one.I1;
}

// What x and v have become from rest after time t under a_g = cos (column 0) or sin of omega t: a
// Taylor series.
static void lanes_sine_force(long double omega2, long double damping, long double omega,
                             long double t, long double out[2][2]) {
    for (int column = 0; column < 2; column++) {
        long double base[2] = {column == 0, column == 1 ? omega * t : 0}; // terms of a_g
        long double term[2] = {0, 0};                                     // of x
        long double x = 0, v = 0;
        for (int k = 0; k < SERIES; k++) {
            const long double next =
                -(damping * t * (k + 1) * term[1] + omega2 * t * t * term[0] + t * t * base[0]) /
                ((k + 1) * (k + 2));
            x += next;
            v += (k + 2) * next / t;
            term[0] = term[1];
            term[1] = next;
            const long double after = -omega * omega * t * t * base[0] / ((k + 1) * (k + 2));
            base[0] = base[1];
            base[1] = after;
        }
        out[0][column] = x;
        out[1][column] = v;
    }
}

static void lanes_sine_turn(long double angle, long double out[2]) {
    long double term = 1;
    out[0] = out[1] = 0;
    for (int k = 0; k < SERIES; k++, term *= angle / k)
        out[k % 2] += k % 4 < 2 ? term : -term;
}

// From rest under a sine, after 1 to 8 samples and 1 to 8 blocks, and how far it has turned.
static void lanes_follow_sine(long double omega2, long double damping, long double omega,
                              long double h, double near[3][2][LANES], double far[3][2][LANES]) {
    long double step[2][2], force[2][2], one[2], at[2][2] = {{0}}, turn[2] = {1, 0};
    lanes_make_step(omega2, damping, h, step);
    lanes_sine_force(omega2, damping, omega, h, force);
    lanes_sine_turn(omega * h, one);
    for (int j = 0; j < LANES * LANES; j++) {
        for (int column = 0; column < 2; column++) {
            // The sine as this interval's start sees it.
            const long double cosine = column == 0 ? turn[0] : turn[1];
            const long double sine = column == 0 ? -turn[1] : turn[0];
            const long double top = at[0][column], low = at[1][column];
            at[0][column] +=
                step[0][0] * top + step[0][1] * low + force[0][0] * cosine + force[0][1] * sine;
            at[1][column] +=
                step[1][0] * top + step[1][1] * low + force[1][0] * cosine + force[1][1] * sine;
        }
        const long double c = turn[0], s = turn[1];
        turn[0] = c * one[0] - s * one[1];
        turn[1] = s * one[0] + c * one[1];
        for (int column = 0; column < 2; column++) {
            const double values[3] = {(double)at[0][column], (double)at[1][column],
                                      (double)turn[column]};
            for (int i = 0; i < 3; i++) {
                if (j < LANES)
                    near[i][column][j] = values[i];
                if (j % LANES == LANES - 1)
                    far[i][column][j / LANES] = values[i];
            }
        }
    }
}

static void lanes_make_sine(Lanes *lanes) {
    double own[2][3][2][LANES], free_mass[2][3][2][LANES];
    LanesMap *const maps[2] = {&lanes->sample, &lanes->block};
    lanes_follow_sine(lanes->omega2, lanes->damping, lanes->base_omega, lanes->interval, own[0],
                      own[1]);
    lanes_follow_sine(0, 0, lanes->base_omega, lanes->interval, free_mass[0], free_mass[1]);
    for (int i = 0; i < 2; i++) {
        memcpy(maps[i]->x_s, own[i][0], sizeof maps[i]->x_s);
        memcpy(maps[i]->v_s, own[i][1], sizeof maps[i]->v_s);
        memcpy(maps[i]->turn, own[i][2], sizeof maps[i]->turn);
        memcpy(maps[i]->z_s, free_mass[i][0], sizeof maps[i]->z_s);
        memcpy(maps[i]->speed_s, free_mass[i][1], sizeof maps[i]->speed_s);
    }
}

static void lanes_multiply(long double step[2][2], long double vector[2]) {
    const long double top = vector[0], low = vector[1];
    vector[0] += step[0][0] * top + step[0][1] * low;
    vector[1] += step[1][0] * top + step[1][1] * low;
}

// Powers, less the identity, of a step of `length` that is given so; `step` becomes the last.
static void lanes_make_map(LanesMap *map, long double step[2][2], long double length) {
    long double one[2][2] = {{step[0][0], step[0][1]}, {step[1][0], step[1][1]}};
    for (int j = 0; j < LANES; j++) {
        for (int c = 0; c < 2 && j > 0; c++) {
            long double column[2] = {step[0][c], step[1][c]};
            lanes_multiply(one, column);
            step[0][c] = column[0] + one[0][c];
            step[1][c] = column[1] + one[1][c];
        }
        map->x_x[j] = (double)step[0][0];
        map->x_v[j] = (double)step[0][1];
        map->v_x[j] = (double)step[1][0];
        map->v_v[j] = (double)step[1][1];
        map->time[j] = (double)((j + 1) * length);
    }
}

// What the base's samples give.
static void lanes_make_base(Lanes *lanes) {
    const long double h = lanes->interval;
    const Impulse one = lanes_impulse(lanes->omega2, lanes->damping, h);
    long double step[2][2];
    lanes_make_step(lanes->omega2, lanes->damping, h, step);
    // What the base's two ends give over one interval, carried on.
    long double first[2] = {one.I2 / h - one.I1, one.I1 / h - one.S};
    long double last[2] = {-one.I2 / h, -one.I1 / h};
    for (int j = 0; j < LANES; j++) {
        // Lane l sees sample i through the interval after it, l - i intervals on, and through the
        // one before it.
        for (int i = 0; i + j < LANES; i++) {
            lanes->x_a[i][i + j] += (double)first[0];
            lanes->v_a[i][i + j] += (double)first[1];
            lanes->x_a[i + 1][i + j] += (double)last[0];
            lanes->v_a[i + 1][i + j] += (double)last[1];
        }
        for (int i = 0; i <= j + 1; i++) {
            const bool is_end = i == 0 || i == j + 1;
            lanes->speed_a[i][j] = (double)(is_end ? -h / 2 : -h);
            lanes->z_a[i][j] = (double)(i == 0       ? -h * h * ((j + 1) / 2.0L - 1.0L / 6)
                                        : i == j + 1 ? -h * h / 6
                                                     : -h * h * (j + 1 - i));
        }
        lanes_multiply(step, first);
        lanes_multiply(step, last);
    }
}

// Integrals over an interval in terms of its end: time runs backwards, damping drives. Gauss-
// Legendre with five points, right to rounding for intervals this short.
static void lanes_make_forms(Lanes *lanes) {
    static const double node[5] = {0.04691007703066800, 0.2307653449471585, 0.5, 0.7692346550528415,
                                   0.9530899229693320};
    static const double weight[5] = {0.1184634425280945, 0.2393143352496832, 0.2844444444444444,
                                     0.2393143352496832, 0.1184634425280945};
    const double W = lanes->omega2, D = lanes->damping, interval = lanes->interval;
    for (int i = 0; i < 5; i++) {
        const Impulse back = lanes_impulse(W, -(long double)D, (long double)interval * node[i]);
        const double S = (double)back.S, I1 = (double)back.I1;
        const double x = W * S, v = 1 + D * S - W * I1, h = weight[i] * interval;
        double a = I1 / interval, b = S - a, from = node[i], to = 1 - node[i];
        if (lanes->base_omega > 0) {
            long double force[2][2], turn[2];
            lanes_sine_force(W, -(long double)D, lanes->base_omega, (long double)interval * node[i],
                             force);
            lanes_sine_turn((long double)lanes->base_omega * interval * node[i], turn);
            b = (double)-force[1][0];
            a = (double)force[1][1];
            to = (double)turn[0];
            from = (double)-turn[1];
        }
        const double vv[LANE_SUMS] = {x * x,     2 * x * v, v * v, 2 * x * b, 2 * x * a,
                                      2 * v * b, 2 * v * a, b * b, 2 * a * b, a * a};
        const double av[LANE_SUMS] = {
            0, 0, 0, x * to, x * from, v * to, v * from, b * to, a * to + b * from, a * from};
        for (int s = 0; s < LANE_SUMS; s++) {
            lanes->vv[s] += h * vv[s];
            lanes->av[s] += h * av[s];
        }
    }
}

static void lanes_make_tables(Lanes *lanes) {
    long double step[2][2];
    lanes_make_step(lanes->omega2, lanes->damping, lanes->interval, step);
    lanes_make_map(&lanes->sample, step, lanes->interval);
    lanes_make_map(&lanes->block, step, (long double)LANES * lanes->interval);
    if (lanes->base_omega > 0)
        lanes_make_sine(lanes);
    else
        lanes_make_base(lanes);
    lanes_make_forms(lanes);
}

void lanes_make(Lanes *lanes, const Motion *flying, double base_omega, double interval,
                LanesWidth width) {
    memset(lanes, 0, sizeof *lanes);
    const double omega = sqrt(flying->omega2);
    if (!(LANES * interval * lanes_greater(lanes_greater(omega, flying->damping), base_omega) <= 1))
        return;
    lanes->base_omega = base_omega;
    lanes->interval = interval;
    lanes->per_interval = 1 / interval;
    lanes->omega2 = flying->omega2;
    lanes->damping = flying->damping;
    lanes->omega = omega;
    lanes_make_tables(lanes);
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
