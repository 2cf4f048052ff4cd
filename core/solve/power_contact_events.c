// On a step's polynomials: where it ends, and what happens first.
#include <float.h>
#include <math.h>
#include <string.h>

#include "core/solve/power_contact_step.h"

enum { ROW = SERIES_ROW, STILL_KINKS = 8 };

// Cuts the step where the leader leaves, for behind it t would fall. Whether it does.
bool power_contact_cut_end(PowerSeries *series) {
    double s;
    if (!root_first_crossing(power_series_root(series), series->degree, &s))
        return false;
    power_series_cut(series, s);
    return true;
}

// Cuts the step where t is `length`. Whether it comes that far, *is_cut whether it came further.
bool power_contact_cut_time(PowerSeries *series, double length, bool *is_cut) {
    double left[ROW], s, t = 0;
    power_series_of(series, series->at_t, left);
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
        power_series_cut(series, s);
    return true;
}

// The first fall of c below zero, if it comes before what was found.
static bool falls(const PowerSeries *series, const double *c, PowerContactFound *found) {
    double s;
    if (!root_first_crossing(c, series->degree, &s) || (found->is_found && s >= found->event.s))
        return false;
    *found = (PowerContactFound){.is_found = true, .event = {.s = s}};
    return true;
}

static void find_end(const PowerContact *ode, size_t c, PowerContactFound *found) {
    const PowerSeries *series = &ode->series;
    const SeriesContact *contact = &series->contact[c];
    const DamperState *damper = &ode->state->damper[contact->damper];
    const double negligible = ode->contact[contact->damper].negligible;
    double gap[ROW];
    if (c == 0)
        memcpy(gap, power_series_root(series), (series->degree + 1) * sizeof *gap);
    else
        power_series_of(series, series->at_r + contact->damper, gap);
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
    gap[0] += negligible;
    if (falls(series, gap, found)) {
        found->is_stop = true;
        found->contact = c;
    }
}

static void find_kink(const PowerContact *ode, size_t c, PowerContactFound *found) {
    const PowerSeries *series = &ode->series;
    const SeriesContact *contact = &series->contact[c];
    const PowerContactContact *at = &ode->contact[contact->damper];
    double off[ROW];
    if (!(at->terms.viscous > 0) || !contact->is_felt || ode->still > STILL_KINKS)
        return;
    const double sign = contact->is_damped ? 1 : -1;
    power_series_of(series, contact->damper, off);
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

static void find_touch(const PowerContact *ode, size_t d, PowerContactFound *found) {
    const ModalState *state = ode->state;
    const PowerSeries *series = &ode->series;
    double r[ROW], gap[ROW], reach = 0;
    power_series_of(series, series->at_r + d, r);
    for (size_t k = 0; k <= series->degree; k++)
        reach += fabs(r[k]);
    for (int side = 0; side < 2; side++) {
        const double sign = modal_state_sign((Side)side),
                     room = modal_state_room(&state->damper[d], (Side)side);
        if (reach < room)
            continue;
        for (size_t k = 0; k <= series->degree; k++)
            gap[k] = -sign * r[k];
        gap[0] = fmax(gap[0] + room, 0);
        if (falls(series, gap, found))
            found->event = (ContactEvent){.damper = d, .s = found->event.s, .side = (Side)side};
    }
}

// A buffer that has let go already: its gap opens from the first instant on.
bool power_contact_find_open(const PowerContact *ode, PowerContactStep *step) {
    const ModalState *state = ode->state;
    for (size_t d = 0; d < state->dampers; d++) {
        const DamperState *damper = &state->damper[d];
        const double sign = modal_state_sign(damper->side), w = sign * damper->w;
        if (damper->phase != PHASE_CONTACT || sign * damper->r > 0 ||
            !(w < 0 || (w == 0 && !(ode->contact[d].push > 0))))
            continue;
        step->is_event = true;
        step->event = (ContactEvent){.damper = d, .s = 1, .side = damper->side};
        return true;
    }
    return false;
}

// `is_end`: at its end the leader leaves.
void power_contact_find(const PowerContact *ode, bool is_end, PowerContactFound *found) {
    const PowerSeries *series = &ode->series;
    *found = (PowerContactFound){0};
    if (is_end) {
        const size_t d = series->contact[0].damper;
        found->is_found = true;
        found->event = (ContactEvent){.damper = d, .s = 1, .side = ode->state->damper[d].side};
    }
    for (size_t c = 0; c < series->contacts; c++) {
        find_end(ode, c, found);
        find_kink(ode, c, found);
    }
    for (size_t d = 0; d < ode->state->dampers; d++)
        if (ode->state->damper[d].phase == PHASE_FLIGHT)
            find_touch(ode, d, found);
}
