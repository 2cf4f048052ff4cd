// A ratio of densities weights all frequencies equally; a difference of powers weights them by
// their share of the motion. Bin 0 is left out, because spectra have no mean.
#include "core/result/spectrum_distance.h"

#include <math.h>

// clang-format off
const Field spectrum_distance_fields[] = {
    FIELD_REAL(SpectrumDistance, from, "Hz", ANY, OPTIONAL, "the spectra are compared from here"),
    FIELD_REAL(SpectrumDistance, to, "Hz", ANY, OPTIONAL, "to here"),
    FIELD_REAL(SpectrumDistance, level, "dB", ANY, OPTIONAL, "rms of 10 log10 of the ratio of the densities, over the reference's bins in the band"),
    FIELD_REAL(SpectrumDistance, difference, NULL, ANY, OPTIONAL, "integral of the absolute difference over the integral of the reference, within the band"),
    FIELD_REAL(SpectrumDistance, power, NULL, ANY, OPTIONAL, "integral over that of the reference, less 1: negative where there is less motion in the band"),
    FIELD_END
};
// clang-format on

// The part of a spectrum's power that its band holds.
static const double band_power = 0.999;

size_t spectrum_distance_band_end(const double *density, size_t rows) {
    double all = 0, sum = 0;
    for (size_t k = 1; k < rows; k++)
        all += density[k];
    if (!(all > 0))
        return 0;
    size_t end = 1;
    while (end < rows && sum < band_power * all)
        sum += density[end++];
    return end;
}

double spectrum_distance_density_at(const Spectrum *spectrum, const double *density,
                                    double frequency) {
    const size_t last = spectrum->densities.rows - 1;
    if (last < 1 || frequency > spectrum->frequency[last] * (1 + 1e-12))
        return (double)NAN;
    const double index = frequency / spectrum->frequency[1];
    if (index <= 1)
        return density[1]; // bin 0 lacks the mean and does not describe its neighbour
    const size_t at = index * (1 + 1e-12) >= (double)last ? last : (size_t)(index * (1 + 1e-12));
    const double part = index - (double)at;
    return at == last || part < 1e-9 ? density[at]
                                     : density[at] + part * (density[at + 1] - density[at]);
}

double spectrum_distance_level(const Spectrum *reference, const double *wanted,
                               const Spectrum *other, const double *density, size_t first,
                               size_t end) {
    double squares = 0;
    size_t count = 0;
    for (size_t k = first; k < end; k++) {
        if (!(wanted[k] > 0))
            continue;
        const double level =
            10 * log10(spectrum_distance_density_at(other, density, reference->frequency[k]) /
                       wanted[k]);
        squares += level * level;
        count++;
    }
    return count > 0 && isfinite(squares) ? sqrt(squares / (double)count) : (double)NAN;
}

SpectrumDistance spectrum_distance_measure(const Spectrum *reference, const double *wanted,
                                           const Spectrum *other, const double *density,
                                           double from, double to) {
    SpectrumDistance distance = {(double)NAN, (double)NAN, (double)NAN, (double)NAN, (double)NAN};
    const size_t rows = reference->densities.rows;
    if (rows < 2 || other->densities.rows < 2)
        return distance;
    const double last = other->frequency[other->densities.rows - 1] * (1 + 1e-12);
    size_t first = 1, end = isnan(to) ? spectrum_distance_band_end(wanted, rows) : rows;
    while (first < end && reference->frequency[first] < from)
        first++;
    while (end > first &&
           (reference->frequency[end - 1] > to || reference->frequency[end - 1] > last))
        end--;
    if (first >= end)
        return distance;
    double whole = 0, own = 0, apart = 0;
    for (size_t k = first; k < end; k++) {
        const double value = spectrum_distance_density_at(other, density, reference->frequency[k]);
        whole += wanted[k];
        own += value;
        apart += fabs(value - wanted[k]);
    }
    distance.from = reference->frequency[first];
    distance.to = reference->frequency[end - 1];
    distance.level = spectrum_distance_level(reference, wanted, other, density, first, end);
    if (whole > 0 && isfinite(own)) {
        distance.difference = apart / whole;
        distance.power = own / whole - 1;
    }
    return distance;
}
