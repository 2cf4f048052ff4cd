// Signals are compared at the samples of the coarser one, because it is unknown between them.
#include "core/result/signal_comparison.h"

#include <math.h>
#include <stdlib.h>

#include "core/math/fft.h"

// clang-format off
const Field signal_comparison_fields[] = {
    FIELD_REAL(SignalComparison, from, "s", ANY, OPTIONAL, "the common span begins here"),
    FIELD_REAL(SignalComparison, to, "s", ANY, OPTIONAL, "and ends here"),
    FIELD_COUNT(SignalComparison, samples, NULL, AT_MIN(0), 0, "compared in it, at the rate of the coarser one"),
    FIELD_REAL(SignalComparison, rms, NULL, ANY, OPTIONAL, "of the reference within it"),
    FIELD_REAL(SignalComparison, other_rms, NULL, ANY, OPTIONAL, "of the other"),
    FIELD_REAL(SignalComparison, peak, NULL, ANY, OPTIONAL, "largest value of the reference within it"),
    FIELD_REAL(SignalComparison, other_peak, NULL, ANY, OPTIONAL, "of the other"),
    FIELD_REAL(SignalComparison, difference_rms, NULL, ANY, OPTIONAL, "of the difference"),
    FIELD_REAL(SignalComparison, difference_peak, NULL, ANY, OPTIONAL, "largest difference"),
    FIELD_REAL(SignalComparison, relative, NULL, ANY, OPTIONAL, "rms of the difference over the rms of the reference"),
    FIELD_REAL(SignalComparison, correlation, NULL, ANY, OPTIONAL, "Pearson's coefficient of correlation"),
    FIELD_END
};
// clang-format on

enum { WATCH_SAMPLES = 1 << 16 }; // compared between two checks of the progress

// A time within this part of a sample interval of a sample is that sample's.
static const double snap = 1e-6;

static double signal_value_at(const Signal *signal, double time) {
    // Far from time 0 rounding may put a time outside the signal: it belongs to the end.
    const double last = (double)(signal->count - 1);
    const double index = fmin(fmax((time - signal->start) * signal->rate, 0), last);
    const double near = nearbyint(index);
    if (fabs(index - near) < snap || index >= last)
        return signal->values[(size_t)near];
    const size_t at = (size_t)index;
    const double part = index - (double)at, from = signal->values[at];
    return from + part * (signal->values[at + 1] - from);
}

static double signal_end(const Signal *signal) {
    return signal->start + (double)(signal->count - 1) / signal->rate;
}

// Samples first ... first + count - 1 of `coarse` lie within both.
typedef struct Grid {
    const Signal *coarse;
    size_t first, count;
} Grid;

static Grid grid_make(const Signal *a, const Signal *b) {
    Grid grid = {a->rate <= b->rate ? a : b, 0, 0};
    if (a->count == 0 || b->count == 0)
        return grid;
    const double from = fmax(a->start, b->start), to = fmin(signal_end(a), signal_end(b));
    const double first = ceil((from - grid.coarse->start) * grid.coarse->rate - snap);
    const double last = fmin(floor((to - grid.coarse->start) * grid.coarse->rate + snap),
                             (double)(grid.coarse->count - 1));
    if (!(first >= 0) || !(last >= first))
        return grid;
    grid.first = (size_t)first;
    grid.count = (size_t)(last - first) + 1;
    return grid;
}

static double grid_time(const Grid *grid, size_t i) {
    return grid->coarse->start + (double)(grid->first + i) / grid->coarse->rate;
}

// Before sample i.
static bool signal_goes_on(const Progress *progress, size_t i) {
    return i % WATCH_SAMPLES != 0 || progress_advance(progress, 1);
}

