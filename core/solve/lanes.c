// With S the structure's response to a unit impulse and I1, I2 its integrals, a base of a + s t
// moves it over t as
//   x(t) = (1 - W I1) x + S v - I1 a - I2 s,   v(t) = -W S x + (1 - D S - W I1) v - S a - I1 s.
// Powers of that one-interval map give the state after 1 to 8 samples as a few products each; only
// the last of them is waited for by the next block. Products and sums are of one lane each and none
// are contracted, so every width of vector gives the same bytes.
#include "core/solve/lanes.h"

#include <math.h>
#include <string.h>

#define INLINE static inline __attribute__((always_inline))

typedef double Vector __attribute__((vector_size(64)));
typedef double Loose __attribute__((vector_size(64), aligned(8), may_alias)); // anywhere in memory

enum { SERIES = 24 };

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
        const long double next = -(damping * k * term * t + omega2 * before * t * t) / (k * (k + 1));
        before = term;
        term = next;
    }
    return out;
}

static void make_powers(Lanes *lanes, const Motion *flying, double interval) {
    const long double W = flying->omega2, D = flying->damping, h = interval;
    const Impulse one = impulse_at(W, D, h);
    const long double step[2][2] = {{-W * one.I1, one.S}, {-W * one.S, -D * one.S - W * one.I1}};
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
        const double x = W * S, v = 1 + D * S - W * I1, a = I1 / interval, b = S - a;
        const double h = weight[i] * interval, from = node[i], to = 1 - node[i];
        const double vv[LANE_SUMS] = {x * x,     2 * x * v, v * v, 2 * x * b, 2 * x * a,
                                      2 * v * b, 2 * v * a, b * b, 2 * a * b, a * a};
        const double av[LANE_SUMS] = {0,        0,        0,      x * to,              x * from,
                                      v * to, v * from, b * to, a * to + b * from, a * from};
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

// What can be said of a block beforehand.
typedef struct Bounds {
    double push, bend; // |r''| and |x''| are not larger [m/s^2]
} Bounds;

// |v| + Omega |x| grows by the base alone.
INLINE Bounds bounds_of(const Lanes *t, double x, double v, double base_most) {
    const double reach =
        size(v) + t->omega * size(x) + LANES * t->interval * base_most;
    const double push = (t->damping + t->omega) * reach;
    return (Bounds){push, push + base_most};
}

INLINE bool is_inside(const Stretch *s, double r, double sag) {
    return r < s->right - sag && r > sag - s->left;
}

static void look_for_peaks(const Lanes *t, Stretch *s, size_t count, const double *x,
                           const double *v, const double *r) {
    Peaks peaks = *s->peaks;
    for (size_t j = 0; j < count; j++) {
        peaks.displacement = larger(peaks.displacement, size(x[j]));
        peaks.velocity = larger(peaks.velocity, size(v[j]));
        peaks.acceleration = larger(peaks.acceleration, size(t->damping * v[j] + t->omega2 * x[j]));
        if (s->right < INFINITY)
            peaks.damper_displacement =
                larger(peaks.damper_displacement, size(x[j] + (s->middle + r[j])));
    }
    *s->peaks = peaks;
}

static void store_means(const Lanes *t, double *column, size_t count, double before,
                        const double *v, const double *a) {
    for (size_t j = 0; j < count; j++) {
        const double base = a == NULL ? 0 : t->interval * (a[j] + a[j + 1]) / 2;
        column[j] = (v[j] - (j == 0 ? before : v[j - 1]) + base) / t->interval;
    }
}

// The last intervals before a stop or the end, one after the other.
static __attribute__((noinline)) size_t careful(const Lanes *t, Stretch *s, size_t sample,
                                                size_t most, const double *base) {
    double a[LANES + 1] = {0}, x[LANES], v[LANES], r[LANES], z[LANES];
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
        dx += t->x_x[j] * s->x + t->x_v[j] * s->v;
        dv += t->v_x[j] * s->x + t->v_v[j] * s->v;
        dz += t->time[j] * s->z;
        x[j] = s->x + dx;
        v[j] = s->v + dv;
        r[j] = s->r + (dz - dx);
        z[j] = s->z + speed;
    }
    const Bounds bounds = bounds_of(t, s->x, s->v, s->base_most);
    const double sag = t->interval * t->interval / 8 * bounds.push;
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
        const double of[4] = {x[j], v[j], a[j + 1], a[j]};
        for (int p = 0, n = 0; p < 4; p++) {
            static const LaneSum sums[4][4] = {
                {XX, XV, XB, XA}, {XV, VV, VB, VA}, {XB, VB, BB, AB}, {XA, VA, AB, AA}};
            for (int q = p; q < 4; q++, n++)
                s->sums[sums[p][q]][j] += of[p] * of[q];
        }
    }
    if (s->columns[CHANNEL_MEAN_ACCELERATION] != NULL)
        store_means(t, s->columns[CHANNEL_MEAN_ACCELERATION] + sample + 1, count, s->v, v,
                    base == NULL ? NULL : a);
    look_for_peaks(t, s, count, x, v, r);
    s->x = x[count - 1];
    s->v = v[count - 1];
    s->r = r[count - 1];
    s->z = z[count - 1];
    return count;
}

