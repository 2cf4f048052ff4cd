// Differences between two outcomes, by the metrics of accuracy. Samples are compared within the
// trust horizon of the reference; beyond it only statistics are meaningful.
#ifndef CORE_SIMULATION_ERROR_METRICS_H
#define CORE_SIMULATION_ERROR_METRICS_H

#include "core/result/response.h"
#include "core/simulation/simulation.h"

// Differences from the reference; NAN is unknown.
typedef struct Errors {
    double displacement;      // largest difference over largest value
    double mean_acceleration; // rms of the difference over rms
    double peak_force;        // relative difference of the largest force
    double impacts;           // difference of the numbers
    double psd;               // rms distance [dB]
    double rms_displacement;  // relative difference
} Errors;
extern const Field error_fields[];

// The error by one Metric.
double error_metrics_by(const Errors *errors, int metric);

// The numbers of the reference.
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
    bool has_motion; // false: only its spectra are compared
    bool has_force;  // every impact has a contact force
    double horizon;  // end of the comparison, of a reference [s]; NAN: end of the run
} Compared;

// Replaces the channels by those that errors are measured with; the spectra stay.
Status error_metrics_request(Simulation *simulation, Problem *problem);

ReferenceSummary error_metrics_reference(const Compared *reference);

Errors error_metrics_measure(const Compared *reference, const Compared *point);

#endif
