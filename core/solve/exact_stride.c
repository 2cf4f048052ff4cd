// A stride: blocks of flight, a stop, its contact and the way back to a sample. Each step proves
// that it misses nothing, or leaves state and ledger at its beginning for the arcs.
#include "core/solve/exact_stride.h"

#include <math.h>
#include <string.h>

#include "core/solve/exact_events.h"
#include "core/solve/exact_press.h"

enum {
    PENDING_MAX = 1024,      // samples between two looks at the energy balance
    WATCH_SAMPLES = 1 << 16, // made ready between two looks at the progress
};

// Of energies, over all samples of a contact: times DBL_EPSILON, what its closed form may lose.
static const double APART_MAX = 4e4;

// The largest of |values|, and of how far each is from the one before.
INLINE void measure(const double *values, size_t count, double *most, double *step) {
    enum { SIDE_BY_SIDE = 8 };
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
        *most = impact_log_larger(*most, fabs(values[i]));
        *step = impact_log_larger(*step, fabs(values[i] - values[i - 1]));
    }
    for (size_t j = 0; j < SIDE_BY_SIDE; j++) {
        *most = impact_log_larger(*most, sizes[j]);
        *step = impact_log_larger(*step, steps[j]);
    }
}

WIDE static void measure_wide(const double *values, size_t count, double *most, double *step) {
    measure(values, count, most, step);
}

// What flight leaves alone of samples `from` to `to`: contacts write over it.
static void lay(const Exact *exact, size_t from, size_t to) {
    const Base *base = exact->run->base;
    for (int i = 0; i < CHANNEL_COUNT; i++)
        if (exact->recorder.columns[i] != NULL && exact->stretch.columns[i] == NULL)
            memset(exact->recorder.columns[i] + from, 0, (to - from) * sizeof(double));
    // From its last sample on the base is still.
    double *const column = exact->recorder.columns[CHANNEL_BASE_ACCELERATION];
    const size_t given = base->count > 0 ? base->count - 1 : 0, end = given < to ? given : to;
    if (column != NULL && base->form == BASE_SAMPLED && from < end)
        memcpy(column + from, base->values + from, (end - from) * sizeof *column);
}

// Part by part: all at once takes long where the run has many samples.
static Status lay_all(const Exact *exact) {
    const size_t count = exact->plan->count;
    for (size_t from = 0; from < count; from += WATCH_SAMPLES) {
        if (from > 0 && !progress_advance(exact->run->progress, 0))
            return problem_set(exact->problem, STATUS_CANCELLED, "cancelled at t = 0 s");
        lay(exact, from, count - from > WATCH_SAMPLES ? from + WATCH_SAMPLES : count);
    }
    return STATUS_OK;
}

Status exact_stride_start(Exact *exact) {
    const Base *base = exact->run->base;
    Stretch *stretch = &exact->stretch;
    double *const *columns = exact->recorder.columns;
    const bool is_sine = base->form == BASE_SINE;
    if (base->form == BASE_PIECES || (base->form == BASE_SAMPLED && exact->base.ratio != 1)) {
        exact->has_lanes = false;
        exact->lanes.run = NULL;
        return STATUS_OK;
    }
    if (!exact->has_lanes) {
        lanes_make(&exact->lanes, &exact->flying, base->omega, exact->interval, lanes_widest());
        hop_table_make(&exact->hops, &exact->flying, base->omega, exact->interval);
    }
    exact->has_lanes = true;
    exact->has_hops = fmax(exact->flying.rate, base->omega) * exact->interval <= HOP_REACH;
    if (base->form == BASE_SAMPLED) {
        double step;
        if (wide_is_at_hand())
            measure_wide(base->values, base->count, &stretch->base_max, &step);
        else
            measure(base->values, base->count, &stretch->base_max, &step);
        exact->base_slope = step * exact->plan->sample_rate;
    }
    if (is_sine)
        stretch->base_max = exact->base_slope = fabs(base->amplitude);
    stretch->base = &exact->base;
    memcpy(stretch->columns, columns, sizeof stretch->columns);
    stretch->left = stretch->right = INFINITY;
    const bool has_damper = exact->plan->damper_count > 0;
    for (int i = 0; i < CHANNEL_COUNT; i++) {
        const bool is_damper = i == CHANNEL_DAMPER_DISPLACEMENT || i == CHANNEL_DAMPER_VELOCITY;
        if (i == CHANNEL_PENETRATION || i == CHANNEL_CONTACT_FORCE ||
            (i == CHANNEL_BASE_ACCELERATION && !is_sine) || (is_damper && !has_damper))
            stretch->columns[i] = NULL;
    }
    return lay_all(exact);
}

