// Eight samples of a contact side by side. Each is seen straight from the beginning of the ride;
// what belongs to the interval before it takes the neighbour's values.
#include "core/solve/exact_ride.h"

#include <math.h>

enum { RIDE = PULSE_RIDE };

typedef double Eight __attribute__((vector_size(8 * RIDE)));
typedef double Loose __attribute__((vector_size(8 * RIDE), aligned(8), may_alias)); // anywhere
#define LOAD(values) (*(const Loose *)(values))
#define STORE(values, eight) (*(Loose *)(values) = (eight))

// LOAD(ones + RIDE - count) is 1 for the first `count`, and 0.
static const double ones[2 * RIDE] = {1, 1, 1, 1, 1, 1, 1, 1};

typedef enum BaseKind { STILL, LINEAR, SINE } BaseKind;

// The samples of a ride: amplitudes and base from there on, and what is seen there.
typedef struct Ride {
    Eight d[4], a, s, jump;
    Eight x, v, r, w, n, rate;
    double d0[4], a0, s0, rate0; // at the beginning, one by one: as vectors they would wait
} Ride;

// What rides add up to and the largest magnitudes seen, lane by lane.
typedef struct Tally {
    Eight swing, vv, ww, work, base, xx, aa;
    double x[RIDE], v[RIDE], acceleration[RIDE], z[RIDE], force[RIDE];
} Tally;

INLINE void shift(const Eight *values, double first, Eight *shifted) {
    *shifted = __builtin_shufflevector(*values, *values, 0, 0, 1, 2, 3, 4, 5, 6);
    (*shifted)[0] = first;
}

// In loops: vectors of all widths compare lane by lane in plain C alone.
INLINE void grow(double most[RIDE], const Eight *values) {
    double size[RIDE];
    STORE(size, *values);
    for (int j = 0; j < RIDE; j++) {
        size[j] = fabs(size[j]);
        most[j] = size[j] > most[j] ? size[j] : most[j];
    }
}

INLINE void halve(const Eight *values, Four *sums) {
    *sums = __builtin_shufflevector(*values, *values, 0, 1, 2, 3) +
            __builtin_shufflevector(*values, *values, 4, 5, 6, 7);
}

INLINE double sum_of(const Eight *values) {
    Four four;
    halve(values, &four);
    return (four[0] + four[2]) + (four[1] + four[3]);
}

INLINE double most_of(const double values[RIDE]) {
    double most = 0;
    for (size_t j = 0; j < RIDE; j++)
        most = impact_log_larger(most, values[j]);
    return most;
}

// All eight straight from the beginning: what each jump of the base's slope leaves is the same, but
// later.
INLINE void turn(const Press *press, Ride *ride, const double *base, BaseKind kind) {
    const Pulse *p = press->pulse;
    const double *d = ride->d0;
    if (kind == LINEAR) {
        const double rate = press->exact->plan->sample_rate;
        ride->a = LOAD(base + 1);
        ride->s = (LOAD(base + 2) - ride->a) * rate;
        ride->jump = ride->s - (ride->a - LOAD(base)) * rate;
        ride->jump[0] = ride->s[0] - ride->s0;
    }
    if (kind == SINE) {
        ride->a = LOAD(p->cosine) * ride->a0 + LOAD(p->sine) * ride->s0;
        ride->s = LOAD(p->cosine) * ride->s0 - LOAD(p->sine) * ride->a0;
    }
    for (int i = 0; i < 4; i += 2) {
        Eight re = LOAD(p->ride[i]) * d[i] - LOAD(p->ride[i + 1]) * d[i + 1];
        Eight im = LOAD(p->ride[i]) * d[i + 1] + LOAD(p->ride[i + 1]) * d[i];
        for (int k = 0; k < RIDE && kind == LINEAR; k++) {
            re += LOAD(p->jumps[i] + RIDE - k) * ride->jump[k];
            im += LOAD(p->jumps[i + 1] + RIDE - k) * ride->jump[k];
        }
        ride->d[i] = re;
        ride->d[i + 1] = im;
    }
}

INLINE void see(const Pulse *p, const Ride *ride, PulseRow row, BaseKind kind, Eight *out) {
    const double(*c)[PULSE_ROWS] = p->see;
    *out = (c[0][row] * ride->d[0] + c[1][row] * ride->d[1]) +
           (c[2][row] * ride->d[2] + c[3][row] * ride->d[3]);
    if (kind != STILL)
        *out += c[PULSE_A][row] * ride->a + c[PULSE_S][row] * ride->s;
}

