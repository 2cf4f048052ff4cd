// Small errors y = (x, v, r, w) follow the homogeneous system of the motion over a phase. Where the
// motion jumps or its equations change they change by what the shifted event makes of them
// (saltation). Each phase adds about one rounding of its own size, with signs that differ from
// phase to phase but are the same in every run.
//
// In contact  x' = v, v' = -s + share n, r' = w, w' = s - n,  n = c w + k r.  The force jumps by c
// w at touch and exit, and an event that comes dt = -dr / w late leaves dw - c dr behind. So V = v
// - share c r and W = w + c r go through touch and exit unchanged:
//   x' = v, V' = -s + share k r, r' = W - c r, W' = s - k r,  v = V + share c r.
// In these the map of a contact is exp(A T), and the state does not enter.
//
// exp(A T) y is exp(A D) to the power of the integer next to T / D, from a table, and a short
// series for the rest, at most D / 2. In contact the series has order 4: r hardly matters to the
// speed that is left, and the series' error in it is multiplied by the contact's rate.
#include "core/solve/rounding_growth.h"

#include <float.h>
#include <math.h>
#include <string.h>

#include "core/solve/wide.h"

enum { X, V, R, W, SIZE };

// D times the rate of the system.
static const double SWING_STEP = 0.2, CONTACT_STEP = 0.1;
static const double ROUNDING = DBL_EPSILON;

// The number of steps D in `length`, and the rest.
INLINE uint64_t rounding_growth_divide(double length, double frequency, double step, double *rest) {
    const double most = 4294967295; // GROWTH_NEAR << GROWTH_LEVELS, less 1
    const double count = length * frequency + 0.5;
    if (!(count < most)) {
        *rest = 0;
        return (uint64_t)most;
    }
    const int64_t n = count > 0 ? (int64_t)count : 0;
    *rest = length - (double)n * step;
    return (uint64_t)n;
}

static void rounding_growth_multiply(const double *p, const double *q, size_t size, double *out) {
    for (size_t i = 0; i < size; i++)
        for (size_t j = 0; j < size; j++) {
            double sum = p[i * size] * q[j];
            for (size_t k = 1; k < size; k++)
                sum += p[i * size + k] * q[k * size + j];
            out[i * size + j] = sum;
        }
}

// Makes all powers up to n of matrices of size x size, of which near[1] is known.
static void rounding_growth_extend(double *near, double *power, size_t size, int *known,
                                   int *levels, uint64_t n) {
    const size_t square = size * size;
    for (const int wanted = n < GROWTH_NEAR ? (int)n + 1 : GROWTH_NEAR; *known < wanted; ++*known)
        rounding_growth_multiply(near + (size_t)(*known - 1) * square, near + square, size,
                                 near + (size_t)*known * square);
    for (; n >> *levels >= GROWTH_NEAR; ++*levels) {
        double *next = power + (size_t)*levels * square;
        const double *last = *levels == 0 ? near + GROWTH_NEAR / 2 * square : next - square;
        rounding_growth_multiply(last, last, size, next);
    }
}

static __attribute__((noinline)) void rounding_growth_make_structure(GrowthStructure *swing,
                                                                     uint64_t n) {
    double(*const near)[2][2] = swing->near;
    if (swing->known == 0) {
        // A Taylor series of exp(A D): |A D| is below 0.2 in the units of the rate.
        const double h = swing->step;
        for (int column = 0; column < 2; column++) {
            double x = column == 0, v = column == 1, term_x = x, term_v = v;
            near[0][0][column] = x;
            near[0][1][column] = v;
            for (int i = 1; i < 12; i++) {
                const double next = -swing->omega2 * term_x - swing->damping * term_v;
                term_x = h / i * term_v;
                term_v = h / i * next;
                x += term_x;
                v += term_v;
            }
            near[1][0][column] = x;
            near[1][1][column] = v;
        }
        swing->known = 2;
    }
    rounding_growth_extend(near[0][0], swing->power[0][0], 2, &swing->known, &swing->levels, n);
}

