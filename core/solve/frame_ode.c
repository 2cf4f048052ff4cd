// A step is a row of Taylor polynomials (frame_series.h), as long as they keep the tolerance and at
// most to the end of what is asked; polynomials tell where on it something happens first:
//
//   in contact:  p falls to 0;  p' passes the speed at which the law has a kink
//   in flight:   the gaps to both stops close
//
// The contact nearest to its end, or its beginning, leads: its p makes the time of the series.
// Others are smooth enough meanwhile. Where p is so small that N, left out until the mass has come
// that far, would change its speed by less than the tolerance, it is left out: that begins what
// series cannot, a touch without speed, or one under an exponent that no root makes whole.
#include "core/solve/frame_ode.h"

#include <float.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "core/contact/power.h"
#include "core/solve/frame_record.h"

enum { ROW = SERIES_ROW, STILL_KINKS = 8, ORDER_MOST = 22 };

static const double STEP_PART = 0.1;    // of a contact's tolerance, what a step may be wrong by
static const double SPAN = 0.3;         // a step is about so long, in (root of depth) / speed
static const double NEARLY_SMALL = 0.9; // of negligible: there it still is
static const double ROUNDING = DBL_EPSILON / 4;
static const double ORDER_BASE = 2.5, ORDER_RISE = 0.55; // the cheapest order, of log(error)

Status frame_ode_make(FrameOde *ode, Frame *frame, double tolerance, Problem *problem) {
    memset(ode, 0, sizeof *ode);
    ode->frame = frame;
    ode->tolerance = tolerance;
    ode->error = fmax(STEP_PART * tolerance, ROUNDING);
    const double order = ORDER_BASE - ORDER_RISE * log(ode->error);
    ode->order = order > ORDER_MOST ? ORDER_MOST : (size_t)order;
    if (frame->plan->form != CONTACT_POWER || frame->dampers == 0)
        return STATUS_OK;
    const size_t n = frame->storeys, m = frame->dampers;
    TRY(frame_series_room(&ode->series, frame, problem));
    ode->contact = calloc(m, sizeof *ode->contact);
    ode->block = calloc(m + n + frame->padded + ode->series.stride + SERIES_NODES * (m + n),
                        sizeof *ode->block);
    if (ode->contact == NULL || ode->block == NULL)
        return problem_set(problem, STATUS_NO_MEMORY, "no memory for contacts of %zu dampers", m);
    ode->row = ode->block;
    ode->elastic = ode->row + ode->series.stride;
    ode->modal = ode->elastic + frame->padded;
    ode->speed = ode->modal + n;
    ode->nodes = ode->speed + m;
    return STATUS_OK;
}

void frame_ode_clear(FrameOde *ode) {
    frame_series_clear(&ode->series);
    free(ode->contact);
    free(ode->block);
}

bool frame_ode_serves(const FrameOde *ode) {
    for (size_t d = 0; ode->contact != NULL && d < ode->frame->dampers; d++)
        if (ode->frame->damper[d].phase == FRAME_CONTACT)
            return true;
    return false;
}

static double root_of(double value, int root) {
    return root == 1   ? value
           : root == 2 ? sqrt(value)
           : root == 3 ? cbrt(value)
                       : sqrt(sqrt(value));
}

static double penetration(const FrameDamper *damper) {
    return fmax(frame_sign(damper->side) * damper->r, 0);
}

// p at which N is k p^n = `force`.
static double depth_at(const ContactTerms *terms, double force) {
    return pow(force / terms->stiffness, 1 / terms->exponent);
}

// Below which p a contact that begins with this speed need not feel N.
static double find_negligible(const FrameOdeContact *at, double error, double w, double mass) {
    const double n = at->terms.exponent, m = at->terms.viscous_exponent;
    double p = 0;
    if (!at->law.is_whole)
        p = at->depth * pow(error, 1 / ((at->terms.viscous > 0 ? fmin(n, m) : n) + 1));
    // Pressed rather than thrown: p = push t^2 / 2.
    if (!(at->push > 0) || !(w * w < 1e-3 * at->push * at->depth))
        return p;
    double slow = depth_at(&at->terms, error * mass * at->push);
    if (at->terms.viscous > 0)
        slow = fmin(slow, pow(error * mass * sqrt(at->push) / at->terms.viscous, 1 / (m + 0.5)));
    return w * w < 2 * at->push * slow ? fmax(p, slow) : p;
}

