// Ground motions in the text layouts they are published in: bytes in, samples in m/s^2 out.
// Not a scene's record (record.h) and no reader of files. Used by command/import.c.
#ifndef CORE_FORMATS_GROUND_MOTION_TEXT_H
#define CORE_FORMATS_GROUND_MOTION_TEXT_H

#include "core/base/field.h"

typedef enum AccelerationUnit {
    ACCELERATION_G,
    ACCELERATION_METRES,
    ACCELERATION_CENTIMETRES
} AccelerationUnit;
extern const char *const acceleration_unit_names[]; // "g", "m/s^2", "cm/s^2"; NULL-terminated
double acceleration_unit_size(int unit);            // [m/s^2]

// What the caller knows of the file.
typedef struct GroundMotionOptions {
    double interval; // [s]; NAN: the file must say
    int unit;        // AccelerationUnit; CHOICE_ABSENT: the file must say
} GroundMotionOptions;

typedef struct GroundMotionText {
    const char *layout; // "at2", "at2_value_first", "count_line", "time_acceleration", "columns" or
                        // "one_column"
    char *header;       // the text before the numbers, lines joined by "; "
    Reals samples;      // [m/s^2]
    double interval;    // [s]
    double start;       // time of the first sample, 0 where the file tells no times [s]
    int unit;           // of the file: AccelerationUnit
    int stated_unit;    // as its header has it; CHOICE_ABSENT: it has none
} GroundMotionText;

// Recognises the layout and reads the whole or nothing. Faults stand at "line 12, column 3".
// STATUS_UNREADABLE, STATUS_TOO_LARGE beyond what a record may hold, STATUS_NO_MEMORY. Freed by
// ground_motion_text_clear, which is not needed after a failure.
//
//   NPTS=  4000, DT= .01000 SEC     at2: a header up to such a line, then columns
//   4096    0.0100    NPTS, DT      at2_value_first: the same
//   4684 0.0100                     count_line: such a line, then one column
//   0.0200   -0.0003                time_acceleration: two columns, the first one rising evenly
//   0.00630   0.00364   ...         columns, one_column: all values in reading order
//
// A line "*** Begin data ***" ends a header, "*** End data ***" the numbers.
Status ground_motion_text_read(const char *text, size_t size, const GroundMotionOptions *request,
                               GroundMotionText *import, Problem *problem);
void ground_motion_text_clear(GroundMotionText *import);

#endif
