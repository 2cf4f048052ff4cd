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
// In flight k and c are 0. At rest the masses move as one: r = 0, and the structure is slower.
//
// exp(A T) y is exp(A D) to the power of the integer next to T / D, from a table of the powers 1,
// 2, 4 ..., and a short series for the rest, at most D / 2.
#include "core/solve/rounding_growth.h"

#include <float.h>
#include <math.h>
#include <string.h>

enum { X, V, R, W, SIZE };
enum { REST_TERMS = 6, STEP_TERMS = 13 }; // of the series of at most D / 2, and of D

static const double STEP = 0.2; // D times the rate of the system
static const double ROUNDING = DBL_EPSILON;

// y becomes exp(A length) y by a Taylor series.
INLINE void rounding_growth_series(const Motion *m, double length, int terms, Four *y) {
    Four x = y[X], v = y[V], r = y[R], w = y[W];
    for (int i = 1; i < terms; i++) {
        const double share = length / i;
        const Four speed = v + m->share * m->contact_damping * r;
        const Four push = m->omega2 * x + m->damping * speed, spring = m->contact_omega2 * r;
        x = share * speed;
        v = share * (m->share * spring - push);
        r = share * (w - m->contact_damping * r);
        w = share * (push - spring);
        y[X] += x;
        y[V] += v;
        y[R] += r;
        y[W] += w;
    }
}

// Makes the powers of exp(A D) up to the highest in exp(A n D).
static __attribute__((noinline)) void rounding_growth_extend(GrowthSystem *system, uint64_t n) {
    _Static_assert((int)GROWTH_LANES == (int)SIZE, "a lane for each column");
    for (; n >> system->levels != 0; system->levels++) {
        double(*next)[4] = system->power[system->levels];
        if (system->levels == 0) {
            Four one[4] = {{1, 0, 0, 0}, {0, 1, 0, 0}, {0, 0, 1, 0}, {0, 0, 0, 1}};
            rounding_growth_series(&system->motion, system->step, STEP_TERMS, one);
            memcpy(next, one, sizeof one);
            continue;
        }
        double(*const last)[4] = system->power[system->levels - 1];
        for (int i = 0; i < SIZE; i++)
            for (int j = 0; j < SIZE; j++)
                next[i][j] = (last[i][X] * last[X][j] + last[i][V] * last[V][j]) +
                             (last[i][R] * last[R][j] + last[i][W] * last[W][j]);
    }
}

// Errors over a phase of `length`.
INLINE void rounding_growth_move(GrowthSystem *system, Four *y, double length) {
    const double most = 4294967295; // 2^GROWTH_LEVELS - 1
    const double count = length * system->frequency + 0.5;
    const uint64_t n = !(count < most) ? (uint64_t)most : count > 0 ? (uint64_t)count : 0;
    if (n >> system->levels != 0)
        rounding_growth_extend(system, n);
    if (count < most)
        rounding_growth_series(&system->motion, length - (double)n * system->step, REST_TERMS, y);
    for (uint64_t level = 0, left = n; left > 0; level++, left >>= 1) {
        if ((left & 1) == 0)
            continue;
        double(*const p)[4] = system->power[level];
        const Four x = y[X], v = y[V], r = y[R], w = y[W];
        for (int i = 0; i < SIZE; i++)
            y[i] = (p[i][X] * x + p[i][V] * v) + (p[i][R] * r + p[i][W] * w);
    }
}

// Adds +-size to each lane.
INLINE void rounding_growth_scatter(RoundingGrowth *growth, int row, double size) {
    static const double signs[16][GROWTH_LANES] = {
        {-1, -1, -1, -1}, {-1, -1, -1, 1}, {-1, -1, 1, -1}, {-1, -1, 1, 1},
        {-1, 1, -1, -1},  {-1, 1, -1, 1},  {-1, 1, 1, -1},  {-1, 1, 1, 1},
        {1, -1, -1, -1},  {1, -1, -1, 1},  {1, -1, 1, -1},  {1, -1, 1, 1},
        {1, 1, -1, -1},   {1, 1, -1, 1},   {1, 1, 1, -1},   {1, 1, 1, 1}};
    const double *sign = signs[growth->signs >> (60 - row * GROWTH_LANES) & 15];
    growth->y[row] += FOUR(sign) * size;
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
    const Motion *flying = &growth->systems[GROWTH_FLIGHT].motion;
    rounding_growth_scatter(
        growth, W,
        ROUNDING * (speed + (flying->omega2 * size + flying->damping * own_speed) * length));
}

