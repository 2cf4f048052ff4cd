#include "core/solve/base_motion_cursor.h"

#include <float.h>
#include <math.h>

enum { PROGRESS_VALUES = 1 << 18 }; // refined between two progress calls

void base_cursor_make(BaseCursor *cursor, const Base *base, double sample_rate) {
    *cursor = (BaseCursor){.base = base, .sample_rate = sample_rate};
    if (base->form != BASE_SAMPLED)
        return;
    const double ratio = base->interval * sample_rate, whole = nearbyint(ratio);
    if (whole >= 1 && whole < 1e9 && fabs(ratio - whole) <= 1e-12 * whole)
        cursor->ratio = (size_t)whole;
}

static Slice base_cursor_sine_slice(const BaseCursor *cursor, size_t n, double offset) {
    const Base *base = cursor->base;
    // In long double, so that late phases are as accurate as early ones.
    const long double turn = 6.28318530717958647692528676655900577L;
    const long double time = (long double)n / cursor->sample_rate + offset;
    const double phase = (double)fmodl(base->omega * time, turn);
    return (Slice){base->amplitude * sin(phase), base->amplitude * cos(phase), base->omega};
}

// Between knots j and j + 1, `part` of the way; slope per second.
static Slice base_cursor_sampled_slice(const Base *base, size_t j, double part) {
    if (j + 1 >= base->count)
        return (Slice){0, 0, 0};
    const double step = base->values[j + 1] - base->values[j];
    return (Slice){base->values[j] + part * step, step / base->interval, 0};
}

static Slice base_cursor_aligned_slice(const BaseCursor *cursor, size_t n, double offset) {
    const size_t j = cursor->ratio == 1 ? n : n / cursor->ratio;
    const double whole =
        cursor->ratio == 1 ? 0 : (double)(n - j * cursor->ratio) / (double)cursor->ratio;
    return base_cursor_sampled_slice(cursor->base, j, whole + offset / cursor->base->interval);
}

// The piece at `offset` after output sample n; returns how long it holds. Times count from the
// sample, so that knots keep their digits late in a run.
static double base_cursor_piece_slice(const BaseCursor *cursor, size_t n, double offset,
                                      Slice *slice) {
    const Base *base = cursor->base;
    const double sample = (double)n / cursor->sample_rate;
    const double clock = 8 * DBL_EPSILON * (sample + offset); // the clock's resolution
    *slice = (Slice){0, 0, 0};
    for (size_t i = 0; i < base->piece_count; i++) {
        const BasePiece *piece = &base->pieces[i];
        const double since = sample - piece->time + offset;
        if (since < -clock)
            return -since;
        const double t = fmax(since, 0), cosine = cos(base->omega * t), sine = sin(base->omega * t);
        const bool is_still = piece->value == 0 && piece->slope == 0;
        *slice = is_still ? (Slice){0, 0, 0}
                 : base->omega > 0
                     ? (Slice){piece->value * cosine + piece->slope * sine,
                               piece->slope * cosine - piece->value * sine, base->omega}
                     : (Slice){piece->value + piece->slope * t, piece->slope, 0};
    }
    return INFINITY;
}

bool base_cursor_interval(const BaseCursor *cursor, size_t n, Slice *slice) {
    switch (cursor->base->form) {
    case BASE_STILL:
        *slice = (Slice){0, 0, 0};
        return true;
    case BASE_SINE:
        *slice = base_cursor_sine_slice(cursor, n, 0);
        return true;
    case BASE_PIECES:
        return base_cursor_piece_slice(cursor, n, 0, slice) >=
               (1 - 8 * DBL_EPSILON * (double)(n + 1)) / cursor->sample_rate;
    case BASE_SAMPLED:
        break;
    }
    if (cursor->ratio == 0)
        return false;
    *slice = base_cursor_aligned_slice(cursor, n, 0);
    return true;
}

double base_cursor_slice(const BaseCursor *cursor, size_t n, double offset, Slice *slice) {
    const Base *base = cursor->base;
    const double time = (double)n / cursor->sample_rate + offset;
    *slice = (Slice){0, 0, 0};
    if (base->form == BASE_PIECES)
        return base_cursor_piece_slice(cursor, n, offset, slice);
    if (base->form == BASE_SINE)
        *slice = base_cursor_sine_slice(cursor, n, offset);
    if (base->form != BASE_SAMPLED)
        return INFINITY;
    if (cursor->ratio > 0) {
        *slice = base_cursor_aligned_slice(cursor, n, offset);
        return INFINITY;
    }
    const double place = floor(time / base->interval);
    if (place >= (double)base->count)
        return INFINITY;
    size_t j = (size_t)place;
    double knot = (double)(j + 1) * base->interval - time;
    if (knot <= 8 * DBL_EPSILON * time) { // below the clock's resolution
        j++;
        knot += base->interval;
    }
    *slice = base_cursor_sampled_slice(base, j, fmax(1 - knot / base->interval, 0));
    return j + 1 >= base->count ? INFINITY : knot;
}

double base_cursor_at(const BaseCursor *cursor, size_t n) {
    Slice slice;
    if (!base_cursor_interval(cursor, n, &slice))
        (void)base_cursor_slice(cursor, n, 0, &slice);
    return slice.value;
}

size_t base_cursor_refined_count(const Base *base, double sample_rate, size_t samples) {
    BaseCursor cursor;
    base_cursor_make(&cursor, base, sample_rate);
    if (cursor.ratio < 2 || base->count < 2)
        return 0;
    // Two more than the run's, so that the base does not seem to end within it.
    const size_t most = samples + 2;
    return base->count - 1 > most / cursor.ratio ? most : (base->count - 1) * cursor.ratio + 1;
}

Status base_cursor_refine(const Base *base, double sample_rate, size_t count, double *values,
                          const Progress *progress, Base *fine, Problem *problem) {
    const size_t ratio = (size_t)nearbyint(base->interval * sample_rate);
    size_t unreported = 0;
    for (size_t j = 0, n = 0; n < count; j++) {
        const double from = base->values[j];
        const double step = j + 1 < base->count ? base->values[j + 1] - from : 0;
        // In parts, for an interval may be as long as the run.
        for (size_t i = 0; i < ratio && n < count;) {
            const size_t left = ratio - i < count - n ? ratio - i : count - n;
            const size_t part = left < PROGRESS_VALUES ? left : PROGRESS_VALUES;
            for (size_t k = 0; k < part; k++)
                values[n + k] = from + (double)(i + k) / (double)ratio * step;
            i += part;
            n += part;
            unreported += part;
            if (unreported < PROGRESS_VALUES)
                continue;
            unreported = 0;
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
