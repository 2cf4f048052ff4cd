// The motion of one storey and its free mass over a piece in which the contact state does not
// change and the base is linear or a sine: Taylor polynomials in s = t / length, exact to rounding.
// The polynomials are linear in the state at the start and in the base, so a table per contact
// state has their coefficients, and a piece is a sum of six rows.
#ifndef CORE_SOLVE_MOTION_TABLE_H
#define CORE_SOLVE_MOTION_TABLE_H

#include <math.h>

#include "core/solve/linear_motion.h"
#include "core/solve/wide.h"

// A start: x, v, r, w and the base's value and slope as in Slice.
enum { START_SIZE = 6 };
// Terms of a polynomial, with zeros above its degree.
enum { PIECE_TERMS = 24 };
// Quadratic forms: integrals of v^2, w^2, a_g v and a_g w. Their pairs are those of form_pairs: the
// first FORM_STATE_PAIRS without the base. Rounded up to multiples of 4.
enum { FORM_VV, FORM_WW, FORM_AV, FORM_AW, FORMS, FORM_STATE_PAIRS = 12, FORM_PAIRS = 24 };
extern const unsigned char form_pairs[FORM_PAIRS][2];
// Lengths of a block of contact and values of a_g that they depend on.
enum { BLOCK_SAMPLES = 4, BLOCK_TAPS = BLOCK_SAMPLES + 1 };

typedef struct MotionTable {
    bool is_made, has_block;
    Motion motion;
    double length, base_omega; // of the pieces [s]; of a sine, or 0 [rad/s]
    double rho;                // length times the fastest rate, at most 1
    size_t terms;              // those that are not 0, rounded up to a multiple of 4
    // Coefficients of x, r and n length^2 (Motion) that a unit of each part of the start gives.
    _Alignas(32) double x[START_SIZE][PIECE_TERMS];
    _Alignas(32) double r[START_SIZE][PIECE_TERMS];
    _Alignas(32) double n[START_SIZE][PIECE_TERMS];
    _Alignas(32) double base[2][PIECE_TERMS]; // of a_g, from value and slope
    // What x, v, r, w gain over the whole length, from each part of the start.
    _Alignas(32) double gain[START_SIZE][4];
    double turn[2];  // cosine and sine of the sine's angle over the length
    double speed[2]; // integral of a_g over the length, from value and slope
    // What x, v, r, w gain in 1 to 4 lengths from the state; from a base that goes on as in Slice;
    // and from one that is linear between its values at whole lengths.
    _Alignas(32) double from_state[4][4][BLOCK_SAMPLES];
    _Alignas(32) double from_slice[4][2][BLOCK_SAMPLES];
    _Alignas(32) double from_base[4][BLOCK_TAPS][BLOCK_SAMPLES];
    // Integrals over the whole length as quadratic forms of the start, pair after pair of its
    // parts.
    _Alignas(32) double forms[FORMS][FORM_PAIRS];
} MotionTable;

// `length` times motion->rate and times base_omega is at most 1.
void motion_table_make(MotionTable *table, const Motion *motion, double base_omega, double length);
void motion_table_make_forms(MotionTable *table);
void motion_table_make_block(MotionTable *table); // from_state to forms

typedef struct Piece {
    const MotionTable *table;
    double start[START_SIZE];
    _Alignas(32) double x[PIECE_TERMS], kx[PIECE_TERMS]; // coefficients, and k times these
    _Alignas(32) double r[PIECE_TERMS], kr[PIECE_TERMS];
} Piece;

// Integrals over a piece.
typedef struct PieceSums {
    double vv, ww, av, aw; // of v^2, w^2 [m^2/s], a_g v, a_g w [m^2/s^2]
    double a;              // of a_g [m/s]
} PieceSums;

