// What the general engine knows while it runs, and how it looks from outside: rooms, forces,
// energies. Not the stepping (frame.c), the events (frame_events.c) nor what is written down of it
// (frame_record.c). Used by core/solve/frame*.c.
#ifndef CORE_SOLVE_MODAL_STATE_H
#define CORE_SOLVE_MODAL_STATE_H

#include "core/plan/modes.h"
#include "core/solve/base_motion_cursor.h"
#include "core/solve/simd_kernels.h"
#include "core/solve/impact_log.h"
#include "core/solve/solver.h"

// FRAME_INSIDE: out of contact by the force's end, but not yet out of the buffer.
typedef enum FramePhase { FRAME_FLIGHT, FRAME_CONTACT, FRAME_INSIDE, FRAME_RESTING } FramePhase;
typedef enum FrameOrigin {
    FRAME_FROM_LEFT = SIDE_LEFT,
    FRAME_FROM_RIGHT = SIDE_RIGHT,
    FRAME_FROM_MIDDLE
} FrameOrigin;

typedef struct FrameDamper {
    const PlanDamper *plan;
    const double *shape;   // of its storey, mode after mode
    double lean;           // a_g's part in r''
    double effective_mass; // m_e, 1 / (1/m + (M^-1)_jj), of the modes kept [kg]
    double thrust;         // a force N on its storey accelerates none by more than this N [1/kg]
    double reach;          // |[M^-1 (C v + K x)]_j| is at most this times sqrt(p'p + q'W^2 q) [1/s]

    FramePhase phase;
    Side side;          // of all phases but flight
    FrameOrigin origin; // what r is counted from
    int leaving; // terms of the gap, from the constant one on, that are exactly 0: it was released
                 // from rest a moment ago
    bool is_fresh;             // the present phase has lasted for no time yet
    double r, w;               // displacement and speed relative to the storey [m], [m/s]
    double force;              // N on the structure as of the last frame_feel [N]
    ContactParameters contact; // frozen at the touch
    LedgerRow row;             // of the present contact or rest

    // Of a long step beside another's contact (frame_press.c): speed of the storey before it, and
    // what r gains.
    double storey_speed, gained;
    // Of a collision: speed towards the stop, speed away from it that is asked for, and the impulse
    // that presses it [m/s], [m/s], [N s]; the rest is frame_collide's own.
    bool is_met, is_bounced; // is_met: takes part; is_bounced: not from rest
    double closing, parting, pressed;
    bool is_pressing, is_spent;
    double wanted;
    bool is_held; // taken into `hold`
} FrameDamper;

// In modal coordinates, x = shapes q:
//   q'' = -(D q' + W^2 q) - participation a_g + sum of shape_d N_d
//   r_d'' = lean_d a_g + shape_d . (D q' + W^2 q) - sum over e of yield_de N_e
// with lean_d = shape_d . participation - 1, which is r_j - 1 where all modes are kept. Where they
// are not, what the base does to the others is theirs: a storey's absolute acceleration is
//   unmoved_j a_g - shape_j . (D q' + W^2 q) + ...,   unmoved_j = r_j - shape_j . participation,
// and arrays over modes have a_g in one slot more behind `elastic`, which the storeys see with
// -unmoved.
typedef struct Frame {
    Run *run;
    const Plan *plan;
    const Modes *modes;
    Modes own_modes; // where the plan has none
    Problem *problem;

    bool has_stops; // that a mass may reach
    bool is_shadow; // only the motion is wanted: no peaks, no energies

    size_t storey_count, mode_count;
    size_t slot_count;       // mode_count, and a_g's slot where modes are left out
    size_t padded;           // values of each array over modes here, zeros behind the slots
    size_t tall;             // likewise of an array over storeys
    const FrameLanes *lanes; // what this processor has
    double *omega2;          // [1/s^2]
    const double *damping;   // D, modes x modes
    double *diagonal;        // of D, where it is diagonal; else NULL
    double *coupled;         // D, where it is not: columns of `padded` values; else NULL
    double *share;           // participation
    double *shapes;          // of the dampers' storeys
    double *spread;          // of all storeys: columns of `tall` values, one a slot
    double *seen;            // scratch of frame_spread
    double *widest;          // of each slot, the largest |shape| of any storey
    double *unmoved;         // of the storeys; NULL where all modes are kept [-]
    double *carry;         // participation + sum of m_d shape_d: -a_g carry . p is the base's work
    double rate;           // no eigenvalue of flight is larger [1/s]
    double turning;        // of a base that turns over whole sample intervals, else 0 [rad/s]
    double turned[2];      // cosine and sine of what it turns in one of them
    double stiff, viscous; // largest of W^2 and of D
    double drive;          // |participation|
    double growth;         // sqrt(p'p + q'W^2 q) grows by no more than this in flight [1/s]

    size_t dampers;
    FrameDamper *damper;
    double *yield; // dampers x dampers: (M^-1) between their storeys, + 1/m on the diagonal [1/kg]
    double *mobility; // dampers x storeys: (M^-1) between their storey and all [1/kg]; as `yield`
                      // of the modes kept
    double *hold;     // dampers x dampers: constraint forces are hold . (r'' without them) [kg]
    size_t resting;   // how many are

    double *q, *p;   // modal displacements and speeds
    double *elastic; // D p + W^2 q, as of the last frame_feel
    double ground;   // a_g now [m/s^2]
    double *scratch; // of frame_hold_make and frame_collide
    double *block;   // all arrays above, but for coupled

    size_t sample; // the last one passed
    double offset; // time since then [s]
    double interval;
    BaseCursor base;
    Ledger ledger;
    size_t events;            // all so far
    size_t still_events;      // in a row, without time passing
    size_t storm_events;      // without more time passing than the clock tells from none
    double storm_time;        // what has passed nevertheless [s]
    double stall, stalled_at; // how long events were last passed over, and when that was [s]
} Frame;

