#include "core/solve/refine.h"

#include <math.h>

#include "core/solve/cursor.h"

size_t refine_count(const Base *base, double sample_rate, size_t samples) {
    BaseCursor cursor;
    base_cursor_make(&cursor, base, sample_rate);
    if (cursor.ratio < 2 || base->count < 2)
        return 0;
    // Behind the run nothing is wanted; two more, so that it does not seem to end within it.
    const size_t most = samples + 2;
    return base->count - 1 > most / cursor.ratio ? most : (base->count - 1) * cursor.ratio + 1;
}

Base refine_base(const Base *base, double sample_rate, size_t count, double *values) {
    const size_t ratio = (size_t)nearbyint(base->interval * sample_rate);
    for (size_t j = 0, n = 0; n < count; j++) {
        const double from = base->values[j];
        const double step = j + 1 < base->count ? base->values[j + 1] - from : 0;
        for (size_t i = 0; i < ratio && n < count; i++, n++)
            values[n] = from + (double)i / (double)ratio * step;
    }
    Base fine = *base;
    fine.values = values;
    fine.count = count;
    fine.interval = 1 / sample_rate;
    return fine;
}
