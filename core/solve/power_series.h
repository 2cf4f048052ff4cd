// Taylor series of the motion during contacts under power laws, in a transformed time in which the
// motion is analytic at the start and at the end of a contact. power_contact.h chooses the
// integration steps and locates the events on them.
#ifndef CORE_SOLVE_POWER_SERIES_H
#define CORE_SOLVE_POWER_SERIES_H

#include "core/contact/contact.h"
#include "core/solve/modal_state.h"

enum { SERIES_ROW = 28, SERIES_NODES = 8, SERIES_POWERS = 20 };

// The contact force in terms of Y = p^(1/root).
typedef struct SeriesLaw {
    double exponents[2]; // of p in the elastic and in the viscous part of N
    int root;
    bool is_integer; // root * exponents are integers; else N has a series only where Y > 0
    // Powers of Y, each the product of two earlier entries. Entry 0 is 1, entry 1 is Y.
    int count, power[SERIES_POWERS], left[SERIES_POWERS], right[SERIES_POWERS];
    int time_factor, elastic, viscous; // entries Y^(root - 1), Y^(root * exponents)
} SeriesLaw;

// Chooses the smallest root, up to 4, that makes the exponents integers.
void series_law_make(SeriesLaw *law, const ContactTerms *terms);

// Coefficients from order 0 up, and reversed for products: order k at SERIES_ROW - 1 - k. Zeros
// follow both.
typedef struct SeriesFactor {
    double up[SERIES_ROW + 4], down[SERIES_ROW + 4];
    double now; // coefficient of the order in progress
} SeriesFactor;

// One damper in contact.
typedef struct SeriesContact {
    size_t damper;
    double sign; // +1 at the right stop, -1 at the left
    ContactTerms terms;
    const SeriesLaw *law;
    bool has_force;                       // else N is negligible and left out
    bool is_damped;                       // p' is above terms.turn
    double inverse_force;                 // 1 / scale of N [1/N]
    SeriesFactor speed, elastic, viscous; // p', and the powers of p in N
    double force[SERIES_ROW];             // N
} SeriesContact;

// The series of one integration step in s = tau / length, 0 <= s <= 1. The transformed time tau has
// dt = root Y^(root - 1) dtau, where Y = p^(1/root) belongs to the leading contact, so that Y' =
// p'. A row of `stride` values holds w of the dampers, t, q, p, then a_g and its quadrature if the
// base is a sine, then r of the dampers if there are several.
typedef struct PowerSeries {
    size_t modes, dampers;
    size_t stride;
    size_t at_t, at_q, at_p, at_a, at_r; // columns
    bool is_sine;
    double length; // of the step in tau
    size_t degree;
    double *z, *rate;       // coefficients of the state and of its derivative in t, row by order
    double *elastic;        // D p + W^2 q of one order
    SeriesContact *contact; // the leading contact first
    size_t contact_count;
    int root;                                                // of the leading contact; 1: tau is t
    SeriesFactor powers[SERIES_POWERS];                      // of Y
    double node_power[ARC_RULES][SERIES_ROW * SERIES_NODES]; // powers of the nodes of arc_rules
    double *block;
} PowerSeries;

// Allocates the series for the modes and dampers of `state`. Freed by power_series_clear, also
// after a failure.
Status power_series_make(PowerSeries *series, const ModalState *state, Problem *problem);
void power_series_clear(PowerSeries *series);

// Truncation error allowed, and the inverse scales of the quantities that it is relative to.
typedef struct SeriesScale {
    double error;
    double inverse_root, inverse_time; // of the leading contact's Y, and of t
    const double *inverse_speed;       // of w, one per damper
    const double *inverse_modal;       // of p, one per mode
    size_t order_max;
} SeriesScale;

// Expands the motion from the present state, with the leading contact at Y, over `length` in tau.
// The order is the smallest that keeps the truncation error, at most scale->order_max. Returns the
// s up to which the error is kept.
double power_series_expand(PowerSeries *series, const ModalState *state, const Slice *slice,
                           double Y, double length, const SeriesScale *scale);

// Reduces the step to 0 to s, and scales the series so that s = 1 is its end again.
void power_series_cut(PowerSeries *series, double s);

// Coefficients of Y of the leading contact.
static inline const double *power_series_leader(const PowerSeries *series) {
    return series->powers[1].up;
}

// Copies the coefficients of one column, degree + 1 values.
void power_series_column(const PowerSeries *series, size_t column, double *out);
// Evaluates the whole row at s.
void power_series_at(const PowerSeries *series, double s, double *row);
// Evaluates the polynomial c, whose coefficients are `stride` values apart, at the nodes of
// arc_rules[rule]; writes SERIES_NODES values.
void power_series_nodes(const PowerSeries *series, size_t rule, const double *c, size_t stride,
                        size_t degree, double *out);

#endif