// The base from the present sample on: how many intervals it goes on in one way, and its samples or
// NULL where it is still.
static size_t base_ahead(const Exact *exact, const double **values) {
    const Base *base = exact->run->base;
    *values = NULL;
    if (base->form != BASE_SAMPLED || exact->sample + 1 >= base->count)
        return SIZE_MAX;
    *values = base->values + exact->sample;
    return base->count - 1 - exact->sample;
}

static size_t smaller(size_t a, size_t b) {
    return a < b ? a : b;
}

// Whole intervals of flight.
static size_t fly(Exact *exact, size_t most) {
    Stretch *s = &exact->stretch;
    const double *base;
    most = smaller(most, base_ahead(exact, &base));
    // The sample where statistics begin is not for blocks: much begins anew there.
    if (exact->sample < exact->recorder.statistics_start)
        most = smaller(most, exact->recorder.statistics_start - 1 - exact->sample);
    if (exact->has_stops) {
        exact->run->work.stop_searches++;
        s->left = exact_room(exact, SIDE_LEFT);
        s->right = exact_room(exact, SIDE_RIGHT);
    }
    if (exact->plan->damper_count > 0)
        s->middle = exact_relative(exact) - exact->state.r;
    const double z = exact->state.v + exact->state.w;
    s->x = exact->state.x;
    s->v = exact->state.v;
    s->r = exact->state.r;
    s->z = z;
    const size_t count = lanes_fly(&exact->lanes, s, exact->sample, most, base);
    if (count == 0)
        return 0;
    exact->state = (State){s->x, s->v, s->r, s->z - s->v};
    const double gain = z - s->z;
    exact->free_work += gain * (z - gain / 2);
    Peaks *peaks = &exact->ledger.response->peaks; // trust asks for this one
    peaks->displacement =
        impact_log_larger(peaks->displacement, lanes_take_peak(s, OF_DISPLACEMENT));
    exact->pending += count;
    exact->sample += count;
    exact->run->steps += EXACT_SAMPLE_STEPS * (double)count;
    exact_count_flight(exact, count);
    exact->recorder.last_velocity = s->v;
    if (exact->pending >= PENDING_MAX)
        exact_stride_enter(exact);
    return count;
}

INLINE void take_hop(Exact *exact, const Hop *hop, double s) {
    ArcIntegrals integrals;
    hop_integrals(hop, s, &integrals);
    const Plan *plan = exact->plan;
    impact_log_work(&exact->ledger,
                    -plan->mass[0] * integrals.av -
                        exact->damper->mass * (integrals.av + integrals.aw),
                    plan->damping[0] * integrals.vv);
    exact_record_base(&exact->recorder, integrals.a);
    hop_at(hop, s, &exact->state);
    exact->run->steps += EXACT_HOP_STEPS;
}

// What r'' can come to in flight over the rest of an interval.
typedef struct Pull {
    double most; // |r''| is not larger
    double vary; // nor by how much it changes
} Pull;

INLINE void see_pull(const Exact *exact, double length, Pull *pull) {
    const Lanes *lanes = &exact->lanes;
    const double base = exact->stretch.base_max, speed = fabs(exact->state.v);
    pull->most = (lanes->damping + lanes->omega) *
                 (speed + lanes->omega * fabs(exact->state.x) + length * base);
    const double drive = pull->most + base; // |x''| is not larger
    pull->vary = length * (lanes->damping * drive + lanes->omega2 * (speed + length * drive));
}

typedef enum Way { FREE, BLOCKED, UNCLEAR } Way;

// A whole interval in which r turns: free if the stop that it went to is surely not reached, though
// it may come near.
INLINE bool turns_free(const Exact *exact, const Hop *hop, double end, double slope, double vary) {
    const double h = exact->interval, w = exact->state.w * h, push = exact_push(exact);
    const Side side = w > 0 ? SIDE_RIGHT : SIDE_LEFT;
    const double sign = exact_sign(side), room = exact_room(exact, side);
    const double other = exact->damper->clearance - room, s = w / (w - slope);
    // The gap is a convex function of time, above each of its tangents.
    if (!(sign * push < -vary) || !(s > 0 && s < 1) || !(other > sign * -exact->state.r) ||
        !(other > sign * -end))
        return false;
    double here, bend;
    const double gap = room - sign * hop_gap(hop, s, &here, &bend);
    return gap > fabs(here);
}

