// The event engine, which moves the modal state from sample to sample through all contact events,
// and its parts, a source file each.
#ifndef CORE_SOLVE_ENGINE_H
#define CORE_SOLVE_ENGINE_H

#include "core/solve/modal_state.h"

// --- taylor_step.c: the motion of all modes and dampers over a time in which no
// contact state changes and the base is linear or a sine, as polynomials that are exact to
// rounding. Whole intervals of flight: flight.c.

// Coefficients in s = t / length, 0 <= s <= 1.
typedef struct TaylorStep {
    double length;                          // [s]
    double rho;                             // length * rate, the base's included, at most 2
    double last_rho;                        // of the last step as it was made: that of `degree`
    size_t degree;                          // of q and r; forces have one less
    double base[POLYNOMIAL_DEGREE_MAX + 1]; // a_g
    size_t base_degree;                     // no coefficient of a_g beyond it
    double *q;                              // order after order, `padded` values each
    double *r, *force; // damper after damper, POLYNOMIAL_DEGREE_MAX + 1 each; force is N
    double *work;      // modes x nodes of a quadrature
    double *push;      // scratch, one per damper
    double *slopes;    // of s^k at the nodes of all rules
    double *block;
} TaylorStep;

// Allocates the steps of one run. Freed by taylor_step_clear, also after a failure.
Status taylor_step_allocate(TaylorStep *arc, const ModalState *state, Problem *problem);
void taylor_step_clear(TaylorStep *arc);

// From the present state; length * modal_state_rate() and length * slice->omega must be at most 2.
void taylor_step_make(TaylorStep *arc, const ModalState *state, const Slice *slice, double length);

// Reduces the step to 0 to s, and scales the series so that s = 1 is its end again.
void taylor_step_cut(TaylorStep *arc, const ModalState *state, double s);

// Sets q and p, and r and w of the dampers that do not rest, to the state at s (0 to 1).
void taylor_step_state(const TaylorStep *arc, ModalState *state, double s);

// Integrals over a step.
typedef struct StepWork {
    double input;   // work of the base [J]
    double damping; // lost in the structure [J]
    double ground;  // integral of a_g [m/s]
} StepWork;
StepWork taylor_step_work(const TaylorStep *arc, const ModalState *state);

// Of one damper: the integral of N [N s] and the energy lost in its contact [J].
void taylor_step_contact(const TaylorStep *arc, const ModalState *state, size_t damper,
                         double *impulse, double *lost);

static inline const double *taylor_step_r(const TaylorStep *arc, size_t damper) {
    return arc->r + damper * (POLYNOMIAL_DEGREE_MAX + 1);
}
static inline const double *taylor_step_force(const TaylorStep *arc, size_t damper) {
    return arc->force + damper * (POLYNOMIAL_DEGREE_MAX + 1);
}

// --- contact_events.c: how they change the state of the masses, and the location of the first one
// on a Taylor step.

typedef struct ContactEvent {
    size_t damper;
    double s;
    Side side;       // of the stop
    bool is_inwards; // of PHASE_INSIDE: back into contact
    bool is_jump;    // of PHASE_RESTING: the force is already below 0
    // Under a power law what ends a step without an event: N is no more negligible, or the law's
    // kink is passed, upwards 1 or downwards -1.
    bool is_onset;
    int kink;
} ContactEvent;

// Finds the first event on the step; of simultaneous ones that of the first damper.
bool contact_event_find(const ModalState *state, const TaylorStep *arc, ContactEvent *event);

// Locates the first place where sign series + room falls to 0. It is not negative at the start,
// where its first `zeros` terms are exactly 0. Replaces *first by the candidate if its s is smaller
// (INFINITY: none yet).
void contact_event_locate(const double *series, size_t degree, double sign, double room, int zeros,
                          ContactEvent candidate, ContactEvent *first);

// Likewise for a damper in flight that touches a stop; r is its relative displacement.
void contact_event_find_touch(const ModalState *state, size_t damper, const double *r,
                              size_t degree, ContactEvent *first);

// After a step: keeps a mass released from rest on its stop until the gap has opened beyond
// rounding. If the step ends by closing it, the speed remains.
void contact_event_leave(DamperState *damper, bool is_hit);

// Changes the state, which is that of the event's instant, and logs it. STATUS_UNSTABLE after too
// many events at one instant, or the status of the impact log.
Status contact_event_apply(ModalState *state, const ContactEvent *event);

// --- collision.c: impulses between masses and their stops, and what they do to all speeds.
// contact_events.c decides when they happen and what follows.

