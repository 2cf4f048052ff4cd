// A measured base acceleration: the scene's own samples or those of a named record.
#ifndef CORE_EXCITATION_RECORDED_MOTION_H
#define CORE_EXCITATION_RECORDED_MOTION_H

#include "core/excitation/excitation.h"

enum { RECORD_SAMPLES = 1 << 22, RECORD_NAME_SIZE = 65, RECORD_DIGEST_SIZE = 65 };

// A record that scenes refer to by name.
typedef struct NamedRecord {
    Refcount shared;
    char name[RECORD_NAME_SIZE];     // [A-Za-z0-9][A-Za-z0-9._-]*
    char digest[RECORD_DIGEST_SIZE]; // of interval and samples, in hexadecimal digits
    double interval;                 // [s]
    double peak;                     // the largest magnitude of the samples [m/s^2]
    Reals samples;                   // [m/s^2]
} NamedRecord;

// Takes ownership of the samples, also when it fails. NULL without memory. Released by
// refcount_unref(&named->shared).
NamedRecord *named_record_new(const char *name, const char *digest, double interval,
                              Reals *samples);

typedef struct ExcitationRecord {
    Excitation excitation;
    char *name, *digest; // of a named record; NULL: the samples are here
    Reals samples;       // [m/s^2] before scaling
    double interval;     // [s]
    double scale;        // [-]
    char *source;        // where the samples come from; may be NULL
    Refcount *named;     // the NamedRecord that the name was resolved to; NULL: not yet
} ExcitationRecord;

static inline const NamedRecord *record_named(const ExcitationRecord *record) {
    return (const NamedRecord *)(const void *)record->named;
}

// The samples before scaling.
static inline const Reals *record_samples(const ExcitationRecord *record) {
    return record->named != NULL ? &record_named(record)->samples : &record->samples;
}
static inline double record_interval(const ExcitationRecord *record) {
    return record->named != NULL ? record_named(record)->interval : record->interval;
}

// Resolves the name to `named`, which is referenced, and sets the digest. False without memory.
bool record_resolve(ExcitationRecord *record, NamedRecord *named);

// Figures by which a record is plausible or doubtful: its extremes and the velocity of the base.
typedef struct RecordLook {
    double highest, lowest;             // acceleration, at least and at most 0 [m/s^2]
    size_t peak_at;                     // sample of the largest magnitude
    double peak_velocity, end_velocity; // of the base, from rest [m/s]
} RecordLook;

RecordLook record_look(const Reals *samples, double interval, double scale);

// Adds a doubt at `place` about values that are allowed but hardly intended; its sentence begins
// with `before`.
void record_look_doubt(const RecordLook *look, const char *before, const char *place,
                       Problem *doubts);

#endif
