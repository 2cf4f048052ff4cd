// Between events the storey and its free mass are a linear system in (x, v, r, w):
//   x'' = -a_g - s + share n,   r'' = s - n,   s = D x' + W x,   n = c r' + k r
// with c = k = 0 in flight. Flight over whole sample intervals goes by blocks (lanes.h), contact
// over whole sample intervals by the transition over one of them, and an interval with an event by
// pieces: Taylor polynomials about the piece's start, whose first root is the event.
#include "core/solve/single_mass.h"

#include <float.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "core/plan/plan.h"
#include "core/solve/linear_contact.h"
#include "core/solve/single_mass_state.h"
#include "core/solve/wide.h"

enum {
    PENDING_MAX = 1024,      // samples between two balances of energy
    PROGRESS_SAMPLES = 8192, // between two looks at the progress
    CLEAR_SAMPLES = 1 << 16, // prepared between two looks at the progress
    BLOCK = 32,              // samples of contact at a time
    PIECE_DEGREE = 26,
    PIECES_MAX = 24, // in one interval; longer contacts are the event engine's
    NEWTON_STEPS = 8,
};

// Solver steps of a sample in a block.
static const double SAMPLE_STEPS = 0.1;
// The longest step, times the system's rate: of a piece, and of the transition over one interval.
static const double PIECE_REACH = 1.0, MAP_REACH = 0.5;
// Intervals shorter than this, times the structure's rate and a sine's, are short.
static const double SHORT_REACH = 0.04;

// A motion over part of an interval: coefficients in s = t / length.
typedef struct Piece {
    double length; // [s]
    size_t degree;
    double x[PIECE_DEGREE + 1], v[PIECE_DEGREE + 1]; // v is dx/ds
    double r[PIECE_DEGREE + 1], w[PIECE_DEGREE + 1];
    double base[PIECE_DEGREE + 1]; // a_g
    size_t base_degree;
} Piece;

// The base from the present sample on: over how many intervals it goes on in one way, and its
// samples, or NULL where it is still or a sine.
static size_t single_mass_base_ahead(const SingleMass *single, const double **values) {
    const Base *base = single->run->base;
    *values = NULL;
    if (base->form != BASE_SAMPLED || single->sample + 1 >= base->count)
        return SIZE_MAX;
    *values = base->values + single->sample;
    return base->count - 1 - single->sample;
}

// From the present sample on, for how many intervals blocks serve: under a pulse while it is still.
static size_t single_mass_blocks_ahead(const SingleMass *single) {
    const Base *base = single->run->base;
    if (!single->has_blocks || base->form != BASE_PIECES)
        return single->has_blocks ? SIZE_MAX : 0;
    const double now = (double)single->sample / single->plan->sample_rate;
    bool is_still = true;
    for (size_t i = 0; i < base->piece_count; i++) {
        const BasePiece *piece = &base->pieces[i];
        const double until = (piece->time - now) * single->plan->sample_rate;
        if (until > 1e-6)
            return is_still ? (size_t)until : 0;
        is_still = piece->value == 0 && piece->slope == 0 && until < -1e-6;
    }
    return is_still ? SIZE_MAX : 0;
}

static inline size_t single_mass_smaller(size_t a, size_t b) {
    return a < b ? a : b;
}

// Whole intervals of flight; 0: a stop may be reached in the next one.
static size_t single_mass_flight_block(SingleMass *single, size_t most) {
    Stretch *s = &single->stretch;
    const double *base;
    most = single_mass_smaller(most, single_mass_base_ahead(single, &base));
    if (single->has_stops) {
        single->run->work.stop_searches++;
        s->left = single_mass_gap(single, SIDE_LEFT);
        s->right = single_mass_gap(single, SIDE_RIGHT);
    }
    if (single->plan->damper_count > 0)
        s->middle = single_mass_origin(single);
    const double z = single->state.v + single->state.w;
    s->x = single->state.x;
    s->v = single->state.v;
    s->r = single->state.r;
    s->z = z;
    const size_t count = lanes_fly(&single->lanes, s, single->sample, most, base);
    if (count == 0)
        return 0;
    single->state = (State){s->x, s->v, s->r, s->z - s->v};
    const double gain = z - s->z;
    single->free_work += gain * (z - gain / 2);
    Peaks *peaks = &single->impacts.response->peaks; // rounding_growth.h asks for this one
    peaks->displacement =
        single_mass_larger(peaks->displacement, lanes_take_peak(s, OF_DISPLACEMENT));
    single->pending += count;
    single->sample += count;
    single->run->steps += SAMPLE_STEPS * (double)count;
    WorkCounters *work = &single->run->work;
    *(single->run->base->form == BASE_STILL ? &work->unforced_samples : &work->flight_samples) +=
        count;
    single->last_velocity = s->v;
    return count;
}

// --- pieces

static const double piece_inverse[PIECE_DEGREE + 2] = {
    0,        1.0 / 1,  1.0 / 2,  1.0 / 3,  1.0 / 4,  1.0 / 5,  1.0 / 6,
    1.0 / 7,  1.0 / 8,  1.0 / 9,  1.0 / 10, 1.0 / 11, 1.0 / 12, 1.0 / 13,
    1.0 / 14, 1.0 / 15, 1.0 / 16, 1.0 / 17, 1.0 / 18, 1.0 / 19, 1.0 / 20,
    1.0 / 21, 1.0 / 22, 1.0 / 23, 1.0 / 24, 1.0 / 25, 1.0 / 26, 1.0 / 27};

// The degree that leaves only rounding: 3! rho^(n - 3) / n! is below 4e-18, as a base's slope
// enters x at t^3 only.
INLINE size_t piece_degree(double rho) {
    static const struct {
        double rho;
        size_t degree;
    } table[] = {{7.8e-6, 6}, {1.9e-3, 8}, {2.1e-2, 10}, {8.5e-2, 12}, {0.214, 14},
                 {0.413, 16}, {0.676, 18}, {0.994, 20},  {1.36, 22},   {1.76, 24}};
    size_t i = 0;
    while (i + 1 < COUNT(table) && rho > table[i].rho)
        i++;
    return table[i].degree;
}

INLINE void piece_make(Piece *p, const Motion *m, const State *y, const Slice *slice,
                       double length) {
    const double *inverse = piece_inverse, T = length, square = T * T;
    const double D = m->damping * T, W = m->omega2 * square;
    const double c = m->contact_damping * T, k2 = m->contact_omega2 * square, share = m->share;
    p->length = length;
    p->degree = piece_degree(length * single_mass_larger(m->rate, slice->omega));
    const size_t degree = p->degree;
    if (slice->omega > 0) {
        const double turn = slice->omega * T;
        const double cycle[4] = {slice->value, slice->slope, -slice->value, -slice->slope};
        double scale = 1;
        for (size_t k = 0; k <= degree; k++) {
            p->base[k] = cycle[k % 4] * scale;
            scale *= turn * inverse[k + 1];
        }
        p->base_degree = degree;
    } else {
        p->base[0] = slice->value;
        p->base[1] = slice->slope * T;
        p->base_degree = 1;
    }
    const double share_c = share * c, share_k = share * k2;
    const size_t base_degree = p->base_degree;
    double x = y->x, v = y->v * T, r = y->r, w = y->w * T;
    for (size_t k = 0; k < degree; k++) {
        p->x[k] = x;
        p->v[k] = v;
        p->r[k] = r;
        p->w[k] = w;
        const double s = D * v + W * x, n = c * w + k2 * r;
        const double next_x = v * inverse[k + 1], next_r = w * inverse[k + 1];
        const double own = (share_c * w - D * v) + (share_k * r - W * x);
        v = (k > base_degree ? own : own - square * p->base[k]) * inverse[k + 1];
        w = (s - n) * inverse[k + 1];
        x = next_x;
        r = next_r;
    }
    p->x[degree] = x;
    p->r[degree] = r;
    p->v[degree] = p->w[degree] = 0;
}