#define AT(column) (*(Loose *)(column))
#define LOAD(values) (*(const Vector *)(values))

// As many whole blocks as surely stay clear.
INLINE size_t fly_blocks(const Lanes *t, Stretch *s, size_t sample, size_t count, const double *a,
                         bool is_still) {
    const double h = t->interval, W = t->omega2, D = t->damping;
    const double sagging = LANES * LANES * h * h / 8;
    double *const cx = s->columns[CHANNEL_DISPLACEMENT], *const cv = s->columns[CHANNEL_VELOCITY];
    double *const ca = s->columns[CHANNEL_ACCELERATION];
    double *const cd = s->columns[CHANNEL_DAMPER_DISPLACEMENT];
    double *const cz = s->columns[CHANNEL_DAMPER_VELOCITY];
    double *const cm = s->columns[CHANNEL_MEAN_ACCELERATION];
    const bool has_damper = s->right < INFINITY;
    const double middle = s->middle;
    double x = s->x, v = s->v, r = s->r, z = s->z;
    size_t done = 0;
    Vector sums[LANE_SUMS];
    for (int i = 0; i < (is_still ? 3 : LANE_SUMS); i++)
        sums[i] = LOAD(s->sums[i]);
    for (; done + LANES <= count; done += LANES) {
        Vector fx = {0}, fv = {0}, fz = {0};
        double z8 = z;
        if (!is_still) {
            fx = LOAD(t->x_a[0]) * a[0];
            fv = LOAD(t->v_a[0]) * a[0];
            fz = LOAD(t->z_a[0]) * a[0];
            for (int i = 1; i <= LANES; i++) {
                fx += LOAD(t->x_a[i]) * a[i];
                fv += LOAD(t->v_a[i]) * a[i];
                fz += LOAD(t->z_a[i]) * a[i];
            }
            z8 = z - h * (((a[0] + a[8]) * 0.5 + (a[1] + a[2])) + ((a[3] + a[4]) + (a[5] + a[6])) +
                          a[7]);
        }
        double dx8 = t->x_x[7] * x + t->x_v[7] * v, dv8 = t->v_x[7] * x + t->v_v[7] * v;
        double dz8 = t->time[7] * z;
        Vector dx = LOAD(t->x_x) * x + LOAD(t->x_v) * v;
        Vector dv = LOAD(t->v_x) * x + LOAD(t->v_v) * v;
        Vector dz = LOAD(t->time) * z;
        if (!is_still) {
            dx8 = fx[7] + dx8;
            dv8 = fv[7] + dv8;
            dz8 = fz[7] + dz8;
            dx = fx + dx;
            dv = fv + dv;
            dz = fz + dz;
        }
        const double x8 = x + dx8, v8 = v + dv8, r8 = r + (dz8 - dx8);
        const Bounds bounds = bounds_of(t, x, v, s->base_most);
        const double sag = sagging * bounds.push;
        if (has_damper && !(is_inside(s, r, sag) && is_inside(s, r8, sag)))
            break;
        const Vector X = x + dx, V = v + dv, R = r + (dz - dx);
        if (cx != NULL)
            AT(cx + sample + done + 1) = X;
        if (cv != NULL)
            AT(cv + sample + done + 1) = V;
        if (ca != NULL)
            AT(ca + sample + done + 1) = -(D * V + W * X);
        if (cd != NULL)
            AT(cd + sample + done + 1) = X + (middle + R);
        if (cz != NULL) {
            Vector speed = {0};
            for (int i = 0; i <= LANES && !is_still; i++)
                speed += LOAD(t->speed_a[i]) * a[i];
            AT(cz + sample + done + 1) = z + speed;
        }
        // Peaks by a bound; only a block that may hold one is looked through.
        const double most_x = larger(size(x), size(x8)) + sagging * bounds.bend;
        const double most_v = larger(size(v), size(v8)) + LANES / 2 * h * bounds.bend;
        const double most_d = larger(size(x + (middle + r)), size(x8 + (middle + r8))) +
                              (is_still ? 0 : sagging * s->base_most);
        const bool has_peak = (most_x > s->peaks->displacement) | (most_v > s->peaks->velocity) |
                              (D * most_v + W * most_x > s->peaks->acceleration) |
                              (has_damper & (most_d > s->peaks->damper_displacement));
        if (has_peak || cm != NULL) {
            _Alignas(64) double xs[LANES], vs[LANES], rs[LANES];
            *(Vector *)xs = X;
            *(Vector *)vs = V;
            *(Vector *)rs = R;
            if (has_peak)
                look_for_peaks(t, s, LANES, xs, vs, rs);
            if (cm != NULL)
                store_means(t, cm + sample + done + 1, LANES, v, vs, is_still ? NULL : a);
        }
        sums[XX] += X * X;
        sums[XV] += X * V;
        sums[VV] += V * V;
        if (!is_still) {
            const Vector A = AT((double *)a), B = AT((double *)a + 1);
            sums[XB] += X * B;
            sums[XA] += X * A;
            sums[VB] += V * B;
            sums[VA] += V * A;
            sums[BB] += B * B;
            sums[AB] += A * B;
            sums[AA] += A * A;
            a += LANES;
        }
        x = x8;
        v = v8;
        r = r8;
        z = z8;
    }
    for (int i = 0; i < (is_still ? 3 : LANE_SUMS); i++)
        *(Vector *)s->sums[i] = sums[i];
    s->x = x;
    s->v = v;
    s->r = r;
    s->z = z;
    return done;
}