// Finds the impulses of all dampers with in_collision, each at its `side`, from their
// approach_speed and separation_speed, and changes all speeds, p and w.
void collision_resolve(ModalState *state);

// The same where it is known which dampers press (is_pressing), whatever the signs of their speeds:
// small changes of a collision.
void collision_transmit(ModalState *state);

// Changes all speeds by one impulse per damper [N s].
void collision_push(ModalState *state, const double *impulses);

// --- transition.c: the transition matrix of all modes, and of dampers whose contacts last, over
// one step; and the work along the step as quadratic forms.

// Over y = (q, r, p, w, value, slope). r and w are those of the damper in contact, and are missing
// in flight. value and slope are the base's at the start, as in a Slice.
typedef struct Transition {
    size_t size;      // of y
    size_t rows;      // of the matrices, filled up with zeros: each component of y has a column
    double *gain;     // increment of (q, r, p, w)
    double *loss;     // symmetric: y' loss y is lost in the structure
    double *contact;  // likewise: in the contact
    double *input[2]; // -(value input[0] + slope input[1]) . y is the base's work on the structure,
                      // and on the damper in contact
    double *block;    // NULL where there is none
} Transition;

// Of the sample interval and `levels` - 1 times its half, except those too short for the series
// (block is NULL then). `contact`: the damper, in contact now, or NULL. Freed by transition_clear,
// also after a failure.
Status transition_make(Transition *transitions, size_t levels, const ModalState *state,
                       const DamperState *contact, Problem *problem);
// Likewise of the sample interval and one mode in flight, which damping does not couple to others.
Status transition_make_mode(Transition *transition, const ModalState *state, size_t mode,
                            Problem *problem);
void transition_clear(Transition *transition);

// The increment of y over `length` [s] with r and w of all dampers and a base that is linear in
// time: `increment` has (2 (modes + dampers) + 2)^2 values, row after row.
Status transition_increment(const ModalState *state, double length, double *increment,
                            Problem *problem);

// --- flight.c: flight of all masses over whole sample intervals, one step each, with tables made
// once per run. Exact for a still base, one that is linear over the interval, and a sine. A bound
// on the curvature of each gap proves that no stop is reached. Contacts and parts of intervals:
// taylor_step.c.

enum { FLIGHT_BUFFER_MAX = 16, FLIGHT_BUFFER_ROWS = FLIGHT_BUFFER_MAX + 1 };

// The last samples of the motion, before they are recorded: those of whole intervals of flight, or
// one. Row 0 is the state before, row k that k samples later; each row of `padded` values has all
// modes.
typedef struct FlightBuffer {
    double *q, *p;
    double *moved, *sped;   // increments of q and p since row 0
    double *elastic;        // D p + W^2 q
    double *r;              // of the dampers, FLIGHT_BUFFER_ROWS each, from the present origins
    double *z;              // likewise, their velocities relative to the base
    double *a, *b, *ground; // of each interval: value and slope of a_g, and its integral
} FlightBuffer;

typedef struct Flight {
    double length;         // of the interval [s]; 0: there are no such steps
    Transition transition; // in place of gains, loss and input where damping couples the modes
    FlightGains gains;
    // Work, mode after mode: loss over FLIGHT_SUMS, input over the last four of these.
    double *loss[FLIGHT_SUMS], *input[4];
    double loss_base[3], input_base[3]; // over (value^2, value slope, slope^2), all modes
    double ground[2], fall[2];          // integral of a_g over (value, slope), and its integral
    double *sums;                       // scratch, as are the next
    double *start, *gained;             // FLIGHT_ROWS times (q, p, value, slope), and their gains
    double *block;
} Flight;

// Freed by flight_clear, also after a failure.
Status flight_make(Flight *flight, const ModalState *state, Problem *problem);
void flight_clear(Flight *flight);

// Moves the state over the first of `count` intervals, at most FLIGHT_BUFFER_MAX, in which no stop
// can be reached, and returns their number. Their samples are in the buffer, their integrals in
// *work if that is not NULL. 0: nothing has changed.
size_t flight_run(Flight *flight, FlightBuffer *buffer, ModalState *state, const Slice *slices,
                  size_t count, StepWork *work);

// Whether r stays between the stops from one value to the other if |r''| is at most `bend` [m/s^2].
bool flight_is_clear(const DamperState *damper, double from, double to, double bend, double length);
// Over (value, slope): the integral of a_g over `length`, and its integral; `omega` is the base's
// (0: linear).
void flight_ground(double omega, double length, double ground[2], double fall[2]);
// An upper bound of |a_g| over `length` [m/s^2].
double flight_max_ground(const Slice *slice, double length);