INLINE void piece_at(const Piece *p, double s, State *at) {
    double x = p->x[p->degree], v = 0, r = p->r[p->degree], w = 0;
    for (size_t k = p->degree; k-- > 0;) {
        x = x * s + p->x[k];
        v = v * s + p->v[k];
        r = r * s + p->r[k];
        w = w * s + p->w[k];
    }
    const double rate = 1 / p->length;
    *at = (State){x, v * rate, r, w * rate};
}

// From the start to s.
INLINE void piece_sums(const Piece *p, double rho, double s, PieceSums *out) {
    const Quadrature *rule = arc_quadrature(rho * s);
    double t[8], v[8] = {0}, w[8] = {0}, a[8] = {0};
    for (size_t i = 0; i < 8; i++)
        t[i] = rule->node[i] * s;
    for (size_t k = p->degree; k-- > 0;)
        for (size_t i = 0; i < 8; i++) {
            v[i] = v[i] * t[i] + p->v[k];
            w[i] = w[i] * t[i] + p->w[k];
        }
    double base = 0;
    for (size_t k = p->base_degree + 1; k-- > 0;) {
        base = base * s + p->base[k] * piece_inverse[k + 1];
        for (size_t i = 0; i < 8; i++)
            a[i] = a[i] * t[i] + p->base[k];
    }
    double vv = 0, ww = 0, av = 0, aw = 0;
    for (size_t i = 0; i < rule->count; i++) {
        const double weight = rule->weight[i];
        vv += weight * v[i] * v[i];
        ww += weight * w[i] * w[i];
        av += weight * a[i] * v[i];
        aw += weight * a[i] * w[i];
    }
    const double per_length = s / p->length;
    *out = (PieceSums){vv * per_length, ww * per_length, av * s, aw * s, base * s * p->length};
}

// Whether a curve surely is monotone or concave, so that it is nowhere below both of its ends.
static bool piece_is_simple(const double *c, size_t n) {
    double slope_least = c[1], slope_most = c[1], bend_most = n > 1 ? 2 * c[2] : 0;
    for (size_t k = 2; k <= n; k++) {
        const double slope = (double)k * c[k], bend = (double)(k - 1) * slope;
        slope_least += slope < 0 ? slope : 0;
        slope_most += slope > 0 ? slope : 0;
        bend_most += k > 2 && bend > 0 ? bend : 0;
    }
    return slope_least > 0 || slope_most < 0 || bend_most < 0;
}

// The first root in (0, 1], as polynomial_root_first: Newton from a guess, and a proof that what is
// left after dividing the root out has none before it.
static bool piece_first_root(const double *c, size_t degree, double *s) {
    const double *from = c;
    size_t n = degree;
    if (from[0] == 0 && n > 1) {
        from++;
        n--;
    }
    double least = from[0], end = from[0];
    for (size_t k = 1; k <= n; k++) {
        end += from[k];
        least += from[k] < 0 ? from[k] : 0;
    }
    if (least > 0)
        return false;
    if (!(end < 0))
        return !(end > 0 && from[0] > 0 && piece_is_simple(from, n)) &&
               polynomial_root_first(c, degree, s);
    if (!(from[0] > 0))
        return polynomial_root_first(c, degree, s);
    double slope_end = 0;
    for (size_t k = n; k > 0; k--)
        slope_end += (double)k * from[k];
    // On the cubic of s over the value with the same ends.
    const double all = from[0] - end, part = from[0] / all, left = 1 - part;
    double at = -1;
    if (from[1] < 0 && slope_end < 0)
        at = part + part * left * ((all / -from[1] - 1) * left - (all / -slope_end - 1) * part);
    if (!(at > 0 && at <= 1)) { // on the parabola with the same start, slope and end
        const double bend = end - from[0] - from[1];
        const double root = sqrt(single_mass_larger(from[1] * from[1] - 4 * bend * from[0], 0));
        at = from[1] < 0 ? 2 * from[0] / (root - from[1]) : (from[1] + root) / (-2 * bend);
    }
    if (!(at > 0 && at <= 1))
        at = part;
    double step = 1;
    for (int i = 0; i < NEWTON_STEPS && fabs(step) > 1e-9 * at; i++) {
        double value = from[n], slope = 0;
        for (size_t k = n; k-- > 0;) {
            slope = slope * at + value;
            value = value * at + from[k];
        }
        step = -value / slope;
        at += step;
        if (!(at > 0 && at <= 1))
            return polynomial_root_first(c, degree, s);
    }
    if (!(fabs(step) <= 1e-9 * at))
        return polynomial_root_first(c, degree, s);
    // (s - at) q(s): -q must be positive up to there.
    double q = from[n], power = 1;
    double divided[PIECE_DEGREE + 1];
    divided[0] = q;
    for (size_t k = n; k-- > 0;) {
        divided[k] = q;
        q = from[k] + at * q;
    }
    least = -divided[0];
    for (size_t k = 1; k < n; k++) {
        power *= at;
        const double term = -divided[k] * power;
        least += term < 0 ? term : 0;
    }
    if (!(least > 0))
        return polynomial_root_first(c, degree, s);
    *s = at;
    return true;
}

// The stop that the mass reaches on the piece, and where.
static bool single_mass_find_touch(const SingleMass *single, const Piece *p, double *s,
                                   Side *side) {
    single->run->work.stop_searches++;
    bool is_found = false;
    double reach = 0, gap[PIECE_DEGREE + 1];
    for (size_t k = 0; k <= p->degree; k++)
        reach += fabs(p->r[k]);
    for (int i = 0; i < 2; i++) {
        const double sign = single_mass_sign((Side)i), room = single_mass_gap(single, (Side)i);
        if (reach < room)
            continue;
        for (size_t k = 0; k <= p->degree; k++)
            gap[k] = -sign * p->r[k];
        gap[0] = single_mass_larger(gap[0] + room, 0);
        double at;
        if (piece_first_root(gap, p->degree, &at) && (!is_found || at < *s)) {
            is_found = true;
            *s = at;
            *side = (Side)i;
        }
    }
    return is_found;
}

static bool single_mass_find_release(const SingleMass *single, const Piece *p, double *s) {
    const double sign = single_mass_sign(single->side);
    double depth[PIECE_DEGREE + 1];
    for (size_t k = 0; k <= p->degree; k++)
        depth[k] = sign * p->r[k];
    depth[0] = single_mass_larger(depth[0], 0);
    return piece_first_root(depth, p->degree, s);
}

