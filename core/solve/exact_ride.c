#include "core/solve/exact_ride.h"

#include <math.h>

#define INLINE static inline __attribute__((always_inline))

enum { RIDE = 8 };

// The samples of a ride, each with the amplitudes from there on.
typedef struct Ride {
    double d[4][RIDE + 1], a[RIDE + 1], s[RIDE + 1];
    double x[RIDE], v[RIDE], r[RIDE], w[RIDE], n[RIDE], rate[RIDE];
    double bend; // |r''| is not larger
} Ride;

INLINE void turn(const Press *press, Ride *ride, const double *base) {
    const Pulse *p = press->pulse;
    const double *t = p->interval, rate = press->exact->plan->sample_rate;
    double d[4] = {press->d[0], press->d[1], press->d[2], press->d[3]}, bend = 0;
    ride->a[0] = press->a;
    ride->s[0] = press->slope;
    for (int j = 0;; j++) {
        for (int i = 0; i < 4; i++)
            ride->d[i][j] = d[i];
        if (j == RIDE)
            break;
        const double here =
            p->size2[0] * (fabs(d[0]) + fabs(d[1])) + p->size2[1] * (fabs(d[2]) + fabs(d[3]));
        bend = here > bend ? here : bend;
        ride->a[j + 1] = base == NULL ? 0 : base[j + 1];
        ride->s[j + 1] = base == NULL ? 0 : (base[j + 2] - base[j + 1]) * rate;
        const double jump = ride->s[j + 1] - ride->s[j];
        const double re1 = t[0] * d[0] - t[1] * d[1], im1 = t[0] * d[1] + t[1] * d[0];
        const double re2 = t[2] * d[2] - t[3] * d[3], im2 = t[2] * d[3] + t[3] * d[2];
        d[0] = re1 + jump * p->jump[0];
        d[1] = im1 + jump * p->jump[1];
        d[2] = re2 + jump * p->jump[2];
        d[3] = im2 + jump * p->jump[3];
    }
    ride->bend = bend;
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
    Gains gains;
    see_gains(press, ride, &gains);
    double swing = 0, v = 0, w = 0, base = 0, work = 0;
    for (size_t j = 0; j < count; j++) {
        swing += gains.swing[j];
        v += gains.v[j];
        w += gains.w[j];
        base += gains.base[j];
        work += gains.work[j];
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

INLINE void put(double *const *columns, ChannelId channel, size_t sample, const double *values,
                size_t count) {
    if (columns[channel] != NULL)
        for (size_t j = 0; j < count; j++)
            columns[channel][sample + j] = values[j];
}

INLINE double largest(const double *values, size_t count, double least) {
    for (size_t j = 0; j < count; j++)
        least = fabs(values[j]) > least ? fabs(values[j]) : least;
    return least;
}

INLINE void take_samples(Press *press, const Ride *ride, size_t count) {
    Exact *exact = press->exact;
    const Motion *m = &exact->flying;
    double acceleration[RIDE], z[RIDE], speed[RIDE], force[RIDE], depth[RIDE];
    const double mass = exact_effective_mass(exact);
    const double middle = exact_relative(exact) - exact->state.r;
    for (int j = 0; j < RIDE; j++) {
        acceleration[j] =
            m->share * ride->n[j] - (m->damping * ride->v[j] + m->omega2 * ride->x[j]);
        z[j] = ride->x[j] + (middle + ride->r[j]);
        speed[j] = ride->v[j] + ride->w[j];
        force[j] = mass * ride->n[j];
        depth[j] = press->sign * ride->r[j];
    }
    double *const *columns = exact->recorder.columns;
    const size_t at = exact->sample + 1;
    put(columns, CHANNEL_DISPLACEMENT, at, ride->x, count);
    put(columns, CHANNEL_VELOCITY, at, ride->v, count);
    put(columns, CHANNEL_ACCELERATION, at, acceleration, count);
    put(columns, CHANNEL_DAMPER_DISPLACEMENT, at, z, count);
    put(columns, CHANNEL_DAMPER_VELOCITY, at, speed, count);
    put(columns, CHANNEL_PENETRATION, at, depth, count);
    put(columns, CHANNEL_CONTACT_FORCE, at, force, count);
    Peaks *peaks = &exact->ledger.response->peaks;
    peaks->displacement = largest(ride->x, count, peaks->displacement);
    peaks->velocity = largest(ride->v, count, peaks->velocity);
    peaks->acceleration = largest(acceleration, count, peaks->acceleration);
    peaks->damper_displacement = largest(z, count, peaks->damper_displacement);
    ledger_force(&exact->ledger, &exact->row, largest(force, count, 0));
    if (exact->sample < exact->recorder.statistics_start)
        return;
    double xx = 0, aa = 0;
    for (size_t j = 0; j < count; j++) {
        xx += ride->x[j] * ride->x[j];
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
