// Contact under power laws: while any buffer is compressed, all modes and masses advance together
// by Taylor series of variable step and order in a transformed time, in which the motion is
// analytic at the start and at the end of a contact, with the events located on the series. Flight
// has steps of its own.
#ifndef CORE_SOLVE_POWER_CONTACT_H
#define CORE_SOLVE_POWER_CONTACT_H

#include "core/solve/contact_events.h"

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

// The contact of one damper.
typedef struct SeriesContact {
    size_t damper;
    double sign;                  // +1 at the right stop, -1 at the left
    ContactParameters parameters; // that terms and law are made of
    ContactTerms terms;
    SeriesLaw law;
    double speed;         // scale of p' [m/s]
    double depth;         // scale of p [m]
    double acceleration;  // p'' without N [m/s^2]
    double onset;         // N is negligible below this p [m]
    int kink_passed;      // at the end of the last step: 1 upwards, -1 downwards, 0 none
    double strain;        // energy in the buffer at the start of the step [J]
    double impulse, work; // of N over the step [N s], [J]
    // Of the step's series:
    bool has_force;                        // else N is negligible and left out
    bool is_damped;                        // p' is above terms.turn
    double inverse_speed, inverse_force;   // 1 / scale of p' [s/m], of N [1/N]
    SeriesFactor speeds, elastic, viscous; // p', and the powers of p in N
    double force[SERIES_ROW];              // N
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
    double error; // relative truncation error allowed
    size_t order_max;
    double inverse_root, inverse_time, *inverse_modal; // 1 / scales of Y, of t and of p
    double length;                                     // of the step in tau
    size_t degree;
    double *z, *rate;        // coefficients of the state and of its derivative in t, row by order
    double *elastic;         // D p + W^2 q of one order
    SeriesContact *all;      // damper after damper
    SeriesContact **contact; // those in contact, the leading one first
    size_t contact_count;
    int root;                           // of the leading contact; 1: tau is t
    SeriesFactor powers[SERIES_POWERS]; // of Y
    double node_power[LINEAR_MOTION_RULES]
                     [SERIES_ROW * SERIES_NODES]; // powers of the nodes of linear_motion_rules
} PowerSeries;

// Expands the motion from the present state, with the leading contact at Y, over `length` in tau.
// The order is the smallest that keeps the truncation error, at most order_max. Returns the s up to
// which the error is kept.
double power_series_expand(PowerSeries *series, const ModalState *state, const Slice *slice,
                           double Y, double length);

// Reduces the step to 0 to s, and scales the series so that s = 1 is its end again.
void power_series_cut(PowerSeries *series, double s);

// Evaluates the whole row at s.
void power_series_at(const PowerSeries *series, double s, double *row);

// Coefficients of Y of the leading contact.
static inline const double *power_series_leader(const PowerSeries *series) {
    return series->powers[1].up;
}

typedef struct PowerContact {
    ModalState *state;
    double tolerance;              // relative error of one contact
    PowerSeries series;            // of the last integration step
    double *row, *elastic, *nodes; // scratch; speeds of all modes or dampers at quadrature nodes
    double last_length;            // of the last series in its tau, before events cut it
    int last_root;                 // its root
    size_t kinks;                  // passed in a row in no time
    double *block;                 // NULL if no contact is under a power law
} PowerContact;

// One integration step.
typedef struct PowerContactStep {
    double length;
    StepWork work;
    bool is_event; // at its end
    ContactEvent event;
    double cost; // in multiplications
} PowerContactStep;

// The smallest tolerance of a contact, at the level of rounding.
#define POWER_CONTACT_TOLERANCE 1e-15

// Allocates for one run, nothing if its contact law is no power law. Freed by power_contact_clear,
// also after a failure.
Status power_contact_make(PowerContact *contact, ModalState *state, double tolerance,
                          Problem *problem);
void power_contact_clear(PowerContact *contact);

// Whether a buffer under a power law is compressed, so that power_contact_step must be used.
bool power_contact_is_active(const PowerContact *contact);

// Advances the state by one integration step, at most `length` long and at most to the first event,
// which is returned but not applied. Updates the impact rows of the dampers in contact. a_g is
// `slice` from the present instant on.
void power_contact_step(PowerContact *contact, const Slice *slice, double length,
                        PowerContactStep *step);

#endif
