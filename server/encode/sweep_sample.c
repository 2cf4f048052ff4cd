#include "server/encode/sweep_sample.h"

#include <math.h>
#include <stdlib.h>

void sweep_sample_clear(SweepSample *sample) {
    free(sample->low);
    free(sample->high);
    free(sample->is_there);
    *sample = (SweepSample){.cells = 0};
}

static void take(SweepSample *sample, size_t at, double value) {
    if (!isfinite(value))
        return;
    sample->low[at] = isnan(sample->low[at]) ? value : fmin(sample->low[at], value);
    sample->high[at] = isnan(sample->high[at]) ? value : fmax(sample->high[at], value);
}

Status sweep_sample_make(const SweepSource *source, size_t metrics, size_t cells, size_t points,
                         size_t (*cell_of)(const void *of, size_t point), const void *of,
                         SweepSample *sample) {
    double numbers[SWEEP_PIECE], values[SWEEP_PIECE];
    size_t among[SWEEP_PIECE], count;
    *sample = (SweepSample){cells, malloc((cells * metrics + 1) * sizeof(double)),
                            malloc((cells * metrics + 1) * sizeof(double)),
                            calloc(cells + 1, sizeof(bool))};
    if (sample->low == NULL || sample->high == NULL || sample->is_there == NULL)
        return STATUS_NO_MEMORY;
    for (size_t i = 0; i < cells * metrics; i++)
        sample->low[i] = sample->high[i] = (double)NAN;
    for (size_t row = 0; row < source->rows; row += count) {
        count = source->rows - row < SWEEP_PIECE ? source->rows - row : SWEEP_PIECE;
        if (!source->read(source->context, SWEEP_CELL_POINT, row, count, numbers))
            return STATUS_CONFLICT;
        if (numbers[0] >= (double)points)
            break;
        for (size_t i = 0; i < count; i++) {
            among[i] = numbers[i] < (double)points ? cell_of(of, (size_t)numbers[i]) : SIZE_MAX;
            if (among[i] < cells)
                sample->is_there[among[i]] = true;
        }
        for (size_t metric = 0; metric < metrics; metric++) {
            if (!source->read(source->context, SWEEP_CELL_METRIC + metric, row, count, values))
                return STATUS_CONFLICT;
            for (size_t i = 0; i < count; i++)
                if (among[i] < cells)
                    take(sample, metric * cells + among[i], values[i]);
        }
    }
    return STATUS_OK;
}
