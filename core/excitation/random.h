// Band-limited Gaussian acceleration of the base: a flat one-sided density of rms^2 / (f1 - f0)
// within [f0, f1]. Not a recorded motion and not white noise of a solver's step: its samples do not
// depend on the solver. Used by excitations.c and the tests; everyone else sees an Excitation.
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

// How the samples are made, known from band and rate alone.
typedef struct RandomBlocks {
    size_t length;          // B, a power of two; a block begins every B / 2 samples
    size_t first_bin, bins; // the bins inside the band, without 0 and B / 2
} RandomBlocks;

RandomBlocks random_blocks(const ExcitationRandom *random);

#endif
