// Writes the general engine's samples into the wanted columns, and takes peaks and sums over all
// storeys and dampers. Not the ledger of impacts (ledger.h), but for its end. Used by
// core/solve/frame*.c and steps*.c.
#ifndef CORE_SOLVE_RECORDER_H
#define CORE_SOLVE_RECORDER_H

#include "core/solve/frame_trail.h"

typedef struct FrameRecord {
    const FrameTrail *trail;
    size_t statistics_start; // the first sample that counts
    double base_speed;       // integral of a_g since the last sample, where that is no flight [m/s]
    double *last_velocity;   // of each column's storey, at the last sample
    double *shapes;          // of each column's storey
    // Sums of q_i q_k and of the modal accelerations' products, for k <= i, and the samples that
    // are not in them yet.
    double *squares[2], *batch[2];
    size_t count;
    double *block;
} FrameRecord;

// Freed by frame_record_clear, also after a failure.
Status frame_record_start(FrameRecord *record, const FrameTrail *trail, const Frame *frame,
                          Response *response, Problem *problem);
void frame_record_clear(FrameRecord *record);

// Writes down rows 1 to `count` of the trail, the last of them being the present sample, with the
// present forces; base_speed goes back to 0.
void frame_record_take(FrameRecord *record, Frame *frame, size_t count);
// Takes their peaks, all of them being samples of flight.
void frame_record_flight_peaks(FrameRecord *record, Frame *frame, size_t count);
void frame_record_finish(FrameRecord *record, const Frame *frame, Response *response);
// The run is over: the ledger lists what is still open and writes its energies.
Status frame_record_ledger(Frame *frame);

// Takes peaks at this instant, after frame_feel; of accelerations alone.
void frame_record_peaks(Frame *frame);
void frame_record_acceleration(Frame *frame);
// Statistics begin here: what came before is left out of the peaks.
void frame_record_forget(Frame *frame);
// Feels, and takes peaks and the energy balance.
void frame_record_note(Frame *frame);

#endif
