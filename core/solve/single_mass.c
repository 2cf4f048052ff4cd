// Between events the storey and its free mass are a linear system in (x, v, r, w):
//   x'' = -a_g - s + share n,   r'' = s - n,   s = D x' + W x,   n = c r' + k r
// with c = k = 0 in flight. Flight over whole sample intervals goes by blocks (lanes.h), contact
// over whole sample intervals by a table of the transitions over one to four of them, and an
// interval with an event by pieces (motion_table.h), whose first root is the event.
#include "core/solve/single_mass.h"

#include <float.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "core/plan/plan.h"
#include "core/solve/single_mass_state.h"
#include "core/solve/wide.h"

enum {
    PENDING_MAX = 1024,      // samples between two balances of energy
    PROGRESS_SAMPLES = 8192, // between two looks at limits and progress, at most
    CLEAR_SAMPLES = 1 << 16, // prepared between two looks at the progress
    BLOCK = 32,              // samples of contact at a time, a multiple of 8
    PIECES_MAX = 24,         // of one contact in an interval; longer ones are the event engine's
    EVENTS_MAX = 4096,       // in an interval; with more the event engine goes on
};

// Solver steps between two looks at limits and progress.
static const double PROGRESS_STEPS = 3e4;
// Solver steps of a sample in a block.
static const double SAMPLE_STEPS = 0.1;
// The longest piece, times the system's rate.
static const double PIECE_REACH = 1.0;

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
    FlightBlock *s = &single->stretch;
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

// The table of the present contact state for pieces under `slice`.
static MotionTable *single_mass_table(SingleMass *single, const Slice *slice) {
    const bool is_contact = single->phase == PHASE_CONTACT;
    const Motion *m = is_contact ? &single->touching[single->side] : &single->flying;
    MotionTable *table = &single->tables[is_contact ? single->contact_table[single->side] : 0];
    if (!table->is_made || table->base_omega != slice->omega) {
        const double rate = single_mass_larger(m->rate, slice->omega), h = single->interval;
        motion_table_make(table, m, slice->omega, rate * h > PIECE_REACH ? PIECE_REACH / rate : h);
    }
    return table;
}

// The stop that the mass reaches on the piece up to `end`, and where.
INLINE bool single_mass_find_touch(const SingleMass *single, const Piece *piece, double end,
                                   double *s, Side *side) {
    single->run->work.stop_searches++;
    const size_t terms = piece->table->terms;
    bool is_found = false;
    double reach = 0, gap[PIECE_TERMS + 1];
    for (size_t k = 0; k < terms; k++)
        reach += fabs(piece->r[k]);
    for (int i = 0; i < 2; i++) {
        const double sign = single_mass_sign((Side)i), room = single_mass_gap(single, (Side)i);
        if (reach < room)
            continue;
        for (size_t k = 0; k < terms; k++)
            gap[k] = -sign * piece->r[k];
        gap[terms] = 0;
        gap[0] = single_mass_larger(gap[0] + room, 0);
        double at;
        if (piece_root(gap, terms, end, EVENT_TOLERANCE, &at) && (!is_found || at < *s)) {
            is_found = true;
            *s = at;
            *side = (Side)i;
        }
    }
    return is_found;
}

INLINE bool single_mass_find_release(const SingleMass *single, const Piece *piece, double end,
                                     double *s) {
    const double sign = single_mass_sign(single->side);
    const size_t terms = piece->table->terms;
    double depth[PIECE_TERMS + 1];
    for (size_t k = 0; k < terms; k++)
        depth[k] = sign * piece->r[k];
    depth[terms] = 0;
    depth[0] = single_mass_larger(depth[0], 0);
    return piece_root(depth, terms, end, EVENT_TOLERANCE, s);
}

// The largest force on the piece between its start and s, and the acceleration there.
INLINE void single_mass_peak(SingleMass *single, const Piece *piece, double s) {
    const MotionTable *table = piece->table;
    const Motion *m = &table->motion;
    const double mass = single_mass_effective(single),
                 per_square = 1 / (table->length * table->length);
    double slope[PIECE_TERMS + 1], bound = 0;
    Four index = {0, 1, 2, 3}, sizes = {0}, size;
    for (size_t k = 0; k < table->terms; k += 4) {
        Four n;
        piece_row(table->n, piece->start, k, &n);
        PUT_FOUR(slope + k, n * index);
        wide_size(&n, &size);
        sizes += size;
        index += 4;
    }
    slope[table->terms] = 0;
    bound = (sizes[0] + sizes[1]) + (sizes[2] + sizes[3]);
    if (!(mass * bound * per_square > impact_log_least_force(&single->impacts, &single->row)))
        return;
    if (slope[1] < 0)
        for (size_t k = 1; k < table->terms; k++)
            slope[k] = -slope[k];
    double at;
    State state;
    if (!piece_root(slope, table->terms, s, PEAK_TOLERANCE, &at) || !(at > 0))
        return;
    piece_at(piece, at, &state);
    const double n = m->contact_damping * state.w + m->contact_omega2 * state.r;
    impact_log_force(&single->impacts, &single->row, mass * fabs(n));
    impact_log_acceleration(&single->impacts, m->share * n - single_mass_push(single, &state));
}

