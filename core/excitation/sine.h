// The settings of a sine of the base.
#ifndef CORE_EXCITATION_SINE_H
#define CORE_EXCITATION_SINE_H

#include "core/excitation/excitation.h"

typedef enum SineQuantity { SINE_ACCELERATION, SINE_DISPLACEMENT } SineQuantity;

typedef struct ExcitationSine {
    Excitation excitation;
    double frequency; // [Hz]
    double amplitude; // [m/s^2] or [m]
    int quantity;     // SineQuantity
} ExcitationSine;

#endif
