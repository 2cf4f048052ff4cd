// Ground motions in the text layouts in which they are published: bytes in, accelerations out.
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
    double interval; // [s]; NAN: stated by the file
    int unit;        // AccelerationUnit; CHOICE_ABSENT: stated by the file
} GroundMotionOptions;

typedef struct GroundMotionText {
    const char *layout; // "at2", "at2_value_first", "count_line", "time_acceleration", "columns" or
                        // "one_column"
    char *header;       // the lines above the numbers, joined by "; "
    Reals samples;      // [m/s^2]
    double interval;    // [s]
    double start;       // time of the first sample; 0 in a file without times [s]
    int unit;           // of the file: AccelerationUnit
    int stated_unit;    // as its header states it; CHOICE_ABSENT: not stated
} GroundMotionText;

// Recognises the layout and reads the file. Faults are at "line 12, column 3". STATUS_UNREADABLE,
// STATUS_TOO_LARGE beyond samples_max, STATUS_NO_MEMORY; `motion` is then empty. Released by
// ground_motion_text_clear.
//
//   NPTS=  4000, DT= .01000 SEC     at2: a header that ends with such a line, then columns
//   4096    0.0100    NPTS, DT      at2_value_first: likewise
//   4684 0.0100                     count_line: such a line, then one column
//   0.0200   -0.0003                time_acceleration: two columns, the first rises evenly
//   0.00630   0.00364   ...         columns, one_column: all values in reading order
//
// A line "*** Begin data ***" ends a header, "*** End data ***" the numbers.
Status ground_motion_text_read(const char *text, size_t size, size_t samples_max,
                               const GroundMotionOptions *options, GroundMotionText *motion,
                               Problem *problem);
void ground_motion_text_clear(GroundMotionText *motion);

#endif
