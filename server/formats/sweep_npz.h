// A sweep's table as NumPy's archive: an array for each column under its name; pointers without
// their first slash, texts as bytes. Not JSON or CSV (sweep_table.h). Used by answer.c and
// api/sweeps.c.
#ifndef SERVER_FORMATS_SWEEP_NPZ_H
#define SERVER_FORMATS_SWEEP_NPZ_H

#include "server/formats/segments.h"
#include "server/formats/sweep_source.h"
#include "server/util/bytes.h"

// What a layout reads from. Set `sweep` and `source`; all else is zero.
typedef struct SweepArchive {
    const Sweep *sweep;
    const SweepSource *source;
    SegmentSource columns;
    size_t axis_widths[SWEEP_AXES]; // of texts; 0: numbers
    size_t status_width;
    bool is_places; // texts are told by their place among the axis's values, from 0
    bool is_broken; // the source was: bytes read since are none of the archive's
} SweepArchive;

// Columns are numbered as in SweepSource, and the axes behind them. Reads from one of them.
void sweep_archive_read(void *context, size_t column, uint64_t offset, void *target, size_t size);

// `layout` borrows `archive`.
Status sweep_npz_lay(SweepArchive *archive, Segments *layout, Problem *problem);

void sweep_npz(const Sweep *sweep, Bytes *bytes);

#endif