// Errors of the structure over `length`.
INLINE void rounding_growth_move_structure(GrowthStructure *swing, Four *at_x, Four *at_v,
                                           double length) {
    double h;
    const uint64_t n = rounding_growth_divide(length, swing->frequency, swing->step, &h);
    if ((int)(n % GROWTH_NEAR) >= swing->known || n >> swing->levels >= GROWTH_NEAR)
        rounding_growth_make_structure(swing, n);
    const double half = h * h / 2;
    Four x = *at_x, v = *at_v;
    const Four a = -swing->omega2 * x - swing->damping * v;
    const Four b = -swing->omega2 * v - swing->damping * a;
    x += h * v + half * a;
    v += h * a + half * b;
    double(*p)[2] = swing->near[n % GROWTH_NEAR];
    *at_x = p[0][0] * x + p[0][1] * v;
    *at_v = p[1][0] * x + p[1][1] * v;
    for (uint64_t level = 0, left = n / GROWTH_NEAR; left > 0; level++, left >>= 1) {
        if ((left & 1) == 0)
            continue;
        p = swing->power[level];
        x = *at_x;
        v = *at_v;
        *at_x = p[0][0] * x + p[0][1] * v;
        *at_v = p[1][0] * x + p[1][1] * v;
    }
}

typedef struct Errors {
    Four x, v, r, w;
} Errors;

// A y in the coordinates (x, V, r, W).
INLINE void rounding_growth_slope(const Motion *m, const Errors *y, Errors *slope) {
    const Four v = y->v + m->share * m->contact_damping * y->r;
    const Four push = m->omega2 * y->x + m->damping * v, spring = m->contact_omega2 * y->r;
    slope->x = v;
    slope->v = m->share * spring - push;
    slope->r = y->w - m->contact_damping * y->r;
    slope->w = push - spring;
}

static __attribute__((noinline)) void rounding_growth_make_contact(GrowthContact *contact,
                                                                   uint64_t n) {
    double(*const near)[4][4] = contact->near;
    if (contact->known == 0) {
        // A Taylor series, each lane a column.
        _Static_assert((int)GROWTH_LANES == (int)SIZE, "a lane for each column");
        Errors term = {{1, 0, 0, 0}, {0, 1, 0, 0}, {0, 0, 1, 0}, {0, 0, 0, 1}}, slope;
        memcpy(near[0], &term, sizeof near[0]);
        Errors sum = term;
        for (int i = 1; i < 12; i++) {
            const double share = contact->step / i;
            rounding_growth_slope(&contact->motion, &term, &slope);
            term = (Errors){share * slope.x, share * slope.v, share * slope.r, share * slope.w};
            sum = (Errors){sum.x + term.x, sum.v + term.v, sum.r + term.r, sum.w + term.w};
        }
        memcpy(near[1], &sum, sizeof near[1]);
        contact->known = 2;
    }
    rounding_growth_extend(near[0][0], contact->power[0][0], SIZE, &contact->known,
                           &contact->levels, n);
}

INLINE void rounding_growth_map(double p[4][4], Errors *y) {
    const Errors from = *y;
    y->x = (p[0][0] * from.x + p[0][1] * from.v) + (p[0][2] * from.r + p[0][3] * from.w);
    y->v = (p[1][0] * from.x + p[1][1] * from.v) + (p[1][2] * from.r + p[1][3] * from.w);
    y->r = (p[2][0] * from.x + p[2][1] * from.v) + (p[2][2] * from.r + p[2][3] * from.w);
    y->w = (p[3][0] * from.x + p[3][1] * from.v) + (p[3][2] * from.r + p[3][3] * from.w);
}

