// Windowed blocks of a spectrum. Block m is a sum over the bins k inside the band,
//
//   y_m[i] = rms / sqrt(bins) * sum_k a_mk cos(2 pi k i / B) - b_mk sin(2 pi k i / B),  0 <= i < B,
//
// with independent standard normal a_mk, b_mk, the numbers of the counter-based generator at
// (seed, stream m, index k). Blocks overlap by half and are faded by w[i] = sin(pi (i + 1/2) / B):
//
//   block 0     block 1     block 2
//     \           / \         /        x[h B/2 + i] = w[B/2 + i] y_h[B/2 + i] + w[i] y_(h+1)[i]
//       \       /     \     /
//         \   /         \ /            for hop h and 0 <= i < B/2
//     |   hop 0   |   hop 1   |
//
// As w^2[i] + w^2[i + B/2] = 1, the variance is rms^2 at every sample; and a sample depends on
// seed, band, rate and its index only, so that a longer run begins with the same bits.
//
// The fade smears the band's edges: d bins outside, the density is 0.0085 / d^3 of that inside
// (20 bins: -60 dB). A block has at least 256 bins in the band or, where B meets its limit, 8.
// Bins 0 and B/2 are left out: no mean, and no bin with half the variance.
#include "core/excitation/excitation.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "core/base/json_pointer.h"
#include "core/base/philox.h"
#include "core/math/fft.h"
#include "core/math/sparse_spectrum.h"

#define PI 3.14159265358979323846264338328
#define RATE_MIN 1e-9 // [Hz]

enum {
    BLOCK_MIN = 1 << 12,
    BLOCK_MAX = 1 << 22,
    BINS_WANTED = 256,
    BINS_MIN = 8,
    SAMPLES_MAX = 1 << 25,
    PART = 1 << 10, // of a block, read at once
};

// clang-format off
static const Field random_fields[] = {
    FIELD_BASE(ExcitationRandom, start, excitation_fields),
    //          struct            member  unit     range                   default   meaning
    FIELD_REALS(ExcitationRandom, band,   "Hz",    AT_MIN(0), 2, PRESENCE_REQUIRED,
                "[f0, f1]: the one-sided density is rms^2 / (f1 - f0) between them and none outside"),
    FIELD_REAL(ExcitationRandom,  rms,    "m/s^2", WITHIN(0, 1e9),         REQUIRED, "rms of the base's acceleration, as a process"),
    FIELD_COUNT(ExcitationRandom, seed,   NULL,    WITHIN(0, 0x1p53 - 1),  0,        "which of the many motions"),
    FIELD_REAL(ExcitationRandom,  rate,   "Hz",    AT_MIN(RATE_MIN),   OPTIONAL, "samples of the base's acceleration per second, linear between them; sample_rate if absent"),
    FIELD_END
};
// clang-format on

static const ExcitationRandom *random_of(const Excitation *excitation) {
    return (const ExcitationRandom *)(const void *)excitation;
}

RandomBlocks random_blocks(const ExcitationRandom *random) {
    const double f0 = random->band.at[0] / random->rate, f1 = random->band.at[1] / random->rate;
    RandomBlocks blocks = {.length = BLOCK_MIN};
    while (blocks.length < BLOCK_MAX && (f1 - f0) * (double)blocks.length < BINS_WANTED)
        blocks.length *= 2;
    const double length = (double)blocks.length;
    const double first = fmax(ceil(f0 * length), 1);
    const double last = fmin(floor(f1 * length), length / 2 - 1);
    blocks.first_bin = (size_t)first;
    blocks.bins = last < first ? 1 : (size_t)(last - first) + 1;
    return blocks;
}

// Samples 0 ... count - 1 reach one past the end of the run, which may be a rounding beyond
// duration * rate.
static double random_sample_count(const ExcitationRandom *random, const Span *span) {
    return floor(span->duration * random->rate * (1 + 1e-12)) + 2;
}