// The largest force on the piece up to s, and the acceleration there. `is_turning`: the force rises
// at the start and falls at s, or the other way round.
static void single_mass_peak(SingleMass *single, const Piece *p, double s, bool is_turning) {
    const Motion *m = &single->touching[single->side];
    const double T = p->length, mass = single_mass_effective(single) / (T * T);
    const double c = m->contact_damping * T, k2 = m->contact_omega2 * T * T;
    const size_t degree = p->degree - 1;
    double n[PIECE_DEGREE + 1];
    double bound = 0;
    for (size_t k = 0; k <= degree; k++) {
        n[k] = c * p->w[k] + k2 * p->r[k];
        bound += fabs(n[k]);
    }
    if (!(mass * bound > impact_log_least_force(&single->impacts, &single->row)))
        return;
    double at = s / 2, value = 0;
    if (!is_turning) { // it may turn twice
        double slope[PIECE_DEGREE + 1] = {0}, power = 1;
        const double sign = n[1] < 0 ? -1 : 1;
        for (size_t k = 0; k < degree; k++, power *= s)
            slope[k] = sign * (double)(k + 1) * n[k + 1] * power;
        double where;
        if (piece_is_simple(slope, degree - 1) || !polynomial_root_first(slope, degree - 1, &where))
            return;
        at = where * s;
        value = polynomial_value(n, degree, at);
    }
    // The zero of the slope: by Newton, or where that leaves the bracket by halves.
    double low = 0, high = s;
    const double sign = n[1] > 0 ? 1 : -1;
    for (int i = 0; is_turning && i < 4 * NEWTON_STEPS; i++) {
        double slope = 0, bend = 0;
        value = n[degree];
        for (size_t k = degree; k-- > 0;) {
            bend = bend * at + slope;
            slope = slope * at + value;
            value = value * at + n[k];
        }
        if (sign * slope > 0)
            low = at;
        else
            high = at;
        const double step = -slope / (2 * bend);
        if (fabs(step) < 1e-8 * s) {
            value += step * (slope + step * bend);
            break;
        }
        at = at + step > low && at + step < high ? at + step : (low + high) / 2;
    }
    if (!(mass * fabs(value) > impact_log_least_force(&single->impacts, &single->row)))
        return;
    impact_log_force(&single->impacts, &single->row, mass * fabs(value));
    State state;
    piece_at(p, at, &state);
    impact_log_acceleration(&single->impacts,
                            m->share * value / (T * T) - single_mass_push(single, &state));
}

// n' [m/s^3].
static inline double single_mass_rise(const SingleMass *single, const Motion *m, const State *at) {
    const double n = m->contact_damping * at->w + m->contact_omega2 * at->r;
    return m->contact_damping * (single_mass_push(single, at) - n) + m->contact_omega2 * at->w;
}

// The same for a piece from the present state to `end`; a force that rises or falls all the way is
// largest at its ends.
static inline void single_mass_peak_between(SingleMass *single, const Piece *p, double s,
                                            const State *end) {
    const Motion *m = &single->touching[single->side];
    const double from = single_mass_rise(single, m, &single->state);
    const double to = single_mass_rise(single, m, end);
    const bool is_turning = from > 0 ? to < 0 : to > 0;
    single_mass_peak(single, p, s, is_turning);
    if (!is_turning)
        impact_log_force(&single->impacts, &single->row,
                         single_mass_effective(single) *
                             fabs(m->contact_damping * end->w + m->contact_omega2 * end->r));
}

// --- events

// False: the mass may come to rest, which is the event engine's.
static bool single_mass_bounce(SingleMass *single, Side side) {
    const double sign = single_mass_sign(side), e = single->damper->stops[side].restitution;
    const double approach = fabs(single->state.w), share = single->flying.share;
    const double v = single->state.v + sign * share * (1 + e) * approach;
    const double pull =
        sign * (single->flying.damping * v + single->flying.omega2 * single->state.x);
    // The bounces that follow towards a stop that pushes are a geometric series.
    const double left = 2 * e * approach / (pull * (1 - e));
    if (!(approach > 0) || single->damper->clearance == 0 ||
        (pull > 0 ? !(left > 1e3 * DBL_EPSILON *
                                 single_mass_larger(single_mass_time(single), single->interval))
                  : e == 0))
        return false;
    single_mass_note(single);
    single_mass_end_phase(single);
    rounding_growth_bounce(&single->growth, e, single->state.w,
                           single_mass_push(single, &single->state));
    single->origin = (ContactOrigin)side;
    single->state.r = 0;
    single->state.v = v;
    single->state.w = -sign * e * approach;
    impact_log_bounce(&single->impacts, single_mass_time(single), 0, side, approach, e * approach,
                      single_mass_effective(single));
    single_mass_note(single);
    return true;
}

// False: the event engine has to go on from here.
static bool single_mass_touch(SingleMass *single, Side side) {
    if (single->plan->form != CONTACT_LINEAR)
        return single->plan->form == CONTACT_IMPULSIVE && single_mass_bounce(single, side);
    single_mass_note(single);
    single_mass_end_phase(single);
    single->phase = PHASE_CONTACT;
    single->side = side;
    single->origin = (ContactOrigin)side;
    single->state.r = 0;
    const double speed = fabs(single->state.w);
    impact_log_open(&single->row, IMPACT_IMPACT, single_mass_time(single), 0, side, speed);
    impact_log_force(&single->impacts, &single->row, single->damper->stops[side].damping * speed);
    single_mass_note_force(single);
    return true;
}

// One piece from the present instant, to its event or to `h` after the present sample at most.
// False: the event engine has to go on.
INLINE bool single_mass_step(SingleMass *single, double h) {
    const bool is_contact = single->phase == PHASE_CONTACT;
    const Motion *m = is_contact ? &single->touching[single->side] : &single->flying;
    Slice slice;
    if (single->has_blocks && single->is_short && single->run->base->form != BASE_PIECES) {
        single_mass_slice(single, &slice);
    } else {
        const double knot =
            base_cursor_slice(&single->base, single->sample, single->offset, &slice);
        h = single->offset + knot < h ? single->offset + knot : h;
    }
    double length = h - single->offset;
    const double rate = single_mass_larger(m->rate, slice.omega);
    length = length * rate > PIECE_REACH ? PIECE_REACH / rate : length;
    Piece piece;
    piece_make(&piece, m, &single->state, &slice, length);
    single->run->work.arcs++;
    single->run->steps += SINGLE_MASS_STEPS;
    double s = 1;
    Side side = single->side;
    const bool is_event =
        is_contact ? single_mass_find_release(single, &piece, &s)
                   : single->has_stops && single_mass_find_touch(single, &piece, &s, &side);
    if (!is_event)
        s = 1;
    if (s > 0) {
        PieceSums sums;
        State end;
        const double z = single->state.v + single->state.w;
        piece_sums(&piece, length * rate, s, &sums);
        piece_at(&piece, s, &end);
        if (is_contact) {
            single_mass_work(single, sums.vv, sums.av, sums.av + sums.aw);
            single_mass_peak_between(single, &piece, s, &end);
            impact_log_stretch(&single->impacts, &single->row, s * length,
                               -single->damper->mass * ((end.v + end.w) - z + sums.a),
                               single->damper->stops[single->side].damping * sums.ww);
        } else {
            single_mass_work(single, sums.vv, sums.av, sums.a * (z - sums.a / 2));
        }
        single->base_speed += sums.a;
        single->state = end;
        single->offset += s * length;
    }
    if (!is_event)
        return true;
    if (!is_contact)
        return single_mass_touch(single, side);
    single_mass_release(single);
    return true;
}

// --- flight over part of a short interval

INLINE void single_mass_take_flight(SingleMass *single, const TaylorFlight *flight, double s) {
    PieceSums sums;
    taylor_flight_integrals(flight, s, &sums);
    single_mass_work(single, sums.vv, sums.av, sums.av + sums.aw);
    single->base_speed += sums.a;
    taylor_flight_at(flight, s, &single->state);
    single->run->steps += SINGLE_MASS_STEPS;
}

// What r'' can come to in flight over the rest of an interval.
typedef struct PushBounds {
    double most; // |r''| is not larger
    double vary; // nor by how much it changes
} PushBounds;