INLINE void rounding_growth_move_contact(GrowthContact *contact, double (*at)[GROWTH_LANES],
                                         double length) {
    double h;
    const uint64_t n = rounding_growth_divide(length, contact->frequency, contact->step, &h);
    if ((int)(n % GROWTH_NEAR) >= contact->known || n >> contact->levels >= GROWTH_NEAR)
        rounding_growth_make_contact(contact, n);
    const double half = h * h / 2, sixth = half * h * (1.0 / 3), last = half * half * (1.0 / 6);
    const Motion *m = &contact->motion;
    Errors y = {FOUR(at[X]), FOUR(at[V]), FOUR(at[R]), FOUR(at[W])}, a, b, c, d;
    rounding_growth_slope(m, &y, &a);
    rounding_growth_slope(m, &a, &b);
    rounding_growth_slope(m, &b, &c);
    rounding_growth_slope(m, &c, &d);
    y.x += (h * a.x + half * b.x) + (sixth * c.x + last * d.x);
    y.v += (h * a.v + half * b.v) + (sixth * c.v + last * d.v);
    y.r += (h * a.r + half * b.r) + (sixth * c.r + last * d.r);
    y.w += (h * a.w + half * b.w) + (sixth * c.w + last * d.w);
    rounding_growth_map(contact->near[n % GROWTH_NEAR], &y);
    for (uint64_t level = 0, left = n / GROWTH_NEAR; left > 0; level++, left >>= 1)
        if ((left & 1) != 0)
            rounding_growth_map(contact->power[level], &y);
    PUT_FOUR(at[X], y.x);
    PUT_FOUR(at[V], y.v);
    PUT_FOUR(at[R], y.r);
    PUT_FOUR(at[W], y.w);
}

// Adds +-size to each lane.
INLINE void rounding_growth_scatter(RoundingGrowth *growth, int row, double size) {
    static const double signs[16][GROWTH_LANES] = {
        {-1, -1, -1, -1}, {-1, -1, -1, 1}, {-1, -1, 1, -1}, {-1, -1, 1, 1},
        {-1, 1, -1, -1},  {-1, 1, -1, 1},  {-1, 1, 1, -1},  {-1, 1, 1, 1},
        {1, -1, -1, -1},  {1, -1, -1, 1},  {1, -1, 1, -1},  {1, -1, 1, 1},
        {1, 1, -1, -1},   {1, 1, -1, 1},   {1, 1, 1, -1},   {1, 1, 1, 1}};
    const double *sign = signs[growth->signs >> (60 - row * GROWTH_LANES) & 15];
    PUT_FOUR(growth->y[row], FOUR(growth->y[row]) + FOUR(sign) * size);
}

// One rounding of the size of a phase of this length.
INLINE void rounding_growth_add_rounding(RoundingGrowth *growth, double length,
                                         const State *state) {
    const double reach = growth->reach;
    const double speed = fabs(state->w), own_speed = fabs(state->v);
    const double size = fabs(state->x) + reach * own_speed;
    // The rounding of the structure's own numbers is systematic and adds up within its memory.
    const double lasting = length < growth->memory ? length : growth->memory;
    const double own = ROUNDING * (size + lasting * growth->rate * size);
    growth->signs = growth->signs * 6364136223846793005U + 1442695040888963407U;
    rounding_growth_scatter(growth, X, own);
    rounding_growth_scatter(growth, V, own * growth->rate);
    rounding_growth_scatter(growth, R, ROUNDING * speed * length);
    rounding_growth_scatter(
        growth, W,
        ROUNDING *
            (speed + (growth->flying.omega2 * size + growth->flying.damping * own_speed) * length));
}

