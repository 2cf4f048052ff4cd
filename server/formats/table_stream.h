// One table on its way out in one format: what it owns, and how much of it was read. Texts come in
// pieces, binary formats in any part of their known size.
#ifndef SERVER_FORMATS_TABLE_STREAM_H
#define SERVER_FORMATS_TABLE_STREAM_H

#include <stddef.h>

#include "core/simulation/simulation.h"
#include "server/formats/format.h"

typedef struct TableStream {
    Table table;           // what it borrows is below
    const Column **chosen; // the table's list of columns
    Columns made;          // columns that are not the outcome's
    Impact *impacts;       // chosen ones, and their numbers
    size_t *numbers;
    Bytes members, end; // JSON
    Outcome *outcome;   // one reference, or NULL
    // Of a table whose cells are read from elsewhere; NULL: it is in memory.
    const bool *is_broken; // the cells cannot be read any more
    void (*release)(void *source);
    void *source;

    // Since table_stream_open.
    const TableFormat *format;
    Segments segments;
    uint64_t at, until; // of the segments
    TextPlace place;
    bool is_last; // `piece` is
    Bytes piece;
    size_t taken; // of the piece
} TableStream;

TableStream *table_stream_new(Outcome *outcome); // takes the reference; NULL without memory
void table_stream_free(void *stream);

// What is written: all of `columns`, with the first one as the axis or without one. They may be
// stream->made.
Status table_stream_columns(TableStream *stream, const Columns *columns, bool has_axis,
                            Problem *problem);
// The outcome's series over time, and its spectra over frequency.
Status table_stream_series(TableStream *stream, Problem *problem);
Status table_stream_psd(TableStream *stream, Problem *problem);
// Structs as columns (table_records).
Status table_stream_records(TableStream *stream, const Field *fields, const void *records,
                            size_t count, size_t size, Problem *problem);

// Impacts whose contact meets [from, to], of them the first `limit` whose number in the list,
// from 1, is at least `first`.
typedef struct ImpactWindow {
    double from, to; // [s]
    size_t first, limit;
} ImpactWindow;
// The outcome's impacts for `format`; the counts in JSON are those of all. With a window (NULL:
// none) JSON has the number of each, and behind the list how many meet [from, to].
Status table_stream_impacts(TableStream *stream, const TableFormat *format,
                            const ImpactWindow *window, Problem *problem);

// Smallest and largest values of the rows in at most `points` buckets of one size, except the last.
Status table_stream_downsample(TableStream *stream, size_t points, Problem *problem);

// STATUS_BUSY: the cells have changed since the document was begun.
Status table_stream_check(const TableStream *stream, Problem *problem);
// Makes it ready to be read. STATUS_LIMIT where the format has no room.
Status table_stream_open(TableStream *stream, const TableFormat *format, Problem *problem);
// Whether a text needs less than that.
bool table_stream_is_below(const TableStream *stream, size_t bytes);
uint64_t table_stream_size(const TableStream *stream); // UINT64_MAX: unknown
// Appends the whole, instead of the functions below.
void table_stream_write(TableStream *stream, Bytes *bytes);
// Only bytes first ... first + size - 1 from now on. For sizes that are known.
void table_stream_cut(TableStream *stream, uint64_t first, uint64_t size);
// The next bytes, at most `size`; 0 at the end, -1 without memory.
ptrdiff_t table_stream_next(TableStream *stream, char *target, size_t size);

#endif