// Bit j: the interval up to sample j surely belongs to the contact. Bit RIDE + j: the force rises
// there.
INLINE unsigned mark(const Press *press, const Ride *ride) {
    static const double bits[2][RIDE] = {
        {1, 2, 4, 8, 16, 32, 64, 128},
        {1 << 8, 1 << 9, 1 << 10, 1 << 11, 1 << 12, 1 << 13, 1 << 14, 1 << 15}};
    const Exact *exact = press->exact;
    const Pulse *p = press->pulse;
    const double h = exact->interval, sway = p->sway * exact->stretch.base_max;
    double d[4][RIDE], bends[RIDE], bend[RIDE], r[RIDE], before[RIDE], w[RIDE], w_before[RIDE];
    double rate[RIDE], marks[RIDE];
    Eight shifted, here;
    for (int i = 0; i < 4; i++)
        STORE(d[i], ride->d[i]);
    for (int j = 0; j < RIDE; j++)
        bends[j] = p->size2[0] * (fabs(d[0][j]) + fabs(d[1][j])) +
                   p->size2[1] * (fabs(d[2][j]) + fabs(d[3][j]));
    here = LOAD(bends);
    const double *d0 = ride->d0;
    const double bend0 =
        p->size2[0] * (fabs(d0[0]) + fabs(d0[1])) + p->size2[1] * (fabs(d0[2]) + fabs(d0[3]));
    shift(&here, bend0, &shifted);
    STORE(bend, shifted + sway); // |r''| in the interval before is not larger
    here = press->sign * ride->r;
    shift(&here, press->sign * exact->state.r, &shifted);
    STORE(r, here);
    STORE(before, shifted);
    shift(&ride->w, exact->state.w, &shifted);
    STORE(w, ride->w);
    STORE(w_before, shifted);
    STORE(rate, press->sign * ride->rate);
    for (int j = 0; j < RIDE; j++) {
        const double sag = bend[j] * (h * h / 8), change = bend[j] * h;
        const double least = r[j] < before[j] ? r[j] : before[j];
        const double one = fabs(w[j]), other = fabs(w_before[j]);
        const double fast = one > other ? one : other;
        const double inside = least > sag ? bits[0][j] : 0;
        const double crossing = fast > change ? bits[0][j] : 0;
        marks[j] =
            (least > 0 && crossing > inside ? crossing : inside) + (rate[j] > 0 ? bits[1][j] : 0);
    }
    here = LOAD(marks);
    return (unsigned)sum_of(&here);
}

// The start of interval j.
INLINE void set_start(Press *press, const Ride *ride, double (*at)[RIDE], size_t j) {
    if (j == 0) {
        press->d = (Four){ride->d0[0], ride->d0[1], ride->d0[2], ride->d0[3]};
        press->a = ride->a0;
        press->slope = ride->s0;
    } else {
        press->d = (Four){at[0][j - 1], at[1][j - 1], at[2][j - 1], at[3][j - 1]};
        press->a = at[4][j - 1];
        press->slope = at[5][j - 1];
    }
}

// How many intervals surely belong to the contact and show its peaks. `at` are the starts' lanes.
INLINE size_t count_clear(Press *press, const Ride *ride, double (*at)[RIDE]) {
    const Exact *exact = press->exact;
    const unsigned marks = mark(press, ride), inside = marks & 0xff, rising = marks >> RIDE;
    size_t count = (size_t)__builtin_ctz(~inside);
    const double first = press->sign * ride->rate0;
    size_t falls = 0; // from there on the force must fall
    if (first > 0) {
        falls = (size_t)__builtin_ctz(~rising);
        if (falls < count) {
            const double from = falls == 0 ? first : press->sign * ride->rate[falls - 1];
            const double to = press->sign * ride->rate[falls];
            set_start(press, ride, at, falls);
            const bool is_found =
                press_find_peak(press, exact->interval * from / (from - to), exact->interval);
            if (!is_found)
                return falls;
        }
    }
    const unsigned again = rising >> falls;
    if (falls < count && again != 0) {
        const size_t next = falls + (size_t)__builtin_ctz(again);
        count = next < count ? next : count;
    }
    return count;
}

