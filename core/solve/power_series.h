// The motion during contacts under power laws as Taylor polynomials in a time of its own, in which
// it is smooth where a contact begins and ends too. Not the choice of steps nor the events on them:
// those are power_contact.h. Used by frame_ode.c.
#ifndef CORE_SOLVE_POWER_SERIES_H
#define CORE_SOLVE_POWER_SERIES_H

#include "core/contact/contact.h"
#include "core/solve/modal_state.h"
#include "core/solve/power_series_law.h"

enum { SERIES_DEGREE = 26, SERIES_ROW = 28, SERIES_NODES = 8 };

// A series from order 0 on and, for products, from its last order back to 0 at the end of
// SERIES_ROW, with zeros behind.
typedef struct Series {
    double up[SERIES_ROW + 4], down[SERIES_ROW + 4];
    double now; // of the order that is being computed
} Series;

// One damper in contact.
typedef struct SeriesContact {
    size_t damper;
    double sign;
    ContactTerms terms;
    const SeriesLaw *law;
    bool is_felt;                  // else N is left out, being too small to matter
    bool is_damped;                // p' is above its turn
    double per_force;              // 1 / what is large for N
    Series speed, spring, viscous; // p', and powers of p
    double force[SERIES_ROW];      // N
} SeriesContact;

// Coefficients in s = tau / length, where dt = root Y^(root - 1) dtau and Y = p^(1/root) is that of
// one contact, the leader: Y' = p'.
typedef struct PowerSeries {
    size_t modes, dampers;
    size_t stride;                 // of a row
    size_t at_t, at_q, at_p, at_a; // places in it; w comes first, r last where dampers > 1
    size_t at_r;
    bool is_sine;
    double length; // in tau
    size_t degree;
    double *z, *rate; // row after row: the state, and its derivative in t
    double *elastic;
    SeriesContact *contact; // those in contact, the leader first
    size_t contacts;
    int root;                                                // of the leader; 1: tau is time
    Series powers[SERIES_POWERS];                            // of Y
    double node_power[ARC_RULES][SERIES_ROW * SERIES_NODES]; // of the nodes of arc_rules
    double *block;
} PowerSeries;

Status power_series_room(PowerSeries *series, const ModalState *state, Problem *problem);
void power_series_clear(PowerSeries *series);

// What is large for each, and the error that is allowed relative to that.
typedef struct SeriesScale {
    double error;
    double per_root, per_time; // 1 / what is large for the leader's Y and for t
    const double *per_speed;   // of the dampers' w
    const double *per_modal;   // of p
    size_t order;              // at most
} SeriesScale;

// From the present state, Y being the leader's: as many orders as the error needs over `length`, or
// scale->order. Returns the s up to which that error is kept.
double power_series_make(PowerSeries *series, const ModalState *state, const Slice *slice, double Y,
                         double length, const SeriesScale *scale);

// Keeps only the part up to s, of which s = 1 becomes the end.
void power_series_cut(PowerSeries *series, double s);

static inline const double *power_series_root(const PowerSeries *series) {
    return series->powers[1].up;
}

// One component's coefficients.
void power_series_of(const PowerSeries *series, size_t place, double *out);
// The whole row at s, and at s = 1.
void power_series_at(const PowerSeries *series, double s, double *row);
void power_series_end(const PowerSeries *series, double *row);
// A polynomial's values at the nodes of one of arc_rules; its coefficients are `stride` apart.
void power_series_nodes(const PowerSeries *series, size_t rule, const double *c, size_t stride,
                        size_t degree, double *out);

#endif