// +1 for the right stop, -1 for the left.
static inline double frame_sign(Side side) {
    return side == SIDE_RIGHT ? 1 : -1;
}

// Columns of a matrix go in pairs.
static inline size_t frame_even(size_t count) {
    return count + count % 2;
}

// In a fixed order that processors can do two by two.
static inline double frame_dot(const double *a, const double *b, size_t count) {
    double sum[4] = {0, 0, 0, 0};
    size_t i = 0;
    for (; i + 4 <= count; i += 4)
        for (size_t j = 0; j < 4; j++)
            sum[j] += a[i + j] * b[i + j];
    for (; i < count; i++)
        sum[0] += a[i] * b[i];
    return (sum[0] + sum[1]) + (sum[2] + sum[3]);
}

// Everything but the ledger. Freed by frame_clear, also after a failure.
Status frame_make(Frame *frame, Run *run, Problem *problem);
void frame_clear(Frame *frame);

double frame_time(const Frame *frame); // [s]
// The shortest time that can be told from none, at the present one [s].
double frame_clock(const Frame *frame);
// Between free mass and stop at r = 0 of the present origin [m].
double frame_room(const FrameDamper *damper, Side side);
// Displacement of the free mass relative to its storey at r = 0 [m].
double frame_middle(const FrameDamper *damper);

// out = D p + W^2 q; arrays of `padded` values.
void frame_elastic(const Frame *frame, const double *q, const double *p, double *restrict out);
// Brings elastic and the dampers' forces up to the present state.
void frame_feel(Frame *frame);
// Values of all storeys from those of all modes, until the next call.
const double *frame_spread(const Frame *frame, const double *modal);
// Likewise of FRAME_FOUR rows of modes, one after the other; `tall` values of each.
const double *frame_spread_four(const Frame *frame, const double *modal);
// Of one storey, relative to the base [m], [m/s]; absolute, after frame_feel [m/s^2].
double frame_displacement(const Frame *frame, size_t storey);
double frame_velocity(const Frame *frame, size_t storey);
double frame_storey_acceleration(const Frame *frame, size_t storey);
// r'' of a damper in flight, after frame_feel [m/s^2].
double frame_acceleration(const Frame *frame, size_t damper);
EnergyState frame_energy(const Frame *frame);
double frame_size(const Frame *frame); // sqrt(p'p + q'W^2 q)
double frame_size_of(const Frame *frame, const double *q, const double *p);

// No eigenvalue of the present motion is larger [1/s].
double frame_rate(const Frame *frame);

// Makes `hold` anew, the inverse of `yield` between those that rest: after every change of who
// does.
void frame_hold_make(Frame *frame);

#endif
