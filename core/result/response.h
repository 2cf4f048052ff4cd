// What a solver hands back: sampled columns, the ledger of impacts, peaks and energies met on the
// way. Statistics and spectra are made of it afterwards (statistics.h, spectrum.h). Filled by
// solve/, read by everyone behind it.
#ifndef CORE_RESULT_RESPONSE_H
#define CORE_RESULT_RESPONSE_H

#include <stdbool.h>
#include <stdint.h>

#include "core/base/columns.h"
#include "core/base/field.h"
#include "core/result/channel.h"

typedef enum ImpactKind { IMPACT_IMPACT, IMPACT_RESTING } ImpactKind;

// One event of the ledger. Magnitudes; what is not known (an open contact's end, a peak under
// impulse) is NAN.
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
    bool is_resumed;         // N rose again inside the buffer: the contact before it goes on
} Impact;

typedef struct Impacts {
    Impact *at;
    size_t count;
} Impacts;

// How fast impacts met one stop whose buffer was measured in a range of approach speeds. A rest has
// no approach, and what is resumed keeps the parameters with which it began: neither counts.
typedef struct Approaches {
    bool is_ranged;
    double from, to;              // that range; NAN: no such end [m/s]
    uint64_t count, below, above; // impacts, and those of them outside
    double least, most;           // speeds met [m/s]
} Approaches;

// Energies relative to the base [J]; `residual` is the largest |balance| over the largest energy.
typedef struct Energy {
    double initial;            // kinetic, of the springs and of the free masses at t = 0
    double input;              // work of the base's motion
    double structural_damping; // lost in C
    double contact;            // lost in contacts
    double kinetic;            // at the end, structure and free masses
    double strain;             // at the end, structure's springs and contact springs
    double residual;           // [-]
} Energy;

// Peaks over samples and event instants, whether or not the channel was asked for; of several
// storeys or dampers the largest.
typedef struct Peaks {
    double displacement, velocity, acceleration, damper_displacement, contact_force;
} Peaks;

typedef struct Response {
    double sample_rate; // [Hz]
    size_t count;       // samples, i = 0 ... count - 1 at t = i / sample_rate
    Columns series;   // the channels that were wanted, in the order wanted; rows == count (or none)
    Impacts impacts;  // empty where is_unlisted
    bool is_unlisted; // set beforehand: impacts are counted, not listed
    uint64_t impact_count; // of kind IMPACT_IMPACT
    uint64_t resting_count;
    Approaches *approaches; // made beforehand, or NULL: of damper d at 2 d + side
    Energy energy;
    Peaks peaks;
    double earlier; // largest displacement before statistics_from [m]
    // Over samples from statistics_from on; of several storeys the largest.
    double sum_squares_displacement, sum_squares_acceleration;
    size_t statistics_count;
    bool has_trust;        // did the solver estimate what follows?
    bool is_stepped;       // it is its steps' error then, not rounding's
    double given_up;       // foretold error of displacement of the modes left out; in the estimate
    double error_estimate; // largest error of displacement over the largest displacement, at most 1
    double trust_horizon;  // that error passes RESPONSE_PARTING here [s]; NAN: not within the run
} Response;

#define RESPONSE_PARTING 1e-6

extern const char *const impact_kind_names[];
extern const Field impact_fields[];
extern const Field energy_fields[];

void response_clear(Response *response);

#endif
