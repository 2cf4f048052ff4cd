// Writes the samples of runs by modes into the wanted columns, and takes peaks and sums over all
// storeys and dampers.
#ifndef CORE_SOLVE_RECORDER_H
#define CORE_SOLVE_RECORDER_H

#include "core/solve/flight.h"

typedef struct Recorder {
    FlightBuffer buffer;     // of the last samples
    size_t statistics_start; // first sample
    double base_speed;       // integral of a_g since the last sample, except in flight [m/s]
    double *last_velocity;   // of each column's storey, at the last sample
    double *shapes;          // of each column's storey
    // Sums of the products q_i q_k and of those of the modal accelerations, for k <= i, and the
    // samples not added yet.
    double *squares[2], *batch[2];
    size_t count;
    double *block;
} Recorder;

// Freed by recorder_clear, also after a failure.
Status recorder_start(Recorder *record, const ModalState *state, Response *response,
                      Problem *problem);
void recorder_clear(Recorder *record);

// Records the present sample with forces and peaks; of a shadow nothing. Resets base_speed.
void recorder_sample(Recorder *record, ModalState *state);
// Records rows 1 to `count` of the buffer, samples of flight of which the last is the present one.
void recorder_flight(Recorder *record, ModalState *state, size_t count);
void recorder_finish(Recorder *record, const ModalState *state, Response *response);
// Ends the impact log of a run.
Status recorder_finish_log(ModalState *state);

// Updates the peaks by the present state, after modal_state_forces; those of accelerations only.
void recorder_peaks(ModalState *state);
void recorder_acceleration(ModalState *state);
// Updates forces, peaks and the energy balance.
void recorder_update(ModalState *state);

#endif