// From a sample to the stop that is reached before the next, or to that one; *side is the stop.
INLINE Way reach(Exact *exact, Side *side) {
    enum { STEPS = 8 };
    const double h = exact->interval;
    Slice slice;
    Hop hop;
    exact_slice(exact, &slice);
    hop_make(&hop, &exact->hops, &exact->state, &slice);
    double slope, bend;
    const double end = hop_gap(&hop, 1, &slope, &bend), w = exact->state.w * h;
    *side = end > exact->state.r ? SIDE_RIGHT : SIDE_LEFT;
    const double sign = exact_sign(*side), room = exact_room(exact, *side);
    const double from = room - sign * exact->state.r, to = room - sign * end;
    Pull pull;
    see_pull(exact, h, &pull);
    // Between two instants w is as linear as r'' is constant.
    const double crooked = pull.vary * h * h;
    if (!(from > 0))
        return UNCLEAR;
    if (to > 0) {
        // Away from one stop all the way, or too far from both for the curve to reach one.
        const double least = from < to ? from : to, other = exact->damper->clearance;
        const double sag = pull.most * h * h / 8;
        if (!(sign * slope > crooked && sign * w > crooked) &&
            !(least > sag && other - from > sag) && !turns_free(exact, &hop, end, slope, pull.vary))
            return UNCLEAR;
        take_hop(exact, &hop, 1);
        return FREE;
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
        const double gap = room - sign * hop_gap(&hop, s, &slope, &bend);
        step = gap * slope / (sign * slope * slope + gap * bend);
        s += step;
    }
    if (!(fabs(step) <= 3e-6) || !(s > 0) || !(s <= 1) || !(sign * slope > 0))
        return UNCLEAR;
    // Met once and not before, as r went towards this stop all the way, or as a function of time
    // that is all convex or all concave; and the other not at all.
    const bool is_straight = first > crooked && sign * slope > crooked;
    if (!is_straight &&
        !(fabs(exact_push(exact)) > pull.vary && exact->damper->clearance - from > fabs(w)))
        return UNCLEAR;
    take_hop(exact, &hop, s);
    exact->offset = s * h;
    return BLOCKED;
}

// In flight from a stop to the next sample.
INLINE bool depart(Exact *exact) {
    const double length = exact->interval - exact->offset, sign = exact_sign((Side)exact->origin);
    const double w = -sign * exact->state.w;
    Pull pull;
    see_pull(exact, length, &pull);
    const double back = sign * exact_push(exact) + pull.vary; // r'' to the stop, at most
    if (!(w > 0 && w > back * length / 2) ||
        !((w + pull.most * length) * length < exact->damper->clearance) || length <= 0)
        return false;
    Slice slice;
    Hop hop;
    exact_slice(exact, &slice);
    hop_make(&hop, &exact->hops, &exact->state, &slice);
    take_hop(exact, &hop, length * hop.table->per_unit);
    return true;
}

WIDE static Way reach_wide(Exact *exact, Side *side) {
    return reach(exact, side);
}

WIDE static bool depart_wide(Exact *exact) {
    return depart(exact);
}

static void make_pulse(Exact *exact, Side side) {
    const ExactKey *key = &exact->key;
    const Side other = side == SIDE_LEFT ? SIDE_RIGHT : SIDE_LEFT;
    if (exact->has_pulse[other] && key->contact_omega2[0] == key->contact_omega2[1] &&
        key->contact_damping[0] == key->contact_damping[1])
        exact->pulses[side] = exact->pulses[other];
    else
        pulse_make(&exact->pulses[side], &exact->touching[side], key->base_omega, exact->interval);
    exact->has_pulse[side] = true;
}

// For how many samples the closed form keeps its digits. It counts the motion from where the base
// would hold it, each sample anew, and beside a soft structure that may be far from where it is.
static double keeps_digits(const Exact *exact, const Pulse *pulse) {
    const double *a = pulse->see[PULSE_A], *s = pulse->see[PULSE_S];
    const double most = exact->stretch.base_max, slope = exact->base_slope;
    const double x = fabs(a[PULSE_X]) * most + fabs(s[PULSE_X]) * slope;
    const double v = fabs(a[PULSE_V]) * most + fabs(s[PULSE_V]) * slope;
    const double apart = exact->plan->mass[0] * (v * v + exact->flying.omega2 * x * x);
    const EnergyState now = exact_energy(exact);
    const double held = impact_log_larger(exact->ledger.largest_energy, now.kinetic + now.strain);
    return apart > 0 ? APART_MAX * held / apart : INFINITY;
}