// Four coefficients from the rows of a table.
INLINE void piece_row(const double (*rows)[PIECE_TERMS], const double *start, size_t k, Four *sum) {
    *sum = ((FOUR(rows[0] + k) * start[0] + FOUR(rows[1] + k) * start[1]) +
            (FOUR(rows[2] + k) * start[2] + FOUR(rows[3] + k) * start[3])) +
           (FOUR(rows[4] + k) * start[4] + FOUR(rows[5] + k) * start[5]);
}

INLINE void piece_make(Piece *piece, const MotionTable *table, const State *state,
                       const Slice *slice) {
    const double start[START_SIZE] = {state->x, state->v,     state->r,
                                      state->w, slice->value, slice->slope};
    Four index = {0, 1, 2, 3};
    piece->table = table;
    for (size_t i = 0; i < START_SIZE; i++)
        piece->start[i] = start[i];
    for (size_t k = 0; k < table->terms; k += 4) {
        Four x, r;
        piece_row(table->x, start, k, &x);
        piece_row(table->r, start, k, &r);
        PUT_FOUR(piece->x + k, x);
        PUT_FOUR(piece->kx + k, x * index);
        PUT_FOUR(piece->r + k, r);
        PUT_FOUR(piece->kr + k, r * index);
        index += 4;
    }
}

// The state at the end of the whole length.
INLINE void piece_end(const MotionTable *table, const double *start, State *end) {
    const double(*const gain)[4] = table->gain;
    const Four sum = ((FOUR(gain[0]) * start[0] + FOUR(gain[1]) * start[1]) +
                      (FOUR(gain[2]) * start[2] + FOUR(gain[3]) * start[3])) +
                     (FOUR(gain[4]) * start[4] + FOUR(gain[5]) * start[5]);
    *end = (State){start[0] + sum[0], start[1] + sum[1], start[2] + sum[2], start[3] + sum[3]};
}

// The state at s, 0 < s <= 1.
INLINE void piece_at(const Piece *piece, double s, State *at) {
    const double s2 = s * s, s4 = s2 * s2;
    // Of the gains alone: v and w themselves would be rounded alike in each of many pieces.
    Four power = {0, s, s2, s2 * s}, slope = {0, 0, s, s2};
    Four x = FOUR(piece->x) * power, v = FOUR(piece->kx) * slope;
    Four r = FOUR(piece->r) * power, w = FOUR(piece->kr) * slope, sum;
    power = (Four){s4, s4 * s, s4 * s2, s4 * (s2 * s)};
    slope = (Four){s2 * s, s4, s4 * s, s4 * s2};
    for (size_t k = 4; k < piece->table->terms; k += 4) {
        x += FOUR(piece->x + k) * power;
        v += FOUR(piece->kx + k) * slope;
        r += FOUR(piece->r + k) * power;
        w += FOUR(piece->kr + k) * slope;
        power *= s4;
        slope *= s4;
    }
    const double rate = 1 / piece->table->length;
    wide_sum(&x, &v, &r, &w, &sum);
    *at = (State){piece->start[0] + sum[0], piece->start[1] + sum[1] * rate,
                  piece->start[2] + sum[2], piece->start[3] + sum[3] * rate};
}