// --- events

// The impulse law at the instant of the touch, as contact_event_bounce applies it to any number of
// masses. False, and nothing has changed: the mass may come to rest, which the event engine
// handles.
static bool single_mass_bounce(SingleMass *single, Side side) {
    const double sign = single_mass_sign(side),
                 e = single->damper->stops[side].parameters.restitution;
    const double approach = fabs(single->state.w), share = single->flying.share;
    const double v = single->state.v + sign * share * (1 + e) * approach;
    // Towards the stop after the bounce [m/s^2]: the next touch takes 2 e approach / closing, those
    // that follow are a geometric series.
    const double closing =
        sign * (single->flying.damping * v + single->flying.omega2 * single->state.x);
    const double left = 2 * e * approach / (closing * (1 - e));
    if (!(approach > 0) || single->damper->clearance == 0 ||
        (closing > 0 ? !(left > 1e3 * DBL_EPSILON *
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

// The mass has reached the stop `side`. False: the event engine has to go on from here; it finds
// the touch again, at once.
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
    impact_log_force(&single->impacts, &single->row,
                     single->damper->stops[side].parameters.damping * speed);
    single_mass_note_force(single);
    return true;
}

// The base from the present instant on; returns for how long it goes on so, up to `h` after the
// present sample at most [s].
INLINE double single_mass_slice_until(SingleMass *single, double h, Slice *slice) {
    const double left = h - single->offset;
    const double knot = base_cursor_slice(&single->base, single->sample, single->offset, slice);
    return knot < left ? knot : left;
}

// One piece from the present instant, to its event or to `h` after the present sample at most.
// False: the event engine has to go on.
INLINE bool single_mass_step(SingleMass *single, double h) {
    const bool is_contact = single->phase == PHASE_CONTACT;
    if (is_contact && ++single->pieces > PIECES_MAX)
        return false;
    Slice slice;
    const double left = single_mass_slice_until(single, h, &slice);
    const MotionTable *table = single_mass_table(single, &slice);
    const double length = table->length, last = left < length ? left / length : 1;
    Piece piece;
    piece_make(&piece, table, &single->state, &slice);
    single->run->work.arcs++;
    single->run->steps += SINGLE_MASS_STEPS;
    double s = last;
    Side side = single->side;
    const bool is_event =
        is_contact ? single_mass_find_release(single, &piece, last, &s)
                   : single->has_stops && single_mass_find_touch(single, &piece, last, &s, &side);
    if (!is_event)
        s = last;
    if (s > 0) {
        PieceSums sums;
        State end;
        const double z = single->state.v + single->state.w;
        piece_sums(&piece, s, &sums);
        if (s == 1)
            piece_end(table, piece.start, &end);
        else
            piece_at(&piece, s, &end);
        if (is_contact) {
            const Motion *m = &table->motion;
            single_mass_work(single, sums.vv, sums.av, sums.av + sums.aw);
            single_mass_peak(single, &piece, s);
            impact_log_force(&single->impacts, &single->row,
                             single_mass_effective(single) *
                                 fabs(m->contact_damping * end.w + m->contact_omega2 * end.r));
            impact_log_stretch(&single->impacts, &single->row, s * length,
                               -single->damper->mass * ((end.v + end.w) - z + sums.a),
                               single->damper->stops[single->side].parameters.damping * sums.ww);
        } else {
            single_mass_work(single, sums.vv, sums.av, sums.a * (z - sums.a / 2));
        }
        single->base_speed += sums.a;
        single->state = end;
        single->offset += s * length;
    }
    if (!is_event)
        return true;
    single->pieces = 0;
    if (++single->events > EVENTS_MAX)
        return false;
    if (!is_contact)
        return single_mass_touch(single, side);
    single_mass_release(single);
    return true;
}

// --- contact over many lengths of its table

// Rows of x, v, r, w and of the base's value and slope: at the present instant and after each
// length. The entries after the last of these are undefined until a function clears them.
enum { BLOCK_ROW = BLOCK + 8 };
typedef double BlockRows[START_SIZE][BLOCK_ROW];

// Rows 4 and 5: `values` of a_g at whole lengths, or all from `slice`. False: the base is still.
INLINE bool single_mass_block_base(const MotionTable *table, const double *values,
                                   const Slice *slice, size_t count, BlockRows y) {
    double *const a = y[4], *const b = y[5];
    a[0] = slice->value;
    b[0] = slice->slope;
    if (values != NULL) {
        const double per_length = 1 / table->length;
        memcpy(a, values, (count + 1) * sizeof *values);
        for (size_t k = 0; k < count; k++)
            b[k] = (a[k + 1] - a[k]) * per_length;
        b[count] = 0;
    } else if (table->base_omega > 0) {
        for (size_t k = 0; k < count; k++) {
            a[k + 1] = table->turn[0] * a[k] + table->turn[1] * b[k];
            b[k + 1] = table->turn[0] * b[k] - table->turn[1] * a[k];
        }
    } else if (slice->value != 0 || slice->slope != 0) {
        for (size_t k = 1; k <= count; k++) {
            a[k] = slice->value + slice->slope * ((double)k * table->length);
            b[k] = slice->slope;
        }
    } else {
        memset(a, 0, BLOCK_ROW * sizeof *a);
        return false;
    }
    for (size_t k = count + 1; k < count + BLOCK_TAPS; k++)
        a[k] = b[k] = 0;
    return true;
}

// Rows 0 to 3, four lengths at a time, up to the first state outside the stop; how many lengths.
INLINE size_t single_mass_block_states(const MotionTable *table, const State *start, double sign,
                                       bool has_base, bool is_sampled, size_t count, BlockRows y) {
    double at[4] = {start->x, start->v, start->r, start->w};
    for (int i = 0; i < 4; i++)
        y[i][0] = at[i];
    size_t k = 0;
    while (k < count) {
        const double *a = y[4] + k, *b = y[5] + k;
        Four next[4];
        for (int i = 0; i < 4; i++) {
            const double(*const state)[BLOCK_SAMPLES] = table->from_state[i];
            const double(*const base)[BLOCK_SAMPLES] = table->from_base[i];
            Four gain = (FOUR(state[0]) * at[0] + FOUR(state[1]) * at[1]) +
                        (FOUR(state[2]) * at[2] + FOUR(state[3]) * at[3]);
            if (has_base && !is_sampled)
                gain += FOUR(table->from_slice[i][0]) * a[0] + FOUR(table->from_slice[i][1]) * b[0];
            else if (has_base)
                gain += ((FOUR(base[0]) * a[0] + FOUR(base[1]) * a[1]) +
                         (FOUR(base[2]) * a[2] + FOUR(base[3]) * a[3])) +
                        FOUR(base[4]) * a[4];
            next[i] = at[i] + gain;
            PUT_FOUR(y[i] + k + 1, next[i]);
        }
        k += BLOCK_SAMPLES;
        for (int i = 0; i < 4; i++)
            at[i] = next[i][3];
        if (!(sign * at[2] > 0))
            break;
    }
    count = k < count ? k : count;
    for (int i = 0; i < 4; i++)
        for (k = count + 1; k % 8 != 1; k++)
            y[i][k] = 0;
    return count;
}

// n, q = r'' and their derivatives at the states of a block, and the absolute acceleration.
typedef struct BlockForces {
    _Alignas(32) double n[BLOCK_ROW + 1], rise[BLOCK_ROW], acceleration[BLOCK_ROW + 1];
    _Alignas(32) double q[BLOCK_ROW], q_rise[BLOCK_ROW];
} BlockForces;

INLINE void single_mass_block_forces(const Motion *m, size_t count, BlockRows y, BlockForces *f) {
    const double k2 = m->contact_omega2, c = m->contact_damping, D = m->damping, W = m->omega2;
    for (size_t k = 0; k <= count; k += 4) {
        const Four v = FOUR(y[1] + k), w = FOUR(y[3] + k);
        const Four s = D * v + W * FOUR(y[0] + k), n = c * w + k2 * FOUR(y[2] + k);
        const Four q = s - n, rise = c * q + k2 * w, acceleration = m->share * n - s;
        PUT_FOUR(f->n + k, n);
        PUT_FOUR(f->q + k, q);
        PUT_FOUR(f->rise + k, rise);
        PUT_FOUR(f->acceleration + k, acceleration);
        PUT_FOUR(f->q_rise + k, D * (acceleration - FOUR(y[4] + k)) + W * v - rise);
    }
}

// How many of the lengths surely belong to the contact. Over a length |r''| is at most that at its
// ends and half a length times |r'''|, which in turn is at most that at its ends and half a length
// times s'' + c |r'''| + k |r''|. s'' is bounded by the storey's own motion V and the contact's N,
// each of which drives the other.
INLINE size_t single_mass_block_inside(const SingleMass *single, const MotionTable *table,
                                       const Slice *slice, double left, size_t count, BlockRows y,
                                       const BlockForces *f) {
    const Motion *m = &table->motion;
    const double h = table->length, omega = sqrt(m->omega2), stiff = sqrt(m->contact_omega2);
    const double sign = single_mass_sign(single->side);
    // Of a_g and its slope: those of the whole run, which are not known of pulses, or of the slice.
    const double value = fabs(slice->value), slope = fabs(slice->slope), turn = table->base_omega;
    const double base =
        single_mass_larger(single->stretch.base_max, value + (turn > 0 ? slope : slope * left));
    const double base_slope = single_mass_larger(single->base_slope * (turn > 0 ? turn : 1),
                                                 turn > 0 ? turn * (value + slope) : slope);
    const double own = m->damping + omega, contact = stiff + m->contact_damping;
    const double both = own * h * h * m->share * contact, per_both = 1 / (1 - both);
    const double k2 = m->contact_omega2;
    const double rest = 1 - (m->contact_damping + k2 * h / 2) * h / 2, half_per_rest = h / 2 / rest;
    double margin[BLOCK];
    if (!(both < 0.5) || !(rest > 0.1))
        return 0;
    for (size_t k = 0; k < count; k += 4) {
        Four x, v, r, w, w_next, q, q_next, rise, rise_next, largest, low, inside;
        const Four here = sign * FOUR(y[2] + k), next = sign * FOUR(y[2] + k + 1);
        const Four up = sign * FOUR(y[3] + k), none = {0};
        wide_size(&FOUR(y[0] + k), &x);
        wide_size(&FOUR(y[1] + k), &v);
        wide_size(&FOUR(y[2] + k), &r);
        wide_size(&FOUR(y[3] + k), &w);
        wide_size(&FOUR(y[3] + k + 1), &w_next);
        q = sign * FOUR(f->q + k);
        q_next = sign * FOUR(f->q + k + 1);
        wide_larger(&q, &q_next, &largest);
        wide_size(&q, &q);
        wide_size(&q_next, &q_next);
        wide_larger(&q, &q_next, &q);
        wide_size(&FOUR(f->q_rise + k), &rise);
        wide_size(&FOUR(f->q_rise + k + 1), &rise_next);
        wide_larger(&rise, &rise_next, &rise);
        const Four N = w + stiff * r;
        const Four V = (v + omega * x + h * (m->share * contact * N + base)) * per_both;
        const Four n_max = contact * (N + own * h * V), x2 = base + own * V + m->share * n_max;
        const Four x3 = base_slope + own * x2 + m->share * contact * (own * V + n_max);
        const Four s2 = m->damping * x3 + m->omega2 * x2;
        const Four more = (rise + h / 2 * (s2 + k2 * q)) * half_per_rest;
        // A length is inside the stop if one of three margins is positive: `sag`, the chord of r
        // less the most that r can lie below it; the end with the larger |w| less the most that w
        // can change, so that r is monotone; `leaves`, the same from r = 0 on (any r > 0 excludes
        // it). And its end must be inside.
        const Four bend = (q + more) * h;
        largest += more;
        wide_larger(&largest, &none, &largest);
        wide_smaller(&here, &next, &low);
        const Four sag = low - largest * (h * h / 8), leaves = up - bend / 2 - 1e300 * r;
        wide_larger(&w, &w_next, &inside);
        inside -= bend;
        wide_larger(&inside, &sag, &inside);
        wide_larger(&inside, &leaves, &inside);
        wide_smaller(&inside, &next, &inside);
        PUT_FOUR(margin + k, inside);
    }
    size_t inside = 0;
    while (inside < count && margin[inside] > 0)
        inside++;
    return inside;
}

// Integrals over the lengths that begin at states 0 to `count` - 1; there are zeros after these.
INLINE void single_mass_block_work(const MotionTable *table, int rows, size_t count, BlockRows y,
                                   Four *sums) {
    Four moment[FORM_PAIRS], form[FORMS] = {{0}};
    const size_t pairs = rows == START_SIZE ? FORM_PAIRS : FORM_STATE_PAIRS;
    for (size_t pair = 0; pair < pairs; pair++)
        moment[pair] = (Four){0};
    for (size_t k = 0; k < count; k += 4)
        for (int i = 0, pair = 0; i < rows; i++)
            for (int j = 0; j <= i; j++, pair++)
                moment[pair] += FOUR(y[j] + k) * FOUR(y[i] + k);
    for (size_t pair = 0; pair < pairs; pair += 4) {
        Four all;
        wide_sum(&moment[pair], &moment[pair + 1], &moment[pair + 2], &moment[pair + 3], &all);
        for (int i = 0; i < FORMS; i++)
            form[i] += FOUR(table->forms[i] + pair) * all;
    }
    wide_sum(&form[0], &form[1], &form[2], &form[3], sums);
}

// Samples 1 to `count` of a block, which are followed by zeros, into the columns, peaks and sums.
INLINE void single_mass_block_record(SingleMass *single, size_t count, BlockRows y, const double *n,
                                     const double *acceleration) {
    const double sign = single_mass_sign(single->side), middle = single_mass_origin(single);
    const double mass = single_mass_effective(single);
    const size_t first = single->sample + 1, bytes = count * sizeof(double);
    double *const *columns = single->columns;
    const double damping = single->plan->damping[0], stiffness = single->plan->stiffness[0];
    _Alignas(32) double place[BLOCK], shear[BLOCK];
    const double *const rows[] = {y[0] + 1, y[1] + 1, acceleration + 1, place, shear, n + 1};
    enum { ROWS = COUNT(rows) };
    Four peaks[ROWS] = {{0}}, squares[2] = {{0}};
    double peak[ROWS];
    for (size_t k = 0; k < count; k += 4) {
        PUT_FOUR(place + k, FOUR(y[0] + k + 1) + (middle + FOUR(y[2] + k + 1)));
        PUT_FOUR(shear + k, damping * FOUR(y[1] + k + 1) + stiffness * FOUR(y[0] + k + 1));
    }
    for (size_t k = count; k % 4 != 0; k++)
        place[k] = 0;
    for (size_t k = 0; k < count; k += 4) {
        for (int i = 0; i < ROWS; i++) {
            Four size;
            wide_size(&FOUR(rows[i] + k), &size);
            wide_larger(&size, &peaks[i], &peaks[i]);
        }
        squares[0] += FOUR(rows[0] + k) * FOUR(rows[0] + k);
        squares[1] += FOUR(rows[2] + k) * FOUR(rows[2] + k);
    }
    for (int i = 0; i < ROWS; i++)
        peak[i] = single_mass_larger(single_mass_larger(peaks[i][0], peaks[i][1]),
                                     single_mass_larger(peaks[i][2], peaks[i][3]));
    Peaks *all = &single->impacts.response->peaks;
    all->displacement = single_mass_larger(all->displacement, peak[0]);
    all->velocity = single_mass_larger(all->velocity, peak[1]);
    all->acceleration = single_mass_larger(all->acceleration, peak[2]);
    all->damper_displacement = single_mass_larger(all->damper_displacement, peak[3]);
    all->base_shear = single_mass_larger(all->base_shear, peak[4]);
    impact_log_force(&single->impacts, &single->row, mass * peak[5]);
    if (single->sample >= single->statistics_start) {
        for (int i = 0; i < 2; i++)
            single->squares[i] += (squares[i][0] + squares[i][2]) + (squares[i][1] + squares[i][3]);
        single->statistics_count += count;
    }
    static const int channel[] = {CHANNEL_DISPLACEMENT, CHANNEL_VELOCITY, CHANNEL_ACCELERATION,
                                  CHANNEL_DAMPER_DISPLACEMENT, CHANNEL_BASE_SHEAR};
    for (int i = 0; i < 5; i++)
        if (columns[channel[i]] != NULL)
            memcpy(columns[channel[i]] + first, rows[i], bytes);
    for (size_t k = 0; k < count && columns[CHANNEL_DAMPER_VELOCITY] != NULL; k++)
        columns[CHANNEL_DAMPER_VELOCITY][first + k] = y[1][k + 1] + y[3][k + 1];
    for (size_t k = 0; k < count && columns[CHANNEL_PENETRATION] != NULL; k++)
        columns[CHANNEL_PENETRATION][first + k] = sign * y[2][k + 1];
    for (size_t k = 0; k < count && columns[CHANNEL_CONTACT_FORCE] != NULL; k++)
        columns[CHANNEL_CONTACT_FORCE][first + k] = mass * n[k + 1];
    for (size_t k = 0; k < count && columns[CHANNEL_BASE_ACCELERATION] != NULL; k++)
        columns[CHANNEL_BASE_ACCELERATION][first + k] = base_cursor_at(&single->base, first + k);
}

// The lengths that surely belong to the present contact: `most` sample intervals at most, where
// that is above 0, else up to the next sample. Returns how many; 0: its end may come in the first.
INLINE size_t single_mass_contact_block(SingleMass *single, size_t most) {
    const double sign = single_mass_sign(single->side), *values = NULL;
    const bool is_sampled = most > 0;
    Slice slice;
    const double left = single_mass_slice_until(single, single->interval, &slice);
    MotionTable *table = single_mass_table(single, &slice);
    const Motion *m = &table->motion;
    const double length = table->length;
    if (is_sampled) {
        most = single_mass_smaller(most, single_mass_base_ahead(single, &values));
    } else {
        const double fits = left / length, limit = PIECES_MAX - single->pieces;
        most = (size_t)(fits < limit ? fits : limit);
    }
    most = single_mass_smaller(most, BLOCK);
    if (most == 0)
        return 0;
    if (!table->has_block)
        motion_table_make_block(table);
    _Alignas(64) BlockRows y;
    const bool has_base = single_mass_block_base(table, values, &slice, most, y);
    size_t count =
        single_mass_block_states(table, &single->state, sign, has_base, values != NULL, most, y);
    BlockForces forces;
    single_mass_block_forces(m, count, y, &forces);
    count = single_mass_block_inside(single, table, &slice, left, count, y, &forces);
    if (count == 0)
        return 0;
    const size_t padded = (count + 1 + 7) / 8 * 8;
    const int rows = has_base ? START_SIZE : 4;
    double last[4];
    for (int i = 0; i < rows; i++)
        for (size_t k = count + 1; k <= padded && k < BLOCK_ROW; k++)
            y[i][k] = 0;
    for (int i = 0; i < 4; i++)
        last[i] = y[i][count];
    double *const n = forces.n, *const rise = forces.rise,
                  *const acceleration = forces.acceleration;
    for (size_t k = count + 1; k <= padded; k++)
        n[k] = acceleration[k] = 0;
    for (size_t k = 0; k < count; k++) { // peaks of the force inside a length
        if (!(sign * rise[k] > 0 && sign * rise[k + 1] < 0))
            continue;
        const State start = {y[0][k], y[1][k], y[2][k], y[3][k]};
        const Slice then = {has_base ? y[4][k] : 0, has_base ? y[5][k] : 0, slice.omega};
        Piece piece;
        piece_make(&piece, table, &start, &then);
        single_mass_peak(single, &piece, 1);
    }
    double gain = 0, speed[BLOCK]; // of the base's velocity
    for (size_t k = 0; k < count; k++) {
        speed[k] = has_base ? table->speed[0] * y[4][k] + table->speed[1] * y[5][k] : 0;
        gain += speed[k];
    }
    if (is_sampled) {
        single_mass_block_record(single, count, y, n, acceleration);
        double *const column = single->columns[CHANNEL_MEAN_ACCELERATION];
        for (size_t k = 0; k < count && column != NULL; k++)
            column[single->sample + 1 + k] =
                (y[1][k + 1] - y[1][k] + speed[k]) * single->plan->sample_rate;
    } else {
        const double force = fabs(n[count]);
        impact_log_force(&single->impacts, &single->row, single_mass_effective(single) * force);
        single->base_speed += gain;
    }
    for (int i = 0; i < rows; i++)
        y[i][count] = 0;
    Four work;
    if (has_base)
        single_mass_block_work(table, START_SIZE, count, y, &work);
    else
        single_mass_block_work(table, 4, count, y, &work);
    const double z = single->state.v + single->state.w;
    single_mass_work(single, work[FORM_VV], work[FORM_AV], work[FORM_AV] + work[FORM_AW]);
    impact_log_stretch(&single->impacts, &single->row, (double)count * length,
                       -single->damper->mass * ((last[1] + last[3]) - z + gain),
                       single->damper->stops[single->side].parameters.damping * work[FORM_WW]);
    single->state = (State){last[0], last[1], last[2], last[3]};
    if (is_sampled) {
        single->last_velocity = last[1];
        single->sample += count;
        single->run->steps += SAMPLE_STEPS * (double)count;
    } else {
        single->offset += (double)count * length;
        single->pieces += (int)count;
        single->run->steps += SINGLE_MASS_STEPS;
    }
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

// Hands the present state to the engine. What only the engine's own steps set is as after a step
// without an event: it finds an event at this instant again.
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

// Takes over the engine's state. Returns whether the kernels of this file can go on.
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
    single->is_by_engine = false;
    if (single->plan->damper_count == 0)
        return true;
    const DamperState *damper = &state->damper[0];
    single->phase = damper->phase;
    single->side = damper->side;
    single->origin = damper->origin;
    single->state.r = damper->r;
    single->state.w = damper->w;
    single->row = damper->row;
    single->is_by_engine = damper->phase != PHASE_CONTACT &&
                           !(damper->phase == PHASE_FLIGHT && damper->zero_gap_terms == 0);
    return !single->is_by_engine;
}

static Status single_mass_check(SingleMass *single) {
    const State *state = &single->state;
    const bool is_finite =
        isfinite(state->x) && isfinite(state->v) && isfinite(state->r) && isfinite(state->w);
    TRY(impact_log_status(&single->impacts, single->problem));
    return run_check(single->run, single_mass_time(single), 0, is_finite, single->problem);
}

// By the event engine from the present instant to a sample where these kernels can go on, or to the
// last one, where is_by_engine tells whether they can.
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

// A block of short lengths is not tried where the mass leaves the stop within about one of them.
INLINE bool single_mass_block_is_worthwhile(const SingleMass *single) {
    const double sign = single_mass_sign(single->side);
    const double r = sign * single->state.r, w = sign * single->state.w;
    return r * single->touching[single->side].rate + w > 0;
}

// Whole intervals by blocks and all else by pieces, up to sample `until` or for PROGRESS_STEPS;
// false: the event engine has to go on.
INLINE bool single_mass_advance(SingleMass *single, size_t until) {
    const double h = single->interval, clock = 2 * DBL_EPSILON * h;
    const double steps_max = single->run->steps + PROGRESS_STEPS;
    single->pieces = single->events = 0;
    while (single->sample < until && single->run->steps < steps_max) {
        const bool is_flight = single->phase == PHASE_FLIGHT;
        const size_t ahead = single->offset == 0 ? single_mass_blocks_ahead(single) : 0;
        size_t most = single_mass_smaller(until - single->sample, ahead);
        // The sample where statistics begin is not for blocks: much begins anew there.
        if (single->sample < single->statistics_start)
            most = single_mass_smaller(most, single->statistics_start - 1 - single->sample);
        if (!is_flight && single->touching[single->side].rate * h > PIECE_REACH) {
            if (single_mass_block_is_worthwhile(single))
                (void)single_mass_contact_block(single, 0);
        } else if (most > 0) {
            const size_t passed = is_flight ? single_mass_flight_block(single, most)
                                            : single_mass_contact_block(single, most);
            if (single->pending >= PENDING_MAX)
                single_mass_flush(single);
            if (passed > 0 && (is_flight || passed == BLOCK || single->sample == until))
                continue;
        }
        if (h - single->offset <= clock) {
            single_mass_pass(single);
            single->pieces = single->events = 0;
        } else if (!single_mass_step(single, h)) {
            return false;
        }
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
    const bool is_wide = wide_is_at_hand();
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

// Of the storey and its free mass.
static Motion single_mass_flying(const Plan *plan) {
    const double free_mass = plan->dampers->mass;
    Motion flying = {.omega2 = plan->stiffness[0] / plan->mass[0],
                     .damping = plan->damping[0] / plan->mass[0],
                     .share = free_mass / (plan->mass[0] + free_mass)};
    flying.rate = fmax(fmax(sqrt(flying.omega2), flying.damping), 1e-300);
    return flying;
}

static void single_mass_make_motions(SingleMass *single) {
    const Plan *plan = single->plan;
    const Motion flying = single_mass_flying(plan);
    const double mass = plan->mass[0] * flying.share;
    single->flying = flying;
    for (int side = 0; side < 2 && plan->form == CONTACT_LINEAR && single->has_stops; side++) {
        Motion *touching = &single->touching[side];
        *touching = flying;
        touching->contact_omega2 = single->damper->stops[side].parameters.stiffness / mass;
        touching->contact_damping = single->damper->stops[side].parameters.damping / mass;
        touching->rate =
            flying.rate + fmax(sqrt(touching->contact_omega2), touching->contact_damping);
    }
}

// Tables of another system are forgotten.
static void single_mass_keep_tables(SingleMass *single) {
    const Motion *touching = single->touching;
    const bool is_alike = motion_is_same(&touching[SIDE_LEFT], &touching[SIDE_RIGHT]);
    const Motion *const motions[] = {&single->flying, &touching[SIDE_LEFT], &touching[SIDE_RIGHT]};
    const Base *base = single->run->base;
    for (size_t i = 0; i < COUNT(motions); i++)
        single->tables[i].is_made &= single->table_interval == single->interval &&
                                     motion_is_same(&single->tables[i].motion, motions[i]);
    single->table_interval = single->interval;
    single->contact_table[SIDE_LEFT] = 1;
    single->contact_table[SIDE_RIGHT] = is_alike ? 1 : 2;
    const double omega = base->form == BASE_SINE ? base->omega : 0;
    const Slice form = {0, omega > 0, omega};
    lanes_make(&single->lanes, single_mass_table(single, &form), base->form == BASE_SAMPLED,
               lanes_widest());
}

static Status single_mass_start(SingleMass *single, Run *run, Response *response,
                                Problem *problem) {
    const Plan *plan = run->plan;
    const Base *base = run->base;
    memset(single, 0, offsetof(SingleMass, table_interval));
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
    rounding_growth_start(&single->growth, flying, single->touching, &single->state,
                          single->damper->clearance, base->form == BASE_SINE, plan->duration);
    const EnergyState energy = single_mass_energy(single);
    impact_log_start(&single->impacts, response, run->impacts_max, &energy);
    single->impacts.gain_max = IMPACT_LOG_GAIN_EXACT;
    for (size_t i = 0; i < run->column_count; i++)
        single->columns[run->columns[i].channel] = run->columns[i].values;
    // The drift of the only storey is its displacement; where both are wanted, it is copied later.
    if (single->columns[CHANNEL_DISPLACEMENT] == NULL)
        single->columns[CHANNEL_DISPLACEMENT] = single->columns[CHANNEL_STOREY_DRIFT];
    single->statistics_start = (size_t)ceil(run->statistics_from * plan->sample_rate * (1 - 1e-12));
    response->sample_rate = plan->sample_rate;
    response->count = plan->count;
    single->has_blocks =
        single->lanes.run != NULL && (base->form != BASE_SAMPLED || single->base.ratio == 1);
    FlightBlock *stretch = &single->stretch;
    if (base->form == BASE_SAMPLED) {
        double step;
        if (wide_is_at_hand())
            single_mass_measure_wide(base->values, base->count, &stretch->base_max, &step);
        else
            single_mass_measure(base->values, base->count, &stretch->base_max, &step);
        single->base_slope = step * plan->sample_rate;
    }
    if (base->form == BASE_SINE)
        stretch->base_max = single->base_slope = fabs(base->amplitude);
    stretch->base = &single->base;
    stretch->mass = plan->mass[0];
    memcpy(stretch->columns, single->columns, sizeof stretch->columns);
    stretch->left = stretch->right = INFINITY;
    for (int i = 0; i < CHANNEL_COUNT; i++) {
        const bool is_damper = i == CHANNEL_DAMPER_DISPLACEMENT || i == CHANNEL_DAMPER_VELOCITY;
        if (i == CHANNEL_PENETRATION || i == CHANNEL_CONTACT_FORCE || i == CHANNEL_STOREY_DRIFT ||
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
    recorder_sample(&single->engine->record, &single->engine->state);
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
    bool is_kept = !single->is_by_engine;
    for (size_t i = 1; is_kept && rest - single->offset > 2 * DBL_EPSILON * rest; i++) {
        is_kept = single_mass_step(single, rest);
        if (i % PROGRESS_SAMPLES == 0)
            TRY(single_mass_check(single));
    }
    if (!is_kept) {
        TRY(single_mass_need_engine(single));
        if (!single->is_by_engine)
            single_mass_to_engine(single);
        TRY(event_engine_cross(single->engine, rest));
        (void)single_mass_from_engine(single);
    }
    single_mass_note(single);
    single_mass_end_phase(single);
    rounding_growth_report(&single->growth, single->impacts.response);
    TRY(single_mass_check(single));
    const EnergyState energy = single_mass_energy(single);
    impact_log_end(&single->impacts, &single->row);
    return impact_log_finish(&single->impacts, 1, &energy, &single->run->work, single->problem);
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
    double *const drift = single->columns[CHANNEL_STOREY_DRIFT];
    if (drift != NULL && drift != single->columns[CHANNEL_DISPLACEMENT])
        memcpy(drift, single->columns[CHANNEL_DISPLACEMENT], run->plan->count * sizeof *drift);
    if (single->engine != NULL)
        event_engine_clear(single->engine);
    free(single->engine);
    single->engine = NULL;
    return status;
}

bool single_mass_serves(const Plan *plan, const Base *base, bool is_clear) {
    const bool has_stops = plan->damper_count > 0 && !is_clear;
    if (!plan_is_single_in_flight(plan) || (has_stops && !plan_is_single(plan)))
        return false;
    // Intervals that are too long for blocks would take many pieces here, and the event engine
    // takes one step for each.
    const Motion flying = single_mass_flying(plan);
    const double omega = base->form == BASE_SINE ? base->omega : 0;
    return has_stops || lanes_are_for(&flying, omega, 1 / plan->sample_rate);
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
