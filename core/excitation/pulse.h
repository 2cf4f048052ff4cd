// The settings of both pulses, half_sine and triangular.
#ifndef CORE_EXCITATION_PULSE_H
#define CORE_EXCITATION_PULSE_H

#include "core/excitation/excitation.h"

typedef struct ExcitationPulse {
    Excitation excitation;
    double amplitude; // at its middle [m/s^2]
    double start;     // [s]
    double length;    // [s]
} ExcitationPulse;

#endif