INLINE void take_sums(Press *press, const Ride *ride, const Eight *keep, size_t count,
                      BaseKind kind, Tally *tally) {
    const Exact *exact = press->exact;
    const Pulse *p = press->pulse;
    const double h = exact->interval, length = (double)count * h;
    const Eight swing = ride->d[0] * ride->d[0] + ride->d[1] * ride->d[1];
    Eight before;
    shift(&swing, ride->d0[0] * ride->d0[0] + ride->d0[1] * ride->d0[1], &before);
    tally->swing += *keep * before;
    press->length += length;
    press->elapsed += length;
    if (kind == LINEAR) {
        const double share = exact->flying.share;
        const double v1 = p->see[PULSE_S][PULSE_V], w1 = p->see[PULSE_S][PULSE_W];
        const Eight jump = ride->jump, u = ride->x + share * ride->r;
        Eight s, a, x, r, u_before, middle = {0}, middle_before, v = {0}, w = {0};
        double middle_first = 0, middle_jump = 0;
        for (int i = 0; i < 4; i++) {
            v += p->vv.jump[i] * ride->d[i];
            w += p->ww.jump[i] * ride->d[i];
            middle += p->middle[i] * ride->d[i];
            middle_first += p->middle[i] * ride->d0[i];
            middle_jump += p->middle[i] * p->jump[i];
        }
        shift(&ride->s, ride->s0, &s);
        shift(&ride->a, ride->a0, &a);
        shift(&ride->x, exact->state.x, &x);
        shift(&ride->r, exact->state.r, &r);
        shift(&u, exact->state.x + share * exact->state.r, &u_before);
        shift(&middle, middle_first, &middle_before);
        const Eight own = (a + ride->a) * (h / 2), v0 = v1 * s, w0 = w1 * s;
        const Eight whole = ((middle - middle_before) - middle_jump * jump) +
                            (p->middle_a * own + (p->middle_s * h) * s);
        tally->base += *keep * own;
        tally->work += *keep * ((ride->a * u - a * u_before) - s * whole);
        tally->vv += *keep * (v0 * (2 * (ride->x - x) - h * v0) - jump * (v - p->vv.jump2 * jump));
        tally->ww += *keep * (w0 * (2 * (ride->r - r) - h * w0) - jump * (w - p->ww.jump2 * jump));
    }
    if (kind == SINE) {
        const Slice ones_of[2] = {{1, 0, p->base_omega}, {0, 1, p->base_omega}};
        const double value = exact_turned(&ones_of[0], h), slope = exact_turned(&ones_of[1], h);
        Eight a, s;
        shift(&ride->a, ride->a0, &a);
        shift(&ride->s, ride->s0, &s);
        tally->base += *keep * (value * a + slope * s);
    }
}

INLINE void put(double *const *columns, ChannelId channel, size_t sample, const Eight *values) {
    if (columns[channel] != NULL)
        STORE(columns[channel] + sample, *values);
}

// Those behind the kept ones are written as zeros, which is what the force is if the contact ends
// (0.0 makes -0 one).
INLINE void take_samples(const Press *press, const Ride *ride, const Eight *keep, Tally *tally) {
    const Exact *exact = press->exact;
    const Motion *m = &exact->flying;
    const double mass = exact_effective_mass(exact);
    const double middle = exact_relative(exact) - exact->state.r;
    const Eight own = m->damping * ride->v + m->omega2 * ride->x;
    const Eight x = *keep * ride->x, v = *keep * ride->v;
    const Eight acceleration = *keep * (m->share * ride->n - own);
    const Eight z = *keep * (ride->x + (middle + ride->r)), speed = ride->v + ride->w;
    const Eight force = *keep * (mass * ride->n) + 0.0;
    const Eight depth = *keep * (press->sign * ride->r) + 0.0;
    double *const *columns = exact->recorder.columns;
    const size_t at = exact->sample + 1;
    put(columns, CHANNEL_DISPLACEMENT, at, &x);
    put(columns, CHANNEL_VELOCITY, at, &v);
    put(columns, CHANNEL_ACCELERATION, at, &acceleration);
    put(columns, CHANNEL_DAMPER_DISPLACEMENT, at, &z);
    put(columns, CHANNEL_DAMPER_VELOCITY, at, &speed);
    put(columns, CHANNEL_PENETRATION, at, &depth);
    put(columns, CHANNEL_CONTACT_FORCE, at, &force);
    grow(tally->x, &x);
    grow(tally->v, &v);
    grow(tally->acceleration, &acceleration);
    grow(tally->z, &z);
    grow(tally->force, &force);
    tally->xx += x * x;
    tally->aa += acceleration * acceleration;
}

INLINE void enter(Press *press, const Tally *tally, size_t count, bool is_counted) {
    Exact *exact = press->exact;
    const Pulse *p = press->pulse;
    const Four unit = {1, 0, 0, 0};
    const double slow = sum_of(&tally->swing) * pulse_slow(p, &unit, exact->interval);
    Four vv, ww, work, base, sums;
    halve(&tally->vv, &vv);
    halve(&tally->ww, &ww);
    halve(&tally->work, &work);
    halve(&tally->base, &base);
    wide_sum(&vv, &ww, &work, &base, &sums);
    press->vv += p->vv.slow * slow + sums[0];
    press->ww += p->ww.slow * slow + sums[1];
    press->work -= (exact->plan->mass[0] + exact->damper->mass) * sums[2];
    press->gained += sums[3];
    Peaks *peaks = &exact->ledger.response->peaks;
    peaks->displacement = impact_log_larger(peaks->displacement, most_of(tally->x));
    peaks->velocity = impact_log_larger(peaks->velocity, most_of(tally->v));
    peaks->acceleration = impact_log_larger(peaks->acceleration, most_of(tally->acceleration));
    peaks->damper_displacement = impact_log_larger(peaks->damper_displacement, most_of(tally->z));
    impact_log_force(&exact->ledger, &exact->row, most_of(tally->force));
    exact->run->steps += EXACT_SAMPLE_STEPS * (double)count;
    if (is_counted)
        exact_record_sums(&exact->recorder, count, sum_of(&tally->xx), sum_of(&tally->aa));
}

