// A measured base acceleration as samples, as the scene gives it.
// Not the motion itself (base.h). Used by record.c, import.c and command/; others see an
// Excitation.
#ifndef CORE_EXCITE_RECORD_H
#define CORE_EXCITE_RECORD_H

#include "core/excite/excitation.h"

enum { RECORD_SAMPLES = 1 << 22 };

typedef struct ExcitationRecord {
    Excitation excitation;
    Reals samples;   // [m/s^2] before scaling
    double interval; // [s]
    double scale;    // [-]
    char *source;    // where the samples come from; may be NULL
} ExcitationRecord;

// What tells a sound record from a doubtful one: its largest magnitudes, each way, and what the
// acceleration adds up to.
typedef struct RecordLook {
    double highest, lowest;             // acceleration, at least and at most 0 [m/s^2]
    size_t peak_at;                     // sample of the largest magnitude
    double peak_velocity, end_velocity; // of the base, from rest [m/s]
} RecordLook;

RecordLook record_look(const Reals *samples, double interval, double scale);

// Whether it swings both ways and yet ends with a base that runs away: a baseline to correct.
bool record_drifts(const RecordLook *look);

#endif
