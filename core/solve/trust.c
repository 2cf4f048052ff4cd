// Small errors y = (x, v, r, w) go along with the motion. Over a stretch they follow its
// homogeneous system; where the motion jumps or its equations change they change by what the
// shifted event makes of them (saltation). Each stretch adds about one rounding of what it held,
// each time with other signs that are the same in every run.
//
// In contact  x' = v, v' = -s + share n, r' = w, w' = s - n,  n = c w + k r.  The force jumps by c
// w at touch and exit, and an event that comes dt = -dr / w late leaves dw - c dr behind: that is
// what V = v - share c r, W = w + c r are, which go through touch and exit unchanged:
//   x' = v, V' = -s + share k r, r' = W - c r, W' = s - k r,  v = V + share c r.
// So a contact's map is exp(A T) in these, and the state does not enter.
//
// exp(A T) y: powers of two of exp(A D) by binary digits of T / D, and for the rest, at most D / 2,
// a short series. In contact it must be a good one: r hardly matters to the speed that is left, and
// what the series misses of it is multiplied by the contact's rate.
#include "core/solve/trust.h"

#include <float.h>
#include <math.h>
#include <string.h>

enum { X, V, R, W, SIZE };

// D times the system's rate.
static const double SWING_STEP = 0.2, CONTACT_STEP = 0.05;
static const double ROUNDING = DBL_EPSILON;

// n steps of D, of which there are `frequency` in a second, and what is left.
static inline uint64_t divide(double length, double frequency, double step, double *rest) {
    const double most = 4294967295; // 2^TRUST_LEVELS - 1
    const double count = length * frequency + 0.5;
    if (!(count < most)) {
        *rest = 0;
        return (uint64_t)most;
    }
    const int64_t n = count > 0 ? (int64_t)count : 0;
    *rest = length - (double)n * step;
    return (uint64_t)n;
}

static void swing_levels(TrustSwing *swing, int levels) {
    if (swing->levels == 0) {
        // A Taylor series of exp(A D): |A D| is below 0.2 in the units of the rate.
        const double h = swing->step;
        for (int column = 0; column < 2; column++) {
            double x = column == 0, v = column == 1, term_x = x, term_v = v;
            for (int i = 1; i < 12; i++) {
                const double next = -swing->omega2 * term_x - swing->damping * term_v;
                term_x = h / i * term_v;
                term_v = h / i * next;
                x += term_x;
                v += term_v;
            }
            swing->power[0][0][column] = x;
            swing->power[0][1][column] = v;
        }
        swing->levels = 1;
    }
    for (; swing->levels < levels; swing->levels++) {
        double(*const p)[2] = swing->power[swing->levels - 1];
        double(*const q)[2] = swing->power[swing->levels];
        for (int i = 0; i < 2; i++)
            for (int j = 0; j < 2; j++)
                q[i][j] = p[i][0] * p[0][j] + p[i][1] * p[1][j];
    }
}

static void swing_go(TrustSwing *swing, double (*y)[TRUST_LANES], double length) {
    double h;
    uint64_t n = divide(length, swing->rate * (1 / SWING_STEP), swing->step, &h);
    const double half = h * h / 2;
    for (int i = 0; i < TRUST_LANES; i++) {
        const double x = y[X][i], v = y[V][i], a = -swing->omega2 * x - swing->damping * v;
        const double b = -swing->omega2 * v - swing->damping * a;
        y[X][i] = x + h * v + half * a;
        y[V][i] = v + h * a + half * b;
    }
    for (int level = 0; n > 0; level++, n >>= 1) {
        if (level >= swing->levels)
            swing_levels(swing, level + 1);
        if ((n & 1) == 0)
            continue;
        const double(*const p)[2] = (const double(*)[2])swing->power[level];
        for (int i = 0; i < TRUST_LANES; i++) {
            const double x = y[X][i], v = y[V][i];
            y[X][i] = p[0][0] * x + p[0][1] * v;
            y[V][i] = p[1][0] * x + p[1][1] * v;
        }
    }
}