// The end of a phase: adds its rounding and updates the estimate.
INLINE void rounding_growth_end_phase(RoundingGrowth *growth, double time, const State *state,
                                      double largest) {
    const double length = time - growth->time;
    rounding_growth_add_rounding(growth, length, state);
    const double here = fabs(state->x), known = here > largest ? here : largest;
    if (known > growth->largest)
        growth->largest = known;
    const Four x = FOUR(growth->y[X]), v = growth->reach * FOUR(growth->y[V]);
    const Four square = x * x + v * v;
    // NaN counts as the largest.
    const double one = square[0] <= square[1] ? square[1] : square[0];
    const double other = square[2] <= square[3] ? square[3] : square[2];
    const double most = one <= other ? other : one;
    growth->worst = most <= growth->worst ? growth->worst : most;
    const double parting = RESPONSE_DIVERGENCE * growth->largest;
    if (isnan(growth->horizon) && !(growth->worst <= parting * parting))
        growth->horizon = growth->time;
    growth->is_spent = !(growth->worst < growth->largest * growth->largest) && growth->largest > 0;
    growth->time = time;
}

void rounding_growth_start(RoundingGrowth *growth, const Motion *flying, const Motion *touching,
                           const Motion *resting, const State *state, double size, bool is_driven,
                           double duration) {
    const double rate = fmax(fmax(sqrt(flying->omega2), flying->damping), 1 / duration);
    GrowthStructure *const swings[2] = {&growth->flying, &growth->resting};
    // Tables of an earlier run of the same system remain valid.
    for (int i = 0; i < 2; i++) {
        GrowthStructure *swing = swings[i];
        const double free = i == 0 ? 1 : 1 - resting->share; // M / (M + m) while the mass rests
        const double omega2 = free * flying->omega2, damping = free * flying->damping;
        if (swing->omega2 == omega2 && swing->damping == damping && swing->rate == rate)
            continue;
        swing->omega2 = omega2;
        swing->damping = damping;
        swing->rate = rate;
        swing->step = SWING_STEP / rate;
        swing->frequency = rate / SWING_STEP;
        swing->known = swing->levels = 0;
    }
    for (int side = 0; side < 2; side++) {
        const Motion *now = &touching[side], *then = &growth->touching[side].motion;
        const double most = fmax(now->rate, rate);
        if (then->omega2 == now->omega2 && then->damping == now->damping &&
            then->share == now->share && then->contact_omega2 == now->contact_omega2 &&
            then->contact_damping == now->contact_damping && then->rate == most)
            continue;
        growth->touching[side].motion = *now;
        growth->touching[side].motion.rate = most;
        growth->touching[side].step = CONTACT_STEP / most;
        growth->touching[side].frequency = most / CONTACT_STEP;
        growth->touching[side].known = growth->touching[side].levels = 0;
    }
    growth->is_wide = wide_is_at_hand();
    growth->is_spent = false;
    growth->time = 0;
    growth->share = flying->share;
    growth->rate = rate;
    growth->reach = 1 / rate;
    growth->memory = flying->damping > 0 ? 2 / flying->damping : duration;
    growth->phase = is_driven ? flying->rate : rate;
    growth->lasting = is_driven ? duration : fmin(duration, growth->memory);
    growth->largest = fabs(state->x);
    growth->worst = 0;
    growth->horizon = NAN;
    growth->signs = 0x9e3779b97f4a7c15U;
    memset(growth->y, 0, sizeof growth->y);
    rounding_growth_scatter(growth, R, ROUNDING * size);
    rounding_growth_add_rounding(growth, 0, state);
}

INLINE void rounding_growth_over_flight(RoundingGrowth *growth, double time, const State *state,
                                        double largest) {
    const double length = time - growth->time;
    Four x = FOUR(growth->y[X]), v = FOUR(growth->y[V]);
    // The free mass keeps its velocity.
    const Four speed = v + FOUR(growth->y[W]), z = x + FOUR(growth->y[R]) + length * speed;
    rounding_growth_move_structure(&growth->flying, &x, &v, length);
    PUT_FOUR(growth->y[X], x);
    PUT_FOUR(growth->y[V], v);
    PUT_FOUR(growth->y[R], z - x);
    PUT_FOUR(growth->y[W], speed - v);
    rounding_growth_end_phase(growth, time, state, largest);
}