INLINE size_t run(const Lanes *lanes, Stretch *stretch, size_t sample, size_t count,
                  const double *base) {
    size_t done = 0;
    for (;;) {
        done += base == NULL
                    ? fly_blocks(lanes, stretch, sample + done, count - done, NULL, true)
                    : fly_blocks(lanes, stretch, sample + done, count - done, base + done, false);
        const size_t left = count - done, most = left < LANES ? left : LANES;
        const size_t more = left == 0 ? 0
                                      : careful(lanes, stretch, sample + done, most,
                                                base == NULL ? NULL : base + done);
        done += more;
        if (more < most || done == count)
            return done;
    }
}

size_t lanes_run_plain(const Lanes *lanes, Stretch *stretch, size_t sample, size_t count,
                       const double *base) {
    return run(lanes, stretch, sample, count, base);
}

#ifdef __x86_64__
__attribute__((target("avx2"))) static size_t run_avx2(const Lanes *lanes, Stretch *stretch,
                                                       size_t sample, size_t count,
                                                       const double *base) {
    return run(lanes, stretch, sample, count, base);
}

__attribute__((target("avx512f,avx512dq,prefer-vector-width=512"))) static size_t
run_avx512(const Lanes *lanes, Stretch *stretch, size_t sample, size_t count, const double *base) {
    return run(lanes, stretch, sample, count, base);
}
#endif

// The widest the processor has: all give the same bytes.
static LanesRun *choose(void) {
#ifdef __x86_64__
    if (__builtin_cpu_supports("avx512f") && __builtin_cpu_supports("avx512dq"))
        return run_avx512;
    if (__builtin_cpu_supports("avx2"))
        return run_avx2;
#endif
    return lanes_run_plain;
}

void lanes_make(Lanes *lanes, const Motion *flying, double interval) {
    memset(lanes, 0, sizeof *lanes);
    const double omega = sqrt(flying->omega2);
    if (!(LANES * interval * (omega > flying->damping ? omega : flying->damping) <= 1))
        return;
    lanes->interval = interval;
    lanes->omega2 = flying->omega2;
    lanes->damping = flying->damping;
    lanes->omega = omega;
    make_powers(lanes, flying, interval);
    make_forms(lanes, flying, interval);
    lanes->run = choose();
}

void lanes_take_sums(Stretch *stretch, double sums[LANE_SUMS]) {
    for (int i = 0; i < LANE_SUMS; i++) {
        const double *s = stretch->sums[i];
        sums[i] = ((s[0] + s[4]) + (s[2] + s[6])) + ((s[1] + s[5]) + (s[3] + s[7]));
    }
    memset(stretch->sums, 0, sizeof stretch->sums);
}