INLINE void single_mass_bound_push(const SingleMass *single, double length, PushBounds *bounds) {
    const Lanes *lanes = &single->lanes;
    const double base = single->stretch.base_max, speed = fabs(single->state.v);
    bounds->most = (lanes->damping + lanes->omega) *
                   (speed + lanes->omega * fabs(single->state.x) + length * base);
    const double drive = bounds->most + base; // |x''| is not larger
    bounds->vary = length * (lanes->damping * drive + lanes->omega2 * (speed + length * drive));
}

typedef enum FlightEnd { END_SAMPLE, END_STOP, END_UNCLEAR } FlightEnd;

// A whole interval in which r turns: free if the stop that it went to is surely not reached, though
// it may come near.
INLINE bool single_mass_turns_before_stop(const SingleMass *single, const TaylorFlight *flight,
                                          double end, double slope, double vary) {
    const double h = single->interval, w = single->state.w * h,
                 push = single_mass_push(single, &single->state);
    const Side side = w > 0 ? SIDE_RIGHT : SIDE_LEFT;
    const double sign = single_mass_sign(side), room = single_mass_gap(single, side);
    const double other = single->damper->clearance - room, s = w / (w - slope);
    // The gap is a convex function of time, above each of its tangents.
    if (!(sign * push < -vary) || !(s > 0 && s < 1) || !(other > sign * -single->state.r) ||
        !(other > sign * -end))
        return false;
    double here, bend;
    const double gap = room - sign * taylor_flight_gap(flight, s, &here, &bend);
    return gap > fabs(here);
}

// From a sample to the stop that is reached before the next, or to that one; *side is the stop.
INLINE FlightEnd single_mass_fly_to_stop(SingleMass *single, Side *side) {
    enum { STEPS = 8 };
    single->run->work.stop_searches++;
    const double h = single->interval;
    Slice slice;
    TaylorFlight flight;
    single_mass_slice(single, &slice);
    taylor_flight_make(&flight, &single->short_flight, &single->state, &slice);
    double slope, bend;
    const double end = taylor_flight_gap(&flight, 1, &slope, &bend), w = single->state.w * h;
    *side = end > single->state.r ? SIDE_RIGHT : SIDE_LEFT;
    const double sign = single_mass_sign(*side), room = single_mass_gap(single, *side);
    const double from = room - sign * single->state.r, to = room - sign * end;
    PushBounds bounds;
    single_mass_bound_push(single, h, &bounds);
    // Between two instants w is as linear as r'' is constant.
    const double crooked = bounds.vary * h * h;
    if (!(from > 0))
        return END_UNCLEAR;
    if (to > 0) {
        // Away from one stop all the way, or too far from both for the curve to reach one.
        const double least = from < to ? from : to, other = single->damper->clearance;
        const double sag = bounds.most * h * h / 8;
        if (!(sign * slope > crooked && sign * w > crooked) &&
            !(least > sag && other - from > sag) &&
            !single_mass_turns_before_stop(single, &flight, end, slope, bounds.vary))
            return END_UNCLEAR;
        single_mass_take_flight(single, &flight, 1);
        return END_SAMPLE;
    }
    double s, step = 1;
    const double gone = from - to, first = sign * w;
    if (first > crooked) { // on the cubic of s over the gap with the slopes of both ends
        const double share = from / gone, left = 1 - share;
        s = share +
            share * left * ((gone / first - 1) * left - (gone / (sign * slope) - 1) * share);
    } else { // on the parabola
        const double half = (gone - first) * from * 4 + first * first;
        s = 2 * from / (first + sqrt(half > 0 ? half : 0));
    }
    for (int i = 0; i < STEPS && fabs(step) > 3e-6; i++) { // each step's error is about its cube
        const double gap = room - sign * taylor_flight_gap(&flight, s, &slope, &bend);
        step = gap * slope / (sign * slope * slope + gap * bend);
        s += step;
    }
    if (!(fabs(step) <= 3e-6) || !(s > 0) || !(s <= 1) || !(sign * slope > 0))
        return END_UNCLEAR;
    // Met once and not before, as r went towards this stop all the way, or as a function of time
    // that is all convex or all concave; and the other not at all.
    const bool is_straight = first > crooked && sign * slope > crooked;
    if (!is_straight && !(fabs(single_mass_push(single, &single->state)) > bounds.vary &&
                          single->damper->clearance - from > fabs(w)))
        return END_UNCLEAR;
    single_mass_take_flight(single, &flight, s);
    single->offset = s * h;
    return END_STOP;
}

// In flight from a stop to the next sample.
INLINE bool single_mass_fly_from_stop(SingleMass *single) {
    const double length = single->interval - single->offset,
                 sign = single_mass_sign((Side)single->origin);
    const double w = -sign * single->state.w;
    PushBounds bounds;
    single_mass_bound_push(single, length, &bounds);
    const double back =
        sign * single_mass_push(single, &single->state) + bounds.vary; // r'' to the stop, at most
    if (!(w > 0 && w > back * length / 2) ||
        !((w + bounds.most * length) * length < single->damper->clearance) || length <= 0)
        return false;
    Slice slice;
    TaylorFlight flight;
    single_mass_slice(single, &slice);
    taylor_flight_make(&flight, &single->short_flight, &single->state, &slice);
    single_mass_take_flight(single, &flight, length * flight.table->per_unit);
    return true;
}

// --- contact over whole intervals

static void contact_map_make(ContactMap *map, const Motion *m, double base_omega, double interval) {
    Piece columns[FORM_SIZE];
    for (int i = 0; i < FORM_SIZE; i++) {
        const State start = {i == 0, i == 1, i == 2, i == 3};
        // a_g = a + (b - a) t / h, or a cos + b sin.
        const Slice slice = base_omega > 0 ? (Slice){i == 4, i == 5, base_omega}
                            : i == 4       ? (Slice){1, -1 / interval, 0}
                            : i == 5       ? (Slice){0, 1 / interval, 0}
                                           : (Slice){0, 0, 0};
        piece_make(&columns[i], m, &start, &slice, interval);
        const Piece *p = &columns[i];
        double gain[4] = {0};
        for (size_t k = p->degree; k > 0; k--) { // small terms first
            gain[0] += p->x[k];
            gain[1] += p->v[k];
            gain[2] += p->r[k];
            gain[3] += p->w[k];
        }
        map->gain[i][0] = gain[0];
        map->gain[i][1] = gain[1] / interval;
        map->gain[i][2] = gain[2];
        map->gain[i][3] = gain[3] / interval;
    }
    memset(map->vv, 0, sizeof map->vv);
    memset(map->ww, 0, sizeof map->ww);
    memset(map->av, 0, sizeof map->av);
    memset(map->aw, 0, sizeof map->aw);
    const Quadrature *rule = &arc_rules[ARC_RULES - 1];
    for (size_t q = 0; q < rule->count; q++) {
        const double s = rule->node[q], weight = rule->weight[q] * interval;
        double v[FORM_SIZE], w[FORM_SIZE], a[FORM_SIZE];
        for (int i = 0; i < FORM_SIZE; i++) {
            v[i] = polynomial_value(columns[i].v, columns[i].degree, s) / interval;
            w[i] = polynomial_value(columns[i].w, columns[i].degree, s) / interval;
            a[i] = polynomial_value(columns[i].base, columns[i].base_degree, s);
        }
        for (int i = 0, n = 0; i < FORM_SIZE; i++)
            for (int j = i; j < FORM_SIZE; j++, n++) {
                const double both = i == j ? weight / 2 : weight;
                map->vv[n] += both * (v[i] * v[j] + v[j] * v[i]);
                map->ww[n] += both * (w[i] * w[j] + w[j] * w[i]);
                map->av[n] += both * (a[i] * v[j] + a[j] * v[i]);
                map->aw[n] += both * (a[i] * w[j] + a[j] * w[i]);
            }
    }
    map->is_made = true;
}