// Brings what is known of a contact up to the present state.
static void look_at(FrameOde *ode, size_t d) {
    const Frame *frame = ode->frame;
    const FrameDamper *damper = &frame->damper[d];
    FrameOdeContact *at = &ode->contact[d];
    const double mass = damper->effective_mass, w = frame_sign(damper->side) * damper->w;
    const ContactParameters *now = &damper->contact;
    if (memcmp(now, &at->parameters, sizeof *now) != 0) {
        at->parameters = *now;
        at->terms = frame->plan->law->terms(now);
        series_law_make(&at->law, &at->terms);
        at->speed = 0;
    }
    at->push = frame_sign(damper->side) * (damper->lean * frame->ground +
                                           frame_dot(damper->shape, ode->elastic, frame->storeys));
    const double n = at->terms.exponent, p = penetration(damper);
    double speed = fmax(fabs(w), damper->row.impact.approach_speed);
    if (!(speed <= at->speed) || !(speed >= at->speed / 4) || !(at->speed > 0)) {
        at->speed = speed;
        at->depth = pow(mass * speed * speed / at->terms.stiffness, 1 / (n + 1));
    }
    // What presses may make it deeper and faster than the touch did.
    if (mass * fabs(at->push) * at->depth > mass * at->speed * at->speed || !(at->speed > 0)) {
        at->depth = depth_at(&at->terms, mass * fabs(at->push));
        at->speed = fmax(speed, sqrt(2 * fabs(at->push) * at->depth));
    }
    at->depth = fmax(at->depth, p);
    at->negligible = find_negligible(at, ode->error, w, mass);
    at->strain = at->terms.stiffness * power_of(p, n) * p / (n + 1);
}

// Which side of the law's kink the motion is on, or goes to.
static bool is_damped(const FrameOdeContact *at, const FrameDamper *damper) {
    const double w = frame_sign(damper->side) * damper->w, off = w - at->terms.turn;
    if (fabs(off) > 4 * DBL_EPSILON * fabs(w))
        return off > 0;
    const double spring =
        at->terms.is_elastic_below
            ? at->terms.stiffness * power_of(penetration(damper), at->terms.exponent)
            : 0;
    return at->push - spring / damper->effective_mass > 0;
}

// Lists those in contact; the leader comes first. Returns its Y.
static double find_contacts(FrameOde *ode) {
    const Frame *frame = ode->frame;
    FrameSeries *series = &ode->series;
    size_t first = 0;
    double nearest = INFINITY;
    series->contacts = 0;
    for (size_t d = 0; d < frame->dampers; d++) {
        const FrameDamper *damper = &frame->damper[d];
        const FrameOdeContact *at = &ode->contact[d];
        if (damper->phase != FRAME_CONTACT)
            continue;
        const double p = penetration(damper);
        SeriesContact *contact = &series->contact[series->contacts];
        contact->damper = d;
        contact->sign = frame_sign(damper->side);
        contact->terms = at->terms;
        contact->law = &at->law;
        contact->is_felt = p >= NEARLY_SMALL * at->negligible;
        contact->is_damped = is_damped(at, damper);
        // Among those whose N is felt the one with the least p leads.
        const double rank = contact->is_felt ? p / at->depth : 0x1p1000;
        if (rank < nearest) {
            nearest = rank;
            first = series->contacts;
        }
        series->contacts++;
    }
    SeriesContact *const all = series->contact;
    if (first > 0) {
        const SeriesContact moved = all[0];
        all[0] = all[first];
        all[first] = moved;
    }
    // Another that is at 0 too has no series of its own until it is pressed.
    for (size_t c = 1; c < series->contacts; c++)
        if (!(penetration(&frame->damper[all[c].damper]) > 0))
            all[c].is_felt = false;
    series->root = all[0].is_felt ? all[0].law->root : 1;
    return root_of(penetration(&frame->damper[all[0].damper]), series->root);
}