// --- sustained_contact.c: long steps of one damper's contact with a linear buffer, a sample
// interval or some halves of it, where the contact is so stiff that it takes many Taylor steps;
// with a proof that it lasts.

enum { SUSTAINED_LEVELS = 16 };

// The tables of one stop, made once contacts with it have lasted long enough.
typedef struct SustainedStop {
    double spent;     // cost of Taylor steps so far
    bool is_given_up; // no memory
    Transition levels[SUSTAINED_LEVELS];
    double *damped, *bent;               // D shape, W^2 shape
    double wide, most_damped, most_bent; // |shape|, |D shape|, |W^2 shape|
    double coupling, bending;            // shape . D shape, shape . W^2 shape
} SustainedStop;

typedef struct SustainedContact {
    SustainedStop *stops; // damper after damper, by Side
    size_t count;
    double length[SUSTAINED_LEVELS];                               // the interval, its half, ...
    double ground[SUSTAINED_LEVELS][2], fall[SUSTAINED_LEVELS][2]; // as those of Flight
    double *start, *gained, *pulled, *elastic;                     // scratch
    double *block;
    bool lacks_memory; // for the tables of a stop
} SustainedContact;

// Freed by sustained_contact_clear, also after a failure.
Status sustained_contact_make(SustainedContact *sustained, const ModalState *state,
                              Problem *problem);
void sustained_contact_clear(SustainedContact *sustained);

// Moves the state by at most `length` if surely no contact begins or ends meanwhile, and returns
// the length of the step [s]. Its integrals are in *work if that is not NULL, and in the damper's
// row. 0: nothing has changed.
double sustained_contact_step(SustainedContact *sustained, ModalState *state, const Slice *slice,
                              double length, StepWork *work);

// --- power_contact.c: contact under power laws: while any buffer is compressed, all modes and
// masses advance together by Taylor series of variable step and order in a transformed time, in
// which the motion is analytic at the start and at the end of a contact, with the events located on
// the series. Flight has steps of its own.

enum { SERIES_ROW = 28, SERIES_POWERS = 20 };

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
    double node_force[8];                  // at the nodes of a Quadrature
} SeriesContact;

// The series of one integration step in s = tau / length, 0 <= s <= 1. The transformed time tau has
// dt = root Y^(root - 1) dtau, where Y = p^(1/root) belongs to the leading contact, so that Y' =
// p'. A row of `stride` values holds w of the dampers, t, q, p, then a_g and its quadrature if the
// base is a sine, then r of the dampers if there are several.
typedef struct PowerContact {
    ModalState *state;
    double tolerance;   // relative error of one contact
    double last_length; // of the last series in its tau, before events cut it
    int last_root;      // its root
    size_t kinks;       // passed in a row in no time
    double *row;        // scratch
    double *block;      // NULL if no contact is under a power law
    // The series of the last integration step:
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
} PowerContact;

// Expands the motion from the present state, with the leading contact at Y, over `length` in tau.
// The order is the smallest that keeps the truncation error, at most order_max. Returns the s up to
// which the error is kept.
double power_series_expand(PowerContact *power, const Slice *slice, double Y, double length);

// Reduces the step to 0 to s, and scales the series so that s = 1 is its end again.
void power_series_cut(PowerContact *power, double s);

// Evaluates the whole row at s.
void power_series_at(const PowerContact *power, double s, double *row);

// Coefficients of Y of the leading contact.
static inline const double *power_series_leader(const PowerContact *power) {
    return power->powers[1].up;
}

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
Status power_contact_make(PowerContact *power, ModalState *state, double tolerance,
                          Problem *problem);
void power_contact_clear(PowerContact *power);

// Whether a buffer under a power law is compressed, so that power_contact_step must be used.
bool power_contact_is_active(const PowerContact *power);

// Advances the state by one integration step, at most `length` long and at most to the first event,
// which is returned but not applied. Updates the impact rows of the dampers in contact. a_g is
// `slice` from the present instant on.
void power_contact_step(PowerContact *power, const Slice *slice, double length,
                        PowerContactStep *step);

// --- recorder.c: the samples of runs by modes in the wanted columns, and peaks and sums over all
// storeys and dampers.

typedef struct Recorder {
    FlightBuffer buffer;     // of the last samples
    size_t statistics_start; // first sample
    double base_speed;       // integral of a_g since the last sample, except in flight [m/s]
    double *last_velocity;   // of each column's storey, at the last sample
    double *shapes;          // of each column's storey
    // Sums of the products q_i q_k and of those of the modal accelerations, for k <= i, and the
    // samples not added yet.
    double *squares[2], *batch[2];
    size_t count;
    double *block;
} Recorder;