// Whole intervals that surely belong to the present contact; 0: its end may come in the next one.
INLINE size_t single_mass_contact_block(SingleMass *single, size_t most) {
    const Motion *m = &single->touching[single->side];
    const double h = single->interval, sign = single_mass_sign(single->side);
    ContactMap *map = &single->maps[single->side];
    if (m->rate * h > MAP_REACH)
        return 0;
    const double *base;
    most = single_mass_smaller(most, single_mass_base_ahead(single, &base));
    if (most > BLOCK)
        most = BLOCK;
    const Base *form = single->run->base;
    const bool is_sine = form->form == BASE_SINE;
    if (!map->is_made) {
        const ContactMap *other = &single->maps[single->side == SIDE_LEFT ? SIDE_RIGHT : SIDE_LEFT];
        const SingleMassKey *key = &single->key;
        if (other->is_made && key->contact_omega2[0] == key->contact_omega2[1] &&
            key->contact_damping[0] == key->contact_damping[1])
            *map = *other;
        else
            contact_map_make(map, m, is_sine ? form->omega : 0, h);
    }
    _Alignas(64) double y[FORM_SIZE][BLOCK + 8];
    if (!is_sine && base == NULL)
        for (size_t k = 0; k < BLOCK + 8; k++)
            y[4][k] = y[5][k] = 0;
    if (is_sine) {
        Slice slice;
        (void)base_cursor_interval(&single->base, single->sample, &slice);
        y[4][0] = slice.value;
        y[5][0] = slice.slope;
        const LanesMap *turns = &single->lanes.sample;
        for (size_t k = 0; k < most; k += LANES)
            for (size_t j = 0; j < LANES; j++) {
                y[4][k + j + 1] = turns->turn[0][j] * y[4][k] + turns->turn[1][j] * y[5][k];
                y[5][k + j + 1] = turns->turn[0][j] * y[5][k] - turns->turn[1][j] * y[4][k];
            }
    } else if (base != NULL) {
        memcpy(y[4], base, (most + 1) * sizeof *base);
        memcpy(y[5], base + 1, most * sizeof *base);
        y[5][most] = 0;
    }
    // |r''| over an interval: of the storey's own motion V and of the contact's N, each of which
    // drives the other.
    const double own = m->damping + sqrt(m->omega2), omega = sqrt(m->omega2);
    const double stiff = sqrt(m->contact_omega2), contact = stiff + m->contact_damping;
    const double both = own * h * h * m->share * contact, base_max = single->stretch.base_max;
    if (!(both < 0.5))
        return 0;
    const double per_both = 1 / (1 - both);
    Four at = {single->state.x, single->state.v, single->state.r, single->state.w};
    double(*const g)[4] = map->gain;
    const Four g0 = FOUR(g[0]), g1 = FOUR(g[1]), g2 = FOUR(g[2]), g3 = FOUR(g[3]);
    const Four g4 = FOUR(g[4]), g5 = FOUR(g[5]);
    size_t count = 0;
    y[0][0] = at[0];
    y[1][0] = at[1];
    y[2][0] = at[2];
    y[3][0] = at[3];
    while (count < most) {
        const double x = at[0], v = at[1], r = at[2], w = at[3];
        const double a = y[4][count], b = y[5][count];
        const Four next = at + (((g0 * x + g1 * v) + (g2 * r + g3 * w)) + (g4 * a + g5 * b));
        const double N = fabs(w) + stiff * fabs(r), V = fabs(v) + omega * fabs(x);
        const double V_most = (V + h * (m->share * contact * N + base_max)) * per_both;
        const double bend = own * V_most + contact * (N + own * h * V_most);
        const double from = sign * r, to = sign * next[2];
        const double least = from < to ? from : to;
        const bool is_inside =
            least > bend * h * h / 8 || fabs(w) > bend * h || fabs(next[3]) > bend * h;
        if (!(to > 0) || !is_inside)
            break;
        count++;
        at = next;
        y[0][count] = next[0];
        y[1][count] = next[1];
        y[2][count] = next[2];
        y[3][count] = next[3];
    }
    if (count == 0)
        return 0;
    // Arrays up to `count` from here on; zeros behind.
    const size_t padded = (count + 1 + 7) / 8 * 8;
    double last[FORM_SIZE];
    for (int i = 0; i < FORM_SIZE; i++) {
        last[i] = y[i][count];
        for (size_t k = count + 1; k < padded; k++)
            y[i][k] = 0;
    }
    const double mass = single_mass_effective(single), k2 = m->contact_omega2;
    const double c = m->contact_damping, D = m->damping, W = m->omega2, share = m->share;
    _Alignas(64) double n[BLOCK + 8], rise[BLOCK + 8], acceleration[BLOCK + 8];
    for (size_t k = 0; k < padded; k++) {
        const double s = D * y[1][k] + W * y[0][k];
        n[k] = c * y[3][k] + k2 * y[2][k];
        rise[k] = c * (s - n[k]) + k2 * y[3][k];
        acceleration[k] = share * n[k] - s;
    }
    // Peaks of the force between samples.
    for (size_t k = 0; k < count; k++) {
        if (!(sign * rise[k] > 0 && sign * rise[k + 1] < 0))
            continue;
        Slice slice = {y[4][k], (y[5][k] - y[4][k]) / h, 0};
        if (is_sine)
            slice = (Slice){y[4][k], y[5][k], form->omega};
        const State start = {y[0][k], y[1][k], y[2][k], y[3][k]};
        Piece piece;
        piece_make(&piece, m, &start, &slice, h);
        single_mass_peak(single, &piece, 1, true);
    }
    // Samples 1 to count.
    const size_t first = single->sample + 1, bytes = count * sizeof(double);
    const double middle = single_mass_origin(single);
    double *const *columns = single->columns;
    if (columns[CHANNEL_DISPLACEMENT] != NULL)
        memcpy(columns[CHANNEL_DISPLACEMENT] + first, y[0] + 1, bytes);
    if (columns[CHANNEL_VELOCITY] != NULL)
        memcpy(columns[CHANNEL_VELOCITY] + first, y[1] + 1, bytes);
    if (columns[CHANNEL_ACCELERATION] != NULL)
        memcpy(columns[CHANNEL_ACCELERATION] + first, acceleration + 1, bytes);
    for (size_t k = 1; k <= count && columns[CHANNEL_DAMPER_DISPLACEMENT] != NULL; k++)
        columns[CHANNEL_DAMPER_DISPLACEMENT][single->sample + k] = y[0][k] + (middle + y[2][k]);
    for (size_t k = 1; k <= count && columns[CHANNEL_DAMPER_VELOCITY] != NULL; k++)
        columns[CHANNEL_DAMPER_VELOCITY][single->sample + k] = y[1][k] + y[3][k];
    for (size_t k = 1; k <= count && columns[CHANNEL_PENETRATION] != NULL; k++)
        columns[CHANNEL_PENETRATION][single->sample + k] = sign * y[2][k];
    for (size_t k = 1; k <= count && columns[CHANNEL_CONTACT_FORCE] != NULL; k++)
        columns[CHANNEL_CONTACT_FORCE][single->sample + k] = mass * n[k];
    for (size_t k = 1; k <= count && columns[CHANNEL_BASE_ACCELERATION] != NULL; k++)
        columns[CHANNEL_BASE_ACCELERATION][single->sample + k] =
            base_cursor_at(&single->base, single->sample + k);
    double gain = 0; // of the base's velocity
    for (size_t k = 0; k < count; k++) {
        double one = (y[4][k] + y[5][k]) * (h / 2);
        if (is_sine) {
            const LanesMap *turns = &single->lanes.sample;
            one = -(turns->speed_s[0][0] * y[4][k] + turns->speed_s[1][0] * y[5][k]);
        }
        gain += one;
        single_mass_put(columns[CHANNEL_MEAN_ACCELERATION], first + k,
                        (y[1][k + 1] - y[1][k] + one) * single->plan->sample_rate);
    }
    double peak[5] = {0}, squares[2] = {0};
    for (size_t k = 1; k <= count; k++) {
        const double place = y[0][k] + (middle + y[2][k]);
        peak[0] = single_mass_larger(peak[0], fabs(y[0][k]));
        peak[1] = single_mass_larger(peak[1], fabs(y[1][k]));
        peak[2] = single_mass_larger(peak[2], fabs(acceleration[k]));
        peak[3] = single_mass_larger(peak[3], fabs(place));
        peak[4] = single_mass_larger(peak[4], fabs(n[k]));
        squares[0] += y[0][k] * y[0][k];
        squares[1] += acceleration[k] * acceleration[k];
    }
    Peaks *peaks = &single->impacts.response->peaks;
    peaks->displacement = single_mass_larger(peaks->displacement, peak[0]);
    peaks->velocity = single_mass_larger(peaks->velocity, peak[1]);
    peaks->acceleration = single_mass_larger(peaks->acceleration, peak[2]);
    peaks->damper_displacement = single_mass_larger(peaks->damper_displacement, peak[3]);
    impact_log_force(&single->impacts, &single->row, mass * peak[4]);
    if (single->sample >= single->statistics_start) {
        single->squares[0] += squares[0];
        single->squares[1] += squares[1];
        single->statistics_count += count;
    }
    // Work: over the intervals from samples 0 to count - 1.
    for (int i = 0; i < FORM_SIZE; i++)
        y[i][count] = 0;
    double vv = 0, ww = 0, av = 0, aw = 0;
    for (int i = 0, p = 0; i < FORM_SIZE; i++)
        for (int j = i; j < FORM_SIZE; j++, p++) {
            double lanes[8] = {0};
            for (size_t k = 0; k < padded; k += 8)
                for (size_t l = 0; l < 8; l++)
                    lanes[l] += y[i][k + l] * y[j][k + l];
            const double sum = ((lanes[0] + lanes[4]) + (lanes[2] + lanes[6])) +
                               ((lanes[1] + lanes[5]) + (lanes[3] + lanes[7]));
            vv += map->vv[p] * sum;
            ww += map->ww[p] * sum;
            av += map->av[p] * sum;
            aw += map->aw[p] * sum;
        }
    const double z = single->state.v + single->state.w;
    single_mass_work(single, vv, av, av + aw);
    impact_log_stretch(&single->impacts, &single->row, (double)count * h,
                       -single->damper->mass * ((last[1] + last[3]) - z + gain),
                       single->damper->stops[single->side].damping * ww);
    single->state = (State){last[0], last[1], last[2], last[3]};
    single->last_velocity = last[1];
    single->sample += count;
    single->run->steps += SAMPLE_STEPS * (double)count;
    return count;
}

