// The output of a solver: sampled columns, list of impacts, peaks and energies. Statistics and
// spectra are computed from it.
#ifndef CORE_RESULT_RESPONSE_H
#define CORE_RESULT_RESPONSE_H

#include <stdbool.h>
#include <stdint.h>

#include "core/base/columns.h"
#include "core/base/field.h"
#include "core/result/channel.h"

// The two stops of a damper, at u = offset -+ clearance / 2.
typedef enum Side { SIDE_LEFT, SIDE_RIGHT } Side;
extern const char *const side_names[]; // NULL-terminated

typedef enum ImpactKind { IMPACT_IMPACT, IMPACT_RESTING } ImpactKind;

// One impact or interval of persistent contact. Magnitudes; NAN if unknown: the end of an open
// contact, the peak of an instantaneous impact.
typedef struct Impact {
    int kind;                // ImpactKind
    double start, end;       // [s]
    uint64_t damper;         // from 1
    int side;                // Side
    double approach_speed;   // [m/s]
    double separation_speed; // [m/s]
    double restitution;      // separation over approach speed [-]
    double duration;         // [s]
    double peak_force;       // largest |N| of the contact [N]
    double impulse;          // |integral of N| [N s]
    double energy_lost;      // work of the dissipative part [J]
    bool is_resumed;         // continues the contact before: N rose again inside the buffer
} Impact;

typedef struct Impacts {
    Impact *at;
    size_t count;
} Impacts;

// Approach speeds at one stop, compared with the range in which its buffer was measured. Persistent
// and resumed contacts are not counted.
typedef struct ApproachSpeeds {
    bool is_ranged;
    double from, to;              // the measured range; NAN: no limit [m/s]
    uint64_t count, below, above; // impacts, and impacts outside the range
    double min, max;              // approach speeds of the impacts [m/s]
} ApproachSpeeds;

// Energies relative to the base [J]; `residual` is the largest |balance| over the largest energy.
typedef struct Energy {
    double initial;            // kinetic and strain at t = 0, free masses included
    double input;              // work of the base motion
    double structural_damping; // lost in C
    double contact;            // lost in contacts
    double kinetic;            // at the end, structure and free masses
    double strain;             // at the end, springs of the structure and contacts
    double residual;           // [-]
} Energy;

// Largest absolute values over samples and event instants, for any selection of channels; the
// largest of all storeys or dampers.
typedef struct Peaks {
    double displacement, velocity, acceleration, damper_displacement, contact_force;
    double storey_drift; // of frames of several storeys
    double base_shear;
} Peaks;

typedef struct Response {
    double sample_rate;    // [Hz]
    size_t count;          // samples, i = 0 ... count - 1 at t = i / sample_rate
    Columns series;        // the requested channels in the requested order; rows == count or 0
    Impacts impacts;       // empty if is_unlisted
    bool is_unlisted;      // set by the caller: impacts are counted, not listed
    uint64_t impact_count; // of kind IMPACT_IMPACT
    uint64_t resting_count;
    ApproachSpeeds *approaches; // allocated by the caller, or NULL; damper d: [2 d + side]
    Energy energy;
    Peaks peaks;
    double peak_before_window; // largest displacement before statistics_from [m]
    // Over samples from statistics_from on; the largest of all storeys.
    double sum_squares_displacement, sum_squares_acceleration;
    size_t statistics_count;
    bool has_trust;          // whether the solver estimated the next four members
    bool is_stepped;         // the error is that of its steps, not of rounding
    double truncation_error; // of displacement by omitted modes; part of error_estimate
    double error_estimate;   // largest error of displacement over the largest displacement, <= 1
    double trust_horizon;    // where the error exceeds RESPONSE_DIVERGENCE [s]; NAN: nowhere
} Response;

#define RESPONSE_DIVERGENCE 1e-6

// Counters of the work done in a run; equal on every machine. The engines update them once per
// block, not per sample. Work that was not needed counts 0.
typedef struct WorkCounters {
    uint64_t base_samples;      // samples of base motion generated
    uint64_t flight_samples;    // samples of flight in whole intervals, base moving
    uint64_t unforced_samples;  // samples of flight in closed form, base at rest
    uint64_t mode_samples;      // modes times samples
    uint64_t arcs;              // Taylor series steps
    uint64_t steps;             // steps of a time-stepping solver and of power-law contacts
    uint64_t stop_searches;     // searches for a stop within a block of flight
    uint64_t contacts;          // contacts of finite duration
    uint64_t bounces;           // instantaneous impacts
    uint64_t rests;             // intervals of a mass at rest on its stop
    uint64_t neighbour_samples; // samples of the companion run that estimates the error
    uint64_t ledger_rows;       // impacts listed
    uint64_t channel_values;    // values written to channels
    uint64_t spectrum_segments; // segments transformed
} WorkCounters;

extern const Field work_counters_fields[];

// Adds the counters of `other` to `work`.
void work_counters_add(WorkCounters *work, const WorkCounters *other);

// Measures of the accuracy of a result, with their units (" dB" or "").
typedef enum Metric {
    METRIC_DISPLACEMENT,
    METRIC_MEAN_ACCELERATION,
    METRIC_PEAK_FORCE,
    METRIC_IMPACTS,
    METRIC_PSD,
    METRIC_RMS_DISPLACEMENT,
    METRIC_PEAK_STOREY_DRIFT,
    METRIC_PEAK_BASE_SHEAR,
    METRIC_COUNT
} Metric;

extern const char *const metric_names[]; // NULL-terminated
extern const char *const metric_units[];

extern const char *const impact_kind_names[];
extern const Field impact_fields[];
extern const Field energy_fields[];

void response_clear(Response *response);

#endif
