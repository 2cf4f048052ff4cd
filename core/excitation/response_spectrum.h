// The response spectrum of a ground motion: the largest displacement of linear oscillators,
// x'' + 2 xi omega x' + omega^2 x = -a_g.
#ifndef CORE_EXCITATION_RESPONSE_SPECTRUM_H
#define CORE_EXCITATION_RESPONSE_SPECTRUM_H

#include "core/base/field.h"
#include "core/base/progress.h"

#define RESPONSE_SPECTRUM_DAMPING_MAX 0.99 // xi

// `count` periods from the first to the last, at equal ratios [s].
void response_spectrum_periods(double from, double to, size_t count, double *periods);

// Steps of all oscillators, of about 10 ns of CPU each.
double response_spectrum_steps(const double *periods, size_t period_count, size_t sample_count,
                               double interval);

// Writes to displacement[k] the largest |x| of the oscillator of periods[k] from rest, relative to
// the base [m]; a_g is linear between its samples and 0 after the last one, the free vibration that
// follows included. Exact to rounding, peaks between samples too. 0 <= damping_ratio <=
// RESPONSE_SPECTRUM_DAMPING_MAX. STATUS_CANCELLED where `progress`, which may be NULL, requests a
// stop.
Status response_spectrum_make(const Reals *samples, double interval, double damping_ratio,
                              const double *periods, size_t period_count, const Progress *progress,
                              double *displacement);

#endif
