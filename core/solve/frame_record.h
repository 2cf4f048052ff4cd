// Writes the general engine's samples into the wanted columns, and takes peaks and sums over all
// storeys and dampers. Not the ledger of impacts (ledger.h). Used by core/solve/frame*.c.
#ifndef CORE_SOLVE_FRAME_RECORD_H
#define CORE_SOLVE_FRAME_RECORD_H

#include "core/solve/frame_state.h"

typedef struct FrameRecord {
    size_t statistics_start;                     // the first sample that counts
    double base_speed;                           // integral of a_g since the last sample [m/s]
    double *last_velocity;                       // of the storeys, at the last sample
    double *sum_displacement, *sum_acceleration; // of the storeys, of squares
    size_t count;
    double *block;
} FrameRecord;

// Freed by frame_record_clear, also after a failure.
Status frame_record_start(FrameRecord *record, const Frame *frame, Response *response,
                          Problem *problem);
void frame_record_clear(FrameRecord *record);

// What can be seen now, after frame_look; base_speed goes back to 0.
void frame_record_take(FrameRecord *record, Frame *frame);
void frame_record_finish(const FrameRecord *record, const Frame *frame, Response *response);

// Takes peaks at this instant, after frame_look.
void frame_record_peaks(Frame *frame);
// Statistics begin here: what came before is left out of the peaks.
void frame_record_forget(Frame *frame);
// Looks, and takes peaks and the energy balance.
void frame_record_note(Frame *frame);

#endif
