#include "core/solve/exact_ride.h"

#include <math.h>

#define INLINE static inline __attribute__((always_inline))

enum { RIDE = PULSE_RIDE };

typedef double Eight __attribute__((vector_size(8 * RIDE)));
typedef double Loose __attribute__((vector_size(8 * RIDE), aligned(8), may_alias)); // anywhere
#define LOAD(values) (*(const Loose *)(values))
#define STORE(values, eight) (*(Loose *)(values) = (eight))

// LOAD(ones + RIDE - count) is 1 for the first `count`, and 0.
static const double ones[2 * RIDE] = {1, 1, 1, 1, 1, 1, 1, 1};

// The samples of a ride, each with the amplitudes from there on.
typedef struct Ride {
    double d[4][RIDE + 1], a[RIDE + 1], s[RIDE + 1];
    double x[RIDE], v[RIDE], r[RIDE], w[RIDE], n[RIDE], rate[RIDE];
    double bend; // |r''| is not larger
} Ride;

INLINE double largest(const double *values, double least) {
    double most[RIDE / 2];
    for (size_t j = 0; j < RIDE / 2; j++) {
        const double a = fabs(values[j]), b = fabs(values[j + RIDE / 2]);
        most[j] = a > b ? a : b;
    }
    const double a = most[0] > most[1] ? most[0] : most[1];
    const double b = most[2] > most[3] ? most[2] : most[3], all = a > b ? a : b;
    return all > least ? all : least;
}

// All eight straight from the beginning: what each jump of the base's slope leaves is the same, but
// later.
INLINE void turn(const Press *press, Ride *ride, const double *base) {
    const Pulse *p = press->pulse;
    const double *d = press->d;
    Eight jump = {0};
    if (base == NULL) {
        STORE(ride->a + 1, jump);
        STORE(ride->s + 1, jump);
    } else {
        const double rate = press->exact->plan->sample_rate;
        const Eight slope = (LOAD(base + 2) - LOAD(base + 1)) * rate;
        jump = slope - (LOAD(base + 1) - LOAD(base)) * rate;
        jump[0] = slope[0] - press->slope;
        STORE(ride->a + 1, LOAD(base + 1));
        STORE(ride->s + 1, slope);
    }
    ride->a[0] = press->a;
    ride->s[0] = press->slope;
    double lane[4][RIDE];
    for (int i = 0; i < 4; i += 2) {
        Eight re = LOAD(p->ride[i]) * d[i] - LOAD(p->ride[i + 1]) * d[i + 1];
        Eight im = LOAD(p->ride[i]) * d[i + 1] + LOAD(p->ride[i + 1]) * d[i];
        for (int k = 0; k < RIDE && base != NULL; k++) {
            re += LOAD(p->jumps[i] + RIDE - k) * jump[k];
            im += LOAD(p->jumps[i + 1] + RIDE - k) * jump[k];
        }
        ride->d[i][0] = d[i];
        ride->d[i + 1][0] = d[i + 1];
        STORE(ride->d[i] + 1, re);
        STORE(ride->d[i + 1] + 1, im);
        STORE(lane[i], re);
        STORE(lane[i + 1], im);
    }
    // Taken from what is at hand: a load across the stores above would wait for them.
    double bend[RIDE];
    for (int j = 0; j < RIDE; j++)
        bend[j] = p->size2[0] * (fabs(lane[0][j]) + fabs(lane[1][j])) +
                  p->size2[1] * (fabs(lane[2][j]) + fabs(lane[3][j]));
    ride->bend = largest(bend, p->size2[0] * (fabs(d[0]) + fabs(d[1])) +
                                   p->size2[1] * (fabs(d[2]) + fabs(d[3])));
}

INLINE void see(const Ride *ride, const PulseRow *row, double out[RIDE]) {
    for (int j = 0; j < RIDE; j++)
        out[j] = ((row->d[0] * ride->d[0][j + 1] + row->d[1] * ride->d[1][j + 1]) +
                  (row->d[2] * ride->d[2][j + 1] + row->d[3] * ride->d[3][j + 1])) +
                 (row->a * ride->a[j + 1] + row->s * ride->s[j + 1]);
}

INLINE void set_start(Press *press, const Ride *ride, size_t j) {
    for (int i = 0; i < 4; i++)
        press->d[i] = ride->d[i][j];
    press->a = ride->a[j];
    press->slope = ride->s[j];
}