// A y in the coordinates (x, V, r, W), all lanes.
static inline void contact_slope(const TrustContact *contact,
                                 const double (*restrict y)[TRUST_LANES],
                                 double (*restrict slope)[TRUST_LANES]) {
    const Motion *m = &contact->motion;
    const double fling = m->share * m->contact_damping;
    for (int i = 0; i < TRUST_LANES; i++) {
        const double v = y[V][i] + fling * y[R][i];
        const double push = m->omega2 * y[X][i] + m->damping * v;
        const double spring = m->contact_omega2 * y[R][i];
        slope[X][i] = v;
        slope[V][i] = m->share * spring - push;
        slope[R][i] = y[W][i] - m->contact_damping * y[R][i];
        slope[W][i] = push - spring;
    }
}

static void contact_levels(TrustContact *contact, int levels) {
    if (contact->levels == 0) {
        const double h = contact->step;
        // A Taylor series, each lane a column.
        _Static_assert((int)TRUST_LANES == (int)SIZE, "a lane for each column");
        double term[SIZE][TRUST_LANES] = {{0}}, slope[SIZE][TRUST_LANES];
        for (int i = 0; i < SIZE; i++)
            term[i][i] = 1;
        memcpy(contact->power[0], term, sizeof term);
        for (int i = 1; i < 12; i++) {
            const double share = h / i;
            contact_slope(contact, (const double(*)[TRUST_LANES])term, slope);
            for (int row = 0; row < SIZE; row++)
                for (int column = 0; column < SIZE; column++) {
                    term[row][column] = share * slope[row][column];
                    contact->power[0][row][column] += term[row][column];
                }
        }
        contact->levels = 1;
    }
    for (; contact->levels < levels; contact->levels++) {
        double(*const p)[4] = contact->power[contact->levels - 1];
        double(*const q)[4] = contact->power[contact->levels];
        for (int i = 0; i < SIZE; i++)
            for (int j = 0; j < SIZE; j++)
                q[i][j] =
                    p[i][0] * p[0][j] + p[i][1] * p[1][j] + p[i][2] * p[2][j] + p[i][3] * p[3][j];
    }
}

// Two lanes at once.
typedef double Pair __attribute__((vector_size(16), aligned(8), may_alias));

typedef struct Pairs {
    Pair x, v, r, w;
} Pairs;

static inline Pairs pairs_slope(const Motion *m, const Pairs *y) {
    const Pair v = y->v + m->share * m->contact_damping * y->r;
    const Pair push = m->omega2 * y->x + m->damping * v, spring = m->contact_omega2 * y->r;
    return (Pairs){v, m->share * spring - push, y->w - m->contact_damping * y->r, push - spring};
}

static void contact_go(TrustContact *contact, double (*y)[TRUST_LANES], double length) {
    double h;
    const uint64_t n = divide(length, contact->motion.rate * (1 / CONTACT_STEP), contact->step, &h);
    int levels = 0;
    while (n >> levels > 0)
        levels++;
    if (levels > contact->levels)
        contact_levels(contact, levels);
    const double half = h * h / 2, sixth = half * h * (1.0 / 3);
    for (int lane = 0; lane < TRUST_LANES; lane += 2) {
        Pair *const at[SIZE] = {(Pair *)&y[X][lane], (Pair *)&y[V][lane], (Pair *)&y[R][lane],
                                (Pair *)&y[W][lane]};
        Pairs now = {*at[X], *at[V], *at[R], *at[W]};
        const Pairs first = pairs_slope(&contact->motion, &now);
        const Pairs second = pairs_slope(&contact->motion, &first);
        const Pairs third = pairs_slope(&contact->motion, &second);
        now.x += h * first.x + (half * second.x + sixth * third.x);
        now.v += h * first.v + (half * second.v + sixth * third.v);
        now.r += h * first.r + (half * second.r + sixth * third.r);
        now.w += h * first.w + (half * second.w + sixth * third.w);
        for (int level = 0; level < levels; level++) {
            if ((n >> level & 1) == 0)
                continue;
            const double(*const p)[4] = (const double(*)[4])contact->power[level];
            const Pairs from = now;
            now.x = (p[0][0] * from.x + p[0][1] * from.v) + (p[0][2] * from.r + p[0][3] * from.w);
            now.v = (p[1][0] * from.x + p[1][1] * from.v) + (p[1][2] * from.r + p[1][3] * from.w);
            now.r = (p[2][0] * from.x + p[2][1] * from.v) + (p[2][2] * from.r + p[2][3] * from.w);
            now.w = (p[3][0] * from.x + p[3][1] * from.v) + (p[3][2] * from.r + p[3][3] * from.w);
        }
        *at[X] = now.x;
        *at[V] = now.v;
        *at[R] = now.r;
        *at[W] = now.w;
    }
}

