// The ledgers kept while a run goes on: impacts, energies, peaks.
// Not the samples: those are record.h's. Used by the solvers.
#ifndef CORE_SOLVE_IMPACT_LOG_H
#define CORE_SOLVE_IMPACT_LOG_H

#include <math.h>

#include "core/result/response.h"
#include "core/result/work_counters.h"
#include "core/scene/scene.h"

// What can be seen at one instant.
typedef struct Moment {
    double x, v, acceleration; // of the structure; acceleration is absolute
    double damper_x, damper_v; // relative to the base
    double penetration, force;
} Moment;

typedef struct EnergyState {
    double kinetic, strain; // [J]
} EnergyState;

// A contact or rest that goes on: one per damper.
typedef struct LedgerRow {
    bool is_open;
    Impact impact;
} LedgerRow;

// Gain_most of an exact solver: there energy comes from nothing but rounding, some 1e-14 of it.
#define LEDGER_GAIN_EXACT 1e-6

typedef struct Ledger {
    Response *response;
    size_t room, most;
    Status status;
    uint64_t bounces;              // rows without a length
    double impulse[SCENE_DAMPERS]; // largest of each damper's impacts [N s]
    Energy energy;
    double largest_energy, largest_balance;
    double largest_gain; // energy held that nothing accounts for [J]
    double gain_max;     // of largest_gain over largest_energy; above it the run fails; 0: any
} Ledger;

// fmax is a call into the C library; this is one instruction, and sees every sample. NaN is caught
// elsewhere.
static inline double ledger_larger(double a, double b) {
    return a > b ? a : b;
}

void ledger_start(Ledger *ledger, Response *response, size_t most, const EnergyState *energy);

// A contact or rest of a damper (from 0) begins; approach NAN for a rest.
void ledger_open(LedgerRow *row, ImpactKind kind, double time, size_t damper, Side side,
                 double approach);
// A stretch of it: its length [s], the integral of N [N s] and the work lost [J].
static inline void ledger_stretch(Ledger *ledger, LedgerRow *row, double length, double impulse,
                                  double lost) {
    row->impact.duration += length;
    row->impact.impulse += impulse;
    row->impact.energy_lost += lost;
    ledger->energy.contact += lost;
}

// A candidate for the peak [N].
static inline void ledger_force(Ledger *ledger, LedgerRow *row, double magnitude) {
    Peaks *peaks = &ledger->response->peaks;
    row->impact.peak_force = ledger_larger(row->impact.peak_force, magnitude);
    peaks->contact_force = ledger_larger(peaks->contact_force, magnitude);
}

// What no peak is asked for below: the row's own, or that of the statistics, which may have begun
// after it [N].
static inline double ledger_least_force(const Ledger *ledger, const LedgerRow *row) {
    const double own = row->impact.peak_force, all = ledger->response->peaks.contact_force;
    return own < all ? own : all;
}

void ledger_close(Ledger *ledger, LedgerRow *row, double time, double separation);
// An instantaneous impact of two bodies with effective mass `mass`.
void ledger_bounce(Ledger *ledger, double time, size_t damper, Side side, double approach,
                   double separation, double mass);

static inline void ledger_work(Ledger *ledger, double input, double structural_damping) {
    ledger->energy.input += input;
    ledger->energy.structural_damping += structural_damping;
    ledger->largest_energy = ledger_larger(ledger->largest_energy, fabs(ledger->energy.input));
}

// So much energy was held at some time, be the balance taken there or not [J].
static inline void ledger_held(Ledger *ledger, double energy) {
    ledger->largest_energy = ledger_larger(ledger->largest_energy, energy);
}

void ledger_balance(Ledger *ledger, const EnergyState *energy);

static inline void ledger_peaks(Ledger *ledger, const Moment *at) {
    Peaks *peaks = &ledger->response->peaks;
    peaks->displacement = ledger_larger(peaks->displacement, fabs(at->x));
    peaks->velocity = ledger_larger(peaks->velocity, fabs(at->v));
    peaks->acceleration = ledger_larger(peaks->acceleration, fabs(at->acceleration));
    peaks->damper_displacement = ledger_larger(peaks->damper_displacement, fabs(at->damper_x));
}

// Statistics begin here: what came before is left out of the peaks.
void ledger_forget_peaks(Ledger *ledger, const Moment *at);

static inline void ledger_acceleration(Ledger *ledger, double acceleration) {
    Peaks *peaks = &ledger->response->peaks;
    peaks->acceleration = ledger_larger(peaks->acceleration, fabs(acceleration));
}

// What the ledger has counted, at the end.
void ledger_count(const Ledger *ledger, Work *work);

// STATUS_LIMIT or STATUS_NO_MEMORY once a row could not be kept, STATUS_UNSTABLE once more energy
// came out of nothing than gain_max allows.
Status ledger_status(const Ledger *ledger, Problem *problem);
// Lists the open ones of `rows`, puts all into order (by start, then damper, then left before
// right) and writes the energies into the response.
Status ledger_finish(Ledger *ledger, LedgerRow *rows, size_t count, const EnergyState *energy,
                     Problem *problem);

#endif
