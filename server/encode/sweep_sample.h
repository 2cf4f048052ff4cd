// A sweep's rows brought down to as many cells as a picture has: of each metric the least and the
// largest number that falls into each. Not the picture. Used by chart_sweep.c and its maps.
#ifndef SERVER_ENCODE_SWEEP_SAMPLE_H
#define SERVER_ENCODE_SWEEP_SAMPLE_H

#include "server/encode/sweep_source.h"

typedef struct SweepSample {
    size_t cells;
    double *low, *high; // cell by cell of one metric after the other; NAN: none
    bool *is_there;     // whether a cell has any row at all, be it a failed one
} SweepSample;

// `cell_of` says into which cell a point falls: SIZE_MAX for none. Rows are read once, those of
// points from `points` on not at all. STATUS_CONFLICT where they cannot be. Cleared by
// sweep_sample_clear in any case.
Status sweep_sample_make(const SweepSource *source, size_t metrics, size_t cells, size_t points,
                         size_t (*cell_of)(const void *of, size_t point), const void *of,
                         SweepSample *sample);
void sweep_sample_clear(SweepSample *sample);

#endif
