// With Y = x + share r (the pair's common motion) the contact's system splits into blocks that
// hardly touch:
//   Y'' = -a - (1 - share) (D Y' + W2 Y) + (1 - share) share (D w + W2 r)
//   r'' = D Y' + W2 Y - (c + share D) w - (k + share W2) r
// L and H remove what is left, by the iterations of singular perturbation theory, which converge
// like the ratio of the two time scales. Then r is a slow part, whose change over a step is bounded
// through its slope, and a fast part, whose norm does not grow. Contact lasts while the first
// outweighs the second.
#include "core/solve/exact_hold.h"

#include <math.h>
#include <string.h>

#include "core/math/matrix_exponential.h"

enum { X, V, R, W, A, B, SUM_A, SUM_N, SIZE };
enum { DECOUPLE_STEPS = 60, SEPARATION = 30 };

// Of |n|: what a fast part may still add to a peak without being looked at.
static const double ripple_max = 1e-12;

typedef double Square[2][2];

static void multiply(Square a, Square b, Square out) {
    Square c;
    for (int i = 0; i < 2; i++)
        for (int j = 0; j < 2; j++)
            c[i][j] = a[i][0] * b[0][j] + a[i][1] * b[1][j];
    memcpy(out, c, sizeof c);
}

static void invert(Square a, Square out) {
    const double determinant = a[0][0] * a[1][1] - a[0][1] * a[1][0];
    Square c = {{a[1][1] / determinant, -a[0][1] / determinant},
                {-a[1][0] / determinant, a[0][0] / determinant}};
    memcpy(out, c, sizeof c);
}

// out = a + factor b.
static void add(Square a, double factor, Square b, Square out) {
    for (int i = 0; i < 2; i++)
        for (int j = 0; j < 2; j++)
            out[i][j] = a[i][j] + factor * b[i][j];
}

// Whether the iterations have settled; SEPARATION sees to it that they do.
static bool decouple(Hold *hold) {
    const Motion *m = &hold->motion;
    const double rest = 1 - m->share;
    Square A11 = {{0, 1}, {-rest * m->omega2, -rest * m->damping}};
    Square A12 = {{0, 0}, {rest * m->share * m->omega2, rest * m->share * m->damping}};
    Square A21 = {{0, 0}, {m->omega2, m->damping}};
    Square A22 = {
        {0, 1},
        {-m->contact_omega2 - m->share * m->omega2, -m->contact_damping - m->share * m->damping}};
    Square inverse, next, part;
    invert(A22, inverse);
    memset(hold->L, 0, sizeof hold->L);
    for (int step = 0; step < DECOUPLE_STEPS; step++) {
        multiply(A12, hold->L, part);
        add(A11, 1, part, part);
        multiply(hold->L, part, next);
        add(next, -1, A21, next);
        multiply(inverse, next, hold->L);
    }
    Square fast;
    multiply(A12, hold->L, part);
    add(A11, 1, part, hold->slow);
    multiply(hold->L, A12, part);
    add(A22, -1, part, fast);
    hold->fast_omega = sqrt(-A22[1][0]);
    const double w = hold->fast_omega;
    hold->fast_growth = hypot(hypot(part[0][0], part[0][1] * w), hypot(part[1][0] / w, part[1][1]));
    invert(fast, inverse);
    memset(hold->H, 0, sizeof hold->H);
    for (int step = 0; step < DECOUPLE_STEPS; step++) {
        multiply(hold->slow, hold->H, next);
        add(next, 1, A12, next);
        multiply(next, inverse, hold->H);
    }
    // G' = fast G + a_g L(:, 2): it follows the base like -inverse L(:, 2) a_g, and so on.
    for (int i = 0; i < 2; i++)
        hold->quasi[i] = inverse[i][0] * hold->L[0][1] + inverse[i][1] * hold->L[1][1];
    for (int i = 0; i < 2; i++)
        hold->quasi_rate[i] = inverse[i][0] * hold->quasi[0] + inverse[i][1] * hold->quasi[1];
    hold->slow_growth = sqrt(m->omega2) + m->damping + fabs(part[1][1]);
    double sum = 0;
    for (int i = 0; i < 2; i++)
        for (int j = 0; j < 2; j++)
            sum += hold->L[i][j] + hold->H[i][j];
    return isfinite(sum);
}

static void pick_row(const long double *transition, int row, double target[6]) {
    for (int i = 0; i < 6; i++)
        target[i] = (double)transition[row * SIZE + i];
}

static void pick_form(const long double *form, double target[HOLD_FORM]) {
    for (int i = 0, n = 0; i < 6; i++)
        for (int j = i; j < 6; j++)
            target[n++] = (double)(form[i * SIZE + j] * (i == j ? 1 : 2));
}

enum { FORM_VV, FORM_WW, FORM_AV, FORM_AW, FORMS };