// Adds `size` to each lane, with signs of its own.
static inline void scatter(Trust *trust, int row, double size) {
    static const double signs[16][TRUST_LANES] = {
        {-1, -1, -1, -1}, {-1, -1, -1, 1}, {-1, -1, 1, -1}, {-1, -1, 1, 1},
        {-1, 1, -1, -1},  {-1, 1, -1, 1},  {-1, 1, 1, -1},  {-1, 1, 1, 1},
        {1, -1, -1, -1},  {1, -1, -1, 1},  {1, -1, 1, -1},  {1, -1, 1, 1},
        {1, 1, -1, -1},   {1, 1, -1, 1},   {1, 1, 1, -1},   {1, 1, 1, 1}};
    const double *sign = signs[trust->signs >> (60 - row * TRUST_LANES) & 15];
    for (int i = 0; i < TRUST_LANES; i++)
        trust->y[row][i] += sign[i] * size;
}

// One rounding of what a stretch of this length held, `speed` being the relative one.
static void round_off(Trust *trust, double length, const State *state) {
    const double reach = trust->reach;
    const double speed = fabs(state->w), own_speed = fabs(state->v);
    const double size = fabs(state->x) + reach * own_speed;
    // Systematic ones, of the structure's own numbers, grow for as long as it remembers.
    const double lasting = length < trust->memory ? length : trust->memory;
    const double own = ROUNDING * (size + lasting * trust->rate * size);
    trust->signs = trust->signs * 6364136223846793005U + 1442695040888963407U;
    scatter(trust, X, own);
    scatter(trust, V, own * trust->rate);
    scatter(trust, R, ROUNDING * speed * length);
    scatter(trust, W,
            ROUNDING * (speed + (trust->flying.omega2 * size + trust->flying.damping * own_speed) *
                                    length));
}

// The end of a stretch: what it adds, and how far the estimate is now.
static void judge(Trust *trust, double time, const State *state, double largest) {
    const double length = time - trust->time;
    round_off(trust, length, state);
    const double here = fabs(state->x), known = here > largest ? here : largest;
    if (known > trust->largest)
        trust->largest = known;
    for (int i = 0; i < TRUST_LANES; i++) {
        const double x = trust->y[X][i], v = trust->reach * trust->y[V][i];
        const double square = x * x + v * v;
        if (!(square <= trust->worst))
            trust->worst = square;
    }
    const double parting = RESPONSE_PARTING * trust->largest;
    if (isnan(trust->horizon) && !(trust->worst <= parting * parting))
        trust->horizon = trust->time;
    trust->is_spent = !(trust->worst < trust->largest * trust->largest) && trust->largest > 0;
    trust->time = time;
}

