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
#include "core/solve/power_contact.h"

#include <float.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "core/solve/power_contact_step.h"

enum { ORDER_MAX = 22 };

static const double STEP_PART = 0.1; // of a contact's tolerance, what a step may be wrong by
static const double ROUNDING = DBL_EPSILON / 4;
static const double STEP_WORK = 800; // of a step without orders, in multiplications
static const double ORDER_BASE = 2.5, ORDER_RISE = 0.55; // the cheapest order, of log(error)

Status power_contact_make(PowerContact *ode, ModalState *state, double tolerance,
                          Problem *problem) {
    memset(ode, 0, sizeof *ode);
    ode->state = state;
    ode->tolerance = tolerance;
    ode->error = fmax(STEP_PART * tolerance, ROUNDING);
    const double order = ORDER_BASE - ORDER_RISE * log(ode->error);
    ode->order = order > ORDER_MAX ? ORDER_MAX : (size_t)order;
    if (state->plan->form != CONTACT_POWER || state->dampers == 0)
        return STATUS_OK;
    const size_t n = state->mode_count, m = state->dampers;
    TRY(power_series_room(&ode->series, state, problem));
    ode->contact = calloc(m, sizeof *ode->contact);
    ode->block = calloc(m + n + state->padded + ode->series.stride + SERIES_NODES * (m + n),
                        sizeof *ode->block);
    if (ode->contact == NULL || ode->block == NULL)
        return problem_set(problem, STATUS_NO_MEMORY, "no memory for contacts of %zu dampers", m);
    ode->row = ode->block;
    ode->elastic = ode->row + ode->series.stride;
    ode->modal = ode->elastic + state->padded;
    ode->speed = ode->modal + n;
    ode->nodes = ode->speed + m;
    return STATUS_OK;
}

void power_contact_clear(PowerContact *ode) {
    power_series_clear(&ode->series);
    free(ode->contact);
    free(ode->block);
}

bool power_contact_serves(const PowerContact *ode) {
    for (size_t d = 0; ode->contact != NULL && d < ode->state->dampers; d++)
        if (ode->state->damper[d].phase == PHASE_CONTACT)
            return true;
    return false;
}

void power_contact_step(PowerContact *ode, const Slice *slice, double length,
                        PowerContactStep *step) {
    ModalState *state = ode->state;
    PowerSeries *series = &ode->series;
    *step = (PowerContactStep){0};
    modal_state_elastic(state, state->q, state->p, ode->elastic);
    for (size_t d = 0; d < state->dampers; d++)
        if (state->damper[d].phase == PHASE_CONTACT)
            power_contact_look(ode, d);
    if (power_contact_find_open(ode, step))
        return;
    SeriesScale scale;
    PowerContactFound found;
    const double Y = power_contact_contacts(ode);
    const double span = power_contact_scale(ode, Y, length, &scale);
    power_series_cut(series, power_series_make(series, state, slice, Y, span, &scale));
    ode->last = series->length;
    ode->last_root = series->root;
    const bool is_leaving = power_contact_cut_end(series);
    bool is_cut;
    const bool is_whole = power_contact_cut_time(series, length, &is_cut);
    power_contact_find(ode, is_leaving && !is_cut, &found);
    if (found.is_found && found.event.s < 1)
        power_series_cut(series, found.event.s);
    const bool is_end = found.is_found && !found.is_kink && !found.is_stop;
    if (!state->is_shadow) {
        power_contact_sums(ode, slice, step);
        power_contact_peaks(ode, slice);
    }
    power_contact_state(ode, slice, 1, is_end && found.event.damper == series->contact[0].damper);
    step->length = is_whole && !found.is_found ? length : ode->row[series->at_t];
    if (!state->is_shadow)
        power_contact_rows(ode, step->length);
    ode->still = step->length > 0 ? 0 : ode->still + 1;
    for (size_t c = 0; c < series->contacts; c++)
        if (step->length > 0)
            ode->contact[series->contact[c].damper].passed = 0;
    if (found.is_kink) {
        const SeriesContact *contact = &series->contact[found.contact];
        state->damper[contact->damper].w = contact->sign * contact->terms.turn;
        ode->contact[contact->damper].passed = contact->is_damped ? -1 : 1;
    }
    step->is_event = is_end;
    step->event = found.event;
    step->event.s = 1;
    const double k = (double)series->degree, n = (double)state->mode_count;
    step->work = STEP_WORK + k * k / 2 * ((double)series->stride + 4 * (double)series->contacts) +
                 (state->diagonal == NULL ? k * n * n : 0) + 12 * k * (double)series->stride;
}
