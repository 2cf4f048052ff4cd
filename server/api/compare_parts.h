// The parts of a comparison of results as JSON: statistics, motions, spectra. Not the requests:
// compare.c and compare_measured.c. Used by those.
#ifndef SERVER_API_COMPARE_PARTS_H
#define SERVER_API_COMPARE_PARTS_H

#include "core/result/signal_comparison.h"
#include "core/result/spectrum_distance.h"
#include "core/simulation/simulation.h"
#include "server/util/bytes.h"

#define COMPARE_PART 0.01 // of the largest displacement, by which motions have parted

// [{"name", "unit", "a", "b", "difference", "relative"}].
void compare_put_metrics(Bytes *bytes, const Summary *a, const Summary *b);

// [{"channel", "unit", ...}] for every channel that both sampled, as many as can be looked at while
// a client waits, and when the displacements part:
// "channels" and "divergence", the members themselves. `horizons` are the summaries'. Returns how
// many channels were too many.
size_t compare_put_motions(Bytes *bytes, const Response *a, const Response *b,
                           const double horizons[2]);

// [{"channel", "unit", ...}] for every density that both have. Returns how many were too many.
size_t compare_put_spectra(Bytes *bytes, const Spectrum *a, const Spectrum *b);

// Says how many of what both have were not compared, if any.
void compare_warn_left(Bytes *bytes, size_t motions, size_t spectra);

// What differs in how they were sampled, added to an array of warnings.
void compare_warn(Bytes *bytes, const Response *a, const Response *b, const Spectrum *spectrum_a,
                  const Spectrum *spectrum_b);

// {"pointer": "", "detail": ...}, with the comma before it where one is needed.
void compare_put_warning(Bytes *bytes, const char *format, ...)
    __attribute__((format(printf, 2, 3)));

#endif