// What a step of tau is about as long as, and what is large for each component.
static double make_scale(FrameOde *ode, double Y, double length, SeriesScale *scale) {
    const Frame *frame = ode->frame;
    const FrameSeries *series = &ode->series;
    const size_t n = frame->storeys;
    const int root = series->root;
    double span = INFINITY;
    for (size_t i = 0; i < n; i++)
        ode->modal[i] = fabs(frame->p[i]) + DBL_MIN;
    for (size_t c = 0; c < series->contacts; c++) {
        const size_t d = series->contact[c].damper;
        const FrameDamper *damper = &frame->damper[d];
        const FrameOdeContact *at = &ode->contact[d];
        const double speed = at->speed + DBL_MIN;
        ode->speed[d] = 1 / speed;
        for (size_t i = 0; i < n; i++)
            ode->modal[i] += fabs(damper->shape[i]) * damper->effective_mass * speed;
        const double own = at->depth / speed;
        span = own < span ? own : span;
    }
    for (size_t i = 0; i < n; i++)
        ode->modal[i] = 1 / ode->modal[i];
    const size_t d = series->contact[0].damper;
    const double w = series->contact[0].sign * frame->damper[d].w;
    const double large = root_of(ode->contact[d].depth, root) + DBL_MIN;
    *scale = (SeriesScale){.error = ode->error,
                           .per_root = 1 / large,
                           .per_time = 1 / (span + DBL_MIN),
                           .per_speed = ode->speed,
                           .per_modal = ode->modal,
                           .order = ode->order};
    // tau over `length`, were the speed to stay.
    double p = Y;
    for (int i = 1; i < root; i++)
        p *= Y;
    const double end = root_of(ledger_larger(p + w * length, 0), root);
    double mean = 0, power = 1; // the sum of Y^i end^(root - 1 - i)
    for (int i = 0; i < root; i++, power *= Y)
        mean = mean * end + power;
    // As far as the step before went, or about so far by the contact's own numbers.
    const double usual = SPAN * large * ode->speed[d];
    const double reach = root == ode->last_root && ode->last > usual ? ode->last : usual;
    return fmin(reach, 1.02 * length / mean);
}

// Cuts the step where the leader leaves, for behind it t would fall. Whether it does.
static bool cut_end(FrameSeries *series) {
    double s;
    if (!root_first_crossing(frame_series_root(series), series->degree, &s))
        return false;
    frame_series_cut(series, s);
    return true;
}

// Cuts the step where t is `length`. Whether it comes that far, *is_cut whether it came further.
static bool cut_time(FrameSeries *series, double length, bool *is_cut) {
    double left[ROW], s, t = 0;
    frame_series_of(series, series->at_t, left);
    for (size_t k = series->degree; k > 0; k--) {
        t += left[k];
        left[k] = -left[k];
    }
    *is_cut = false;
    if (t <= length)
        return t >= length * (1 - 4 * DBL_EPSILON);
    left[0] = length;
    *is_cut = root_first_crossing(left, series->degree, &s);
    if (*is_cut)
        frame_series_cut(series, s);
    return true;
}

typedef struct Found {
    bool is_found, is_kink, is_stop; // is_stop: N is to be felt from here on
    size_t contact;
    FrameEvent event;
} Found;

// The first fall of c below zero, if it comes before what was found.
static bool falls(const FrameSeries *series, const double *c, Found *found) {
    double s;
    if (!root_first_crossing(c, series->degree, &s) || (found->is_found && s >= found->event.s))
        return false;
    *found = (Found){.is_found = true, .event = {.s = s}};
    return true;
}

