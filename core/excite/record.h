// A measured base acceleration as samples, as the scene gives it.
// Not the motion itself (base.h). Used by record.c and by tests; everyone else sees an Excitation.
#ifndef CORE_EXCITE_RECORD_H
#define CORE_EXCITE_RECORD_H

#include "core/excite/excitation.h"

typedef struct ExcitationRecord {
    Excitation excitation;
    Reals samples;   // [m/s^2] before scaling
    double interval; // [s]
    double scale;    // [-]
} ExcitationRecord;

#endif
