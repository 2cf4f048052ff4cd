// The ledgers kept while a run goes on: impacts, energies, peaks.
// Not the samples: those are record.h's.
#ifndef CORE_SOLVE_IMPACT_LOG_H
#define CORE_SOLVE_IMPACT_LOG_H

#include <math.h>

#include "core/result/response.h"
#include "core/result/work_counters.h"
#include "core/scene/scene.h"

// What can be seen at one instant.
typedef struct Instant {
    double x, v, acceleration; // of the structure; acceleration is absolute
    double damper_x, damper_v; // relative to the base
    double penetration, force;
} Instant;

typedef struct EnergyState {
    double kinetic, strain; // [J]
} EnergyState;

// A contact or rest that goes on: one per damper.
typedef struct ImpactRow {
    bool is_open;
    Impact impact;
} ImpactRow;

// Gain_most of an exact solver: there energy comes from nothing but rounding, some 1e-14 of it.
#define IMPACT_LOG_GAIN_EXACT 1e-6

typedef struct ImpactLog {
    Response *response;
    size_t room, most;
    Status status;
    uint64_t bounces;              // rows without a length
    double impulse[SCENE_DAMPERS]; // largest of each damper's impacts [N s]
    Energy energy;
    double largest_energy, largest_balance;
    double largest_gain; // energy held that nothing accounts for [J]
    double gain_max;     // of largest_gain over largest_energy; above it the run fails; 0: any
} ImpactLog;

// fmax is a call into the C library; this is one instruction, and sees every sample. NaN is caught
// elsewhere.
static inline double impact_log_larger(double a, double b) {
    return a > b ? a : b;
}

void impact_log_start(ImpactLog *ledger, Response *response, size_t most,
                      const EnergyState *energy);

// A contact or rest of a damper (from 0) begins; approach NAN for a rest.
void impact_log_open(ImpactRow *row, ImpactKind kind, double time, size_t damper, Side side,
                     double approach);
// A stretch of it: its length [s], the integral of N [N s] and the work lost [J].
static inline void impact_log_stretch(ImpactLog *ledger, ImpactRow *row, double length,
                                      double impulse, double lost) {
    row->impact.duration += length;
    row->impact.impulse += impulse;
    row->impact.energy_lost += lost;
    ledger->energy.contact += lost;
}

// A candidate for the peak [N].
static inline void impact_log_force(ImpactLog *ledger, ImpactRow *row, double magnitude) {
    Peaks *peaks = &ledger->response->peaks;
    row->impact.peak_force = impact_log_larger(row->impact.peak_force, magnitude);
    peaks->contact_force = impact_log_larger(peaks->contact_force, magnitude);
}

// What no peak is asked for below: the row's own, or that of the statistics, which may have begun
// after it [N].
static inline double impact_log_least_force(const ImpactLog *ledger, const ImpactRow *row) {
    const double own = row->impact.peak_force, all = ledger->response->peaks.contact_force;
    return own < all ? own : all;
}

void impact_log_close(ImpactLog *ledger, ImpactRow *row, double time, double separation);
// An instantaneous impact of two bodies with effective mass `mass`.
void impact_log_bounce(ImpactLog *ledger, double time, size_t damper, Side side, double approach,
                       double separation, double mass);

static inline void impact_log_work(ImpactLog *ledger, double input, double structural_damping) {
    ledger->energy.input += input;
    ledger->energy.structural_damping += structural_damping;
    ledger->largest_energy = impact_log_larger(ledger->largest_energy, fabs(ledger->energy.input));
}

// So much energy was held at some time, be the balance taken there or not [J].
static inline void impact_log_held(ImpactLog *ledger, double energy) {
    ledger->largest_energy = impact_log_larger(ledger->largest_energy, energy);
}

void impact_log_balance(ImpactLog *ledger, const EnergyState *energy);

static inline void impact_log_peaks(ImpactLog *ledger, const Instant *at) {
    Peaks *peaks = &ledger->response->peaks;
    peaks->displacement = impact_log_larger(peaks->displacement, fabs(at->x));
    peaks->velocity = impact_log_larger(peaks->velocity, fabs(at->v));
    peaks->acceleration = impact_log_larger(peaks->acceleration, fabs(at->acceleration));
    peaks->damper_displacement = impact_log_larger(peaks->damper_displacement, fabs(at->damper_x));
}

// Statistics begin here: what came before is left out of the peaks.
void impact_log_forget_peaks(ImpactLog *ledger, const Instant *at);

static inline void impact_log_acceleration(ImpactLog *ledger, double acceleration) {
    Peaks *peaks = &ledger->response->peaks;
    peaks->acceleration = impact_log_larger(peaks->acceleration, fabs(acceleration));
}

// What the ledger has counted, at the end.
void impact_log_count(const ImpactLog *ledger, WorkCounters *work);

// STATUS_LIMIT or STATUS_NO_MEMORY once a row could not be kept, STATUS_UNSTABLE once more energy
// came out of nothing than gain_max allows.
Status impact_log_status(const ImpactLog *ledger, Problem *problem);
// Lists the open ones of `rows`, puts all into order (by start, then damper, then left before
// right) and writes the energies into the response.
Status impact_log_finish(ImpactLog *ledger, ImpactRow *rows, size_t count,
                         const EnergyState *energy, Problem *problem);

#endif
