// A sine of the base, as the scene gives it.
// Not the motion itself (base.h). Used by sine.c and by tests; everyone else sees an Excitation.
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