static void find_end(const FrameOde *ode, size_t c, Found *found) {
    const FrameSeries *series = &ode->series;
    const SeriesContact *contact = &series->contact[c];
    const FrameDamper *damper = &ode->frame->damper[contact->damper];
    const double negligible = ode->contact[contact->damper].negligible;
    double gap[ROW];
    if (c == 0)
        memcpy(gap, frame_series_root(series), (series->degree + 1) * sizeof *gap);
    else
        frame_series_of(series, series->at_r + contact->damper, gap);
    for (size_t k = 0; k <= series->degree && c > 0; k++)
        gap[k] *= contact->sign;
    if (c > 0 && falls(series, gap, found)) {
        found->event.damper = contact->damper;
        found->event.side = damper->side;
    }
    if (contact->is_felt)
        return;
    for (size_t k = 0; k <= series->degree; k++)
        gap[k] = -gap[k];
    gap[0] += negligible > 0 ? negligible : ode->contact[contact->damper].depth * 1e-3;
    if (falls(series, gap, found)) {
        found->is_stop = true;
        found->contact = c;
    }
}

static void find_kink(const FrameOde *ode, size_t c, Found *found) {
    const FrameSeries *series = &ode->series;
    const SeriesContact *contact = &series->contact[c];
    const FrameOdeContact *at = &ode->contact[contact->damper];
    double off[ROW];
    if (!(at->terms.viscous > 0) || !contact->is_felt || ode->still > STILL_KINKS)
        return;
    const double sign = contact->is_damped ? 1 : -1;
    frame_series_of(series, contact->damper, off);
    for (size_t k = 0; k <= series->degree; k++)
        off[k] *= sign * contact->sign;
    const double size = fabs(off[0]);
    off[0] -= sign * at->terms.turn;
    if (fabs(off[0]) <= 4 * DBL_EPSILON * size || off[0] < 0)
        off[0] = 0;
    if (falls(series, off, found)) {
        found->is_kink = true;
        found->contact = c;
    }
}

static void find_touch(const FrameOde *ode, size_t d, Found *found) {
    const Frame *frame = ode->frame;
    const FrameSeries *series = &ode->series;
    double r[ROW], gap[ROW], reach = 0;
    frame_series_of(series, series->at_r + d, r);
    for (size_t k = 0; k <= series->degree; k++)
        reach += fabs(r[k]);
    for (int side = 0; side < 2; side++) {
        const double sign = frame_sign((Side)side),
                     room = frame_room(&frame->damper[d], (Side)side);
        if (reach < room)
            continue;
        for (size_t k = 0; k <= series->degree; k++)
            gap[k] = -sign * r[k];
        gap[0] = fmax(gap[0] + room, 0);
        if (falls(series, gap, found))
            found->event = (FrameEvent){.damper = d, .s = found->event.s, .side = (Side)side};
    }
}

// The state at s.
static void take_state(FrameOde *ode, const Slice *slice, double s, bool is_ended) {
    Frame *frame = ode->frame;
    const FrameSeries *series = &ode->series;
    const double *row = ode->row;
    if (s < 1)
        frame_series_at(series, s, ode->row);
    else
        frame_series_end(series, ode->row);
    memcpy(frame->q, row + series->at_q, frame->storeys * sizeof *frame->q);
    memcpy(frame->p, row + series->at_p, frame->storeys * sizeof *frame->p);
    for (size_t d = 0; d < frame->dampers; d++) {
        frame->damper[d].w = row[d];
        if (frame->dampers > 1)
            frame->damper[d].r = row[series->at_r + d];
    }
    const SeriesContact *leader = &series->contact[0];
    const double Y = fmax(root_value(frame_series_root(series), series->degree, s), 0);
    double r = Y;
    for (int i = 1; i < series->root; i++)
        r *= Y;
    frame->damper[leader->damper].r = is_ended ? 0 : leader->sign * r;
    frame->ground = slice_at(slice, row[series->at_t]);
}