// --- the event engine for what is not handled here

static Status single_mass_need_engine(SingleMass *single) {
    if (single->engine != NULL)
        return STATUS_OK;
    single->engine = calloc(1, sizeof *single->engine);
    if (single->engine == NULL)
        return problem_set(single->problem, STATUS_NO_MEMORY, "no memory for a run");
    TRY(event_engine_make(single->engine, single->run, 0, single->impacts.response,
                          single->problem));
    single->engine->growth = &single->growth;
    return STATUS_OK;
}

static void single_mass_to_engine(SingleMass *single) {
    EventEngine *engine = single->engine;
    ModalState *state = &engine->state;
    const double shape = state->modes->shapes[0];
    state->q[0] = single->state.x / shape;
    state->p[0] = single->state.v / shape;
    state->sample = single->sample;
    state->offset = single->offset;
    state->impacts = single->impacts;
    state->events_at_instant = 0;
    state->chatter_events = 0;
    if (single->plan->damper_count > 0) {
        DamperState *damper = &state->damper[0];
        damper->phase = single->phase;
        damper->side = single->side;
        damper->origin = single->origin;
        damper->r = single->state.r;
        damper->w = single->state.w;
        damper->zero_gap_terms = 0;
        damper->just_begun = false;
        damper->row = single->row;
        if (single->phase == PHASE_CONTACT)
            damper->contact =
                stops_freeze(&damper->plan->stops[damper->side], single->row.impact.approach_speed);
    }
    engine->record.base_speed = single->base_speed;
    for (size_t i = 0; i < single->run->column_count; i++)
        engine->record.last_velocity[i] = single->last_velocity;
    Slice slice;
    (void)base_cursor_slice(&state->base, state->sample, state->offset, &slice);
    state->base_acceleration = slice.value;
    modal_state_forces(state);
}

// Returns whether the kernels of this file can go on.
static bool single_mass_from_engine(SingleMass *single) {
    const EventEngine *engine = single->engine;
    const ModalState *state = &engine->state;
    const double shape = state->modes->shapes[0];
    single->state.x = state->q[0] * shape;
    single->state.v = state->p[0] * shape;
    single->sample = state->sample;
    single->offset = state->offset;
    single->impacts = state->impacts;
    single->base_speed = engine->record.base_speed;
    single->last_velocity = single->state.v;
    if (single->plan->damper_count == 0)
        return true;
    const DamperState *damper = &state->damper[0];
    single->phase = damper->phase;
    single->side = damper->side;
    single->origin = damper->origin;
    single->state.r = damper->r;
    single->state.w = damper->w;
    single->row = damper->row;
    return damper->phase == PHASE_CONTACT ||
           (damper->phase == PHASE_FLIGHT && damper->zero_gap_terms == 0);
}

static Status single_mass_check(SingleMass *single) {
    const State *state = &single->state;
    const Run *run = single->run;
    TRY(impact_log_status(&single->impacts, single->problem));
    if (!isfinite(state->x) || !isfinite(state->v) || !isfinite(state->r) || !isfinite(state->w))
        return problem_set(single->problem, STATUS_UNSTABLE,
                           "the motion left what double precision can hold at t = %.6g s",
                           single_mass_time(single));
    if (run->steps_max > 0 && run->steps > run->steps_max)
        return problem_set(single->problem, STATUS_LIMIT, SOLVER_STOPPED "t = %.6g s of %.6g s",
                           run->steps_max, run->steps_max * SOLVER_STEP, single_mass_time(single),
                           single->plan->duration);
    if (!progress_advance(run->progress, single_mass_time(single) / single->plan->duration))
        return problem_set(single->problem, STATUS_CANCELLED, "cancelled at t = %.6g s",
                           single_mass_time(single));
    return STATUS_OK;
}

// By the event engine from the present instant to a sample where these kernels can go on, or to the
// last one.
static Status single_mass_by_engine(SingleMass *single) {
    single_mass_flush(single);
    TRY(single_mass_need_engine(single));
    single_mass_to_engine(single);
    const size_t last = single->plan->count - 1;
    EventEngine *engine = single->engine;
    if (engine->state.offset > 0)
        TRY(event_engine_finish_interval(engine));
    else
        TRY(event_engine_step(engine, engine->state.sample + 1));
    while (!single_mass_from_engine(single) && single->sample < last)
        TRY(event_engine_step(engine, engine->state.sample + 1));
    return single_mass_check(single);
}

