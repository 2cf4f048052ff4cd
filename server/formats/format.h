// A table of numbers, and the formats that can be written of one. stream.h sends it.
#ifndef SERVER_FORMATS_FORMAT_H
#define SERVER_FORMATS_FORMAT_H

#include "core/base/columns.h"
#include "core/base/field.h"
#include "server/formats/segments.h"
#include "server/util/bytes.h"

// Columns over an axis: a time series over time, or a spectrum over frequency; or without one. All
// of it is borrowed.
typedef struct Table {
    const char *axis_name, *axis_unit; // "time", "s"; NULL: no axis
    double axis_rate;    // axis value of row i: (first + i) / axis_rate, or axis[first + i]
    size_t first, count; // rows first ... first + count - 1 of the columns are written
    const double *axis;  // may be NULL
    const Column *const *columns;
    size_t column_count;
    // 0: rows are samples. Else each row stands for so many (the last for what is left of
    // `samples`) from number `first` on: it lies at (first + i bucket) / axis_rate and is row i of
    // the columns, which come in pairs, "NAME_min" and "NAME_max".
    size_t bucket, samples;
    // Columns whose numbers are elsewhere, by their place in `columns`; NULL: in memory. For binary
    // formats.
    const SegmentSource *source;
    // In text formats a row may be a struct in place of columns; texts of choices are words.
    const Field *fields; // NULL: columns
    const void *records;
    size_t record_size;
    const size_t *numbers; // JSON: "number" of each record; NULL: none
    // JSON: members before and behind the lists, NULL for the usual ones.
    const char *members, *end;
} Table;

// The first of the values of a column, or of the axis, that are written.
static inline const double *table_values(const Table *table, const double *values) {
    return values + (table->bucket > 0 ? 0 : table->first);
}

// A division, so that row 50 at 1000 Hz reads 0.05.
static inline double table_time(const Table *table, size_t row) {
    const size_t step = table->bucket > 0 ? table->bucket : 1;
    return (double)(table->first + row * step) / table->axis_rate;
}

// Appends the numbers of a column, or of the axis, which there is.
void table_lay_column(const Table *table, size_t column, Segments *segments);
void table_lay_axis(const Table *table, Segments *segments);

// Structs as columns by their Field rows, a row for each of `count` structs of `size` bytes. A
// choice is its index, from 0; an absent member is NAN; texts and lists are left out. Cleared by
// columns_clear.
Status table_records(const Field *fields, const void *records, size_t count, size_t size,
                     Columns *columns, Problem *problem);

// How much of a text is written.
typedef struct TextPlace {
    size_t part, row;
} TextPlace;

typedef struct TableFormat {
    const char *extension;    // "csv"
    const char *content_type; // "text/csv; charset=utf-8"
    bool is_binary;           // Range requests make sense
    // One of the two, or none where TableStream's segments are filled already. Binary: appends all
    // segments of the document ...
    Status (*lay)(const Table *table, Segments *segments, Problem *problem);
    // ... text: appends the next piece; false: it was the last one.
    bool (*next)(const Table *table, TextPlace *place, Bytes *bytes);
} TableFormat;

enum { FORMAT_PIECE_NUMBERS = 2048 }; // of a text's piece, about

// JSON: {"sample_rate", "start", "count", "channels"}. CSV: a header with units, a row per sample.
// NPY: float64 of shape (rows, axis and columns). NPZ: an NPY for each. MAT: MATLAB's level 5, a
// vector for each. SVG: a chart.
extern const TableFormat format_json, format_csv, format_npy, format_npz, format_mat, format_svg;
extern const TableFormat *const table_formats[];       // NULL-terminated; json first
const TableFormat *format_find(const char *extension); // NULL if there is none

// Appends the whole document. STATUS_LIMIT where the format has no room for it; `bytes` reports
// itself what it has no room for.
Status format_write(const TableFormat *format, const Table *table, Bytes *bytes, Problem *problem);

// The header of an NPY file of `type` ("<f8", "|S7"); `columns` 0: of one dimension.
void npy_put_header(Segments *segments, const char *type, size_t rows, size_t columns);

enum { MAT_NAME_SIZE = 64 }; // 63 characters, MATLAB's longest, and a NUL
// A variable's name for MATLAB: letters, digits and underscores, a letter first.
void mat_name(const char *name, char target[MAT_NAME_SIZE]);

#endif