// p' D p of all nodes, into `loss`.
static void find_loss(FrameOde *ode, size_t rule, double *loss) {
    const Frame *frame = ode->frame;
    const FrameSeries *series = &ode->series;
    const size_t n = frame->storeys, count = arc_rules[rule].count;
    memset(loss, 0, SERIES_NODES * sizeof *loss);
    for (size_t i = 0; i < n; i++) {
        double *p = ode->nodes + i * SERIES_NODES;
        frame_series_nodes(series, rule, series->z + series->at_p + i, series->stride,
                           series->degree, p);
        for (size_t k = 0; k < count && frame->diagonal != NULL; k++)
            loss[k] += frame->diagonal[i] * p[k] * p[k];
    }
    for (size_t i = 0; i < n && frame->diagonal == NULL; i++)
        for (size_t j = 0; j < n; j++) {
            const double *a = ode->nodes + i * SERIES_NODES, *b = ode->nodes + j * SERIES_NODES;
            for (size_t k = 0; k < count; k++)
                loss[k] += frame->damping[i * n + j] * a[k] * b[k];
        }
}

// Integrals over the step.
static void take_sums(FrameOde *ode, const Slice *slice, FrameOdeStep *step) {
    const Frame *frame = ode->frame;
    const FrameSeries *series = &ode->series;
    const size_t rule = ode->error > 1e-8 ? 0 : ARC_RULES - 1, count = arc_rules[rule].count;
    const size_t n = frame->storeys, m = frame->dampers, degree = series->degree;
    double weight[SERIES_NODES], Y[SERIES_NODES], ground[SERIES_NODES], loss[SERIES_NODES],
        momentum[SERIES_NODES] = {0};
    frame_series_nodes(series, rule, frame_series_root(series), 1, degree, Y);
    frame_series_nodes(series, rule, series->z + (series->is_sine ? series->at_a : series->at_t),
                       series->stride, degree, ground);
    find_loss(ode, rule, loss);
    for (size_t i = 0; i < n; i++)
        for (size_t k = 0; k < count; k++)
            momentum[k] += frame->carry[i] * ode->nodes[i * SERIES_NODES + k];
    for (size_t d = 0; d < m; d++) {
        double *w = ode->nodes + d * SERIES_NODES; // the modes' are no longer wanted
        frame_series_nodes(series, rule, series->z + d, series->stride, degree, w);
        for (size_t k = 0; k < count; k++)
            momentum[k] += frame->damper[d].plan->mass * w[k];
    }
    for (size_t k = 0; k < count; k++) {
        weight[k] = arc_rules[rule].weight[k] * series->length * series->root;
        for (int i = 1; i < series->root; i++)
            weight[k] *= Y[k];
        ground[k] = series->is_sine ? ground[k] : slice_at(slice, ground[k]);
        step->input -= weight[k] * ground[k] * momentum[k];
        step->damping += weight[k] * loss[k];
        step->ground += weight[k] * ground[k];
    }
    for (size_t c = 0; c < series->contacts; c++) {
        const SeriesContact *contact = &series->contact[c];
        FrameOdeContact *at = &ode->contact[contact->damper];
        const double *w = ode->nodes + contact->damper * SERIES_NODES;
        double force[SERIES_NODES];
        at->impulse = at->work = 0;
        if (!contact->is_felt)
            continue;
        frame_series_nodes(series, rule, contact->force, 1, degree - 1, force);
        for (size_t k = 0; k < count; k++) {
            const double impulse = weight[k] * contact->sign * force[k];
            at->impulse += impulse;
            at->work += impulse * w[k];
        }
    }
}

// Largest forces on the way, and what they accelerate.
static void take_peaks(FrameOde *ode, const Slice *slice) {
    Frame *frame = ode->frame;
    const FrameSeries *series = &ode->series;
    for (size_t c = 0; c < series->contacts; c++) {
        const SeriesContact *contact = &series->contact[c];
        FrameDamper *damper = &frame->damper[contact->damper];
        double s = -1;
        if (!contact->is_felt)
            continue;
        const double peak = arc_largest(contact->force, series->degree - 1,
                                        ledger_least_force(&frame->ledger, &damper->row), &s);
        ledger_force(&frame->ledger, &damper->row, peak);
        if (!(s > 0 && s < 1))
            continue;
        take_state(ode, slice, s, false);
        frame_feel(frame);
        frame_record_acceleration(frame);
    }
}

