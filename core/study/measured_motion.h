// Measured motions, and how a run differs from them: sample by sample, or in the logarithms of
// their spectra.
#ifndef CORE_STUDY_MEASURED_MOTION_H
#define CORE_STUDY_MEASURED_MOTION_H

#include "core/simulation/simulation.h"

enum { MEASURED_CHANNELS = 16, MEASURED_SAMPLES = 1 << 17 };

// Sample i is at start + i interval.
typedef struct MeasuredChannel {
    char *channel;
    Reals samples;
    double interval, start; // [s]
    double deviation;       // standard deviation of the noise; NAN: unknown
} MeasuredChannel;

typedef struct MeasuredChannels {
    MeasuredChannel *at;
    size_t count;
} MeasuredChannels;

extern const Field measured_channel_fields[];

static inline double measured_time(const MeasuredChannel *measured, size_t sample) {
    return measured->start + (double)sample * measured->interval;
}
double measured_rms(const MeasuredChannel *measured); // about the mean

// The part of a measured channel that is compared. The measured channel is borrowed.
typedef struct MeasuredTarget {
    const MeasuredChannel *measured;
    size_t first, samples; // the samples in it
    bool is_spectrum;
    WelchSettings welch; // of a spectrum
    double floor;        // density of the noise, of both spectra
    Reals values;     // compared: samples, or logarithms of densities from the second frequency on
    double deviation; // of each
    size_t place;     // of the first value among those of all channels
} MeasuredTarget;

// Samples from `from` to `to` [s], both included; `psd`: as a spectrum with these settings, NULL:
// in time. Cleared by measured_target_clear in any case.
Status measured_target_make(const MeasuredChannel *measured, double from, double to,
                            const SpectrumRequest *psd, MeasuredTarget *target, Problem *problem);
void measured_target_clear(MeasuredTarget *target);

// The values of a run at the measured times moved by `shift` to later times [s]; `slopes`, unless
// NULL, gets their derivatives by it. `cache` may be NULL.
Status measured_target_model(const MeasuredTarget *target, const Response *response, double shift,
                             FftCache *cache, double *values, double *slopes, Problem *problem);

#endif