void trust_start(Trust *trust, const Motion *flying, const Motion *touching, const Motion *resting,
                 const State *state, double size, bool is_driven, double duration) {
    const double rate = fmax(fmax(sqrt(flying->omega2), flying->damping), 1 / duration);
    TrustSwing *const swings[2] = {&trust->flying, &trust->resting};
    // What an earlier run of the same system has made is still right.
    for (int i = 0; i < 2; i++) {
        TrustSwing *swing = swings[i];
        const double free = i == 0 ? 1 : 1 - resting->share; // M / (M + m) while the mass rests
        const double omega2 = free * flying->omega2, damping = free * flying->damping;
        if (swing->omega2 == omega2 && swing->damping == damping && swing->rate == rate)
            continue;
        swing->omega2 = omega2;
        swing->damping = damping;
        swing->rate = rate;
        swing->step = SWING_STEP / rate;
        swing->levels = 0;
    }
    for (int side = 0; side < 2; side++) {
        const Motion *now = &touching[side], *then = &trust->touching[side].motion;
        const double most = fmax(now->rate, rate);
        if (then->omega2 == now->omega2 && then->damping == now->damping &&
            then->share == now->share && then->contact_omega2 == now->contact_omega2 &&
            then->contact_damping == now->contact_damping && then->rate == most)
            continue;
        trust->touching[side].motion = *now;
        trust->touching[side].motion.rate = most;
        trust->touching[side].step = CONTACT_STEP / most;
        trust->touching[side].levels = 0;
    }
    trust->is_spent = false;
    trust->time = 0;
    trust->share = flying->share;
    trust->rate = rate;
    trust->reach = 1 / rate;
    trust->memory = flying->damping > 0 ? 2 / flying->damping : duration;
    trust->phase = is_driven ? flying->rate : rate;
    trust->lasting = is_driven ? duration : fmin(duration, trust->memory);
    trust->largest = fabs(state->x);
    trust->worst = 0;
    trust->horizon = NAN;
    trust->signs = 0x9e3779b97f4a7c15U;
    memset(trust->y, 0, sizeof trust->y);
    scatter(trust, R, ROUNDING * size);
    round_off(trust, 0, state);
}

void trust_fly(Trust *trust, double time, const State *state, double largest) {
    if (trust->is_spent)
        return;
    const double length = time - trust->time;
    double z[TRUST_LANES], speed[TRUST_LANES];
    for (int i = 0; i < TRUST_LANES; i++) { // the free mass goes straight on
        speed[i] = trust->y[V][i] + trust->y[W][i];
        z[i] = trust->y[X][i] + trust->y[R][i] + length * speed[i];
    }
    swing_go(&trust->flying, trust->y, length);
    for (int i = 0; i < TRUST_LANES; i++) {
        trust->y[R][i] = z[i] - trust->y[X][i];
        trust->y[W][i] = speed[i] - trust->y[V][i];
    }
    judge(trust, time, state, largest);
}

void trust_press(Trust *trust, Side side, double time, const State *state, double largest) {
    if (trust->is_spent)
        return;
    contact_go(&trust->touching[side], trust->y, time - trust->time);
    judge(trust, time, state, largest);
}

void trust_rest(Trust *trust, double time, const State *state, double largest) {
    if (trust->is_spent)
        return;
    swing_go(&trust->resting, trust->y, time - trust->time);
    judge(trust, time, state, largest);
    for (int i = 0; i < TRUST_LANES; i++)
        trust->y[R][i] = trust->y[W][i] = 0;
}

void trust_bounce(Trust *trust, double restitution, double w, double push) {
    if (trust->is_spent)
        return;
    const double gain = trust->share * (1 + restitution);
    // s itself jumps, by what the structure's damper feels.
    const double kick = trust->flying.damping * gain * w;
    for (int i = 0; i < TRUST_LANES; i++) {
        const double r = trust->y[R][i];
        const double late = w != 0 ? -r / w : 0;
        const double arriving = trust->y[W][i] + push * late;
        trust->y[X][i] += gain * r;
        trust->y[V][i] += gain * arriving + kick * late;
        trust->y[R][i] = -restitution * r;
        trust->y[W][i] = -restitution * arriving - (push + kick) * late;
    }
}

void trust_stick(Trust *trust) {
    for (int i = 0; i < TRUST_LANES; i++) {
        trust->y[V][i] += trust->share * trust->y[W][i];
        trust->y[R][i] = trust->y[W][i] = 0;
    }
}

void trust_tell(const Trust *trust, Response *response) {
    const double size = fmax(trust->largest, response->peaks.displacement);
    double error = size > 0 ? sqrt(trust->worst) / size : trust->worst == 0 ? 0 : 1;
    response->trust_horizon = trust->horizon;
    // Without any event a rounded frequency still turns the phase.
    const double drift = size > 0 ? ROUNDING * (1 + trust->phase * trust->lasting) : 0;
    const double adrift = (RESPONSE_PARTING / ROUNDING - 1) / trust->phase;
    if (drift > RESPONSE_PARTING && !(trust->horizon <= adrift))
        response->trust_horizon = adrift;
    if (drift > error)
        error = drift;
    response->error_estimate = error < 1 ? error : 1;
    response->has_trust = true;
}