INLINE void piece_sums_at(const Piece *piece, double s, const Quadrature *rule, size_t groups,
                          PieceSums *out) {
    enum { GROUPS_MAX = 2 }; // of four nodes
    const MotionTable *table = piece->table;
    const double length = table->length * s, value = piece->start[4], slope = piece->start[5];
    const size_t last = table->terms - 1;
    Four t[GROUPS_MAX], square[GROUPS_MAX], v[GROUPS_MAX], odd_v[GROUPS_MAX], w[GROUPS_MAX],
        odd_w[GROUPS_MAX], a[GROUPS_MAX], sums;
    Four vv = {0}, ww = {0}, av = {0}, aw = {0};
    for (size_t i = 0; i < groups; i++) {
        t[i] = FOUR(rule->node + 4 * i) * s;
        square[i] = t[i] * t[i];
        v[i] = odd_v[i] = w[i] = odd_w[i] = (Four){0};
    }
    // Even and odd powers of dx/ds side by side: kx[k] belongs to s^(k - 1), and kx[0] is 0.
    for (size_t k = last; k > 2; k -= 2)
        for (size_t i = 0; i < groups; i++) {
            v[i] = (v[i] + piece->kx[k]) * square[i];
            odd_v[i] = odd_v[i] * square[i] + piece->kx[k - 1];
            w[i] = (w[i] + piece->kr[k]) * square[i];
            odd_w[i] = odd_w[i] * square[i] + piece->kr[k - 1];
        }
    if (table->base_omega > 0) {
        double sum = 0;
        for (size_t i = 0; i < groups; i++)
            a[i] = (Four){0};
        for (size_t k = table->terms; k-- > 0;) {
            const double c = table->base[0][k] * value + table->base[1][k] * slope;
            sum = sum * s + c / (double)(k + 1);
            for (size_t i = 0; i < groups; i++)
                a[i] = a[i] * t[i] + c;
        }
        out->a = sum * length;
    } else {
        for (size_t i = 0; i < groups; i++)
            a[i] = value + slope * (table->length * t[i]);
        out->a = length * (value + slope * length / 2);
    }
    for (size_t i = 0; i < groups; i++) {
        const Four dx = (v[i] + piece->kx[1]) + t[i] * odd_v[i];
        const Four dr = (w[i] + piece->kr[1]) + t[i] * odd_w[i];
        const Four x = FOUR(rule->weight + 4 * i) * dx, r = FOUR(rule->weight + 4 * i) * dr;
        vv += x * dx;
        ww += r * dr;
        av += x * a[i];
        aw += r * a[i];
    }
    wide_sum(&vv, &ww, &av, &aw, &sums);
    const double per_length = s / table->length;
    out->vv = sums[0] * per_length;
    out->ww = sums[1] * per_length;
    out->av = sums[2] * s;
    out->aw = sums[3] * s;
}

// From the start to s, 0 < s <= 1.
INLINE void piece_sums(const Piece *piece, double s, PieceSums *out) {
    const Quadrature *rule = linear_motion_quadrature(piece->table->rho * s);
    if (rule->count <= 4)
        piece_sums_at(piece, s, rule, 1, out);
    else
        piece_sums_at(piece, s, rule, 2, out);
}

// --- roots

// Of the place of an event, and of that of a peak, whose size it changes by its square.
#define EVENT_TOLERANCE 3e-6
#define PEAK_TOLERANCE 3e-3

// A polynomial g on [0, s], as a function of u = t / s.
typedef struct PolynomialRange {
    double value, slope, bend;   // g, g' and g'' at u = 1
    double value_min;            // g is not smaller
    double slope_min, slope_max; // bounds of g'
    double bend_min, bend_max;   // bounds of g''
} PolynomialRange;

// `has_bounds`: all of it, else only the values at u = 1.
INLINE void polynomial_range(const double *c, size_t terms, double s, bool has_bounds,
                             PolynomialRange *range) {
    const double s2 = s * s, s4 = s2 * s2;
    Four power = {1, s, s2, s2 * s}, index = {0, 1, 2, 3}, sum, size;
    Four value = {0}, slope = {0}, bend = {0}, values = {0}, slopes = {0}, bends = {0};
    const Four none = {0};
    double first[4] = {0};
    for (size_t k = 0; k < terms; k += 4) {
        const Four term = FOUR(c + k) * power;
        const Four once = term * index, twice = once * (index - 1);
        value += term;
        slope += once;
        bend += twice;
        power *= s4;
        index += 4;
        if (!has_bounds)
            continue;
        if (k == 0)
            PUT_FOUR(first, term);
        wide_size(&term, &size);
        values += size;
        wide_size(&once, &size);
        slopes += size;
        wide_size(&twice, &size);
        bends += size;
    }
    wide_sum(&value, &slope, &bend, &none, &sum);
    range->value = sum[0];
    range->slope = sum[1];
    range->bend = sum[2];
    if (!has_bounds)
        return;
    // (a - |a|) / 2 is a where that is negative, else 0. The bounds keep the terms of u^0 whole,
    // and leave room for rounding.
    const double room = 1e-14, two = 2 * first[2];
    wide_sum(&values, &slopes, &bends, &none, &size);
    const double rest = sum[1] - first[1], rest_size = size[1] - fabs(first[1]);
    const double bend_rest = sum[2] - two, bend_size = size[2] - fabs(two);
    range->value_min =
        first[0] + ((sum[0] - first[0]) - (size[0] - fabs(first[0]))) / 2 - room * size[0];
    range->slope_min = first[1] + (rest - rest_size) / 2 - room * size[1];
    range->slope_max = first[1] + (rest + rest_size) / 2 + room * size[1];
    range->bend_min = two + (bend_rest - bend_size) / 2 - room * size[2];
    range->bend_max = two + (bend_rest + bend_size) / 2 + room * size[2];
}