// How many intervals surely belong to the contact and show its peaks.
INLINE size_t count_clear(Press *press, const Ride *ride) {
    const Exact *exact = press->exact;
    const double sag = ride->bend * exact->interval * exact->interval / 8;
    const double speed = ride->bend * exact->interval;
    double r = press->sign * exact->state.r, w = exact->state.w;
    double rate = press->sign * pulse_see(&press->pulse->n_rate, press->d, 0, press->slope);
    size_t clear = 0;
    int near = 0, rising = 0, falling = 0;
    for (int j = 0; j < RIDE; j++) {
        near += !(press->sign * ride->r[j] > sag);
        rising += press->sign * ride->rate[j] > 0;
        falling += press->sign * ride->rate[j] < 0;
    }
    if (near == 0 && r > sag && (rate > 0 ? rising == RIDE : falling == RIDE))
        return RIDE;
    for (; clear < RIDE; clear++) {
        const double next = press->sign * ride->r[clear], next_w = ride->w[clear];
        const double next_rate = press->sign * ride->rate[clear];
        const bool is_inside = (next > sag && r > sag) ||
                               (next > 0 && r > 0 && (fabs(w) > speed || fabs(next_w) > speed));
        if (!is_inside || (rate <= 0 && next_rate >= 0))
            break;
        if (rate > 0 && next_rate < 0) {
            set_start(press, ride, clear);
            const bool is_found = press_find_peak(
                press, exact->interval * rate / (rate - next_rate), exact->interval);
            set_start(press, ride, 0);
            if (!is_found)
                break;
        }
        r = next;
        w = next_w;
        rate = next_rate;
    }
    return clear;
}

// What each interval adds.
typedef struct Gains {
    double swing[RIDE], v[RIDE], w[RIDE], base[RIDE], work[RIDE];
} Gains;

INLINE void see_gains(const Press *press, const Ride *ride, Gains *gains) {
    const Exact *exact = press->exact;
    const Pulse *p = press->pulse;
    const double h = exact->interval, mass = exact->damper->mass;
    const double total = exact->plan->mass[0] + mass;
    double x0[RIDE] = {exact->state.x}, r0[RIDE] = {exact->state.r};
    for (int j = 1; j < RIDE; j++) {
        x0[j] = ride->x[j - 1];
        r0[j] = ride->r[j - 1];
    }
    for (int j = 0; j < RIDE; j++) {
        const double s = ride->s[j], a = ride->a[j], b = ride->a[j + 1];
        const double jump = ride->s[j + 1] - s, own = (a + b) / 2 * h;
        const double v = p->v.s * s, w = p->w.s * s;
        double x = p->x.a * own + p->x.s * s * h, r = p->r.a * own + p->r.s * s * h;
        double dv = -jump * p->vv.jump2, dw = -jump * p->ww.jump2;
        for (int i = 0; i < 4; i++) {
            const double end = ride->d[i][j + 1], change = end - jump * p->jump[i] - ride->d[i][j];
            x += p->x_sum.d[i] * change;
            r += p->r_sum.d[i] * change;
            dv += p->vv.jump[i] * end;
            dw += p->ww.jump[i] * end;
        }
        gains->swing[j] = ride->d[0][j] * ride->d[0][j] + ride->d[1][j] * ride->d[1][j];
        gains->v[j] = v * (2 * (ride->x[j] - x0[j]) - v * h) - jump * dv;
        gains->w[j] = w * (2 * (ride->r[j] - r0[j]) - w * h) - jump * dw;
        gains->base[j] = own;
        gains->work[j] = total * (b * ride->x[j] - a * x0[j] - s * x) +
                         mass * (b * ride->r[j] - a * r0[j] - s * r);
    }
}

INLINE void take_sums(Press *press, const Ride *ride, size_t count) {
    const Pulse *p = press->pulse;
    const double length = (double)count * press->exact->interval;
    const double *keep = ones + RIDE - count;
    Gains gains;
    see_gains(press, ride, &gains);
    double swing = 0, v = 0, w = 0, base = 0, work = 0;
    for (size_t j = 0; j < RIDE; j++) {
        swing += keep[j] * gains.swing[j];
        v += keep[j] * gains.v[j];
        w += keep[j] * gains.w[j];
        base += keep[j] * gains.base[j];
        work += keep[j] * gains.work[j];
    }
    const double unit[4] = {1, 0, 0, 0};
    const double slow = swing * pulse_slow(p, unit, press->exact->interval);
    press->vv += p->vv.slow * slow + v;
    press->ww += p->ww.slow * slow + w;
    press->work -= work;
    press->gained += base;
    press->length += length;
    press->elapsed += length;
}

INLINE void put(double *const *columns, ChannelId channel, size_t sample, const double *values) {
    if (columns[channel] != NULL)
        for (size_t j = 0; j < RIDE; j++)
            columns[channel][sample + j] = values[j];
}

