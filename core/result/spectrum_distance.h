// How far one spectrum is from another: in decibels, and by power. Not of time series:
// likeness.h. Used by simulation/compare.c, the study compare and the comparison of results.
#ifndef CORE_RESULT_SPECTRUM_DISTANCE_H
#define CORE_RESULT_SPECTRUM_DISTANCE_H

#include "core/base/field.h"
#include "core/result/welch.h"

// Over the bins of the reference within a band, the other's density on the line between its own.
typedef struct Distance {
    double from, to;   // the band that was compared [Hz]
    double level;      // rms of 10 log10 of the ratio [dB]
    double difference; // integral of |difference| over that of the reference
    double power;      // integral over that of the reference, less 1
} Distance;
extern const Field distance_fields[];

// The bins, from 1 on, that hold all but a thousandth of the power.
size_t distance_band_end(const double *density, size_t rows);

// The density at a frequency, on the line between the bins beside it. NAN beyond the last one.
double distance_density_at(const Spectrum *spectrum, const double *density, double frequency);

// The level of `other` over the reference's bins first ... end - 1, those without density left
// out. NAN where `other` has no number for one of them.
double distance_level(const Spectrum *reference, const double *wanted, const Spectrum *other,
                      const double *density, size_t first, size_t end);

// Of two densities over the band [from, to] (NAN: where the reference has 99.9 % of its power),
// cut to where both have bins. All NAN where nothing is left of it.
Distance distance_measure(const Spectrum *reference, const double *wanted, const Spectrum *other,
                          const double *density, double from, double to);

#endif
