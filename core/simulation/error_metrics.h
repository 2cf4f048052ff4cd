// How far one outcome is from another: the metrics by which accuracy is asked for and measured.
// Samples are compared within the reference's trust horizon only; beyond it statistics alone mean
// something. Not a choice between ways to run: that is aim.h and study/. Used by those.
#ifndef CORE_SIMULATION_ERROR_METRICS_H
#define CORE_SIMULATION_ERROR_METRICS_H

#include "core/result/metric.h"
#include "core/simulation/simulation.h"

// Differences from the reference; NAN where an outcome does not answer it.
typedef struct Errors {
    double displacement;      // largest over the largest
    double mean_acceleration; // rms over rms
    double peak_force;        // of the largest
    double impacts;           // how many more or fewer
    double psd;               // rms [dB]
    double rms_displacement;
} Errors;
extern const Field error_fields[];

// The error by one Metric.
double error_metrics_by(const Errors *errors, int metric);

// What others are compared with.
typedef struct ReferenceSummary {
    double error_estimate, trust_horizon;
    uint64_t impacts;        // within the horizon
    double peak_force;       // of those [N]
    double largest;          // displacement [m]
    double psd_from, psd_to; // the band compared [Hz]
} ReferenceSummary;
extern const Field reference_summary_fields[];

// An outcome whose series holds `storeys` columns of displacement, then as many of
// mean_acceleration.
typedef struct Compared {
    const Outcome *outcome;
    size_t storeys;
    bool has_motion; // false: its samples answer something else, and only its spectra count
    bool has_force;  // a contact force is known of every impact
    double horizon;  // of a reference: compared to here [s]; NAN: to the end
} Compared;

// Asks for the channels that errors are measured by, and for no others; the spectra stay.
Status error_metrics_request(Simulation *simulation, Problem *problem);

ReferenceSummary error_metrics_reference(const Compared *reference);

Errors error_metrics_measure(const Compared *reference, const Compared *point);

#endif