// Whether the band can be validated against the rate. Adds a fault where the base would have too
// many samples.
static bool random_check_rate(const ExcitationRandom *random, const Span *span, const char *pointer,
                              Problem *problem) {
    if (!(random->rate >= RATE_MIN) || !isfinite(random->rate))
        return false; // a fault of the row or of the sample rate
    const size_t most = span->most != 0 && span->most < SAMPLES_MAX ? span->most : SAMPLES_MAX;
    // The sample past the end of the run does not count against the limit.
    if (!isfinite(span->duration) || random_sample_count(random, span) - 1 <= (double)most)
        return true;
    json_pointer_fault_real(
        problem, pointer, "rate", random->rate, "Hz",
        "must be at most %s Hz, which makes %zu samples of the base in this duration, "
        "is %s",
        real_text(((double)most - 1) / span->duration).at, most, real_text(random->rate).at);
    return false;
}

static Status random_complete(Excitation *excitation, const Span *span, const char *pointer,
                              Problem *problem) {
    ExcitationRandom *random = (ExcitationRandom *)(void *)excitation;
    Status status = STATUS_OK;
    const JsonPointer band = json_pointer_of(pointer, "band");
    const JsonPointer highest = json_pointer_at(band.at, 1);
    if (isnan(random->rate)) {
        random->rate = span->sample_rate;
        if (random->rate > 0 && random->rate < RATE_MIN) // no row checks a default
            json_pointer_fault_real(problem, pointer, "rate", random->rate, "Hz",
                                    "must be at least %s Hz, is the sample_rate, %s",
                                    real_text(RATE_MIN).at, real_text(random->rate).at);
    }
    const bool has_rate = random_check_rate(random, span, pointer, problem);
    if (!has_rate)
        status = STATUS_INVALID;

    if (random->band.count != 2)
        return problem_add(problem, STATUS_INVALID, band.at,
                           "must have two entries, the lowest and the highest frequency in Hz, "
                           "has %zu",
                           random->band.count);
    const double f0 = random->band.at[0], f1 = random->band.at[1];
    if (!(f0 >= 0) || !isfinite(f0) || !isfinite(f1))
        return STATUS_INVALID; // the row adds the fault
    const double narrowest = random->rate * BINS_MIN / BLOCK_MAX;
    if (!(f0 < f1))
        status = problem_add_real(problem, STATUS_INVALID, highest.at, f1, "Hz",
                                  "must be above the lowest frequency, %s Hz, is %s",
                                  real_text(f0).at, real_text(f1).at);
    else if (has_rate && f1 > random->rate / 2)
        status = problem_add_real(problem, STATUS_INVALID, highest.at, f1, "Hz",
                                  "must be at most half the rate of the base's samples, %s Hz, "
                                  "is %s",
                                  real_text(random->rate / 2).at, real_text(f1).at);
    else if (has_rate && f1 - f0 < narrowest)
        status = problem_add_real(problem, STATUS_INVALID, band.at, f1 - f0, "Hz",
                                  "must be at least %s Hz wide at this rate, is %s; a lower rate "
                                  "allows a narrower band",
                                  real_text(narrowest).at, real_text(f1 - f0).at);
    return status;
}

// Writes the spectrum of y_m and transforms it.
static void random_make_block(const ExcitationRandom *random, const RandomBlocks *blocks,
                              uint64_t m, SparseSpectrum *synthesis) {
    double *bin = sparse_spectrum_bins(synthesis);
    // Half, because the transform of a real sequence adds bin k and its mirror.
    const double scale = random->rms / sqrt((double)blocks->bins) / 2;
    memset(bin, 0, 2 * blocks->first_bin * sizeof *bin);
    double *inside = bin + 2 * blocks->first_bin;
    philox_normal_pairs(random->seed, m, blocks->first_bin, blocks->bins, inside);
    for (size_t k = 0; k < 2 * blocks->bins; k++)
        inside[k] *= scale;
    sparse_spectrum_run(synthesis);
}