INLINE size_t run(Press *press, size_t most, BaseKind kind) {
    Exact *exact = press->exact;
    const Pulse *p = press->pulse;
    const Base *base = exact->run->base;
    const size_t counts_from = exact->recorder.statistics_start;
    const bool is_counted = exact->sample >= counts_from;
    if (exact->recorder.columns[CHANNEL_MEAN_ACCELERATION] != NULL)
        return 0;
    if (!is_counted && most > counts_from - 1 - exact->sample)
        most = counts_from - 1 - exact->sample;
    size_t done = 0;
    const Eight none = {0};
    Tally tally; // member by member: as a whole it would be a call
    tally.swing = tally.vv = tally.ww = tally.work = tally.base = tally.xx = tally.aa = none;
    STORE(tally.x, none);
    STORE(tally.v, none);
    STORE(tally.acceleration, none);
    STORE(tally.z, none);
    STORE(tally.force, none);
    Ride ride;
    Four force;
    pulse_see(p, PULSE_N, &press->d, press->a, press->slope, &force);
    for (int i = 0; i < 4; i++)
        ride.d0[i] = press->d[i];
    ride.a0 = press->a;
    ride.s0 = press->slope;
    ride.rate0 = force[1];
    double at[11][RIDE];
    while (done + RIDE <= most) {
        if (kind == LINEAR && exact->sample + RIDE + 1 >= base->count)
            break;
        if (kind == SINE && exact->sample % PRESS_FRESH < RIDE) {
            Slice slice;
            exact_slice(exact, &slice);
            ride.a0 = slice.value;
            ride.s0 = slice.slope;
        }
        turn(press, &ride, kind == LINEAR ? base->values + exact->sample : NULL, kind);
        see(p, &ride, PULSE_X, kind, &ride.x);
        see(p, &ride, PULSE_V, kind, &ride.v);
        see(p, &ride, PULSE_R, kind, &ride.r);
        see(p, &ride, PULSE_W, kind, &ride.w);
        see(p, &ride, PULSE_N, kind, &ride.n);
        see(p, &ride, PULSE_N1, kind, &ride.rate);
        for (int i = 0; i < 4; i++)
            STORE(at[i], ride.d[i]);
        STORE(at[4], kind == STILL ? none : ride.a);
        STORE(at[5], kind == STILL ? none : ride.s);
        STORE(at[6], ride.x);
        STORE(at[7], ride.v);
        STORE(at[8], ride.r);
        STORE(at[9], ride.w);
        STORE(at[10], ride.rate);
        const size_t count = count_clear(press, &ride, at);
        if (count == 0)
            break;
        const Eight keep = LOAD(ones + RIDE - count);
        take_sums(press, &ride, &keep, count, kind, &tally);
        take_samples(press, &ride, &keep, &tally);
        const size_t last = count - 1;
        for (int i = 0; i < 4; i++)
            ride.d0[i] = at[i][last];
        ride.a0 = at[4][last];
        ride.s0 = at[5][last];
        ride.rate0 = at[10][last];
        exact->state = (State){at[6][last], at[7][last], at[8][last], at[9][last]};
        exact->sample += count;
        done += count;
        if (count < RIDE)
            break;
    }
    set_start(press, &ride, at, 0);
    if (done > 0) {
        exact->recorder.last_velocity = exact->state.v;
        enter(press, &tally, done, is_counted);
    }
    return done;
}

INLINE size_t run_any(Press *press, size_t most) {
    if (press->pulse->base_omega > 0)
        return run(press, most, SINE);
    return press->exact->stretch.base_max > 0 ? run(press, most, LINEAR) : run(press, most, STILL);
}

#ifdef __x86_64__
__attribute__((target("avx2"))) static size_t run_avx2(Press *press, size_t most) {
    return run_any(press, most);
}

__attribute__((target("avx512f,avx512dq"))) static size_t run_avx512(Press *press, size_t most) {
    return run_any(press, most);
}
#endif

size_t press_ride(Press *press, size_t most) {
#ifdef __x86_64__
    if (press->exact->lanes.width == LANES_AVX512)
        return run_avx512(press, most);
    if (press->exact->lanes.width == LANES_AVX2)
        return run_avx2(press, most);
#endif
    return run_any(press, most);
}