static void take_rows(FrameOde *ode, double length) {
    Frame *frame = ode->frame;
    const FrameSeries *series = &ode->series;
    for (size_t c = 0; c < series->contacts; c++) {
        FrameDamper *damper = &frame->damper[series->contact[c].damper];
        const FrameOdeContact *at = &ode->contact[series->contact[c].damper];
        const double p = penetration(damper), n = at->terms.exponent;
        const double strain = at->terms.stiffness * power_of(p, n) * p / (n + 1);
        ledger_stretch(&frame->ledger, &damper->row, length, at->impulse,
                       at->work - (strain - at->strain));
    }
}

// A buffer that has let go already: its gap opens from the first instant on.
static bool find_open(const FrameOde *ode, FrameOdeStep *step) {
    const Frame *frame = ode->frame;
    for (size_t d = 0; d < frame->dampers; d++) {
        const FrameDamper *damper = &frame->damper[d];
        const double sign = frame_sign(damper->side), w = sign * damper->w;
        if (damper->phase != FRAME_CONTACT || sign * damper->r > 0 ||
            !(w < 0 || (w == 0 && !(ode->contact[d].push > 0))))
            continue;
        step->is_event = true;
        step->event = (FrameEvent){.damper = d, .s = 1, .side = damper->side};
        return true;
    }
    return false;
}

// `is_end`: at its end the leader leaves.
static void find_first(const FrameOde *ode, bool is_end, Found *found) {
    const FrameSeries *series = &ode->series;
    *found = (Found){0};
    if (is_end) {
        const size_t d = series->contact[0].damper;
        found->is_found = true;
        found->event = (FrameEvent){.damper = d, .s = 1, .side = ode->frame->damper[d].side};
    }
    for (size_t c = 0; c < series->contacts; c++) {
        find_end(ode, c, found);
        find_kink(ode, c, found);
    }
    for (size_t d = 0; d < ode->frame->dampers; d++)
        if (ode->frame->damper[d].phase == FRAME_FLIGHT)
            find_touch(ode, d, found);
}

void frame_ode_step(FrameOde *ode, const Slice *slice, double length, FrameOdeStep *step) {
    Frame *frame = ode->frame;
    FrameSeries *series = &ode->series;
    *step = (FrameOdeStep){0};
    frame_elastic(frame, frame->q, frame->p, ode->elastic);
    for (size_t d = 0; d < frame->dampers; d++)
        if (frame->damper[d].phase == FRAME_CONTACT)
            look_at(ode, d);
    if (find_open(ode, step))
        return;
    SeriesScale scale;
    Found found;
    const double Y = find_contacts(ode);
    const double span = make_scale(ode, Y, length, &scale);
    frame_series_cut(series, frame_series_make(series, frame, slice, Y, span, &scale));
    ode->last = series->length;
    ode->last_root = series->root;
    const bool is_leaving = cut_end(series);
    bool is_cut;
    const bool is_whole = cut_time(series, length, &is_cut);
    find_first(ode, is_leaving && !is_cut, &found);
    if (found.is_found && found.event.s < 1)
        frame_series_cut(series, found.event.s);
    const bool is_end = found.is_found && !found.is_kink && !found.is_stop;
    if (!frame->is_shadow) {
        take_sums(ode, slice, step);
        take_peaks(ode, slice);
    }
    take_state(ode, slice, 1, is_end && found.event.damper == series->contact[0].damper);
    step->length = is_whole && !found.is_found ? length : ode->row[series->at_t];
    if (!frame->is_shadow)
        take_rows(ode, step->length);
    ode->still = step->length > 0 ? 0 : ode->still + 1;
    if (found.is_kink) {
        const SeriesContact *contact = &series->contact[found.contact];
        frame->damper[contact->damper].w = contact->sign * contact->terms.turn;
    }
    step->is_event = is_end;
    step->event = found.event;
    step->event.s = 1;
    const double k = (double)series->degree, n = (double)frame->storeys;
    step->work = k * k / 2 * ((double)series->stride + 4 * (double)series->contacts) +
                 (frame->diagonal == NULL ? k * n * n : 0) + 12 * k * (double)series->stride;
    frame->events += !is_end && !(step->length > 0); // a step may end where it began
}
