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
    double rms_displacement;  // relative difference, as of the next
    double peak_storey_drift, peak_base_shear;
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

// Replaces the channels by those that errors are measured with; the spectra stay.
Status error_metrics_request(Simulation *simulation, Problem *problem);

// Below, the series of an outcome holds the displacement of each storey, then its mean
// acceleration.

ReferenceSummary error_metrics_reference(const Outcome *reference);

// Without `has_motion` only the spectra are compared.
Errors error_metrics_measure(const Outcome *reference, const Outcome *point, bool has_motion);

#endif
