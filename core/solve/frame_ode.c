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

enum { ROW = SERIES_ROW, STILL_KINKS = 8 };

static const double STEP_PART = 0.1;     // of a contact's tolerance, what a step may be wrong by
static const double SPAN = 0.3;          // a step is about so long, in (root of depth) / speed
static const double NEARLY_SMALL = 0.9;  // of negligible: there it still is
static const double ROUNDING = DBL_EPSILON / 4;

Status frame_ode_make(FrameOde *ode, Frame *frame, double tolerance, Problem *problem) {
    memset(ode, 0, sizeof *ode);
    ode->frame = frame;
    ode->tolerance = tolerance;
    if (frame->plan->form != CONTACT_POWER || frame->dampers == 0)
        return STATUS_OK;
    const size_t n = frame->storeys, m = frame->dampers;
    TRY(frame_series_room(&ode->series, frame, problem));
    ode->contact = calloc(m, sizeof *ode->contact);
    ode->block = calloc(m + n + 3 * frame->padded + ode->series.stride, sizeof *ode->block);
    if (ode->contact == NULL || ode->block == NULL)
        return problem_set(problem, STATUS_NO_MEMORY, "no memory for contacts of %zu dampers", m);
    ode->row = ode->block;
    ode->elastic = ode->row + ode->series.stride;
    ode->q = ode->elastic + frame->padded;
    ode->p = ode->q + frame->padded;
    ode->modal = ode->p + frame->padded;
    ode->speed = ode->modal + n;
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

static double error_of(const FrameOde *ode) {
    return fmax(STEP_PART * ode->tolerance, ROUNDING);
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
    at->push = frame_sign(damper->side) *
               (damper->lean * frame->ground + frame_dot(damper->shape, ode->elastic,
                                                         frame->storeys));
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
    at->negligible = find_negligible(at, error_of(ode), w, mass);
    at->strain = at->terms.stiffness * power_of(p, n) * p / (n + 1);
}

// Which side of the law's kink the motion is on, or goes to.
static bool is_damped(const FrameOdeContact *at, const FrameDamper *damper) {
    const double w = frame_sign(damper->side) * damper->w, off = w - at->terms.turn;
    if (fabs(off) > 4 * DBL_EPSILON * fabs(w))
        return off > 0;
    const double spring = at->terms.is_elastic_below
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
    const SeriesContact leader = all[first];
    all[first] = all[0];
    all[0] = leader;
    // Another that is at 0 too has no series of its own until it is pressed.
    for (size_t c = 1; c < series->contacts; c++)
        if (!(penetration(&frame->damper[all[c].damper]) > 0))
            all[c].is_felt = false;
    series->root = leader.is_felt ? leader.law->root : 1;
    return root_of(penetration(&frame->damper[leader.damper]), series->root);
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
        ode->speed[d] = at->speed + DBL_MIN;
        for (size_t i = 0; i < n; i++)
            ode->modal[i] += fabs(damper->shape[i]) * damper->effective_mass * at->speed;
        span = fmin(span, at->depth / ode->speed[d]);
    }
    const FrameOdeContact *leader = &ode->contact[series->contact[0].damper];
    const double w = series->contact[0].sign * frame->damper[series->contact[0].damper].w;
    *scale = (SeriesScale){.error = error_of(ode),
                           .root = root_of(leader->depth, root) + DBL_MIN,
                           .time = span + DBL_MIN,
                           .speed = ode->speed,
                           .modal = ode->modal};
    const double order = 2.5 - 0.55 * log(scale->error);
    scale->order = order > 22 ? 22 : order < 5 ? 5 : (size_t)order;
    // tau over `length`, were the speed to stay.
    const double end = root_of(fmax(pow(Y, root) + w * length, 0), root);
    double mean = 0, power = 1;
    for (int i = 0; i < root; i++, power *= end)
        mean += power * pow(Y, root - 1 - i);
    return fmin(SPAN * scale->root / ode->speed[series->contact[0].damper], 1.02 * length / mean);
}

