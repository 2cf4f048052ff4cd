// What the exact solver knows while it runs, and how it looks from outside: origin, room, forces,
// energies. Not the stepping (exact.c) nor the events (exact_events.c); these three alone use it.
#ifndef CORE_SOLVE_EXACT_STATE_H
#define CORE_SOLVE_EXACT_STATE_H

#include "core/solve/arc.h"
#include "core/solve/cursor.h"
#include "core/solve/flight.h"
#include "core/solve/hold.h"
#include "core/solve/lanes.h"
#include "core/solve/ledger.h"
#include "core/solve/pulse.h"
#include "core/solve/record.h"
#include "core/solve/solver.h"
#include "core/solve/trust.h"

typedef enum Phase { FLIGHT, CONTACT, RESTING } Phase;
typedef enum Origin { ORIGIN_LEFT = SIDE_LEFT, ORIGIN_RIGHT = SIDE_RIGHT, ORIGIN_MIDDLE } Origin;

// All that the tables are made from.
typedef struct ExactKey {
    double omega2, damping, share;
    double contact_omega2[2], contact_damping[2]; // by Side
    double interval, base_omega;
} ExactKey;

typedef struct Exact {
    Run *run;
    const Plan *plan;
    const PlanDamper *damper; // all zero where there is none
    Problem *problem;
    Motion flying, touching[2], resting;
    Stretch stretch;
    bool has_hops;    // intervals are short enough for hop.h
    size_t pending;   // samples whose sums wait in `stretch`
    double free_work; // integral of a_g times the free mass's relative velocity over them [m^2/s^2]
    Phase phase;
    Side side;       // of CONTACT and RESTING
    Origin origin;   // what state.r is counted from
    bool is_leaving; // released from rest a moment ago: gap, its speed and its acceleration are
                     // exactly 0
    State state;
    size_t sample; // the last one passed
    double offset; // time since then [s]
    double interval;
    BaseCursor base;
    Ledger ledger;
    LedgerRow row; // of the present contact or rest
    Recorder recorder;
    size_t contact_arcs; // since it began
    size_t arcs;         // since the watch was asked
    size_t events;       // all so far
    size_t still_events; // in a row, without time passing
    // From here on what the next run of the same system finds ready; a run begins with all above
    // empty. Each is made when it is first needed.
    ExactKey key;
    bool has_lanes, has_flight, has_pulse[2];
    Flight flight;
    Lanes lanes;
    Pulse pulses[2]; // by Side
    Hold *holds[2];  // by Side; made when a contact first lasts long
    Trust trust;     // its tables
} Exact;

// Forgets all tables. The Exact itself stays.
void exact_forget(Exact *exact);

// +1 for the right stop, -1 for the left.
static inline double exact_sign(Side side) {
    return side == SIDE_RIGHT ? 1 : -1;
}

double exact_time(const Exact *exact); // [s]
double exact_room(const Exact *exact,
                  Side side);              // between free mass and stop at r = 0 of the origin [m]
double exact_relative(const Exact *exact); // u, of the free mass [m]
double exact_push(const Exact *exact);     // s = (C v + K x) / M [m/s^2]
double exact_force(const Exact *exact);    // on the structure, positive to the right [N]
double exact_effective_mass(const Exact *exact); // m_e [kg]
const Motion *exact_motion(const Exact *exact);  // of the present phase
Moment exact_moment(const Exact *exact);
EnergyState exact_energy(const Exact *exact);

#endif
