// With S the structure's response to a unit impulse and I1, I2 its integrals, a base of a + s t
// moves it over t as
//   x(t) = (1 - W I1) x + S v - I1 a - I2 s,   v(t) = -W S x + (1 - D S - W I1) v - S a - I1 s.
// Powers of that one-interval map give the state after 1 to 8 samples as a few products each; only
// the last of them is waited for by the next block. Products and sums are of one lane each and none
// are contracted, so every width of vector gives the same bytes.
#include "core/solve/lanes.h"

#include <math.h>
#include <stdint.h>
#include <string.h>

#define INLINE static inline __attribute__((always_inline))

enum { SERIES = 24, GROUP = 8 };

typedef struct Impulse {
    long double S, I1, I2;
} Impulse;

// Of y'' + damping y' + omega2 y = 0 at time t.
static Impulse impulse_at(long double omega2, long double damping, long double t) {
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
static void make_step(long double omega2, long double damping, long double h,
                      long double step[2][2]) {
    const Impulse one = impulse_at(omega2, damping, h);
    step[0][0] = -omega2 * one.I1;
    step[0][1] = one.S;
    step[1][0] = -omega2 * one.S;
    step[1][1] = -damping * one.S - omega2 * one.I1;
}

// What x and v have become from rest after time t under a_g = cos (column 0) or sin of omega t: a
// Taylor series.
static void force_by_sine(long double omega2, long double damping, long double omega, long double t,
                          long double out[2][2]) {
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

static void turn_by_sine(long double angle, long double out[2]) {
    long double term = 1;
    out[0] = out[1] = 0;
    for (int k = 0; k < SERIES; k++, term *= angle / k)
        out[k % 2] += k % 4 < 2 ? term : -term;
}

// From rest under a sine, after 1 to 8 intervals.
static void follow_sine(long double omega2, long double damping, long double omega, long double h,
                        double x[2][LANES], double v[2][LANES]) {
    long double step[2][2], force[2][2], one[2], at[2][2] = {{0}}, turn[2] = {1, 0};
    make_step(omega2, damping, h, step);
    force_by_sine(omega2, damping, omega, h, force);
    turn_by_sine(omega * h, one);
    for (int j = 0; j < LANES; j++) {
        for (int column = 0; column < 2; column++) {
            // The sine as this interval's start sees it.
            const long double cosine = column == 0 ? turn[0] : turn[1];
            const long double sine = column == 0 ? -turn[1] : turn[0];
            const long double top = at[0][column], low = at[1][column];
            at[0][column] +=
                step[0][0] * top + step[0][1] * low + force[0][0] * cosine + force[0][1] * sine;
            at[1][column] +=
                step[1][0] * top + step[1][1] * low + force[1][0] * cosine + force[1][1] * sine;
            x[column][j] = (double)at[0][column];
            v[column][j] = (double)at[1][column];
        }
        const long double c = turn[0], s = turn[1];
        turn[0] = c * one[0] - s * one[1];
        turn[1] = s * one[0] + c * one[1];
    }
}

static void make_sine(Lanes *lanes, const Motion *flying, double interval) {
    const long double omega = lanes->base_omega;
    follow_sine(flying->omega2, flying->damping, omega, interval, lanes->x_s, lanes->v_s);
    follow_sine(0, 0, omega, interval, lanes->z_s, lanes->speed_s);
    for (int j = 0; j < LANES; j++) {
        long double turn[2];
        turn_by_sine(omega * interval * (j + 1), turn);
        lanes->turn[0][j] = (double)turn[0];
        lanes->turn[1][j] = (double)turn[1];
    }
}

static void make_powers(Lanes *lanes, const Motion *flying, double interval) {
    const long double W = flying->omega2, D = flying->damping, h = interval;
    const Impulse one = impulse_at(W, D, h);
    long double step[2][2];
    make_step(W, D, h, step);
    // Powers less the identity, and what the base's two ends give over one interval, carried on.
    long double power[2][2] = {{step[0][0], step[0][1]}, {step[1][0], step[1][1]}};
    long double first[2] = {one.I2 / h - one.I1, one.I1 / h - one.S};
    long double last[2] = {-one.I2 / h, -one.I1 / h};
    for (int j = 0; j < LANES; j++) {
        lanes->x_x[j] = (double)power[0][0];
        lanes->x_v[j] = (double)power[0][1];
        lanes->v_x[j] = (double)power[1][0];
        lanes->v_v[j] = (double)power[1][1];
        lanes->time[j] = (double)((j + 1) * h);
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
        for (int c = 0; c < 2; c++) {
            const long double top = power[0][c], low = power[1][c];
            power[0][c] += step[0][0] * top + step[0][1] * low + step[0][c];
            power[1][c] += step[1][0] * top + step[1][1] * low + step[1][c];
        }
        long double *const pair[2] = {first, last};
        for (int p = 0; p < 2; p++) {
            const long double top = pair[p][0], low = pair[p][1];
            pair[p][0] += step[0][0] * top + step[0][1] * low;
            pair[p][1] += step[1][0] * top + step[1][1] * low;
        }
    }
}

// Integrals over an interval in terms of its end: time runs backwards, damping drives. Gauss-
// Legendre with five points, right to rounding for intervals this short.
static void make_forms(Lanes *lanes, const Motion *flying, double interval) {
    static const double node[5] = {0.04691007703066800, 0.2307653449471585, 0.5, 0.7692346550528415,
                                   0.9530899229693320};
    static const double weight[5] = {0.1184634425280945, 0.2393143352496832, 0.2844444444444444,
                                     0.2393143352496832, 0.1184634425280945};
    const double W = flying->omega2, D = flying->damping;
    for (int i = 0; i < 5; i++) {
        const Impulse back = impulse_at(W, -(long double)D, (long double)interval * node[i]);
        const double S = (double)back.S, I1 = (double)back.I1;
        const double x = W * S, v = 1 + D * S - W * I1, h = weight[i] * interval;
        double a = I1 / interval, b = S - a, from = node[i], to = 1 - node[i];
        if (lanes->base_omega > 0) {
            long double force[2][2], turn[2];
            force_by_sine(W, -(long double)D, lanes->base_omega, (long double)interval * node[i],
                          force);
            turn_by_sine((long double)lanes->base_omega * interval * node[i], turn);
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

INLINE double larger(double a, double b) {
    return a > b ? a : b;
}

INLINE double size(double a) {
    return __builtin_fabs(a);
}

// |r''| over a block or more is not larger [m/s^2]: |v| + Omega |x| grows by the base alone.
INLINE double push_bound(const Lanes *t, double x, double v, size_t count, double base_most) {
    const double reach = size(v) + t->omega * size(x) + (double)count * t->interval * base_most;
    return (t->damping + t->omega) * reach;
}

INLINE bool is_inside(const Stretch *s, double r, double sag) {
    return r < s->right - sag && r > sag - s->left;
}

// Eight side by side; what is behind `count` is filled up with the first.
INLINE void look_for_peaks(const Lanes *t, Stretch *s, size_t count, const double *x,
                           const double *v, const double *r) {
    double most[4][LANES] = {{0}};
    for (size_t from = 0; from < count; from += LANES) {
        double here[3][LANES];
        for (size_t j = 0; j < LANES; j++) {
            const size_t k = from + j < count ? from + j : from;
            here[0][j] = x[k];
            here[1][j] = v[k];
            here[2][j] = r[k];
        }
        for (size_t j = 0; j < LANES; j++) {
            const double X = here[0][j], V = here[1][j];
            most[0][j] = larger(size(X), most[0][j]);
            most[1][j] = larger(size(V), most[1][j]);
            most[2][j] = larger(size(t->damping * V + t->omega2 * X), most[2][j]);
            most[3][j] = larger(size(X + (s->middle + here[2][j])), most[3][j]);
        }
    }
    double *const peaks[4] = {&s->peaks->displacement, &s->peaks->velocity, &s->peaks->acceleration,
                              &s->peaks->damper_displacement};
    for (int i = 0; i < (s->right < INFINITY ? 4 : 3); i++)
        for (int j = 0; j < LANES; j++)
            *peaks[i] = larger(most[i][j], *peaks[i]);
}

// a_g's integrals over intervals that end at `count` samples: from b and a there (LaneSum) under a
// sine, else from a_g itself, from the sample before on, or NULL if it is still.
static void store_means(const Lanes *t, double *column, size_t count, double before,
                        const double *v, const double *b, const double *a) {
    for (size_t j = 0; j < count; j++) {
        double base = 0;
        if (t->base_omega > 0)
            base = t->speed_s[1][0] * a[j] - t->speed_s[0][0] * b[j];
        else if (b != NULL)
            base = t->interval * (a[j] + b[j]) / 2;
        column[j] = (v[j] - (j == 0 ? before : v[j - 1]) + base) / t->interval;
    }
}

// The states between the blocks of a group, and all its samples.
typedef struct Group {
    struct {
        double x, v, r, z;
        double b, a; // of a sine
    } state[GROUP + 1];
    _Alignas(64) double x[GROUP * LANES], v[GROUP * LANES], r[GROUP * LANES];
    double b[GROUP * LANES], a[GROUP * LANES]; // of a sine
} Group;

typedef enum BaseKind { STILL, LINEAR, SINE } BaseKind;

static void start_group(const Stretch *s, Group *group, size_t sample, BaseKind kind) {
    group->state[0].x = s->x;
    group->state[0].v = s->v;
    group->state[0].r = s->r;
    group->state[0].z = s->z;
    if (kind != SINE)
        return;
    Slice slice;
    (void)base_cursor_interval(s->base, sample, &slice);
    group->state[0].b = slice.value;
    group->state[0].a = slice.slope;
}

// What single samples add; b is NULL where the base is still.
static void add_samples(Stretch *s, size_t count, const double *x, const double *v, const double *b,
                        const double *a) {
    for (size_t j = 0; j < count; j++) {
        s->sums[XX][j] += x[j] * x[j];
        s->sums[XV][j] += x[j] * v[j];
        s->sums[VV][j] += v[j] * v[j];
        if (b == NULL)
            continue;
        s->sums[XB][j] += x[j] * b[j];
        s->sums[XA][j] += x[j] * a[j];
        s->sums[VB][j] += v[j] * b[j];
        s->sums[VA][j] += v[j] * a[j];
        s->sums[BB][j] += b[j] * b[j];
        s->sums[AB][j] += a[j] * b[j];
        s->sums[AA][j] += a[j] * a[j];
    }
}

// The last intervals before the end, fewer than a block.
static __attribute__((noinline)) size_t careful(const Lanes *t, Stretch *s, size_t sample,
                                                size_t most, const double *base) {
    double a[LANES + 1] = {0}, b[LANES] = {0}, x[LANES], v[LANES], r[LANES], z[LANES];
    const BaseKind kind = t->base_omega > 0 ? SINE : base != NULL ? LINEAR : STILL;
    Slice sine = {0, 0, 0};
    if (kind == SINE)
        (void)base_cursor_interval(s->base, sample, &sine);
    if (base != NULL)
        memcpy(a, base, (most + 1) * sizeof *a);
    for (int j = 0; j < LANES; j++) {
        double dx = 0, dv = 0, dz = 0, speed = 0;
        for (int i = 0; i <= LANES && base != NULL; i++) {
            dx += t->x_a[i][j] * a[i];
            dv += t->v_a[i][j] * a[i];
            dz += t->z_a[i][j] * a[i];
            speed += t->speed_a[i][j] * a[i];
        }
        if (kind == SINE) {
            dx = t->x_s[0][j] * sine.value + t->x_s[1][j] * sine.slope;
            dv = t->v_s[0][j] * sine.value + t->v_s[1][j] * sine.slope;
            dz = t->z_s[0][j] * sine.value + t->z_s[1][j] * sine.slope;
            speed = t->speed_s[0][j] * sine.value + t->speed_s[1][j] * sine.slope;
            b[j] = t->turn[0][j] * sine.value + t->turn[1][j] * sine.slope;
            a[j] = t->turn[0][j] * sine.slope - t->turn[1][j] * sine.value;
        } else {
            b[j] = a[j + 1];
        }
        dx += t->x_x[j] * s->x + t->x_v[j] * s->v;
        dv += t->v_x[j] * s->x + t->v_v[j] * s->v;
        dz += t->time[j] * s->z;
        x[j] = s->x + dx;
        v[j] = s->v + dv;
        r[j] = s->r + (dz - dx);
        z[j] = s->z + speed;
    }
    const double push = push_bound(t, s->x, s->v, LANES, s->base_most);
    const double sag = t->interval * t->interval / 8 * push;
    size_t count = 0;
    if (is_inside(s, s->r, sag))
        while (count < most && is_inside(s, r[count], sag))
            count++;
    if (count == 0)
        return 0;
    for (size_t j = 0; j < count; j++) {
        double *const *columns = s->columns;
        const size_t at = sample + 1 + j;
        if (columns[CHANNEL_DISPLACEMENT] != NULL)
            columns[CHANNEL_DISPLACEMENT][at] = x[j];
        if (columns[CHANNEL_VELOCITY] != NULL)
            columns[CHANNEL_VELOCITY][at] = v[j];
        if (columns[CHANNEL_ACCELERATION] != NULL)
            columns[CHANNEL_ACCELERATION][at] = -(t->damping * v[j] + t->omega2 * x[j]);
        if (columns[CHANNEL_DAMPER_DISPLACEMENT] != NULL)
            columns[CHANNEL_DAMPER_DISPLACEMENT][at] = x[j] + (s->middle + r[j]);
        if (columns[CHANNEL_DAMPER_VELOCITY] != NULL)
            columns[CHANNEL_DAMPER_VELOCITY][at] = z[j];
        if (columns[CHANNEL_BASE_ACCELERATION] != NULL)
            columns[CHANNEL_BASE_ACCELERATION][at] = b[j];
    }
    add_samples(s, count, x, v, kind == STILL ? NULL : b, a);
    if (s->columns[CHANNEL_MEAN_ACCELERATION] != NULL)
        store_means(t, s->columns[CHANNEL_MEAN_ACCELERATION] + sample + 1, count, s->v, v,
                    kind == STILL ? NULL : b, a);
    look_for_peaks(t, s, count, x, v, r);
    s->x = x[count - 1];
    s->v = v[count - 1];
    s->r = r[count - 1];
    s->z = z[count - 1];
    return count;
}

// Between the ends of a block nothing is further from them than this lets it be.
INLINE bool may_hold_peak(const Lanes *t, const Stretch *s, const Group *group, size_t count,
                          double sagging, double bend) {
    double x = 0, v = 0, d = 0;
    for (size_t b = 0; b <= count; b++) {
        x = larger(size(group->state[b].x), x);
        v = larger(size(group->state[b].v), v);
        d = larger(size(group->state[b].x + (s->middle + group->state[b].r)), d);
    }
    x += sagging * bend;
    v += LANES / 2 * t->interval * bend;
    d += sagging * s->base_most;
    return (x > s->peaks->displacement) | (v > s->peaks->velocity) |
           (t->damping * v + t->omega2 * x > s->peaks->acceleration) |
           ((s->right < INFINITY) & (d > s->peaks->damper_displacement));
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
    lanes->omega2 = flying->omega2;
    lanes->damping = flying->damping;
    lanes->omega = omega;
    make_powers(lanes, flying, interval);
    if (base_omega > 0)
        make_sine(lanes, flying, interval);
    make_forms(lanes, flying, interval);
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