INLINE void rounding_growth_over_contact(RoundingGrowth *growth, Side side, double time,
                                         const State *state, double largest) {
    rounding_growth_move_contact(&growth->touching[side], growth->y, time - growth->time);
    rounding_growth_end_phase(growth, time, state, largest);
}

WIDE static void rounding_growth_over_flight_wide(RoundingGrowth *growth, double time,
                                                  const State *state, double largest) {
    rounding_growth_over_flight(growth, time, state, largest);
}

WIDE static void rounding_growth_over_contact_wide(RoundingGrowth *growth, Side side, double time,
                                                   const State *state, double largest) {
    rounding_growth_over_contact(growth, side, time, state, largest);
}

void rounding_growth_flight(RoundingGrowth *growth, double time, const State *state,
                            double largest) {
    if (growth->is_spent)
        return;
    if (growth->is_wide)
        rounding_growth_over_flight_wide(growth, time, state, largest);
    else
        rounding_growth_over_flight(growth, time, state, largest);
}

void rounding_growth_contact(RoundingGrowth *growth, Side side, double time, const State *state,
                             double largest) {
    if (growth->is_spent)
        return;
    if (growth->is_wide)
        rounding_growth_over_contact_wide(growth, side, time, state, largest);
    else
        rounding_growth_over_contact(growth, side, time, state, largest);
}

void rounding_growth_rest(RoundingGrowth *growth, double time, const State *state, double largest) {
    if (growth->is_spent)
        return;
    Four x = FOUR(growth->y[X]), v = FOUR(growth->y[V]);
    rounding_growth_move_structure(&growth->resting, &x, &v, time - growth->time);
    PUT_FOUR(growth->y[X], x);
    PUT_FOUR(growth->y[V], v);
    rounding_growth_end_phase(growth, time, state, largest);
    for (int i = 0; i < GROWTH_LANES; i++)
        growth->y[R][i] = growth->y[W][i] = 0;
}

void rounding_growth_bounce(RoundingGrowth *growth, double restitution, double w, double push) {
    if (growth->is_spent)
        return;
    const double gain = growth->share * (1 + restitution);
    // s jumps too, by the damping of the structure's velocity change.
    const double kick = growth->flying.damping * gain * w;
    for (int i = 0; i < GROWTH_LANES; i++) {
        const double r = growth->y[R][i];
        const double late = w != 0 ? -r / w : 0;
        const double arriving = growth->y[W][i] + push * late;
        growth->y[X][i] += gain * r;
        growth->y[V][i] += gain * arriving + kick * late;
        growth->y[R][i] = -restitution * r;
        growth->y[W][i] = -restitution * arriving - (push + kick) * late;
    }
}

void rounding_growth_stick(RoundingGrowth *growth) {
    for (int i = 0; i < GROWTH_LANES; i++) {
        growth->y[V][i] += growth->share * growth->y[W][i];
        growth->y[R][i] = growth->y[W][i] = 0;
    }
}

void rounding_growth_report(const RoundingGrowth *growth, Response *response) {
    const double size = fmax(growth->largest, response->peaks.displacement);
    double error = size > 0 ? sqrt(growth->worst) / size : growth->worst == 0 ? 0 : 1;
    response->trust_horizon = growth->horizon;
    // The rounding of the frequency shifts the phase even without an event.
    const double drift = size > 0 ? ROUNDING * (1 + growth->phase * growth->lasting) : 0;
    const double adrift = (RESPONSE_DIVERGENCE / ROUNDING - 1) / growth->phase;
    if (drift > RESPONSE_DIVERGENCE && !(growth->horizon <= adrift))
        response->trust_horizon = adrift;
    if (drift > error)
        error = drift;
    response->error_estimate = error < 1 ? error : 1;
    response->has_trust = true;
}
