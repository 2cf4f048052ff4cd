// What ONE output format is; encoders.c lists all. An encoder turns named columns into bytes, piece
// by piece or all at once (encoding.h does both). Used by encoding.c, api/ and cli/run.c.
#ifndef SERVER_FORMATS_FORMAT_H
#define SERVER_FORMATS_FORMAT_H

#include "core/base/columns.h"
#include "server/formats/segments.h"
#include "server/util/bytes.h"

// Columns over an axis: a time series over time, or a spectrum over frequency; or without one.
typedef struct Table {
    const char *axis_name, *axis_unit; // "time", "s"; NULL: no axis
    double axis_rate; // axis value of row i is (first + i) / axis_rate, or, if axis is not NULL,
                      // axis[i]
    size_t
        first; // the first row's index: rows first ... first + count - 1 of the columns are written
    size_t count;
    const double *axis;           // may be NULL; indexed like the columns
    const Column *const *columns; // the chosen ones
    size_t column_count;
    // 0: rows are samples. Else each row stands for so many (the last for what is left of
    // `samples`) from number `first` on: it lies at (first + i bucket) / axis_rate and is row i of
    // the columns, which come in pairs, "NAME_min" and "NAME_max".
    size_t bucket, samples;
    // Where the columns' numbers lie instead, by their place in `columns`; NULL: in memory. For
    // formats that are laid out.
    const SegmentSource *source;
} Table;

// Where the values of a column, or of the axis, that are written begin.
static inline const double *table_values(const Table *table, const double *values) {
    return values + (table->bucket > 0 ? 0 : table->first);
}

static inline void table_lay_column(const Table *table, size_t column, Segments *layout) {
    if (table->source != NULL)
        segments_source(layout, table->source, column, sizeof(double) * (uint64_t)table->count);
    else
        segments_values(layout, table_values(table, table->columns[column]->values), table->count);
}

// A division, so that row 50 at 1000 Hz reads 0.05.
static inline double table_time(const Table *table, size_t row) {
    const size_t step = table->bucket > 0 ? table->bucket : 1;
    return (double)(table->first + row * step) / table->axis_rate;
}

// How far a text has come.
typedef struct TextPlace {
    size_t part, row;
} TextPlace;

typedef struct TableFormat {
    const char *extension;    // "csv"
    const char *content_type; // "text/csv; charset=utf-8"
    bool is_binary;           // Range requests make sense
    // One of the two. What the whole document is made of, where every byte's place is known...
    Status (*lay)(const Table *table, Segments *layout, Problem *problem);
    // ... or the next piece of a text, appended to `bytes`; false: that was the last one.
    bool (*next)(const Table *table, TextPlace *place, Bytes *bytes);
} TableFormat;

enum { ENCODER_PIECE_NUMBERS = 2048 }; // of a text's piece, about

extern const TableFormat *const encoders[];            // NULL-terminated; json first
const TableFormat *format_find(const char *extension); // NULL if there is none

#endif