// Where a polynomial of u that falls from `from` to all->value below 0 over [0, 1] is about 0: on
// the quintic of u over the value with the same slopes and curvatures at both ends, if it falls at
// both; else on a parabola. `first` and `second` are the slope and half the curvature at u = 0.
INLINE double polynomial_guess(double from, double first, double second,
                               const PolynomialRange *all) {
    const double fall = from - all->value, part = from / fall, left = 1 - part;
    double at;
    if (first < 0 && all->slope < 0) {
        // u is a function of p = (from - value) / fall, with these derivatives at 0 and 1.
        const double d0 = -fall / first, d1 = -fall / all->slope;
        const double e0 = 2 * second * d0 * d0 * d0 / fall, e1 = all->bend * d1 * d1 * d1 / fall;
        const double p2 = part * part, l2 = left * left;
        at = part +
             part * left * ((d0 - 1) * l2 * (1 + 3 * part) - (d1 - 1) * p2 * (1 + 3 * left)) +
             p2 * l2 * (e0 * left + e1 * part) / 2;
    } else {
        const double bend = all->value - from - first;
        at = (first + sqrt(first * first - 4 * bend * from)) / (-2 * bend);
    }
    return at > 0 && at <= 1 ? at : part;
}

// The first place in (0, end] at which a polynomial becomes negative, as polynomial_root_first, for
// pieces on which it is monotone, concave or convex; for all others by polynomial_root_first. `c`
// has `terms` coefficients, a multiple of 4, and a zero after them. The error is about `tolerance`
// cubed.
INLINE bool piece_root(const double *c, size_t terms, double end, double tolerance, double *s) {
    enum { STEPS_MAX = 8 };
    if (c[0] == 0) // a root at 0 does not count; what follows it is 0
        c++;
    PolynomialRange all;
    polynomial_range(c, terms, end, true, &all);
    const double from = c[0];
    if (all.value_min > 0)
        return false;
    const bool is_simple = all.slope_max < 0 || all.bend_max < 0;
    if (all.value > 0 && from > 0 && (is_simple || all.slope_min > 0))
        return false;
    if (all.value < 0 && from > 0 && (is_simple || all.bend_min > 0)) {
        double at = end * polynomial_guess(from, c[1] * end, c[2] * end * end, &all);
        for (int i = 0; i < STEPS_MAX; i++) { // Halley's method: the error is cubed
            PolynomialRange here;
            polynomial_range(c, terms, at, false, &here);
            const double step =
                here.value * here.slope / (here.slope * here.slope - here.value * here.bend / 2);
            at -= at * step;
            if (!(at > 0 && at <= end && here.slope < 0))
                break;
            if (fabs(step) <= tolerance) {
                *s = at;
                return true;
            }
        }
    }
    double scaled[PIECE_TERMS], power = 1;
    for (size_t k = 0; k < terms; k++, power *= end)
        scaled[k] = c[k] * power;
    if (!polynomial_root_first(scaled, terms - 1, s))
        return false;
    *s *= end;
    return true;
}

#endif