// Cuts the step where t is `length`. Whether it is.
static bool cut_time(FrameOde *ode, double length) {
    FrameSeries *series = &ode->series;
    double left[ROW], s, t = 0;
    frame_series_of(series, series->at_t, left);
    for (size_t k = series->degree; k > 0; k--) {
        t += left[k];
        left[k] = -left[k];
    }
    if (t <= length)
        return t >= length * (1 - 4 * DBL_EPSILON);
    left[0] = length;
    if (root_first_crossing(left, series->degree, &s))
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
    if (c == 0) {
        memcpy(gap, frame_series_root(series), (series->degree + 1) * sizeof *gap);
    } else {
        frame_series_of(series, series->at_r + contact->damper, gap);
        for (size_t k = 0; k <= series->degree; k++)
            gap[k] *= contact->sign;
    }
    if (falls(series, gap, found)) {
        found->contact = c;
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
        const double sign = frame_sign((Side)side), room = frame_room(&frame->damper[d], (Side)side);
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
    frame_series_at(series, s, ode->row);
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

// p' D p of a row.
static double loss_of(FrameOde *ode, const double *q, const double *p) {
    const Frame *frame = ode->frame;
    const size_t n = frame->storeys;
    double loss = 0;
    if (frame->diagonal != NULL) {
        for (size_t i = 0; i < n; i++)
            loss += frame->diagonal[i] * p[i] * p[i];
        return loss;
    }
    memcpy(ode->q, q, n * sizeof *q); // whole vectors
    memcpy(ode->p, p, n * sizeof *p);
    frame_elastic(frame, ode->q, ode->p, ode->elastic);
    loss = frame_dot(ode->elastic, p, n);
    for (size_t i = 0; i < n; i++)
        loss -= frame->omega2[i] * q[i] * p[i];
    return loss;
}

// Integrals over the step.
static void take_sums(FrameOde *ode, const Slice *slice, FrameOdeStep *step) {
    const Frame *frame = ode->frame;
    const FrameSeries *series = &ode->series;
    const Quadrature *rule = &arc_rules[error_of(ode) > 1e-8 ? 0 : ARC_RULES - 1];
    const double *q = ode->row + series->at_q, *p = ode->row + series->at_p;
    for (size_t c = 0; c < series->contacts; c++)
        ode->contact[series->contact[c].damper].impulse =
            ode->contact[series->contact[c].damper].work = 0;
    for (size_t node = 0; node < rule->count; node++) {
        const double s = rule->node[node];
        frame_series_at(series, s, ode->row);
        const double Y = root_value(frame_series_root(series), series->degree, s);
        double weight = rule->weight[node] * series->length * series->root;
        for (int i = 1; i < series->root; i++)
            weight *= Y;
        const double ground = series->is_sine ? ode->row[series->at_a]
                                              : slice_at(slice, ode->row[series->at_t]);
        double momentum = frame_dot(frame->carry, p, frame->storeys);
        for (size_t d = 0; d < frame->dampers; d++)
            momentum += frame->damper[d].plan->mass * ode->row[d];
        step->input -= weight * ground * momentum;
        step->damping += weight * loss_of(ode, q, p);
        step->ground += weight * ground;
        for (size_t c = 0; c < series->contacts; c++) {
            const SeriesContact *contact = &series->contact[c];
            FrameOdeContact *at = &ode->contact[contact->damper];
            if (!contact->is_felt)
                continue;
            const double impulse =
                weight * contact->sign * root_value(contact->force, series->degree - 1, s);
            at->impulse += impulse;
            at->work += impulse * ode->row[contact->damper];
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

static void find_first(const FrameOde *ode, Found *found) {
    const FrameSeries *series = &ode->series;
    *found = (Found){0};
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
    const bool is_whole = cut_time(ode, length);
    find_first(ode, &found);
    if (found.is_found)
        frame_series_cut(series, found.event.s);
    const bool is_end = found.is_found && !found.is_kink && !found.is_stop;
    if (!frame->is_shadow) {
        take_sums(ode, slice, step);
        take_peaks(ode, slice);
    }
    take_state(ode, slice, 1,
               is_end && found.event.damper == series->contact[0].damper);
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