// Adds `count` faded samples of a block, from its beginning or from its middle on. Only the samples
// needed are computed.
static void random_fade(const SparseSpectrum *synthesis, const double *fade, size_t hop,
                        bool is_second_half, size_t count, double *x) {
    double y[PART];
    for (size_t from = 0; from < count; from += PART) {
        const size_t many = count - from < PART ? count - from : PART;
        sparse_spectrum_samples(synthesis, is_second_half ? hop + from : from, PART, y);
        for (size_t i = 0; i < many; i++)
            x[from + i] += fade[is_second_half ? hop - 1 - from - i : from + i] * y[i];
    }
}

static Status random_make_samples(const ExcitationRandom *random, const RandomBlocks *blocks,
                                  SparseSpectrum *synthesis, const double *fade,
                                  const Progress *progress, Base *base, Problem *problem) {
    const size_t hop = blocks->length / 2;
    const size_t hops = (base->count + hop - 1) / hop;
    for (size_t m = 0; m <= hops; m++) {
        if (!progress_advance(progress, (double)m / (double)(hops + 1)))
            return problem_set(problem, STATUS_CANCELLED,
                               "stopped while the base's motion was made");
        random_make_block(random, blocks, m, synthesis);
        for (size_t h = m > 0 ? m - 1 : 0; h < hops && h <= m; h++)
            random_fade(synthesis, fade, hop, h == m, h == hops - 1 ? base->count - h * hop : hop,
                        base->values + h * hop);
    }
    return STATUS_OK;
}

static Status random_make(const Excitation *excitation, const Span *span, const Progress *progress,
                          Base *base, Problem *problem) {
    const ExcitationRandom *random = random_of(excitation);
    if (random->rms == 0)
        return STATUS_OK; // still
    const double wanted = random_sample_count(random, span);
    if (!(wanted >= 2 && wanted <= SAMPLES_MAX + 1))
        return problem_set(problem, STATUS_LIMIT, "the base may have at most %d samples, not %.0f",
                           SAMPLES_MAX, wanted);
    const RandomBlocks blocks = random_blocks(random);
    const size_t hop = blocks.length / 2;
    SparseSpectrum *synthesis =
        sparse_spectrum_new(blocks.length, blocks.first_bin + blocks.bins, span->transforms);
    double *fade = malloc(hop * sizeof *fade);
    base->count = (size_t)wanted;
    base->values = calloc(base->count, sizeof *base->values);
    Status status;
    if (synthesis == NULL || fade == NULL || base->values == NULL) {
        status = problem_set(problem, STATUS_NO_MEMORY,
                             "no memory for %zu samples of the base's motion", base->count);
    } else {
        base->form = BASE_SAMPLED;
        base->interval = 1 / random->rate;
        const double step = PI / (double)blocks.length;
        fft_cosines((0.5 - (double)hop) * step, step, hop, fade); // sines, a quarter turn on
        status = random_make_samples(random, &blocks, synthesis, fade, progress, base, problem);
    }
    free(fade);
    sparse_spectrum_free(synthesis, span->transforms);
    if (status != STATUS_OK)
        base_clear(base);
    return status;
}

static double random_interval(const Excitation *excitation) {
    return 1 / random_of(excitation)->rate;
}

static double random_band(const Excitation *excitation, double band[2]) {
    for (int i = 0; i < 2; i++)
        band[i] = 2 * PI * random_of(excitation)->band.at[i];
    return random_of(excitation)->rms;
}

const ExcitationKind excitation_random = {
    .kind = {.name = "random",
             .doc = "band-limited Gaussian acceleration of the base, the same for the same seed",
             .fields = random_fields,
             .size = sizeof(ExcitationRandom)},
    .complete = random_complete,
    .band = random_band,
    .interval = random_interval,
    .effort = 0.06,
    .make = random_make,
};
