#include "core/solve/base_motion_cursor.h"

#include <float.h>
#include <math.h>

void base_cursor_make(BaseCursor *cursor, const Base *base, double sample_rate) {
    *cursor = (BaseCursor){.base = base, .sample_rate = sample_rate};
    if (base->form != BASE_SAMPLED)
        return;
    const double ratio = base->interval * sample_rate, whole = nearbyint(ratio);
    if (whole >= 1 && whole < 1e9 && fabs(ratio - whole) <= 1e-12 * whole)
        cursor->ratio = (size_t)whole;
}

static Slice sine_slice(const BaseCursor *cursor, size_t n, double offset) {
    const Base *base = cursor->base;
    // Timed and reduced in long double, so that late phases are as good as early ones.
    const long double turn = 6.28318530717958647692528676655900577L;
    const long double time = (long double)n / cursor->sample_rate + offset;
    const double phase = (double)fmodl(base->omega * time, turn);
    return (Slice){base->amplitude * sin(phase), base->amplitude * cos(phase), base->omega};
}

// Between knots j and j + 1, `part` of the way; slope per second.
static Slice sampled_slice(const Base *base, size_t j, double part) {
    if (j + 1 >= base->count)
        return (Slice){0, 0, 0};
    const double step = base->values[j + 1] - base->values[j];
    return (Slice){base->values[j] + part * step, step / base->interval, 0};
}

static Slice aligned_slice(const BaseCursor *cursor, size_t n, double offset) {
    const size_t j = cursor->ratio == 1 ? n : n / cursor->ratio;
    const double whole =
        cursor->ratio == 1 ? 0 : (double)(n - j * cursor->ratio) / (double)cursor->ratio;
    return sampled_slice(cursor->base, j, whole + offset / cursor->base->interval);
}

// The piece that holds `offset` after output sample n; returns for how long. Times are taken from
// the sample on, so that knots keep their digits late in a run.
static double piece_slice(const BaseCursor *cursor, size_t n, double offset, Slice *slice) {
    const Base *base = cursor->base;
    const double sample = (double)n / cursor->sample_rate;
    const double clock = 8 * DBL_EPSILON * (sample + offset); // nearer is as good as there
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
        *slice = sine_slice(cursor, n, 0);
        return true;
    case BASE_PIECES:
        return piece_slice(cursor, n, 0, slice) >=
               (1 - 8 * DBL_EPSILON * (double)(n + 1)) / cursor->sample_rate;
    case BASE_SAMPLED:
        break;
    }
    if (cursor->ratio == 0)
        return false;
    *slice = aligned_slice(cursor, n, 0);
    return true;
}

double base_cursor_slice(const BaseCursor *cursor, size_t n, double offset, Slice *slice) {
    const Base *base = cursor->base;
    const double time = (double)n / cursor->sample_rate + offset;
    *slice = (Slice){0, 0, 0};
    if (base->form == BASE_PIECES)
        return piece_slice(cursor, n, offset, slice);
    if (base->form == BASE_SINE)
        *slice = sine_slice(cursor, n, offset);
    if (base->form != BASE_SAMPLED)
        return INFINITY;
    if (cursor->ratio > 0) {
        *slice = aligned_slice(cursor, n, offset);
        return INFINITY;
    }
    const double place = floor(time / base->interval);
    if (place >= (double)base->count)
        return INFINITY;
    size_t j = (size_t)place;
    double knot = (double)(j + 1) * base->interval - time;
    if (knot <= 8 * DBL_EPSILON * time) { // as good as there
        j++;
        knot += base->interval;
    }
    *slice = sampled_slice(base, j, fmax(1 - knot / base->interval, 0));
    return j + 1 >= base->count ? INFINITY : knot;
}

double base_cursor_at(const BaseCursor *cursor, size_t n) {
    Slice slice;
    if (!base_cursor_interval(cursor, n, &slice))
        (void)base_cursor_slice(cursor, n, 0, &slice);
    return slice.value;
}