SignalComparison signal_comparison_measure(const Signal *reference, const Signal *other,
                                           double part, const Progress *progress) {
    const Grid grid = grid_make(reference, other);
    const double none = (double)NAN;
    SignalComparison found = {none, none, grid.count, none, none, none,
                              none, none, none,       none, none, none};
    if (grid.count == 0)
        return found;
    double sx = 0, sy = 0, sxx = 0, syy = 0, sdd = 0, most_x = 0, most_y = 0, most_d = 0;
    for (size_t i = 0; i < grid.count; i++) {
        if (!signal_goes_on(progress, i))
            return found;
        const double t = grid_time(&grid, i), x = signal_value_at(reference, t),
                     y = signal_value_at(other, t);
        sx += x;
        sy += y;
        sxx += x * x;
        syy += y * y;
        sdd += (y - x) * (y - x);
        most_x = fmax(most_x, fabs(x));
        most_y = fmax(most_y, fabs(y));
        most_d = fmax(most_d, fabs(y - x));
    }
    const double n = (double)grid.count, mean_x = sx / n, mean_y = sy / n;
    double vxx = 0, vyy = 0, vxy = 0;
    for (size_t i = 0; i < grid.count; i++) {
        if (!signal_goes_on(progress, i))
            return found;
        const double t = grid_time(&grid, i);
        const double x = signal_value_at(reference, t), y = signal_value_at(other, t);
        vxx += (x - mean_x) * (x - mean_x);
        vyy += (y - mean_y) * (y - mean_y);
        vxy += (x - mean_x) * (y - mean_y);
        if (isnan(found.parting) && fabs(y - x) > part * most_x)
            found.parting = t;
    }
    found.from = grid_time(&grid, 0);
    found.to = grid_time(&grid, grid.count - 1);
    found.rms = sqrt(sxx / n);
    found.other_rms = sqrt(syy / n);
    found.peak = most_x;
    found.other_peak = most_y;
    found.difference_rms = sqrt(sdd / n);
    found.difference_peak = most_d;
    if (sxx > 0)
        found.relative = sqrt(sdd / sxx);
    if (vxx > 0 && vyy > 0)
        found.correlation = fmin(fmax(vxy / (sqrt(vxx) * sqrt(vyy)), -1), 1);
    return found;
}

Status signal_comparison_align(const Signal *reference, const Signal *other, size_t least,
                               Columns *pair, double *rate, Problem *problem) {
    const Grid grid = grid_make(reference, other);
    *rate = grid.coarse->rate;
    if (grid.count < least)
        return problem_set(problem, STATUS_LIMIT,
                           "only %zu samples are within both, at least %zu are needed", grid.count,
                           least);
    TRY(columns_allocate(pair, 2, grid.count, 0, problem));
    for (size_t i = 0; i < grid.count; i++) {
        pair->at[0].values[i] = signal_value_at(reference, grid_time(&grid, i));
        pair->at[1].values[i] = signal_value_at(other, grid_time(&grid, i));
    }
    return STATUS_OK;
}

// A constant without its mean is rounding noise, not motion.
static const double motionless = 1e-24; // of the energy

// On a grid of `rate` from the signal's own start, without its mean; zeros behind it.
static void signal_put_centred(const Signal *signal, double rate, size_t count, double *target,
                               size_t size) {
    double sum = 0, whole = 0, rest = 0;
    for (size_t i = 0; i < count; i++) {
        target[i] = signal_value_at(signal, signal->start + (double)i / rate);
        sum += target[i];
        whole += target[i] * target[i];
    }
    for (size_t i = 0; i < count; i++) {
        target[i] -= sum / (double)count;
        rest += target[i] * target[i];
    }
    for (size_t i = rest > motionless * whole ? count : 0; i < size; i++)
        target[i] = 0;
}

// energy[i]: of the first i values.
static void signal_energy(const double *values, size_t count, double *energy) {
    energy[0] = 0;
    for (size_t i = 0; i < count; i++)
        energy[i + 1] = energy[i] + values[i] * values[i];
}

static double signal_share(const double *energy, ptrdiff_t from, ptrdiff_t to) {
    return energy[to] - energy[from];
}

// Inputs of a correlation. Lags are in samples, of `other` behind the start of the reference.
typedef struct Lags {
    const double *products;     // by lag, negative ones from the end
    size_t size;                // of those
    const double *a, *b;        // energies
    ptrdiff_t a_count, b_count; // samples
} Lags;

// NAN with less than half of the shorter one in common.
static double signal_at_lag(const Lags *lags, ptrdiff_t lag) {
    const ptrdiff_t from = lag > 0 ? lag : 0;
    const ptrdiff_t to = lag + lags->b_count < lags->a_count ? lag + lags->b_count : lags->a_count;
    const ptrdiff_t shorter = lags->a_count < lags->b_count ? lags->a_count : lags->b_count;
    if (2 * (to - from) < shorter || to - from < 2)
        return (double)NAN;
    const double scale =
        sqrt(signal_share(lags->a, from, to)) * sqrt(signal_share(lags->b, from - lag, to - lag));
    const double product = lags->products[lag >= 0 ? (size_t)lag : lags->size - (size_t)(-lag)];
    return scale > 0 ? product / (double)lags->size / scale : (double)NAN;
}