size_t exact_stride_press(Exact *exact, size_t most) {
    if (!exact->has_hops)
        return 0;
    const Pulse *pulse = &exact->pulses[exact->side];
    if (!exact->has_pulse[exact->side])
        make_pulse(exact, exact->side);
    const double samples = pulse->is_usable ? keeps_digits(exact, pulse) : 0;
    if (!(samples >= 1))
        return 0;
    return exact_press(exact, samples < (double)most ? (size_t)samples : most);
}

size_t exact_stride(Exact *exact, size_t most) {
    if (exact->lanes.run == NULL || exact->phase != FLIGHT || exact->is_leaving)
        return 0;
    const bool is_wide = exact->lanes.width != LANES_PLAIN;
    size_t count = 0;
    while (count < most) {
        const size_t flown = fly(exact, most - count);
        count += flown;
        if (count == most || !exact->has_stops)
            break;
        if (exact->sample + 1 == exact->recorder.statistics_start || !exact->has_hops)
            break;
        Side side;
        exact->run->work.stop_searches++;
        const Way way = is_wide ? reach_wide(exact, &side) : reach(exact, &side);
        if (way == UNCLEAR)
            break;
        if (way == FREE) {
            exact_stride_pass(exact);
            count++;
            continue;
        }
        exact->events++;
        exact->still_events = 0;
        exact_touch(exact, side);
        if (exact->phase == CONTACT)
            count += exact_stride_press(exact, most - count);
        if (exact->phase != FLIGHT || exact->is_leaving || exact->offset == 0 || count >= most ||
            !(is_wide ? depart_wide(exact) : depart(exact)))
            break;
        exact_stride_pass(exact);
        count++;
    }
    return count;
}

void exact_stride_enter(Exact *exact) {
    if (exact->pending == 0)
        return;
    const Plan *plan = exact->plan;
    const Lanes *lanes = &exact->lanes;
    double sums[LANE_SUMS], vv = 0, av = 0;
    Stretch *stretch = &exact->stretch;
    Peaks *peaks = &exact->ledger.response->peaks;
    lanes_take_sums(stretch, sums);
    const double speed = lanes_take_peak(stretch, OF_VELOCITY);
    peaks->velocity = impact_log_larger(peaks->velocity, speed);
    peaks->acceleration =
        impact_log_larger(peaks->acceleration, lanes_take_peak(stretch, OF_ACCELERATION));
    const double damper = lanes_take_peak(stretch, OF_DAMPER);
    if (plan->damper_count > 0)
        peaks->damper_displacement = impact_log_larger(peaks->damper_displacement, damper);
    for (int i = 0; i < LANE_SUMS; i++) {
        vv += lanes->vv[i] * sums[i];
        av += lanes->av[i] * sums[i];
    }
    impact_log_work(&exact->ledger, -plan->mass[0] * av - exact->damper->mass * exact->free_work,
                    plan->damping[0] * vv);
    if (exact->sample >= exact->recorder.statistics_start)
        exact_record_sums(&exact->recorder, exact->pending, sums[XX],
                          lanes->damping * lanes->damping * sums[VV] +
                              2 * lanes->damping * lanes->omega2 * sums[XV] +
                              lanes->omega2 * lanes->omega2 * sums[XX]);
    // It may all be gone again by the time that the balance is taken.
    impact_log_held(&exact->ledger, plan->mass[0] * speed * speed / 2);
    impact_log_held(&exact->ledger,
                    plan->stiffness[0] * peaks->displacement * peaks->displacement / 2);
    exact->free_work = 0;
    exact->pending = 0;
    if (exact->phase != FLIGHT) // a contact's work is entered at its end
        return;
    const EnergyState energy = exact_energy(exact);
    impact_log_balance(&exact->ledger, &energy);
}

void exact_stride_pass(Exact *exact) {
    if (exact->sample + 1 == exact->recorder.statistics_start)
        exact_stride_enter(exact);
    exact_pass_sample(exact);
}