// Whole intervals by blocks, stiff contacts in closed form, and all else by pieces, up to sample
// `until`; false: the event engine has to go on.
INLINE bool single_mass_advance(SingleMass *single, size_t until) {
    const double h = single->interval, clock = 2 * DBL_EPSILON * h;
    int pieces = 0;
    bool is_released = false; // just now
    while (single->sample < until) {
        const bool is_flight = single->phase == PHASE_FLIGHT;
        const size_t ahead = single_mass_blocks_ahead(single);
        const bool is_quick = ahead > 0 && single->is_short;
        size_t most = single_mass_smaller(until - single->sample, ahead);
        if (single->offset == 0 && ahead > 0) {
            // The sample where statistics begin is not for blocks: much begins anew there.
            if (single->sample < single->statistics_start)
                most = single_mass_smaller(most, single->statistics_start - 1 - single->sample);
            const size_t passed = most == 0   ? 0
                                  : is_flight ? single_mass_flight_block(single, most)
                                              : single_mass_contact_block(single, most);
            if (single->pending >= PENDING_MAX)
                single_mass_flush(single);
            if (passed > 0)
                continue;
        }
        if (h - single->offset <= clock) {
            single_mass_pass(single);
            pieces = 0;
            continue;
        }
        if (!is_flight && is_quick && single->state.r == 0 &&
            single->touching[single->side].rate * h > MAP_REACH) {
            const size_t sample = single->sample;
            const double offset = single->offset;
            (void)linear_contact_run(single, single_mass_smaller(until - sample, ahead));
            if (single->sample != sample || single->offset != offset) {
                pieces = 0;
                continue;
            }
        }
        if (is_flight && is_quick && (pieces == 0 || is_released)) {
            is_released = false;
            Side side;
            const FlightEnd end =
                single->offset == 0 && single->has_stops ? single_mass_fly_to_stop(single, &side)
                : single->offset > 0 && single_mass_fly_from_stop(single) ? END_SAMPLE
                                                                          : END_UNCLEAR;
            if (end == END_SAMPLE)
                single->offset = h;
            else if (end == END_STOP && !single_mass_touch(single, side))
                return false;
            if (end != END_UNCLEAR)
                continue;
        }
        if (++pieces > PIECES_MAX || !single_mass_step(single, h))
            return false;
        is_released = !is_flight && single->phase == PHASE_FLIGHT;
    }
    return true;
}

WIDE static bool single_mass_advance_wide(SingleMass *single, size_t until) {
    return single_mass_advance(single, until);
}

static bool single_mass_advance_plain(SingleMass *single, size_t until) {
    return single_mass_advance(single, until);
}

static Status single_mass_loop(SingleMass *single) {
    const size_t last = single->plan->count - 1;
    const bool is_wide = single->lanes.width != LANES_PLAIN;
    while (single->sample < last) {
        const size_t until =
            single->sample + single_mass_smaller(last - single->sample, PROGRESS_SAMPLES);
        if (!(is_wide ? single_mass_advance_wide(single, until)
                      : single_mass_advance_plain(single, until)))
            TRY(single_mass_by_engine(single));
        TRY(single_mass_check(single));
    }
    return STATUS_OK;
}

// --- a run

// The largest of |values|, and of how far each is from the one before.
INLINE void single_mass_measure(const double *values, size_t count, double *most, double *step) {
    enum { SIDE_BY_SIDE = 32 };
    double sizes[SIDE_BY_SIDE] = {0}, steps[SIDE_BY_SIDE] = {0};
    size_t i = 1;
    for (; i + SIDE_BY_SIDE <= count; i += SIDE_BY_SIDE)
        for (size_t j = 0; j < SIDE_BY_SIDE; j++) {
            const double size = fabs(values[i + j]),
                         change = fabs(values[i + j] - values[i + j - 1]);
            sizes[j] = size > sizes[j] ? size : sizes[j];
            steps[j] = change > steps[j] ? change : steps[j];
        }
    *most = count > 0 ? fabs(values[0]) : 0;
    *step = 0;
    for (; i < count; i++) {
        *most = single_mass_larger(*most, fabs(values[i]));
        *step = single_mass_larger(*step, fabs(values[i] - values[i - 1]));
    }
    for (size_t j = 0; j < SIDE_BY_SIDE; j++) {
        *most = single_mass_larger(*most, sizes[j]);
        *step = single_mass_larger(*step, steps[j]);
    }
}

WIDE static void single_mass_measure_wide(const double *values, size_t count, double *most,
                                          double *step) {
    single_mass_measure(values, count, most, step);
}

// The columns' values that flight leaves alone, of samples `from` to `to`; contacts write over
// them.
static void single_mass_clear_rows(const SingleMass *single, size_t from, size_t to) {
    const Base *base = single->run->base;
    for (int i = 0; i < CHANNEL_COUNT; i++)
        if (single->columns[i] != NULL && single->stretch.columns[i] == NULL)
            memset(single->columns[i] + from, 0, (to - from) * sizeof(double));
    // From its last sample on the base is still.
    double *const column = single->columns[CHANNEL_BASE_ACCELERATION];
    const size_t given = base->count > 0 ? base->count - 1 : 0, end = given < to ? given : to;
    if (column != NULL && base->form == BASE_SAMPLED && single->base.ratio == 1 && from < end)
        memcpy(column + from, base->values + from, (end - from) * sizeof *column);
}

// Part by part: all at once takes long where the run has many samples.
static Status single_mass_clear_columns(const SingleMass *single) {
    const size_t count = single->plan->count;
    for (size_t from = 0; from < count; from += CLEAR_SAMPLES) {
        if (from > 0 && !progress_advance(single->run->progress, 0))
            return problem_set(single->problem, STATUS_CANCELLED, "cancelled at t = 0 s");
        single_mass_clear_rows(single, from,
                               count - from > CLEAR_SAMPLES ? from + CLEAR_SAMPLES : count);
    }
    return STATUS_OK;
}

static void single_mass_make_motions(SingleMass *single) {
    const Plan *plan = single->plan;
    const double total = plan->mass[0] + single->damper->mass;
    const double share = single->damper->mass / total, mass = plan->mass[0] * share;
    Motion flying = {.omega2 = plan->stiffness[0] / plan->mass[0],
                     .damping = plan->damping[0] / plan->mass[0],
                     .share = share};
    const double own = fmax(sqrt(flying.omega2), flying.damping);
    flying.rate = fmax(own, 1e-300);
    single->flying = single->resting = flying;
    single->resting.is_resting = true;
    for (int side = 0; side < 2 && plan->form == CONTACT_LINEAR && single->has_stops; side++) {
        Motion *touching = &single->touching[side];
        *touching = flying;
        touching->contact_omega2 = single->damper->stops[side].stiffness / mass;
        touching->contact_damping = single->damper->stops[side].damping / mass;
        touching->rate = fmax(own + fmax(sqrt(touching->contact_omega2), touching->contact_damping),
                              flying.rate);
    }
}