static void pick_level(const long double *increment, long double forms[FORMS][SIZE * SIZE],
                       double length, HoldLevel *level) {
    long double transition[SIZE * SIZE];
    memcpy(transition, increment, sizeof transition);
    for (int i = 0; i < SIZE; i++)
        transition[i * SIZE + i] += 1;
    level->length = length;
    for (int row = X; row <= W; row++)
        pick_row(transition, row, level->state[row]);
    pick_row(transition, SUM_A, level->base);
    pick_row(transition, SUM_N, level->force);
    pick_form(forms[FORM_VV], level->vv);
    pick_form(forms[FORM_WW], level->ww);
    pick_form(forms[FORM_AV], level->av);
    pick_form(forms[FORM_AW], level->aw);
}

// From the shortest level up, each one the last one doubled.
static void make_levels(Hold *hold, const long double *system, double interval) {
    const long double v[SIZE] = {[V] = 1}, w[SIZE] = {[W] = 1}, a[SIZE] = {[A] = 1};
    const long double *const pairs[FORMS][2] = {{v, v}, {w, w}, {a, v}, {a, w}};
    long double increment[SIZE * SIZE], forms[FORMS][SIZE * SIZE];
    for (size_t i = hold->count; i-- > 0;) {
        const double length = ldexp(interval, -(int)i);
        if (i + 1 == hold->count) {
            exponential_increment(system, SIZE, length, increment);
            exponential_forms(system, SIZE, length, FORMS, pairs, forms[0]);
        } else {
            for (int f = 0; f < FORMS; f++)
                exponential_form_double(SIZE, increment, forms[f]);
            exponential_double(SIZE, increment);
        }
        pick_level(increment, forms, length, &hold->levels[i]);
    }
}

void hold_make(Hold *hold, const Motion *motion, double base_omega, double interval) {
    hold->motion = *motion;
    hold->count = 0;
    const double slow = sqrt(motion->omega2) + motion->damping + base_omega;
    const double k = motion->contact_omega2, c = motion->contact_damping;
    const double slowest =
        c * c < 4 * k ? sqrt(k) : k / c; // of the contact's own motion, a lower bound
    hold->is_usable = slowest > SEPARATION * slow && decouple(hold);
    if (!hold->is_usable)
        return;
    long double system[SIZE * SIZE] = {0};
    const long double share = motion->share;
    system[X * SIZE + V] = 1;
    system[V * SIZE + X] = -(long double)motion->omega2;
    system[V * SIZE + V] = -(long double)motion->damping;
    system[V * SIZE + R] = share * k;
    system[V * SIZE + W] = share * c;
    system[V * SIZE + A] = -1;
    system[R * SIZE + W] = 1;
    system[W * SIZE + X] = motion->omega2;
    system[W * SIZE + V] = motion->damping;
    system[W * SIZE + R] = -(long double)k;
    system[W * SIZE + W] = -(long double)c;
    system[A * SIZE + B] = base_omega > 0 ? base_omega : 1;
    system[B * SIZE + A] = -(long double)base_omega;
    system[SUM_A * SIZE + A] = 1;
    system[SUM_N * SIZE + R] = k;
    system[SUM_N * SIZE + W] = c;
    for (double length = interval; hold->count < HOLD_LEVELS && length * motion->rate > 4;
         length /= 2)
        hold->count++;
    make_levels(hold, system, interval);
}

static State transit(const HoldLevel *level, const State *start, const Slice *slice) {
    const double y[6] = {start->x, start->v, start->r, start->w, slice->value, slice->slope};
    double end[4];
    for (int row = 0; row < 4; row++) {
        end[row] = 0;
        for (int i = 0; i < 6; i++)
            end[row] += level->state[row][i] * y[i];
    }
    return (State){end[0], end[1], end[2], end[3]};
}

// a_g and its first two derivatives over a stretch: a_g and a_g' at its start, and bounds of all.
typedef struct BaseBounds {
    double a, rate;
    double a_max, rate_max, bend_max;
} BaseBounds;

static BaseBounds base_bounds(const Slice *slice, double length) {
    const double omega = slice->omega;
    if (omega > 0) {
        const double most = fabs(slice->value) + fabs(slice->slope);
        return (BaseBounds){slice->value, omega * slice->slope, most, omega * most,
                            omega * omega * most};
    }
    const double end = slice->value + slice->slope * length;
    return (BaseBounds){slice->value, slice->slope, fmax(fabs(slice->value), fabs(end)),
                        fabs(slice->slope), 0};
}

// What bounds need of a state: the slow coordinates and the size of the fast ones.
typedef struct Split {
    double Z[2];
    double fast; // norm of G + quasi a_g + quasi_rate a_g'
} Split;

static Split split(const Hold *hold, const State *state, const BaseBounds *base) {
    const double S[2] = {state->x + hold->motion.share * state->r,
                         state->v + hold->motion.share * state->w};
    const double F[2] = {state->r, state->w};
    double G[2], own[2];
    Split out;
    for (int i = 0; i < 2; i++) {
        G[i] = F[i] - hold->L[i][0] * S[0] - hold->L[i][1] * S[1];
        own[i] = G[i] + hold->quasi[i] * base->a + hold->quasi_rate[i] * base->rate;
    }
    for (int i = 0; i < 2; i++)
        out.Z[i] = S[i] - hold->H[i][0] * G[0] - hold->H[i][1] * G[1];
    out.fast = hypot(own[0], own[1] / hold->fast_omega);
    return out;
}

