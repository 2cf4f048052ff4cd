// A measured base acceleration as samples: the scene's own, or those of a record that it names.
// Not the motion itself (base.h), nor where named records are kept. Used by record.c, import.c,
// server/jobs/prepare_record.c and command/; others see an Excitation.
#ifndef CORE_EXCITATION_RECORDED_MOTION_H
#define CORE_EXCITATION_RECORDED_MOTION_H

#include "core/excitation/excitation.h"

enum { RECORD_SAMPLES = 1 << 22, RECORD_NAME_SIZE = 65, RECORD_DIGEST_SIZE = 65 };

// What a name stands for. Whoever resolves names makes it.
typedef struct NamedRecord {
    Shared shared;
    char name[RECORD_NAME_SIZE];     // [A-Za-z0-9][A-Za-z0-9._-]*
    char digest[RECORD_DIGEST_SIZE]; // of interval and samples, in hexadecimal digits
    double interval;                 // [s]
    double peak;                     // the largest magnitude of the samples [m/s^2]
    Reals samples;                   // [m/s^2]
} NamedRecord;

// Takes the samples, also when it fails. NULL without memory. Dropped by
// shared_drop(&named->shared).
NamedRecord *named_record_new(const char *name, const char *digest, double interval,
                              Reals *samples);

typedef struct ExcitationRecord {
    Excitation excitation;
    char *name, *digest; // of a record that is kept elsewhere; NULL: the samples stand here
    Reals samples;       // [m/s^2] before scaling
    double interval;     // [s]
    double scale;        // [-]
    char *source;        // where the samples come from; may be NULL
    Shared *named;       // a NamedRecord, what the name was found to stand for; NULL: not yet
} ExcitationRecord;

static inline const NamedRecord *record_named(const ExcitationRecord *record) {
    return (const NamedRecord *)(const void *)record->named;
}

// Before scaling, wherever they stand.
static inline const Reals *record_samples(const ExcitationRecord *record) {
    return record->named != NULL ? &record_named(record)->samples : &record->samples;
}
static inline double record_interval(const ExcitationRecord *record) {
    return record->named != NULL ? record_named(record)->interval : record->interval;
}

// The name now stands for `named`, of which it gets a hold, and the digest says so. False without
// memory.
bool record_resolve(ExcitationRecord *record, NamedRecord *named);

// What tells a sound record from a doubtful one: its largest magnitudes, each way, and what the
// acceleration adds up to.
typedef struct RecordLook {
    double highest, lowest;             // acceleration, at least and at most 0 [m/s^2]
    size_t peak_at;                     // sample of the largest magnitude
    double peak_velocity, end_velocity; // of the base, from rest [m/s]
} RecordLook;

RecordLook record_look(const Reals *samples, double interval, double scale);

// What is allowed but hardly meant, at `place`; the sentence, which speaks of samples, begins with
// `before`.
void record_look_doubt(const RecordLook *look, const char *before, const char *place,
                       Problem *doubts);

// Whether it swings both ways and yet ends with a base that runs away: a baseline to correct.
bool record_drifts(const RecordLook *look);

#endif
