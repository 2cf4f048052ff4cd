// The only callback of the core: reports progress and asks whether to stop. A NULL Progress is
// allowed everywhere.
#ifndef CORE_BASE_PROGRESS_H
#define CORE_BASE_PROGRESS_H

#include <stdbool.h>
#include <stddef.h>

typedef struct Progress {
    void *context;
    // Called every few 10,000 steps with the fraction done, 0 to 1. False requests a stop.
    bool (*advance)(void *context, double fraction);
} Progress;

static inline bool progress_advance(const Progress *progress, double fraction) {
    return progress == NULL || progress->advance == NULL ||
           progress->advance(progress->context, fraction);
}

// Maps the progress of a part, 0 to 1, to a range of the whole. The whole never decreases, so two
// parts that run side by side may report in turn.
typedef struct ProgressRange {
    const Progress *whole;
    double from, share;
    double furthest; // largest fraction of the part so far, at first 0
} ProgressRange;

static inline bool progress_range_advance(void *context, double fraction) {
    ProgressRange *range = context;
    if (fraction > range->furthest)
        range->furthest = fraction;
    return progress_advance(range->whole, range->from + range->share * range->furthest);
}

static inline Progress progress_range_view(ProgressRange *range) {
    return (Progress){range, progress_range_advance};
}

#endif
