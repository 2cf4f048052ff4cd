// The modal state of a run: structure, dampers and contacts at one instant, with gaps, forces and
// energies.
#ifndef CORE_SOLVE_MODAL_STATE_H
#define CORE_SOLVE_MODAL_STATE_H

#include "core/plan/modes.h"
#include "core/solve/base_motion_cursor.h"
#include "core/solve/impact_log.h"
#include "core/solve/simd_kernels.h"
#include "core/solve/solver.h"

// PHASE_INSIDE: the contact has ended by its force, but the mass is still inside the buffer.
typedef enum ContactPhase { PHASE_FLIGHT, PHASE_CONTACT, PHASE_INSIDE, PHASE_RESTING } ContactPhase;
typedef enum ContactOrigin {
    FROM_LEFT = SIDE_LEFT,
    FROM_RIGHT = SIDE_RIGHT,
    FROM_MIDDLE
} ContactOrigin;

typedef struct DamperState {
    const PlanDamper *plan;
    const double *shape;   // of its storey, mode after mode
    double base_coupling;  // coefficient of a_g in r''
    double effective_mass; // m_e, 1 / (1/m + (M^-1)_jj), with the modes kept [kg]
    double max_mobility; // acceleration of any storey by a force on this one is at most this [1/kg]
    double elastic_bound; // |[M^-1 (C v + K x)]_j| is at most this times sqrt(p'p + q'W^2 q) [1/s]

    ContactPhase phase;
    Side side;            // of all phases but flight
    ContactOrigin origin; // origin of r
    int zero_gap_terms;   // number of leading terms of the gap that are exactly 0, just after a
                          // release from rest
    bool just_begun;      // the present phase has no duration yet; of a bounce at the end of a step
                          // (step_contact.c): it ends in rest
    double r, w;          // displacement and speed relative to the storey [m], [m/s]
    double force;         // N on the structure as of the last modal_state_forces [N]
    ContactParameters contact; // frozen at the touch
    ImpactRow row;             // of the present contact or rest

    // Of a long step in flight (sustained_contact.c): speed of the storey before it, increment of
    // r.
    double storey_speed, gained;
    // Of a collision: speed towards the stop and required speed away from it [m/s], and the impulse
    // [N s].
    bool in_collision, is_bounced; // is_bounced: takes part, not from rest
    double approach_speed, separation_speed, impulse;
    bool is_pressing; // scratch of collision_resolve
} DamperState;

// In modal coordinates, x = shapes q:
//   q'' = -(D q' + W^2 q) - participation a_g + sum of shape_d N_d
//   r_d'' = base_coupling_d a_g + shape_d . (D q' + W^2 q) - sum over e of delassus_de N_e
// with base_coupling_d = shape_d . participation - 1, which is influence_j - 1 where all modes are
// kept. Modes that are left out move with the base: a storey's absolute acceleration is
//   residual_influence_j a_g - shape_j . (D q' + W^2 q) + ...,   residual_influence_j = influence_j
//   - shape_j . participation,
// and `elastic` has one more slot with a_g, whose shape is -residual_influence. The force of the
// structure on the base is
//   r' (C x' + K x) = participation . (D q' + W^2 q) - residual_mass a_g,   residual_mass = r' M
//   residual_influence,
// which of a frame is k_1 x_1 + c_1 x_1'.
typedef struct ModalState {
    Run *run;
    const Plan *plan;
    const Modes *modes;
    Modes own_modes; // if the plan has none
    Problem *problem;

    bool has_stops; // a mass may reach a stop
    bool is_shadow; // without record: no peaks, no energies

    size_t storey_count, mode_count;
    size_t slot_count;        // mode_count, and a_g's slot where modes are left out
    size_t padded;            // values of each array over modes here, zeros behind the slots
    size_t tall;              // likewise of an array over storeys
    const SimdKernels *lanes; // for this processor
    double *omega2;           // [1/s^2]
    const double *damping;    // D, modes x modes
    double *diagonal;         // of D, where it is diagonal; else NULL
    double *coupled;          // D, where it is not: columns of `padded` values; else NULL
    double *participation;
    double *shapes;             // of the dampers' storeys
    double *shape_matrix;       // of all storeys: a column of `tall` values for each slot
    double *storey_values;      // scratch of modal_state_expand
    double *difference;         // scratch of modal_state_difference
    double *largest;            // of each slot, scratch of the recorder
    double *max_shape;          // of each slot, the largest |shape| of any storey
    double *max_drift;          // likewise |shape| less that of the storey below; 0 without drifts
    double *base_shear;         // of each slot: its share in the force on the base
    double *max_base_shear;     // their sizes
    double *residual_influence; // of the storeys; NULL where all modes are kept [-]
    double *momentum_weights;   // participation + sum of m_d shape_d; -a_g momentum_weights . p is
                                // the power of the base
    double rate;                // bound of the eigenvalues in flight [1/s]
    double base_omega;          // of a sine base over whole sample intervals, else 0 [rad/s]
    double base_rotation[2];    // cosine and sine of its phase in one interval
    double stiff, viscous;      // largest of W^2 and of D
    double participation_norm;  // |participation|
    double growth;              // bound of the growth rate of sqrt(p'p + q'W^2 q) in flight [1/s]

    size_t dampers;
    DamperState *damper;
    double
        *delassus; // dampers x dampers: (M^-1) between their storeys, + 1/m on the diagonal [1/kg]
    double *mobility;        // dampers x storeys: (M^-1) between their storey and all [1/kg]; as
                             // `delassus` of the modes kept
    double *constraint_mass; // dampers x dampers: constraint forces are constraint_mass . (r''
                             // without them) [kg]
    size_t resting;          // number of dampers at rest

    double *q, *p;            // modal displacements and speeds
    double *elastic;          // D p + W^2 q, as of the last modal_state_forces
    double base_acceleration; // a_g now [m/s^2]
    double *scratch;          // of modal_state_constrain and collision_resolve
    double *block;            // all arrays above, but for coupled

    size_t sample; // the last one passed
    double offset; // time since then [s]
    double interval;
    BaseCursor base;
    ImpactLog impacts;
    size_t events;            // all so far
    size_t events_at_instant; // in a row, without time passing
    size_t chatter_events;    // within less time than the clock's resolution
    double chatter_time;      // time since the first of them [s]
    double suppress_time,
        suppressed_at; // duration and start of the last suppression of events [s]
} ModalState;

