// Band-limited Gaussian acceleration of the base with a flat one-sided density of rms^2 / (f1 - f0)
// within [f0, f1]. Its samples do not depend on the solver.
#ifndef CORE_EXCITATION_RANDOM_H
#define CORE_EXCITATION_RANDOM_H

#include <stdint.h>

#include "core/excitation/excitation.h"

typedef struct ExcitationRandom {
    Excitation start;
    Reals band; // f0, f1 [Hz]
    double rms; // of the process, not of one sample path [m/s^2]
    uint64_t seed;
    double rate; // of the samples [Hz]; absent: the run's sample rate
} ExcitationRandom;

// The blocks of which the samples are made; they depend on band and rate alone.
typedef struct RandomBlocks {
    size_t length;          // B, a power of two; a block begins every B / 2 samples
    size_t first_bin, bins; // the bins inside the band, without 0 and B / 2
} RandomBlocks;

RandomBlocks random_blocks(const ExcitationRandom *random);

#endif