void rounding_growth_start(RoundingGrowth *growth, const Motion *flying, const Motion *touching,
                           const State *state, double size, bool is_driven, double duration) {
    const double rate = fmax(fmax(sqrt(flying->omega2), flying->damping), 1 / duration);
    const double free = 1 - flying->share; // M / (M + m) while the mass rests
    const Motion motions[GROWTH_SYSTEMS] = {
        [SIDE_LEFT] = touching[SIDE_LEFT],
        [SIDE_RIGHT] = touching[SIDE_RIGHT],
        [GROWTH_FLIGHT] = *flying,
        [GROWTH_REST] = {free * flying->omega2, free * flying->damping, .share = flying->share}};
    for (int i = 0; i < GROWTH_SYSTEMS; i++) {
        GrowthSystem *system = &growth->systems[i];
        Motion motion = motions[i];
        motion.rate = i < GROWTH_FLIGHT ? fmax(motion.rate, rate) : rate;
        if (memcmp(&system->motion, &motion, sizeof motion) == 0)
            continue; // the table of an earlier run of the same system remains valid
        system->motion = motion;
        system->step = STEP / motion.rate;
        system->frequency = motion.rate / STEP;
        system->levels = 0;
    }
    growth->is_wide = wide_is_at_hand();
    growth->is_spent = false;
    growth->time = 0;
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

// Carries the errors through a phase, adds its rounding and updates the estimate.
INLINE void rounding_growth_phase(RoundingGrowth *growth, int system, double time,
                                  const State *state, double largest) {
    const double length = time - growth->time;
    rounding_growth_move(&growth->systems[system], growth->y, length);
    rounding_growth_add_rounding(growth, length, state);
    if (system == GROWTH_REST)
        growth->y[R] = growth->y[W] = (Four){0};
    const double here = fabs(state->x), known = here > largest ? here : largest;
    if (known > growth->largest)
        growth->largest = known;
    const Four x = growth->y[X], v = growth->reach * growth->y[V];
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

WIDE static void rounding_growth_phase_wide(RoundingGrowth *growth, int system, double time,
                                            const State *state, double largest) {
    rounding_growth_phase(growth, system, time, state, largest);
}

void rounding_growth_end_phase(RoundingGrowth *growth, ContactPhase phase, Side side, double time,
                               const State *state, double largest) {
    const int system = phase == PHASE_FLIGHT    ? GROWTH_FLIGHT
                       : phase == PHASE_CONTACT ? (int)side
                                                : GROWTH_REST;
    if (growth->is_spent)
        return;
    if (growth->is_wide)
        rounding_growth_phase_wide(growth, system, time, state, largest);
    else
        rounding_growth_phase(growth, system, time, state, largest);
}

void rounding_growth_bounce(RoundingGrowth *growth, double restitution, double w, double push) {
    if (growth->is_spent)
        return;
    const Motion *flying = &growth->systems[GROWTH_FLIGHT].motion;
    const double gain = flying->share * (1 + restitution);
    // s jumps too, by the damping of the structure's velocity change.
    const double kick = flying->damping * gain * w;
    const Four r = growth->y[R], late = r * (w != 0 ? -1 / w : 0);
    const Four arriving = growth->y[W] + push * late;
    growth->y[X] += gain * r;
    growth->y[V] += gain * arriving + kick * late;
    growth->y[R] = -restitution * r;
    growth->y[W] = -restitution * arriving - (push + kick) * late;
}

void rounding_growth_stick(RoundingGrowth *growth) {
    growth->y[V] += growth->systems[GROWTH_FLIGHT].motion.share * growth->y[W];
    growth->y[R] = growth->y[W] = (Four){0};
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
