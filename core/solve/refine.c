#include "core/solve/refine.h"

#include <math.h>

#include "core/solve/base_motion_cursor.h"

enum { WATCH_VALUES = 1 << 18 }; // made between two looks at the progress

size_t refine_count(const Base *base, double sample_rate, size_t samples) {
    BaseCursor cursor;
    base_cursor_make(&cursor, base, sample_rate);
    if (cursor.ratio < 2 || base->count < 2)
        return 0;
    // Behind the run nothing is wanted; two more, so that it does not seem to end within it.
    const size_t most = samples + 2;
    return base->count - 1 > most / cursor.ratio ? most : (base->count - 1) * cursor.ratio + 1;
}

Status refine_base(const Base *base, double sample_rate, size_t count, double *values,
                   const Progress *progress, Base *fine, Problem *problem) {
    const size_t ratio = (size_t)nearbyint(base->interval * sample_rate);
    size_t unwatched = 0;
    for (size_t j = 0, n = 0; n < count; j++) {
        const double from = base->values[j];
        const double step = j + 1 < base->count ? base->values[j + 1] - from : 0;
        // A part of an interval at a time: one may be as long as the run.
        for (size_t i = 0; i < ratio && n < count;) {
            const size_t left = ratio - i < count - n ? ratio - i : count - n;
            const size_t part = left < WATCH_VALUES ? left : WATCH_VALUES;
            for (size_t k = 0; k < part; k++)
                values[n + k] = from + (double)(i + k) / (double)ratio * step;
            i += part;
            n += part;
            unwatched += part;
            if (unwatched < WATCH_VALUES)
                continue;
            unwatched = 0;
            if (!progress_advance(progress, 0))
                return problem_set(problem, STATUS_CANCELLED, "cancelled before the first step");
        }
    }
    *fine = *base;
    fine->values = values;
    fine->count = count;
    fine->interval = 1 / sample_rate;
    return STATUS_OK;
}
