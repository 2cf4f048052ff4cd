// Writes the general engine's samples into the wanted columns, and takes peaks and sums over all
// storeys and dampers. Not the ledger of impacts (impact_log.h), but for its end.
#ifndef CORE_SOLVE_RECORDER_H
#define CORE_SOLVE_RECORDER_H

#include "core/solve/flight.h"

typedef struct Recorder {
    const FlightBuffer *buffer;
    size_t statistics_start; // the first sample that counts
    double base_speed;       // integral of a_g since the last sample, where that is no flight [m/s]
    double *last_velocity;   // of each column's storey, at the last sample
    double *shapes;          // of each column's storey
    // Sums of q_i q_k and of the modal accelerations' products, for k <= i, and the samples that
    // are not in them yet.
    double *squares[2], *batch[2];
    size_t count;
    double *block;
} Recorder;

// Freed by recorder_clear, also after a failure.
Status recorder_start(Recorder *record, const FlightBuffer *buffer, const ModalState *state,
                      Response *response, Problem *problem);
void recorder_clear(Recorder *record);

// Writes down rows 1 to `count` of the buffer, the last of them being the present sample, with the
// present forces; base_speed goes back to 0.
void recorder_take(Recorder *record, ModalState *state, size_t count);
// Records the present sample by way of the buffer, with forces and peaks; of a shadow nothing.
void recorder_sample(Recorder *record, FlightBuffer *buffer, ModalState *state);
// Updates the peaks by the same rows, all of them samples of flight.
void recorder_flight_peaks(Recorder *record, ModalState *state, size_t count);
void recorder_finish(Recorder *record, const ModalState *state, Response *response);
// The run is over: the ledger lists what is still open and writes its energies.
Status recorder_ledger(ModalState *state);

// Takes peaks at this instant, after modal_state_forces; of accelerations alone.
void recorder_peaks(ModalState *state);
void recorder_acceleration(ModalState *state);
// Statistics begin here: what came before is left out of the peaks.
void recorder_forget(ModalState *state);
// Feels, and takes peaks and the energy balance.
void recorder_note(ModalState *state);

#endif
