// What ONE excitation is; excitations.c lists all. It yields the base's acceleration over the whole
// run. The initial state belongs to it because every kind takes one. Not the solver's view of a
// step: that is base.h. Used by scene/, plan/ and simulation/.
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

// What an excitation needs to know of the run it serves.
typedef struct Span {
    double duration;          // [s]
    double sample_rate;       // [Hz]
    size_t most;              // samples at most, 0: no limit
    FourierStock *transforms; // may be NULL
} Span;

typedef struct ExcitationKind {
    Kind kind;
    // Judges what the run does not matter for, beside what rows can see. NULL: nothing.
    Status (*check)(const Excitation *excitation, const char *pointer, Problem *problem);
    // Judges what ranges cannot say and completes defaults that depend on the run, below `pointer`.
    // May be NULL.
    Status (*complete)(Excitation *excitation, const Span *span, const char *pointer,
                       Problem *problem);
    // The fastest the base moves, beyond what its samples show [rad/s]. NULL: it has nothing
    // faster.
    double (*fastest)(const Excitation *excitation);
    // Between the samples by which the base is known [s]. NULL: it is known in closed form.
    double (*interval)(const Excitation *excitation);
    // Until when it has samples [s]. NULL: to the run's end.
    double (*lasts)(const Excitation *excitation);
    double effort; // of making one of them, in solver steps
    // Makes the base's motion over span->duration. `base` is cleared by base_clear. Stops when
    // `progress` says so.
    Status (*make)(const Excitation *excitation, const Span *span, const Progress *progress,
                   Base *base, Problem *problem);
    // Adds what is allowed but hardly meant to `doubts`, below `pointer`. NULL: nothing to doubt.
    void (*doubt)(const Excitation *excitation, const Span *span, const char *pointer,
                  Problem *doubts);
} ExcitationKind;

extern const ExcitationKind *const excitations[]; // NULL-terminated; "free" first
extern const KindTable excitation_kinds;
extern const Field excitation_fields[]; // the rows that every kind has
extern const ExcitationKind excitation_free, excitation_random, excitation_sine, excitation_record,
    excitation_chirp, excitation_half_sine, excitation_triangular;

// A doubt at pointer/name where the output's samples cannot show motion of this frequency.
void excitation_doubt_frequency(double frequency, const Span *span, const char *pointer,
                                const char *name, Problem *doubts);

static inline const ExcitationKind *excitation_kind(const Excitation *excitation) {
    return (const ExcitationKind *)(const void *)excitation->variant.kind;
}

#endif
