// The table of a sweep as JSON, CSV, NPY, NPZ and MAT: a row for each point that is made, with its
// number, the value of each axis, the metrics and a status. The same document for a whole answer
// and for rows that are read from a database piece by piece.
#ifndef SERVER_FORMATS_SWEEP_H
#define SERVER_FORMATS_SWEEP_H

#include "core/study/sweep.h"
#include "server/formats/segments.h"
#include "server/util/bytes.h"

enum {
    SWEEP_CELL_POINT,  // its number, rising
    SWEEP_CELL_STATUS, // SweepStatus
    SWEEP_CELL_METRIC, // the first of them
};
enum {
    SWEEP_PIECE = 256,                                  // rows that are read at once, at most
    SWEEP_COLUMNS_MAX = 2 + SWEEP_AXES + SWEEP_METRICS, // at most
};

// Rows of doubles.
typedef struct SweepSource {
    size_t rows; // that are there
    // Cell `cell` of rows first ... first + count - 1. False: they cannot be read any more.
    bool (*read)(void *context, size_t cell, size_t first, size_t count, double *target);
    void *context;
} SweepSource;

SweepSource sweep_source(const Sweep *sweep); // the answer's own table, which is borrowed

// A document in the making; all but the first three are zero at the start.
typedef struct SweepDocument {
    const Sweep *sweep; // of its table only the failures are used
    const SweepSource *source;
    const char *result; // under which it is served, for links; NULL: it is not
    bool is_broken;     // the source was: what was written since is not the table
    size_t part, row;   // of a text
    // Of an archive:
    SegmentSource columns;
    size_t widths[SWEEP_COLUMNS_MAX];  // bytes of a text; 0: numbers
    bool is_number[SWEEP_COLUMNS_MAX]; // an axis whose values are numbers
} SweepDocument;

// Appends the next piece of a text; false: that was the last one.
typedef bool (*SweepNext)(SweepDocument *document, Bytes *bytes);
SweepNext sweep_text(const char *extension); // "json", "csv"; NULL: it is an archive
// An archive, whose bytes are read when they are needed: "npz" with texts; "npy" and "mat" hold
// numbers alone, of a text its index among the axis's values, of a status SweepStatus. `layout`
// borrows the document. STATUS_CONFLICT: the source was broken.
Status sweep_lay(SweepDocument *document, const char *extension, Segments *layout,
                 Problem *problem);

// The whole document of an answer that has its table.
void sweep_write(const Sweep *sweep, const char *extension, Bytes *bytes);

#endif
