// A table of numbers, and the formats that can be written of one; table_stream.h sends it.
#ifndef SERVER_FORMATS_FORMAT_H
#define SERVER_FORMATS_FORMAT_H

#include <stdint.h>

#include "core/base/columns.h"
#include "core/base/field.h"
#include "server/util/bytes.h"

typedef struct TableColumn {
    const char *name, *unit;
    // Texts that the numbers of the column are indices of; NULL: the column has numbers.
    const char *const *texts;
    size_t text_count;
    bool is_json; // the texts are JSON scalars, else bare words
} TableColumn;

// Columns whose numbers are not in memory.
typedef struct TableSource {
    void *context;
    TableColumn (*column)(const void *context, size_t column);
    // Rows first ... first + count - 1 of a column. False: they cannot be read any more.
    bool (*read)(void *context, size_t column, size_t first, size_t count, double *target);
    // JSON: the members before the first column and behind the last one.
    void (*put_head)(const void *context, Bytes *bytes);
    void (*put_end)(const void *context, Bytes *bytes);
} TableSource;

struct Table;

typedef struct Segment {
    uint64_t start, size;      // in the document
    const struct Table *table; // borrowed; NULL: text
    size_t text;               // where it begins in `text` of Segments
    size_t column, width;      // of the table; bytes of a text, 0: numbers
    bool is_numeric;           // the column's texts are numbers
} Segment;

// A document as a list of segments: headers, and columns of a table.
// Its size is known, and any part of it can be read alone, without a copy of the whole. All zero is
// empty. Once it failed (memory) it stays so, like Bytes.
typedef struct Segments {
    Segment *at;
    size_t count, room;
    uint64_t size;
    Bytes text;
    bool is_failed;
} Segments;

void segments_clear(Segments *segments);
void segments_put(Segments *segments, const void *data, size_t size); // copied
void segments_text(Segments *segments, Bytes *text);                  // copied, and cleared
void segments_number(Segments *segments, uint64_t value,
                     size_t size); // its `size` lowest bytes, lowest first
void segments_fill(Segments *segments, char with, size_t count);
// A column of `table`, which is borrowed: texts of `width` bytes, filled up with zeros; or with
// width 0 numbers: those that all texts are, else the indices of texts.
void segments_column(Segments *segments, const struct Table *table, size_t column, size_t width);
void segments_join(Segments *segments,
                   const Segments *other); // behind; borrows what `other` borrows

// Copies `size` bytes from `start` on; both within the document.
void segments_read(const Segments *segments, uint64_t start, void *target, size_t size);
void segments_write(const Segments *segments, Bytes *bytes); // appends the whole
uint32_t segments_crc32(const Segments *segments);           // of the whole

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
    const TableSource *source; // in place of `columns`, which are NULL then; NULL: in memory
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

// Columns with the axis, if there is one: it is column 0.
size_t table_width(const Table *table);
TableColumn table_column(const Table *table, size_t column);
// Rows first ... first + count - 1 of a column. False: they cannot be read any more.
bool table_read(const Table *table, size_t column, size_t first, size_t count, double *target);
// Whether a column has texts, and all of them are numbers.
bool table_column_is_numeric(const TableColumn *column);
// A text without the quotes of a JSON string; those of columns have none inside.
const char *table_bare(const TableColumn *column, double value, size_t *length);

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
    Status (*layout)(const Table *table, Segments *segments, Problem *problem);
    // ... text: appends the next piece; false: it was the last one.
    bool (*next)(const Table *table, TextPlace *place, Bytes *bytes);
} TableFormat;

enum {
    FORMAT_PIECE_NUMBERS = 2048, // of a text's piece, about
    TABLE_PIECE = 256,           // rows of a binary format that are read at once, at most
};

// JSON: {"sample_rate", "start", "count", "channels"}. CSV: a header with units, a row per sample.
// NPY: float64 of shape (rows, axis and columns). NPZ: an NPY for each. MAT: MATLAB's level 5, a
// vector for each. SVG: a chart.
extern const TableFormat format_json, format_csv, format_npy, format_npz, format_mat, format_svg;
// NULL-terminated; json first.
extern const TableFormat *const table_formats[], *const table_formats_without_chart[];
const TableFormat *format_find(const char *extension); // NULL if there is none

// Appends the whole document. STATUS_LIMIT where the format cannot hold it; a limit of `bytes` is
// reported by is_failed.
Status format_write(const TableFormat *format, const Table *table, Bytes *bytes, Problem *problem);

enum { MAT_NAME_SIZE = 64 }; // 63 characters, MATLAB's longest, and a NUL
// A variable's name for MATLAB: letters, digits and underscores, a letter first.
void mat_name(const char *name, char target[MAT_NAME_SIZE]);

enum { ZIP_NAME_MAX = 79 };

// A ZIP archive being written to `segments`, of members that are stored as they are: no times, no
// compression. No ZIP64: what would need it is refused. All zero but that is empty.
typedef struct Zip {
    Segments *segments;
    Segments directory; // the end of the archive
    size_t count;
} Zip;

// Appends a member; borrows what `content` borrows. STATUS_LIMIT from 4 GiB on.
Status zip_put(Zip *zip, const char *name, const Segments *content, Problem *problem);
// Appends the directory and clears `zip`, also when it fails.
Status zip_end(Zip *zip, Problem *problem);

// The minimum and the maximum of `count` values, at least one, all of them finite.
void downsample_extremes(const double *values, size_t count, double *min, double *max);

// Values first ... first + count - 1 of each column in buckets of `bucket`, the last one perhaps
// shorter: two columns for each, "NAME_min" and "NAME_max". Cleared by columns_clear.
Status downsample(const Column *const *columns, size_t column_count, size_t first, size_t count,
                  size_t bucket, Columns *buckets, Problem *problem);

#endif