// +1 for the right stop, -1 for the left.
static inline double modal_state_sign(Side side) {
    return side == SIDE_RIGHT ? 1 : -1;
}

// Columns of a matrix go in pairs.
static inline size_t modal_state_even(size_t count) {
    return count + count % 2;
}

// In a fixed order that suits vectors.
static inline double modal_state_dot(const double *a, const double *b, size_t count) {
    double sum[4] = {0, 0, 0, 0};
    size_t i = 0;
    for (; i + 4 <= count; i += 4)
        for (size_t j = 0; j < 4; j++)
            sum[j] += a[i + j] * b[i + j];
    for (; i < count; i++)
        sum[0] += a[i] * b[i];
    return (sum[0] + sum[1]) + (sum[2] + sum[3]);
}

// Everything but the impact log. Freed by modal_state_clear, also after a failure.
Status modal_state_make(ModalState *state, Run *run, Problem *problem);
void modal_state_clear(ModalState *state);

double modal_state_time(const ModalState *state); // [s]
// The clock's resolution at the present time [s].
double modal_state_clock(const ModalState *state);
// Gap between free mass and stop at r = 0 of the present origin [m].
double modal_state_room(const DamperState *damper, Side side);

// out = D p + W^2 q; arrays of `padded` values.
void modal_state_elastic(const ModalState *state, const double *q, const double *p,
                         double *restrict out);
// As run_check, or the status of the impact log.
Status modal_state_check(const ModalState *state, double step);

// Copies the state to y, and y to the state: q and p of all modes, then r and w of all dampers.
void modal_state_gather(const ModalState *state, double *y);
void modal_state_scatter(ModalState *state, const double *y);

// N that keeps a damper at rest on its stop [N].
double modal_state_constraint(const ModalState *state, size_t damper, const double *elastic,
                              double ground);
// Updates `elastic` and the forces of the dampers to the present state.
void modal_state_forces(ModalState *state);
// The largest difference of any storey's displacement between modes q and `other` [m], or `least`
// if that is larger.
double modal_state_difference(const ModalState *state, const double *q, const double *other,
                              double least);
// Values of all storeys, `tall` of each row, from those of all modes in 1 or FLIGHT_ROWS rows, one
// after the other; valid until the next call.
double *modal_state_expand(const ModalState *state, const double *modal, size_t rows);
// r'' of a damper in flight, after modal_state_forces [m/s^2].
double modal_state_acceleration(const ModalState *state, size_t damper);
EnergyState modal_state_energy(const ModalState *state);
// sqrt(p'p + q'W^2 q).
double modal_state_size_of(const ModalState *state, const double *q, const double *p);
static inline double modal_state_size(const ModalState *state) {
    return modal_state_size_of(state, state->q, state->p);
}

// Bound of the eigenvalues of the present motion [1/s].
double modal_state_rate(const ModalState *state);

// Updates `constraint_mass` and `resting`, after every change of the dampers at rest.
void modal_state_constrain(ModalState *state);

#endif
