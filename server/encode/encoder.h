// What ONE output format is; encoders.c lists all. An encoder turns named columns into bytes.
// Used by api/results.c and command/run.c.
#ifndef SERVER_ENCODE_ENCODER_H
#define SERVER_ENCODE_ENCODER_H

#include "core/base/columns.h"
#include "server/base/bytes.h"

// Columns over an axis: a time series over time, or a spectrum over frequency.
typedef struct Table {
    const char *axis_name, *axis_unit; // "time", "s"
    double axis_rate; // axis value of row i is (first + i) / axis_rate, or, if axis is not NULL,
                      // axis[i]
    size_t
        first; // the first row's index: rows first ... first + count - 1 of the columns are written
    size_t count;
    const double *axis;           // may be NULL; indexed like the columns
    const Column *const *columns; // the chosen ones
    size_t column_count;
} Table;

typedef struct Encoder {
    const char *extension;    // "csv"
    const char *content_type; // "text/csv; charset=utf-8"
    bool is_binary;           // Range requests make sense
    // Appends the whole document. json.c's shape for series: {"sample_rate", "start", "count",
    // "channels"}.
    void (*write)(const Table *table, Bytes *bytes);
} Encoder;

extern const Encoder *const encoders[];             // NULL-terminated; json first
const Encoder *encoder_find(const char *extension); // NULL if there is none

#endif
