// The table of a sweep as JSON, CSV, NPY, NPZ and MAT: a row for each point that is made, with its
// number, the value of each axis, the metrics and a status. The same document for a whole answer
// and for rows that are read from a database piece by piece.
#ifndef SERVER_FORMATS_SWEEP_H
#define SERVER_FORMATS_SWEEP_H

#include "core/study/sweep.h"
#include "server/formats/format.h"
#include "server/util/bytes.h"

enum {
    SWEEP_CELL_POINT,  // its number, rising
    SWEEP_CELL_STATUS, // SweepStatus
    SWEEP_CELL_METRIC, // the first of them
};

// Rows of doubles.
typedef struct SweepSource {
    size_t rows; // that are there
    // Cell `cell` of rows first ... first + count - 1. False: they cannot be read any more.
    bool (*read)(void *context, size_t cell, size_t first, size_t count, double *target);
    void *context;
} SweepSource;

SweepSource sweep_source(const Sweep *sweep); // the answer's own table, which is borrowed

// A table to be written. Set the first three; it is neither moved nor changed until then.
typedef struct SweepDocument {
    const Sweep *sweep; // of its table only the failures are used
    const SweepSource *source;
    const char *result;  // under which it is served, for links; NULL: it is not
    bool is_broken;      // the source was: what was written since is not the table
    TableSource columns; // by sweep_document_table
} SweepDocument;

// As a table for the formats but SVG; it borrows the document. NPZ has texts; NPY and MAT hold
// numbers alone, of a text its index among the axis's values, of a status SweepStatus.
Table sweep_document_table(SweepDocument *document);

// The whole document of an answer that has its table.
void sweep_write(const Sweep *sweep, const char *extension, Bytes *bytes);

#endif