// The lag of the largest correlation, on the parabola through it and its neighbours.
static double signal_best_lag(const Lags *lags, double centre, double most) {
    double best = (double)NAN, largest = -2;
    const ptrdiff_t from = (ptrdiff_t)ceil(fmax(centre - most, -(double)lags->b_count));
    const ptrdiff_t to = (ptrdiff_t)floor(fmin(centre + most, (double)lags->a_count));
    for (ptrdiff_t lag = from; lag <= to; lag++) {
        const double value = signal_at_lag(lags, lag);
        if (!(value > largest))
            continue;
        largest = value;
        best = (double)lag;
        const double before = signal_at_lag(lags, lag - 1), after = signal_at_lag(lags, lag + 1);
        const double curve = before - 2 * value + after;
        if (curve < 0 && before <= value && after <= value)
            best += 0.5 * (before - after) / curve;
    }
    return best;
}

static double signal_moved_correlation(const Signal *reference, const Signal *other, double shift) {
    Signal moved = *other;
    moved.start += shift;
    return signal_comparison_measure(reference, &moved, 1, NULL).correlation;
}

// The parabola is skewed where one signal ends within the other's span: of its vertex and the
// nearest sample, the one with the larger correlation.
static double signal_better_shift(const Signal *reference, const Signal *other, double whole,
                                  double vertex) {
    return signal_moved_correlation(reference, other, whole) >=
                   signal_moved_correlation(reference, other, vertex)
               ? whole
               : vertex;
}

Status signal_comparison_shift(const Signal *reference, const Signal *other, double most,
                               double *shift, Problem *problem) {
    const double rate = fmin(reference->rate, other->rate);
    const Signal *const both[2] = {reference, other};
    size_t counts[2], size = 1;
    *shift = (double)NAN;
    for (int i = 0; i < 2; i++)
        counts[i] =
            both[i]->count < 2
                ? 0
                : (size_t)floor((double)(both[i]->count - 1) / both[i]->rate * rate * (1 + 1e-12)) +
                      1;
    if (counts[0] < 2 || counts[1] < 2)
        return problem_set(problem, STATUS_LIMIT, "too few samples to find a shift");
    if (counts[0] + counts[1] > SIGNAL_COMPARISON_SHIFT_MAX)
        return problem_set(problem, STATUS_LIMIT,
                           "%zu samples are too many to find a shift, at most %d: give the shift, "
                           "or fewer samples",
                           counts[0] + counts[1], SIGNAL_COMPARISON_SHIFT_MAX);
    while (size < counts[0] + counts[1])
        size *= 2;
    Fft *forward = fft_new(size, FFT_FORWARD);
    Fft *backward = fft_new(size, FFT_BACKWARD);
    double *energies[2] = {calloc(counts[0] + 1, sizeof(double)),
                           calloc(counts[1] + 1, sizeof(double))};
    double *first = calloc(size + 2, sizeof *first);
    Status status = STATUS_OK;
    if (forward == NULL || backward == NULL || energies[0] == NULL || energies[1] == NULL ||
        first == NULL)
        status = problem_set(problem, STATUS_NO_MEMORY, "no memory to find a shift");
    for (int i = 0; i < 2 && status == STATUS_OK; i++) {
        signal_put_centred(both[i], rate, counts[i], fft_real(forward), size);
        signal_energy(fft_real(forward), counts[i], energies[i]);
        fft_run(forward);
        const double *made = fft_complex(forward);
        for (size_t k = 0; k < size + 2 && i == 0; k++)
            first[k] = made[k];
        double *product = fft_complex(backward);
        for (size_t k = 0; k < size / 2 + 1 && i == 1; k++) { // a times the conjugate of b
            const double re = first[2 * k], im = first[2 * k + 1];
            product[2 * k] = re * made[2 * k] + im * made[2 * k + 1];
            product[2 * k + 1] = im * made[2 * k] - re * made[2 * k + 1];
        }
    }
    if (status == STATUS_OK) {
        fft_run(backward);
        const Lags lags = {fft_real(backward),   size,
                           energies[0],          energies[1],
                           (ptrdiff_t)counts[0], (ptrdiff_t)counts[1]};
        // Without a shift `other` begins so many samples behind the reference.
        const double centre = (other->start - reference->start) * rate;
        const double lag = signal_best_lag(&lags, centre, most * rate);
        if (isnan(lag))
            status = problem_set(problem, STATUS_LIMIT,
                                 "no shift within %g s leaves half of the shorter one in common "
                                 "with the other, and both moving there",
                                 most);
        else
            *shift = signal_better_shift(reference, other, (nearbyint(lag) - centre) / rate,
                                         (lag - centre) / rate);
    }
    fft_free(forward);
    fft_free(backward);
    free(energies[0]);
    free(energies[1]);
    free(first);
    return status;
}