// Those behind `count` are written as zeros, which is what the force is if the contact ends
// (0.0 makes -0 one).
INLINE void take_samples(Press *press, const Ride *ride, size_t count) {
    Exact *exact = press->exact;
    const Motion *m = &exact->flying;
    const double *keep = ones + RIDE - count;
    double x[RIDE], v[RIDE], acceleration[RIDE], z[RIDE], speed[RIDE], force[RIDE], depth[RIDE];
    const double mass = exact_effective_mass(exact);
    const double middle = exact_relative(exact) - exact->state.r;
    for (size_t j = 0; j < RIDE; j++) {
        x[j] = keep[j] * ride->x[j];
        v[j] = keep[j] * ride->v[j];
        const double own = m->damping * ride->v[j] + m->omega2 * ride->x[j];
        acceleration[j] = keep[j] * (m->share * ride->n[j] - own);
        z[j] = keep[j] * (ride->x[j] + (middle + ride->r[j]));
        speed[j] = ride->v[j] + ride->w[j];
        force[j] = keep[j] * (mass * ride->n[j]) + 0.0;
        depth[j] = keep[j] * (press->sign * ride->r[j]) + 0.0;
    }
    double *const *columns = exact->recorder.columns;
    const size_t at = exact->sample + 1;
    put(columns, CHANNEL_DISPLACEMENT, at, x);
    put(columns, CHANNEL_VELOCITY, at, v);
    put(columns, CHANNEL_ACCELERATION, at, acceleration);
    put(columns, CHANNEL_DAMPER_DISPLACEMENT, at, z);
    put(columns, CHANNEL_DAMPER_VELOCITY, at, speed);
    put(columns, CHANNEL_PENETRATION, at, depth);
    put(columns, CHANNEL_CONTACT_FORCE, at, force);
    Peaks *peaks = &exact->ledger.response->peaks;
    peaks->displacement = largest(x, peaks->displacement);
    peaks->velocity = largest(v, peaks->velocity);
    peaks->acceleration = largest(acceleration, peaks->acceleration);
    peaks->damper_displacement = largest(z, peaks->damper_displacement);
    ledger_force(&exact->ledger, &exact->row, largest(force, 0));
    if (exact->sample < exact->recorder.statistics_start)
        return;
    double xx = 0, aa = 0;
    for (size_t j = 0; j < RIDE; j++) {
        xx += x[j] * x[j];
        aa += acceleration[j] * acceleration[j];
    }
    recorder_sums(&exact->recorder, count, xx, aa);
}

INLINE size_t run(Press *press, size_t most) {
    Exact *exact = press->exact;
    const Pulse *p = press->pulse;
    const bool is_still = exact->stretch.base_most == 0;
    size_t done = 0;
    if (exact->recorder.columns[CHANNEL_MEAN_ACCELERATION] != NULL)
        return 0;
    if (exact->sample < exact->recorder.statistics_start &&
        most > exact->recorder.statistics_start - 1 - exact->sample)
        most = exact->recorder.statistics_start - 1 - exact->sample;
    while (done + RIDE <= most) {
        Ride ride;
        if (!is_still && exact->sample + RIDE + 1 >= exact->run->base->count)
            break;
        turn(press, &ride, is_still ? NULL : exact->run->base->values + exact->sample);
        see(&ride, &p->x, ride.x);
        see(&ride, &p->v, ride.v);
        see(&ride, &p->r, ride.r);
        see(&ride, &p->w, ride.w);
        see(&ride, &p->n, ride.n);
        see(&ride, &p->n_rate, ride.rate);
        const size_t count = count_clear(press, &ride);
        if (count == 0)
            break;
        take_sums(press, &ride, count);
        take_samples(press, &ride, count);
        set_start(press, &ride, count);
        exact->state =
            (State){ride.x[count - 1], ride.v[count - 1], ride.r[count - 1], ride.w[count - 1]};
        exact->sample += count;
        exact->run->steps += (double)count;
        exact->recorder.last_velocity = exact->state.v;
        done += count;
        if (count < RIDE)
            break;
    }
    return done;
}

static size_t run_plain(Press *press, size_t most) {
    return run(press, most);
}

#ifdef __x86_64__
__attribute__((target("avx2"))) static size_t run_avx2(Press *press, size_t most) {
    return run(press, most);
}

__attribute__((target("avx512f,avx512dq"))) static size_t run_avx512(Press *press, size_t most) {
    return run(press, most);
}
#endif

size_t press_ride(Press *press, size_t most) {
#ifdef __x86_64__
    if (press->exact->lanes.width == LANES_AVX512)
        return run_avx512(press, most);
    if (press->exact->lanes.width == LANES_AVX2)
        return run_avx2(press, most);
#endif
    return run_plain(press, most);
}
