// Difference of two spectra, in decibels and by power.
#ifndef CORE_RESULT_SPECTRUM_DISTANCE_H
#define CORE_RESULT_SPECTRUM_DISTANCE_H

#include "core/base/field.h"
#include "core/result/welch.h"

// Over the bins of the reference within a band; the other density is interpolated linearly.
typedef struct SpectrumDistance {
    double from, to;   // the compared band [Hz]
    double level;      // rms of 10 log10(ratio) [dB]
    double difference; // integral of |difference| over the integral of the reference
    double power;      // integral over the integral of the reference, minus 1
} SpectrumDistance;
extern const Field spectrum_distance_fields[];

// The end of the bins from 1 on that contain 99.9 % of the power.
size_t spectrum_distance_band_end(const double *density, size_t rows);

// The density at a frequency [Hz], interpolated linearly. NAN above the last bin.
double spectrum_distance_density_at(const Spectrum *spectrum, const double *density,
                                    double frequency);

// The level over the bins first ... end - 1 of the reference, without those of zero density. NAN if
// `other` has no value for one of them.
double spectrum_distance_level(const Spectrum *reference, const double *wanted,
                               const Spectrum *other, const double *density, size_t first,
                               size_t end);

// The difference of two densities over [from, to] (NAN: the band with 99.9 % of the reference's
// power), limited to the bins of both. All NAN if the band is empty.
SpectrumDistance spectrum_distance_measure(const Spectrum *reference, const double *wanted,
                                           const Spectrum *other, const double *density,
                                           double from, double to);

#endif