// Tables of another system are forgotten.
static void single_mass_keep_tables(SingleMass *single) {
    const Motion *left = &single->touching[SIDE_LEFT], *right = &single->touching[SIDE_RIGHT];
    const SingleMassKey key = {
        .omega2 = single->flying.omega2,
        .damping = single->flying.damping,
        .share = single->flying.share,
        .contact_omega2 = {left->contact_omega2, right->contact_omega2},
        .contact_damping = {left->contact_damping, right->contact_damping},
        .interval = single->interval,
        .base_omega = single->run->base->form == BASE_SINE ? single->run->base->omega : 0};
    if (single->has_tables && memcmp(&key, &single->key, sizeof key) == 0)
        return;
    single->key = key;
    single->has_tables = true;
    single->maps[0].is_made = single->maps[1].is_made = false;
    single->has_modes[0] = single->has_modes[1] = false;
    lanes_make(&single->lanes, &single->flying, key.base_omega, key.interval, lanes_widest());
    taylor_flight_table_make(&single->short_flight, &single->flying, key.base_omega, key.interval);
}

static Status single_mass_start(SingleMass *single, Run *run, Response *response,
                                Problem *problem) {
    const Plan *plan = run->plan;
    const Base *base = run->base;
    memset(single, 0, offsetof(SingleMass, key));
    single->run = run;
    single->plan = plan;
    single->damper = plan->dampers;
    single->problem = problem;
    single->interval = 1 / plan->sample_rate;
    single->has_stops = plan->damper_count > 0 && !run->is_clear;
    single->phase = PHASE_FLIGHT;
    single->origin = FROM_MIDDLE;
    single_mass_make_motions(single);
    const Motion *flying = &single->flying;
    if (!isfinite(flying->rate) ||
        !isfinite(single->touching[SIDE_LEFT].rate + single->touching[SIDE_RIGHT].rate) ||
        !(flying->share > 0 || plan->damper_count == 0) || !(flying->share < 1))
        return problem_set(
            problem, STATUS_UNSTABLE,
            "the scene's masses and stiffnesses are too far apart for double precision");
    base_cursor_make(&single->base, base, plan->sample_rate);
    single_mass_keep_tables(single);
    single->state = (State){plan->displacement[0], plan->velocity[0], single->damper->position,
                            single->damper->velocity};
    rounding_growth_start(&single->growth, flying, single->touching, &single->resting,
                          &single->state, single->damper->clearance, base->form == BASE_SINE,
                          plan->duration);
    const EnergyState energy = single_mass_energy(single);
    impact_log_start(&single->impacts, response, run->impacts_max, &energy);
    single->impacts.gain_max = IMPACT_LOG_GAIN_EXACT;
    for (size_t i = 0; i < run->column_count; i++)
        single->columns[run->columns[i].channel] = run->columns[i].values;
    single->statistics_start = (size_t)ceil(run->statistics_from * plan->sample_rate * (1 - 1e-12));
    response->sample_rate = plan->sample_rate;
    response->count = plan->count;
    single->has_blocks =
        single->lanes.run != NULL && (base->form != BASE_SAMPLED || single->base.ratio == 1);
    Stretch *stretch = &single->stretch;
    if (base->form == BASE_SAMPLED) {
        double step;
        if (single->lanes.width != LANES_PLAIN)
            single_mass_measure_wide(base->values, base->count, &stretch->base_max, &step);
        else
            single_mass_measure(base->values, base->count, &stretch->base_max, &step);
        single->base_slope = step * plan->sample_rate;
    }
    if (base->form == BASE_SINE)
        stretch->base_max = single->base_slope = fabs(base->amplitude);
    single->is_short = fmax(flying->rate, base->omega) * single->interval <= SHORT_REACH;
    stretch->base = &single->base;
    memcpy(stretch->columns, single->columns, sizeof stretch->columns);
    stretch->left = stretch->right = INFINITY;
    for (int i = 0; i < CHANNEL_COUNT; i++) {
        const bool is_damper = i == CHANNEL_DAMPER_DISPLACEMENT || i == CHANNEL_DAMPER_VELOCITY;
        if (i == CHANNEL_PENETRATION || i == CHANNEL_CONTACT_FORCE ||
            (i == CHANNEL_BASE_ACCELERATION && base->form != BASE_SINE) ||
            (is_damper && plan->damper_count == 0))
            stretch->columns[i] = NULL;
    }
    return single->has_blocks ? single_mass_clear_columns(single) : STATUS_OK;
}

// A mass that starts on a stop may touch it at t = 0; the first sample shows the moment after.
static Status single_mass_first_sample(SingleMass *single) {
    if (!single->has_stops || fabs(single->state.r) < single->damper->clearance / 2) {
        single_mass_record(single);
        return STATUS_OK;
    }
    TRY(single_mass_need_engine(single));
    single_mass_to_engine(single);
    TRY(event_engine_settle(single->engine));
    event_engine_take_sample(single->engine);
    if (!single_mass_from_engine(single) && single->plan->count > 1)
        return single_mass_by_engine(single);
    return STATUS_OK;
}

static Status single_mass_solve(SingleMass *single) {
    const Plan *plan = single->plan;
    TRY(single_mass_first_sample(single));
    TRY(single_mass_loop(single));
    single_mass_flush(single);
    // The duration may end between samples.
    const double rest = plan->duration - (double)single->sample / plan->sample_rate;
    bool is_there = single->phase != PHASE_RESTING;
    for (int i = 0; is_there && rest - single->offset > 2 * DBL_EPSILON * rest; i++)
        is_there = i < PIECES_MAX && single_mass_step(single, rest);
    if (!is_there) {
        TRY(single_mass_need_engine(single));
        single_mass_to_engine(single);
        TRY(event_engine_cross(single->engine, rest));
        (void)single_mass_from_engine(single);
    }
    single_mass_note(single);
    single_mass_end_phase(single);
    rounding_growth_report(&single->growth, single->impacts.response);
    TRY(single_mass_check(single));
    const EnergyState energy = single_mass_energy(single);
    const Status status =
        impact_log_finish(&single->impacts, &single->row, 1, &energy, single->problem);
    impact_log_count(&single->impacts, &single->run->work);
    return status;
}

static Status single_mass_run_with(SingleMass *single, Run *run, Response *response,
                                   Problem *problem) {
    Status status = single_mass_start(single, run, response, problem);
    if (status == STATUS_OK)
        status = single_mass_solve(single);
    if (single->engine != NULL && single->engine->record.block != NULL)
        recorder_finish(&single->engine->record, &single->engine->state, response);
    response->sum_squares_displacement += single->squares[0];
    response->sum_squares_acceleration += single->squares[1];
    response->statistics_count += single->statistics_count;
    if (single->engine != NULL)
        event_engine_clear(single->engine);
    free(single->engine);
    single->engine = NULL;
    return status;
}

bool single_mass_serves(const Plan *plan, bool is_clear) {
    return plan_is_single(plan) || (is_clear && plan_is_single_in_flight(plan));
}

// Without a workspace: all on the stack.
static __attribute__((noinline)) Status single_mass_run_alone(Run *run, Response *response,
                                                              Problem *problem) {
    SingleMass single;
    memset(&single, 0, sizeof single);
    return single_mass_run_with(&single, run, response, problem);
}

Status single_mass_run(Run *run, Response *response, Problem *problem) {
    Workspace *workspace = run->workspace;
    if (workspace == NULL)
        return single_mass_run_alone(run, response, problem);
    if (workspace->single == NULL) {
        // Its vectors want their alignment.
        const size_t room = (sizeof(SingleMass) + 63) / 64 * 64;
        if ((workspace->single = aligned_alloc(64, room)) == NULL)
            return single_mass_run_alone(run, response, problem);
        memset(workspace->single, 0, room);
    }
    return single_mass_run_with(workspace->single, run, response, problem);
}
