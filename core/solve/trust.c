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

// n steps of D and what is left.
static uint64_t divide(double length, double step, double *rest) {
    const double most = (double)(UINT64_C(1) << TRUST_LEVELS) - 1;
    const double count = length / step + 0.5;
    const uint64_t n = (uint64_t)(!(count < most) ? most : count > 0 ? count : 0);
    *rest = length - (double)n * step;
    if (!(count < most))
        *rest = 0;
    return n;
}

static void swing_levels(TrustSwing *swing, int levels) {
    if (swing->levels == 0) {
        // A Taylor series of exp(A D): |A D| is below 0.2 in the units of the rate.
        const double h = SWING_STEP / swing->rate;
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
    uint64_t n = divide(length, SWING_STEP / swing->rate, &h);
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

// A y in the coordinates (x, V, r, W).
static void contact_slope(const TrustContact *contact, const double *y, double *slope) {
    const double v = y[V] + contact->motion.share * contact->motion.contact_damping * y[R];
    const double push = contact->motion.omega2 * y[X] + contact->motion.damping * v;
    const double spring = contact->motion.contact_omega2 * y[R];
    slope[X] = v;
    slope[V] = contact->motion.share * spring - push;
    slope[R] = y[W] - contact->motion.contact_damping * y[R];
    slope[W] = push - spring;
}

static void contact_levels(TrustContact *contact, int levels) {
    if (contact->levels == 0) {
        const double h = CONTACT_STEP / contact->motion.rate;
        for (int column = 0; column < SIZE; column++) {
            double term[SIZE] = {0}, sum[SIZE] = {0};
            term[column] = sum[column] = 1;
            for (int i = 1; i < 12; i++) {
                double slope[SIZE];
                contact_slope(contact, term, slope);
                for (int row = 0; row < SIZE; row++) {
                    term[row] = h / i * slope[row];
                    sum[row] += term[row];
                }
            }
            for (int row = 0; row < SIZE; row++)
                contact->power[0][row][column] = sum[row];
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

static void contact_go(TrustContact *contact, double (*y)[TRUST_LANES], double length) {
    double h;
    uint64_t n = divide(length, CONTACT_STEP / contact->motion.rate, &h);
    for (int i = 0; i < TRUST_LANES; i++) {
        const double at[SIZE] = {y[X][i], y[V][i], y[R][i], y[W][i]};
        double first[SIZE], second[SIZE], third[SIZE];
        contact_slope(contact, at, first);
        contact_slope(contact, first, second);
        contact_slope(contact, second, third);
        for (int row = 0; row < SIZE; row++)
            y[row][i] = at[row] + h * (first[row] + h / 2 * (second[row] + h / 3 * third[row]));
    }
    for (int level = 0; n > 0; level++, n >>= 1) {
        if (level >= contact->levels)
            contact_levels(contact, level + 1);
        if ((n & 1) == 0)
            continue;
        const double(*const p)[4] = (const double(*)[4])contact->power[level];
        double to[SIZE][TRUST_LANES];
        for (int row = 0; row < SIZE; row++)
            for (int i = 0; i < TRUST_LANES; i++)
                to[row][i] = p[row][0] * y[0][i] + p[row][1] * y[1][i] + p[row][2] * y[2][i] +
                             p[row][3] * y[3][i];
        memcpy(y, to, sizeof to);
    }
}

// Adds `size` to each lane, with signs of its own.
static inline void scatter(Trust *trust, int row, double size) {
    static const double signs[2] = {-1, 1};
    for (int i = 0; i < TRUST_LANES; i++)
        trust->y[row][i] += signs[trust->signs >> (63 - row * TRUST_LANES - i) & 1] * size;
}

// One rounding of what a stretch of this length held, `speed` being the relative one.
static void round_off(Trust *trust, double length, const State *state) {
    const double reach = trust->reach;
    const double size = fabs(state->x) + reach * fabs(state->v);
    // Systematic ones, of the structure's own numbers, grow for as long as it remembers.
    const double lasting = length < trust->memory ? length : trust->memory;
    const double own = ROUNDING * size * (1 + lasting / reach);
    const double speed = fabs(state->w);
    trust->signs = trust->signs * 6364136223846793005U + 1442695040888963407U;
    scatter(trust, X, own);
    scatter(trust, V, own / reach);
    scatter(trust, R, ROUNDING * speed * length);
    scatter(trust, W,
            ROUNDING *
                (speed +
                 (trust->flying.omega2 * size + trust->flying.damping * fabs(state->v)) * length));
}

// The end of a stretch: what it adds, and how far the estimate is now.
static void judge(Trust *trust, double time, const State *state, double largest) {
    const double length = time - trust->time;
    round_off(trust, length, state);
    const double known = fmax(fabs(state->x), largest);
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
    for (int i = 0; i < 2; i++) {
        const double free = i == 0 ? 1 : 1 - resting->share; // M / (M + m) while the mass rests
        swings[i]->omega2 = free * flying->omega2;
        swings[i]->damping = free * flying->damping;
        swings[i]->rate = rate;
        swings[i]->levels = 0;
    }
    for (int side = 0; side < 2; side++) {
        trust->touching[side].motion = touching[side];
        trust->touching[side].motion.rate = fmax(touching[side].rate, rate);
        trust->touching[side].levels = 0;
    }
    trust->is_spent = false;
    trust->time = 0;
    trust->share = flying->share;
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
