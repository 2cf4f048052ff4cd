// The state of a run of single_mass.c.
#ifndef CORE_SOLVE_SINGLE_MASS_STATE_H
#define CORE_SOLVE_SINGLE_MASS_STATE_H

#include <math.h>

#include "core/solve/base_motion_cursor.h"
#include "core/solve/engine.h"
#include "core/solve/lanes.h"
#include "core/solve/motion_table.h"
#include "core/solve/rounding_growth.h"

typedef struct SingleMass SingleMass;
struct SingleMass {
    Run *run;
    const Plan *plan;
    const PlanDamper *damper; // all zero where there is none
    Problem *problem;
    Motion flying, touching[2];
    FlightBlock stretch;
    bool has_stops;     // that the mass may reach
    bool has_blocks;    // of flight
    size_t pending;     // samples whose sums wait in `stretch`
    double free_work;   // integral of a_g times the free mass's velocity over them [m^2/s^2]
    ContactPhase phase; // PHASE_FLIGHT or PHASE_CONTACT
    Side side;
    ContactOrigin origin;
    State state;
    size_t sample; // the last one passed
    double offset; // time since then [s]
    double interval;
    BaseCursor base;
    ImpactLog impacts;
    ImpactRow row;
    double *columns[CHANNEL_COUNT];
    size_t statistics_start, statistics_count;
    double base_speed, last_velocity; // since the last sample, for mean accelerations [m/s]
    double squares[2];                // sums of displacement^2 and acceleration^2
    double base_slope;   // of the base, no larger over the whole run: [m/s^3], of a sine [m/s^2]
    int pieces, events;  // of the present contact, of the present interval
    EventEngine *engine; // made when it is first needed
    bool is_by_engine;   // its state is the present one, and these kernels cannot go on from it
    // Tables, kept for the next run of the same system.
    double table_interval;
    Lanes lanes;
    size_t contact_table[2]; // by Side: which of the tables
    MotionTable tables[3];   // of flight and of contacts
    RoundingGrowth growth;
};

static inline double single_mass_larger(double a, double b) {
    return a > b ? a : b;
}

static inline double single_mass_sign(Side side) {
    return side == SIDE_RIGHT ? 1 : -1;
}

static inline double single_mass_time(const SingleMass *single) {
    return (double)single->sample / single->plan->sample_rate + single->offset;
}

// Between the mass and a stop at r = 0 of the present origin [m].
static inline double single_mass_gap(const SingleMass *single, Side side) {
    if (single->origin == FROM_MIDDLE)
        return single->damper->clearance / 2;
    return single->origin == (ContactOrigin)side ? 0 : single->damper->clearance;
}

// Displacement of the mass relative to the storey at r = 0 [m].
static inline double single_mass_origin(const SingleMass *single) {
    const double stop = single->damper->clearance / 2;
    return single->damper->offset +
           (single->origin == FROM_MIDDLE ? 0 : single_mass_sign((Side)single->origin) * stop);
}

// 1 - share would lose digits where the free mass is the larger.
static inline double single_mass_effective(const SingleMass *single) {
    return single->plan->mass[0] * single->flying.share;
}

// s of Motion, the structure's elastic and damping acceleration [m/s^2].
static inline double single_mass_push(const SingleMass *single, const State *at) {
    return single->flying.damping * at->v + single->flying.omega2 * at->x;
}

// n of Motion, the contact force over the effective mass [m/s^2]; 0 in flight.
static inline double single_mass_contact_term(const SingleMass *single, const State *at) {
    if (single->phase != PHASE_CONTACT)
        return 0;
    const Motion *m = &single->touching[single->side];
    return m->contact_damping * at->w + m->contact_omega2 * at->r;
}

#define SINGLE_MASS_STEPS 5 // solver steps of a piece or of a stretch of contact

EnergyState single_mass_energy(const SingleMass *single);
// What can be seen at the present instant.
Instant single_mass_instant(const SingleMass *single);
void single_mass_put(double *column, size_t sample, double value); // unless the column is NULL
void single_mass_record(SingleMass *single);                       // the present sample
// Adds to the energies: integrals of v^2, a_g v and a_g times the free mass's velocity.
void single_mass_work(SingleMass *single, double vv, double av, double az);
// Enters what waits in `stretch`, and takes the balance of energy.
void single_mass_flush(SingleMass *single);
void single_mass_note(SingleMass *single);       // peaks of the present instant
void single_mass_note_force(SingleMass *single); // of the acceleration, after the force has jumped
// Carries the rounding errors to the end of the present phase.
void single_mass_end_phase(SingleMass *single);
// The next sample is reached: records it.
void single_mass_pass(SingleMass *single);
void single_mass_release(SingleMass *single); // the present contact ends now

#endif
