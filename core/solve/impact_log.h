// Log of impacts, energies and peaks during a run.
#ifndef CORE_SOLVE_IMPACT_LOG_H
#define CORE_SOLVE_IMPACT_LOG_H

#include <math.h>

#include "core/result/response.h"
#include "core/scene/scene.h"

// The state at one instant.
typedef struct Instant {
    double x, v, acceleration; // of the structure; acceleration is absolute
    double damper_x, damper_v; // relative to the base
    double penetration, force;
    double drift; // largest |storey drift|
    double shear; // of the base
} Instant;

typedef struct EnergyState {
    double kinetic, strain; // [J]
} EnergyState;

// The present contact or rest of a damper.
typedef struct ImpactRow {
    bool is_open;
    Impact impact;
} ImpactRow;

// gain_max of an exact solver, whose energy grows by rounding only, relatively about 1e-14.
#define IMPACT_LOG_GAIN_EXACT 1e-6

typedef struct ImpactLog {
    Response *response;
    size_t room, most;
    Status status;
    uint64_t bounces;              // impacts without duration
    double impulse[SCENE_DAMPERS]; // largest of each damper's impacts [N s]
    Energy energy;
    double largest_energy, largest_balance;
    double largest_gain; // energy without a source [J]
    double gain_max;     // limit of largest_gain over largest_energy; 0: none
} ImpactLog;

// One instruction, while fmax is a call into the C library. NaN is caught elsewhere.
static inline double impact_log_larger(double a, double b) {
    return a > b ? a : b;
}

void impact_log_start(ImpactLog *log, Response *response, size_t most, const EnergyState *energy);

// A contact or rest of a damper (from 0) begins; approach NAN for a rest.
void impact_log_open(ImpactRow *row, ImpactKind kind, double time, size_t damper, Side side,
                     double approach);
// Adds a part of it: its length [s], the integral of N [N s] and the energy lost [J].
static inline void impact_log_stretch(ImpactLog *log, ImpactRow *row, double length, double impulse,
                                      double lost) {
    row->impact.duration += length;
    row->impact.impulse += impulse;
    row->impact.energy_lost += lost;
    log->energy.contact += lost;
}

// A candidate for the peak [N].
static inline void impact_log_force(ImpactLog *log, ImpactRow *row, double magnitude) {
    Peaks *peaks = &log->response->peaks;
    row->impact.peak_force = impact_log_larger(row->impact.peak_force, magnitude);
    peaks->contact_force = impact_log_larger(peaks->contact_force, magnitude);
}

// The smallest force that may be a new peak, of the row or of the statistics, which may have begun
// after it [N].
static inline double impact_log_least_force(const ImpactLog *log, const ImpactRow *row) {
    const double own = row->impact.peak_force, all = log->response->peaks.contact_force;
    return own < all ? own : all;
}

void impact_log_close(ImpactLog *log, ImpactRow *row, double time, double separation);
// An instantaneous impact of two bodies with effective mass `mass`.
void impact_log_bounce(ImpactLog *log, double time, size_t damper, Side side, double approach,
                       double separation, double mass);

static inline void impact_log_work(ImpactLog *log, double input, double structural_damping) {
    log->energy.input += input;
    log->energy.structural_damping += structural_damping;
    log->largest_energy = impact_log_larger(log->largest_energy, fabs(log->energy.input));
}

// Energy at an instant without a balance [J].
static inline void impact_log_held(ImpactLog *log, double energy) {
    log->largest_energy = impact_log_larger(log->largest_energy, energy);
}

void impact_log_balance(ImpactLog *log, const EnergyState *energy);

static inline void impact_log_peaks(ImpactLog *log, const Instant *at) {
    Peaks *peaks = &log->response->peaks;
    peaks->displacement = impact_log_larger(peaks->displacement, fabs(at->x));
    peaks->velocity = impact_log_larger(peaks->velocity, fabs(at->v));
    peaks->acceleration = impact_log_larger(peaks->acceleration, fabs(at->acceleration));
    peaks->damper_displacement = impact_log_larger(peaks->damper_displacement, fabs(at->damper_x));
    peaks->storey_drift = impact_log_larger(peaks->storey_drift, at->drift);
    peaks->base_shear = impact_log_larger(peaks->base_shear, fabs(at->shear));
}

// Statistics begin here: restarts the peaks. `force` is the largest one now [N].
void impact_log_restart_peaks(ImpactLog *log, double force);

static inline void impact_log_acceleration(ImpactLog *log, double acceleration) {
    Peaks *peaks = &log->response->peaks;
    peaks->acceleration = impact_log_larger(peaks->acceleration, fabs(acceleration));
}

// STATUS_LIMIT or STATUS_NO_MEMORY once an impact could not be listed, STATUS_UNSTABLE once the
// energy gain exceeds gain_max.
Status impact_log_status(const ImpactLog *log, Problem *problem);
// The run ends: lists a contact or rest that is still open.
void impact_log_end(ImpactLog *log, ImpactRow *row);
// Then sorts the list (by start, then damper, then left before right) and writes energies and
// counts.
Status impact_log_finish(ImpactLog *log, size_t dampers, const EnergyState *energy,
                         WorkCounters *work, Problem *problem);

#endif