// What can be said of r and n over a stretch of contact.
typedef struct Foresight {
    bool lasts;       // surely
    double force_max; // |n| is not larger
    double ripple;    // the fast part's share of n is not larger
} Foresight;

static Foresight foresee(const Hold *hold, const Split *at, const BaseBounds *base, double length,
                         double sign) {
    const Motion *m = &hold->motion;
    const double omega = sqrt(m->omega2);
    // r = L1 Z + (e1 + L1 H) G with G = fast - quasi a_g - quasi_rate a_g'.
    const double *L1 = hold->L[0];
    const double mix[2] = {1 + L1[0] * hold->H[0][0] + L1[1] * hold->H[1][0],
                           L1[0] * hold->H[0][1] + L1[1] * hold->H[1][1]};
    const double kappa = mix[0] * hold->quasi[0] + mix[1] * hold->quasi[1];
    const double kappa_rate = mix[0] * hold->quasi_rate[0] + mix[1] * hold->quasi_rate[1];
    const double drive = hypot(hold->quasi_rate[0], hold->quasi_rate[1] / hold->fast_omega);
    const double fast = hypot(mix[0], mix[1] * hold->fast_omega) *
                        (at->fast + length * drive * base->bend_max) *
                        exp(hold->fast_growth * length);
    // The slow part at the start, and the most it can change: Omega |Z1| + |Z2| bounds what Z
    // becomes.
    const double slow =
        L1[0] * at->Z[0] + L1[1] * at->Z[1] - kappa * base->a - kappa_rate * base->rate;
    const double reach = (omega * fabs(at->Z[0]) + fabs(at->Z[1]) + length * base->a_max) *
                         exp(hold->slow_growth * length);
    const double slope1 = L1[0] * hold->slow[0][0] + L1[1] * hold->slow[1][0];
    const double slope2 = L1[0] * hold->slow[0][1] + L1[1] * hold->slow[1][1];
    const double entry = L1[1] +
                         L1[0] * (hold->H[0][0] * hold->L[0][1] + hold->H[0][1] * hold->L[1][1]) +
                         L1[1] * (hold->H[1][0] * hold->L[0][1] + hold->H[1][1] * hold->L[1][1]);
    const double change =
        length * ((omega > 0 ? fabs(slope1) / omega : 0) * reach + fabs(slope2) * reach +
                  fabs(entry) * base->a_max + fabs(kappa) * base->rate_max +
                  fabs(kappa_rate) * base->bend_max);
    const double ripple = (m->contact_omega2 + m->contact_damping * hold->fast_omega) * fast;
    return (Foresight){.lasts = sign * slow - change > fast,
                       .force_max = m->contact_omega2 * (fabs(slow) + change) +
                                    m->contact_damping * change / length + ripple,
                       .ripple = ripple};
}

// How fast n changes [m/s^3].
static double force_rate(const Motion *motion, const State *state) {
    const double slope =
        motion->damping * state->v + motion->omega2 * state->x - hold_force(motion, state); // of w
    return motion->contact_damping * slope + motion->contact_omega2 * state->w;
}

const HoldLevel *hold_step(const Hold *hold, const State *start, const Slice *slice, double length,
                           double sign, double peak, State *end) {
    if (!hold->is_usable || hold->count == 0)
        return NULL;
    for (size_t i = 0; i < hold->count; i++) {
        const HoldLevel *level = &hold->levels[i];
        if (level->length > length * (1 + 1e-15))
            continue;
        const BaseBounds base = base_bounds(slice, level->length);
        const Split at = split(hold, start, &base);
        const Foresight seen = foresee(hold, &at, &base, level->length, sign);
        if (!seen.lasts)
            continue;
        *end = transit(level, start, slice);
        if (seen.force_max <= peak)
            return level;
        // A new peak may lie inside, unless the ripple has died and what is left only rises or only
        // falls.
        const double n = fabs(hold_force(&hold->motion, start));
        if (seen.ripple <= ripple_max * n &&
            force_rate(&hold->motion, start) * force_rate(&hold->motion, end) >= 0)
            return level;
    }
    return NULL;
}

static double form_value(const double *form, const double *y) {
    double sum = 0;
    for (int i = 0, n = 0; i < 6; i++)
        for (int j = i; j < 6; j++)
            sum += form[n++] * y[i] * y[j];
    return sum;
}

ArcIntegrals hold_integrals(const HoldLevel *level, const State *start, const Slice *slice,
                            double *impulse) {
    const double y[6] = {start->x, start->v, start->r, start->w, slice->value, slice->slope};
    ArcIntegrals out = {form_value(level->vv, y), form_value(level->ww, y),
                        form_value(level->av, y), form_value(level->aw, y), 0};
    *impulse = 0;
    for (int i = 0; i < 6; i++) {
        out.a += level->base[i] * y[i];
        *impulse += level->force[i] * y[i];
    }
    return out;
}
