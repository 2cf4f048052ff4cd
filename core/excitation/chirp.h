// The settings of a sweep of the base's acceleration.
#ifndef CORE_EXCITATION_CHIRP_H
#define CORE_EXCITATION_CHIRP_H

#include "core/excitation/excitation.h"

typedef struct ExcitationChirp {
    Excitation excitation;
    double start_frequency, end_frequency; // [Hz]
    double amplitude;                      // [m/s^2]
    double sweep_time;                     // [s]
    double rate;                           // [Hz]
} ExcitationChirp;

#endif
