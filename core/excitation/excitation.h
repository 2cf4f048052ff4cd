// One kind of excitation: the initial state and the base's motion over the whole run, and the
// settings of each kind except the recorded motion. excitations.c lists all kinds.
#ifndef CORE_EXCITATION_EXCITATION_H
#define CORE_EXCITATION_EXCITATION_H

#include "core/base/field.h"
#include "core/base/progress.h"
#include "core/excitation/base_motion.h"
#include "core/math/fft.h"

// First member of every excitation's struct.
typedef struct Excitation {
    Variant variant;    // kind is an ExcitationKind's
    Reals displacement; // of each storey at t = 0, relative to the base; none: 0 [m]
    Reals velocity;     // [m/s]
} Excitation;

// Properties of the run on which an excitation depends.
typedef struct Span {
    double duration;      // [s]
    double sample_rate;   // [Hz]
    size_t most;          // limit on the samples of the base, 0: none
    FftCache *transforms; // may be NULL
} Span;

typedef struct ExcitationKind {
    Kind kind;
    // Validates relations between fields that do not depend on the run. NULL: none.
    Status (*check)(const Excitation *excitation, const char *pointer, Problem *problem);
    // Validates fields that depend on the run and sets their defaults, below `pointer`. NULL: none.
    Status (*complete)(Excitation *excitation, const Span *span, const char *pointer,
                       Problem *problem);
    // The lowest and the highest of the base's main frequencies [rad/s]; returns the size of its
    // acceleration: an amplitude, or a root mean square [m/s^2]. NULL: the base is still.
    double (*band)(const Excitation *excitation, double band[2]);
    // Between the samples of the base [s]. NULL: the base has a closed form.
    double (*interval)(const Excitation *excitation);
    // The time of its last sample [s]. NULL: the end of the run.
    double (*lasts)(const Excitation *excitation);
    double effort; // cost of one sample, in solver steps
    // The motion in closed form. NULL, and no make(): the base is still.
    Base (*form)(const Excitation *excitation);
    // Makes the samples of the motion over span->duration into an empty base, which the caller
    // clears. STATUS_CANCELLED where `progress` stops it. NULL: it has a closed form.
    Status (*make)(const Excitation *excitation, const Span *span, const Progress *progress,
                   Base *base, Problem *problem);
    // Adds values that are allowed but hardly intended to `doubts`, below `pointer`. NULL: none.
    void (*doubt)(const Excitation *excitation, const Span *span, const char *pointer,
                  Problem *doubts);
} ExcitationKind;

extern const ExcitationKind *const excitations[]; // NULL-terminated; "free" first
extern const KindTable excitation_kinds;
extern const Field excitation_fields[]; // the rows that every kind has
extern const ExcitationKind excitation_free, excitation_random, excitation_sine, excitation_record,
    excitation_chirp, excitation_half_sine, excitation_triangular;

// Kind "random": band-limited Gaussian acceleration of the base with a flat one-sided density of
// rms^2 / (f1 - f0) within [f0, f1]. Its samples do not depend on the solver.
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

// Kind "sine".
typedef enum SineQuantity { SINE_ACCELERATION, SINE_DISPLACEMENT } SineQuantity;

typedef struct ExcitationSine {
    Excitation excitation;
    double frequency; // [Hz]
    double amplitude; // [m/s^2] or [m]
    int quantity;     // SineQuantity
} ExcitationSine;

// Kind "chirp": a sweep.
typedef struct ExcitationChirp {
    Excitation excitation;
    double start_frequency, end_frequency; // [Hz]
    double amplitude;                      // [m/s^2]
    double sweep_time;                     // [s]
    double rate;                           // [Hz]
} ExcitationChirp;

// Kinds "half_sine" and "triangular".
typedef struct ExcitationPulse {
    Excitation excitation;
    double amplitude; // at its middle [m/s^2]
    double start;     // [s]
    double length;    // [s]
} ExcitationPulse;

// Makes the base's motion over span->duration; the caller clears `base` with base_clear, also after
// a failure. STATUS_CANCELLED where `progress` stops it.
Status excitation_make(const Excitation *excitation, const Span *span, const Progress *progress,
                       Base *base, Problem *problem);

// Adds a doubt at pointer/name where the output's samples cannot show motion of this frequency.
void excitation_doubt_frequency(double frequency, const Span *span, const char *pointer,
                                const char *name, Problem *doubts);

static inline const ExcitationKind *excitation_kind(const Excitation *excitation) {
    return (const ExcitationKind *)(const void *)excitation->variant.kind;
}

// Whether the base never moves.
static inline bool excitation_is_still(const Excitation *excitation) {
    const ExcitationKind *kind = excitation_kind(excitation);
    return kind->band == NULL || kind->band(excitation, (double[2]){0}) == 0;
}

#endif