// Freed by recorder_clear, also after a failure.
Status recorder_start(Recorder *record, const ModalState *state, Response *response,
                      Problem *problem);
void recorder_clear(Recorder *record);

// Records the present sample with forces and peaks; of a shadow nothing. Resets base_speed.
void recorder_sample(Recorder *record, ModalState *state);
// Records rows 1 to `count` of the buffer, samples of flight of which the last is the present one.
void recorder_flight(Recorder *record, ModalState *state, size_t count);
void recorder_finish(Recorder *record, const ModalState *state, Response *response);
// Ends the impact log of a run.
Status recorder_finish_log(ModalState *state);

// Updates the peaks by the present state, after modal_state_forces; those of accelerations only.
void recorder_peaks(ModalState *state);
void recorder_acceleration(ModalState *state);
// Updates forces, peaks and the energy balance.
void recorder_update(ModalState *state);

// --- linearised_motion.c: beside a run, the course of small changes of its state through steps and
// events; and peaks and squares of the displacement between events.

// All zero follows nothing.
typedef struct LinearisedMotion {
    size_t size;     // of a column: (q, p, r, w), modes and dampers
    size_t count;    // columns in progress, at most `size`
    double *columns; // borrowed, one after the other
    double *late;    // of each column: delay of the last event [s]; `size` of them
    bool is_measured;
    double peak;     // largest displacement of any storey so far [m]
    double *squares; // of each storey, integral of the square of its displacement [m^2 s]

    double *before, *after; // derivatives of the state on the two sides of an event
    ContactPhase *phases;   // of the dampers before it
    double *state, *work;   // the run's own state meanwhile, and scratch
    double base_acceleration;
    TaylorStep arc;
    double *block;
} LinearisedMotion;

// Freed by linearised_motion_clear, also after a failure.
Status linearised_motion_make(LinearisedMotion *motion, const ModalState *state, Problem *problem);
void linearised_motion_clear(LinearisedMotion *motion);

// The run is at the start of a Taylor step that it makes as a whole.
void linearised_motion_step(LinearisedMotion *motion, ModalState *state, const TaylorStep *arc);
// Before and after a step of contact under a power law, which is only measured.
void linearised_motion_begin_step(LinearisedMotion *motion, const ModalState *state);
void linearised_motion_end_step(LinearisedMotion *motion, const ModalState *state, double length);

// Before and after an event is applied.
void linearised_motion_begin_event(LinearisedMotion *motion, ModalState *state,
                                   const ContactEvent *event);
void linearised_motion_end_event(LinearisedMotion *motion, ModalState *state,
                                 const ContactEvent *event);

// --- event_engine.c: from sample to sample.

// All zero is empty.
typedef struct EventEngine {
    ModalState state;
    TaylorStep arc;
    Flight flight;
    SustainedContact sustained;
    PowerContact power;
    Recorder record;
    double work;                   // solver steps since the last check
    size_t idle;                   // steps of contact in a row without time passing
    struct RoundingGrowth *growth; // of a single mass, or NULL
    LinearisedMotion *linearised;  // beside a run by Taylor steps alone, or NULL
    double *track; // of the last FLIGHT_BUFFER_MAX samples, all modes: sample k at (k - 1) %
                   // FLIGHT_BUFFER_MAX; NULL: not wanted
} EventEngine;

// `tolerance` is of contacts under a power law. Cleared by event_engine_clear, also after a
// failure.
Status event_engine_make(EventEngine *engine, Run *run, double tolerance, Response *response,
                         Problem *problem);
void event_engine_clear(EventEngine *engine);

// A second run of the same scene without any record. It owns `state` and `power` and borrows the
// rest.
Status event_engine_shadow(EventEngine *engine, const EventEngine *of, Run *run, double tolerance,
                           Response *response);

// Applies the events at t = 0 of masses that start on a stop; the first sample is the state after.
Status event_engine_settle(EventEngine *engine);

// Moves to the next sample or several, at most to sample `until`, and records them.
Status event_engine_step(EventEngine *engine, size_t until);

// Moves from the present instant to the next sample, and records it.
Status event_engine_finish_interval(EventEngine *engine);

// Moves from the present sample over `length` [s].
Status event_engine_cross(EventEngine *engine, double length);

// As modal_state_check.
Status event_engine_check(EventEngine *engine);

#endif
