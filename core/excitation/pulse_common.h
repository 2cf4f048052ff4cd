// What pulses have in common: amplitude, start and length, and how these are judged.
// Not a pulse's form: half_sine.c and triangular.c. Used by these and by tests.
#ifndef CORE_EXCITATION_PULSE_COMMON_H
#define CORE_EXCITATION_PULSE_COMMON_H

#include "core/excitation/excitation.h"

typedef struct ExcitationPulse {
    Excitation excitation;
    double amplitude; // at its middle [m/s^2]
    double start;     // [s]
    double length;    // [s]
} ExcitationPulse;

extern const Field pulse_fields[];

Status pulse_complete(Excitation *excitation, const Span *span, const char *pointer,
                      Problem *problem);
void pulse_doubt(const Excitation *excitation, const Span *span, const char *pointer,
                 Problem *doubts);

static inline const ExcitationPulse *pulse_of(const Excitation *excitation) {
    return (const ExcitationPulse *)(const void *)excitation;
}

#endif
