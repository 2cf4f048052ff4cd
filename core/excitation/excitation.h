// One kind of excitation: the initial state and the base's motion over the whole run. excitations.c
// lists all kinds.
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
    // The highest frequency of the base's motion [rad/s]. NULL: no higher than its samples show.
    double (*fastest)(const Excitation *excitation);
    // Between the samples of the base [s]. NULL: the base has a closed form.
    double (*interval)(const Excitation *excitation);
    // The time of its last sample [s]. NULL: the end of the run.
    double (*lasts)(const Excitation *excitation);
    double effort; // cost of one sample, in solver steps
    // Whether the base never moves. NULL: it may move.
    bool (*is_still)(const Excitation *excitation);
    // Makes the base's motion over span->duration; the caller clears `base` with base_clear.
    // STATUS_CANCELLED where `progress` stops it.
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

// Adds a doubt at pointer/name where the output's samples cannot show motion of this frequency.
void excitation_doubt_frequency(double frequency, const Span *span, const char *pointer,
                                const char *name, Problem *doubts);

static inline const ExcitationKind *excitation_kind(const Excitation *excitation) {
    return (const ExcitationKind *)(const void *)excitation->variant.kind;
}

static inline bool excitation_is_still(const Excitation *excitation) {
    const ExcitationKind *kind = excitation_kind(excitation);
    return kind->is_still != NULL && kind->is_still(excitation);
}

#endif
