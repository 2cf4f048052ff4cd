// Variable projection: for given start, end and L the pulse f is fixed but for its amplitude A and
// the baseline b, which are linear. What remains is to minimise the sum of squares of x - A f - b
// over start, end and L. The force jumps where a contact starts and ends, so the sum is smooth only
// while the same samples are in contact: within a box, start and end stay in their gaps between
// samples. Levenberg and Marquardt's method finds the minimum of a box; a search moves from box to
// box.
#include "core/drop_test/pulse_fit.h"

#include <float.h>
#include <math.h>
#include <string.h>

#include "core/base/status.h"

// e from 2.7, which only noise causes, to 0.01.
static const double decay_min = -1, decay_max = 4.6;

FitBox fit_box_make(long first, long last, long gaps) {
    return (FitBox){
        .least = {(double)(first - gaps), (double)last, decay_min},
        .most = {(double)first, (double)(last + gaps), decay_max},
        .first = first - gaps + 1,
        .last = last + gaps - 1,
    };
}

bool pulse_fit_model(const FitWindow *window, const FitPoint *point, PulseModel *model,
                     double *contact_time) {
    const double length = point->part[FIT_END] - point->part[FIT_START];
    *model = pulse_model_make_lasting(point->part[FIT_DECAY], window->pull_rate * length,
                                      window->separation);
    *contact_time = length / model->length;
    return length > 0 && isfinite(model->length);
}

// The samples in contact; false: there are none.
static bool fit_samples(const FitWindow *window, const FitPoint *point, const FitBox *box,
                        long *first, long *last) {
    const long end = (long)(window->blocks * window->per_block) - 1;
    *first = (long)fmax(ceil(point->part[FIT_START]), (double)box->first);
    *last = (long)fmin(floor(point->part[FIT_END]), (double)box->last);
    return *first >= 0 && *last <= end && *first <= *last;
}

// The mean of `count` values about s at distances `step`, by the second difference over their
// width; higher terms do not matter for a pulse over a block.
static double fit_mean(const PulseModel *model, double s, double step, long count) {
    const double middle = pulse_model_force(model, s), half = step * (double)count / 2;
    if (count == 1)
        return middle;
    const double about =
        (pulse_model_force(model, s - half) + pulse_model_force(model, s + half)) / 2;
    return middle + (about - middle) * (1 - 1 / ((double)count * (double)count)) / 3;
}

// The pulse of unit amplitude over blocks; it is not 0 in those from *from to *to.
static bool fit_pulse(const FitWindow *window, const FitPoint *point, long first, long last,
                      double *f, size_t *from, size_t *to) {
    PulseModel model;
    double T;
    if (!pulse_fit_model(window, point, &model, &T))
        return false;
    const long m = (long)window->per_block;
    const long begin = first / m, end = last / m;
    *from = (size_t)begin;
    *to = (size_t)end;
    // In whole blocks the oscillation follows from the two blocks before.
    const double step = (double)m / T, x = sqrt(fabs(model.turn)) * step;
    const double fall = exp(-model.decay * step), back = fall * fall;
    const double turn = 2 * fall * (model.turn > 0 ? cos(x) : cosh(x));
    double before = 0, here = 0;
    for (long k = begin; k <= end; k++) {
        const long lowest = k * m > first ? k * m : first;
        const long highest = k * m + m - 1 < last ? k * m + m - 1 : last;
        const bool is_whole = highest - lowest + 1 == m;
        double value;
        if (is_whole && k >= begin + 3) {
            value = turn * here - back * before + model.pull;
        } else {
            const double centre = (double)lowest + (double)(highest - lowest) / 2;
            value = fit_mean(&model, (centre - point->part[FIT_START]) / T, 1 / T,
                             highest - lowest + 1);
        }
        before = here;
        here = value - model.pull;
        f[k] = is_whole ? value : value * (double)(highest - lowest + 1) / (double)m;
    }
    return true;
}

static FitResidual fit_residual_of(const FitWindow *window, const double *f, size_t from,
                                   size_t to) {
    const double n = (double)window->blocks, m = (double)window->per_block;
    double sum = 0, square = 0, product = 0;
    for (size_t k = from; k <= to; k++) {
        sum += f[k];
        square += f[k] * f[k];
        product += f[k] * window->mean[k];
    }
    const double ff = square - sum * sum / n, fx = product - sum * window->sum / n;
    const double A = fx / ff, b = (window->sum - A * sum) / n;
    if (!(ff > 0) || !(A > 0))
        return (FitResidual){.sum = (double)INFINITY};
    // A difference of sums loses the digits of small residuals: those are summed directly.
    double left = 0;
    for (size_t k = from; k <= to; k++) {
        const double r = window->mean[k] - A * f[k] - b;
        left += r * r - (window->mean[k] - b) * (window->mean[k] - b);
    }
    double direct = 0;
    const double all = window->square - 2 * b * window->sum + n * b * b;
    if (left + all < 1e-6 * all) {
        for (size_t k = 0; k < window->blocks; k++) {
            const double r = window->mean[k] - b - (k >= from && k <= to ? A * f[k] : 0);
            direct += r * r;
        }
        left = direct;
    } else {
        left += all;
    }
    return (FitResidual){.sum = m * left, .amplitude = A, .baseline = b, .model_square = m * ff};
}

static FitResidual fit_residual_at(const FitWindow *window, const FitPoint *point,
                                   const FitBox *box) {
    double f[FIT_BLOCKS_MAX];
    long first, last;
    size_t from, to;
    if (!fit_samples(window, point, box, &first, &last) ||
        !fit_pulse(window, point, first, last, f, &from, &to))
        return (FitResidual){.sum = (double)INFINITY};
    return fit_residual_of(window, f, from, to);
}

// Slope and curvature of half the sum of squares, by differences of the pulse with the same samples
// in contact; amplitude and baseline are projected out.
static bool fit_derive(const FitWindow *window, const FitBox *box, PulseFit *fit) {
    double f[FIT_BLOCKS_MAX], above[FIT_BLOCKS_MAX], d[FIT_PARTS][FIT_BLOCKS_MAX];
    long first, last;
    size_t from, to;
    if (!fit_samples(window, &fit->at, box, &first, &last) ||
        !fit_pulse(window, &fit->at, first, last, f, &from, &to))
        return false;
    const double n = (double)window->blocks, m = (double)window->per_block;
    const double A = fit->residual.amplitude, b = fit->residual.baseline;
    const double length = fit->at.part[FIT_END] - fit->at.part[FIT_START];
    double f_sum = 0, ff = 0, d_sum[FIT_PARTS] = {0}, df[FIT_PARTS] = {0};
    for (size_t k = from; k <= to; k++) {
        f_sum += f[k];
        ff += f[k] * f[k];
    }
    for (int p = 0; p < FIT_PARTS; p++) {
        const double step = 1e-5 * (p == FIT_DECAY ? 1 : length);
        FitPoint point = fit->at;
        point.part[p] += step;
        if (!fit_pulse(window, &point, first, last, above, &from, &to))
            return false;
        point.part[p] -= 2 * step;
        if (!fit_pulse(window, &point, first, last, d[p], &from, &to))
            return false;
        for (size_t k = from; k <= to; k++) {
            d[p][k] = A * (above[k] - d[p][k]) / (2 * step);
            d_sum[p] += d[p][k];
            df[p] += d[p][k] * f[k];
        }
    }
    ff -= f_sum * f_sum / n;
    for (int p = 0; p < FIT_PARTS; p++) {
        fit->slope[p] = 0;
        // x - A f - b sums to 0 and is orthogonal to f: no projection is needed.
        for (size_t k = from; k <= to; k++)
            fit->slope[p] -= m * d[p][k] * (window->mean[k] - A * f[k] - b);
        df[p] -= d_sum[p] * f_sum / n;
        for (int q = 0; q <= p; q++) {
            double sum = -d_sum[p] * d_sum[q] / n - df[p] * df[q] / ff;
            for (size_t k = from; k <= to; k++)
                sum += d[p][k] * d[q][k];
            fit->curvature[p][q] = fit->curvature[q][p] = m * sum;
        }
    }
    return true;
}

// (curvature + damping diagonal) step = -slope over the free parts, by elimination.
static bool fit_solve(const PulseFit *fit, const bool *is_free, double damping, double *step) {
    double a[FIT_PARTS][FIT_PARTS + 1];
    int at[FIT_PARTS], n = 0;
    for (int p = 0; p < FIT_PARTS; p++) {
        step[p] = 0;
        if (is_free[p])
            at[n++] = p;
    }
    for (int i = 0; i < n; i++) {
        for (int j = 0; j < n; j++)
            a[i][j] = fit->curvature[at[i]][at[j]] * (i == j ? 1 + damping : 1);
        a[i][n] = -fit->slope[at[i]];
    }
    for (int i = 0; i < n; i++) {
        if (!(a[i][i] > 0))
            return false;
        for (int j = i + 1; j < n; j++) {
            const double factor = a[j][i] / a[i][i];
            for (int k = i; k <= n; k++)
                a[j][k] -= factor * a[i][k];
        }
    }
    for (int i = n; i-- > 0;) {
        double value = a[i][n];
        for (int j = i + 1; j < n; j++)
            value -= a[i][j] * step[at[j]];
        step[at[i]] = value / a[i][i];
    }
    return true;
}

void pulse_fit_in_box(const FitWindow *window, const FitBox *box, PulseFit *fit) {
    for (int p = 0; p < FIT_PARTS; p++)
        fit->at.part[p] = fmin(fmax(fit->at.part[p], box->least[p]), box->most[p]);
    fit->residual = fit_residual_at(window, &fit->at, box);
    double damping = 1e-3;
    bool is_derived = false;
    for (int round = 0; round < 60 && isfinite(fit->residual.sum); round++) {
        if (!is_derived && !fit_derive(window, box, fit))
            return;
        is_derived = true;
        // A part at a bound whose slope points outward is fixed there.
        bool is_free[FIT_PARTS];
        for (int p = 0; p < FIT_PARTS; p++)
            is_free[p] = !(fit->at.part[p] <= box->least[p] && fit->slope[p] > 0) &&
                         !(fit->at.part[p] >= box->most[p] && fit->slope[p] < 0);
        double step[FIT_PARTS];
        if (!fit_solve(fit, is_free, damping, step)) {
            damping = 10 * damping + 1e-9;
            if (damping > 1e9)
                return;
            continue;
        }
        PulseFit next = *fit;
        double gain = 0, size = 0;
        for (int p = 0; p < FIT_PARTS; p++) {
            next.at.part[p] = fmin(fmax(fit->at.part[p] + step[p], box->least[p]), box->most[p]);
            gain -= step[p] * fit->slope[p];
            size = fmax(size, fabs(next.at.part[p] - fit->at.part[p]));
        }
        next.residual = fit_residual_at(window, &next.at, box);
        if (next.residual.sum < fit->residual.sum) {
            const bool is_done = fit->residual.sum - next.residual.sum <
                                 1e-7 * pulse_fit_variance(window, next.residual.sum);
            *fit = next;
            is_derived = false;
            damping /= 10;
            if (is_done)
                break;
        } else {
            damping = 10 * damping + 1e-9;
            if (damping > 1e9 || size < 1e-12 ||
                gain < 1e-9 * pulse_fit_variance(window, fit->residual.sum))
                break;
        }
    }
    if (!is_derived)
        fit_derive(window, box, fit);
    fit_samples(window, &fit->at, box, &fit->first, &fit->last);
}

double pulse_fit_variance(const FitWindow *window, double sum) {
    const double n = (double)window->blocks + window->noise_freedom;
    // 1e-16: rounding of data and model is noise as well.
    return (sum + window->noise_square) / fmax(n - 5, 1) + 1e-16;
}

double pulse_fit_log_likelihood(const FitWindow *window, double sum) {
    const double n = (double)window->blocks + window->noise_freedom;
    return -fmax(n - 5, 1) / 2 * log((sum + window->noise_square) + fmax(n - 5, 1) * 1e-16);
}

// The best of a coarse grid of starts and ends, for one L.
static bool fit_search_grid(const FitWindow *window, double decay, PulseFit *fit) {
    enum { PLACES = 7 };
    const long lead = window->first - window->least_start, tail = window->most_end - window->last;
    const long lead_step = lead / PLACES + 1, tail_step = tail / PLACES + 1;
    fit->residual.sum = (double)INFINITY;
    for (long first = window->first; first >= window->least_start; first -= lead_step)
        for (long last = window->last; last <= window->most_end; last += tail_step) {
            const FitBox box = fit_box_make(first, last, 1);
            const FitPoint point = {{(double)first - 0.5, (double)last + 0.5, decay}};
            const FitResidual left = fit_residual_at(window, &point, &box);
            if (left.sum < fit->residual.sum) {
                fit->at = point;
                fit->residual = left;
            }
        }
    return isfinite(fit->residual.sum);
}

// Moves from gap to gap while the fit improves.
static void fit_climb(const FitWindow *window, PulseFit *fit) {
    static const int moves[8][2] = {{0, 1}, {0, -1},  {1, 0},  {-1, 0},
                                    {1, 1}, {-1, -1}, {-1, 1}, {1, -1}};
    long stride = 1;
    for (int move = 0, failed = 0; failed < 8; move = (move + 1) % 8) {
        const long from = fit->first + stride * moves[move][0];
        const long to = fit->last + stride * moves[move][1];
        PulseFit other = *fit;
        other.residual.sum = (double)INFINITY;
        if (from >= window->least_start && from <= window->first && to >= window->last &&
            to <= window->most_end) {
            const FitBox box = fit_box_make(from, to, 1);
            pulse_fit_in_box(window, &box, &other);
        }
        if (other.residual.sum < fit->residual.sum * (1 - 1e-9)) {
            *fit = other;
            failed = 0;
            move--; // once more in this direction, twice as far
            stride *= 2;
        } else if (stride > 1) {
            stride = 1;
            move--;
        } else {
            failed++;
        }
    }
}

static bool fit_is_found(const PulseFit *fits, size_t count, const PulseFit *fit) {
    for (size_t i = 0; i < count; i++)
        if (fit->first == fits[i].first && fit->last == fits[i].last)
            return true;
    return false;
}

static size_t fit_insert(PulseFit *fits, size_t count, const PulseFit *fit) {
    size_t at = count;
    for (; at > 0 && fits[at - 1].residual.sum > fit->residual.sum; at--)
        fits[at] = fits[at - 1];
    fits[at] = *fit;
    return count + 1;
}

size_t pulse_fit_run(const FitWindow *window, PulseFit fits[FITS_MAX]) {
    static const double decays[FITS_MAX] = {0.02, 0.3, 0.7, 1.3, 2, 3};
    const FitBox wide = {
        .least = {(double)window->least_start - 1, (double)window->last, decay_min},
        .most = {(double)window->first, (double)window->most_end + 1, decay_max},
        .first = window->least_start,
        .last = window->most_end,
    };
    PulseFit seeds[FITS_MAX];
    size_t seeded = 0, count = 0;
    for (size_t i = 0; i < FITS_MAX; i++) {
        PulseFit fit;
        if (!fit_search_grid(window, decays[i], &fit))
            continue;
        // First as if there were no jumps.
        pulse_fit_in_box(window, &wide, &fit);
        const FitBox box = fit_box_make(fit.first, fit.last, 1);
        pulse_fit_in_box(window, &box, &fit);
        if (isfinite(fit.residual.sum) && !fit_is_found(seeds, seeded, &fit))
            seeded = fit_insert(seeds, seeded, &fit);
    }
    for (size_t i = 0; i < seeded; i++) {
        // Too much worse than the best: a search from here cannot reach it.
        if (i > 0 && pulse_fit_log_likelihood(window, seeds[i].residual.sum) <
                         pulse_fit_log_likelihood(window, fits[0].residual.sum) - 40)
            break;
        fit_climb(window, &seeds[i]);
        if (!fit_is_found(fits, count, &seeds[i]))
            count = fit_insert(fits, count, &seeds[i]);
    }
    return count;
}

void pulse_fit_continue(const FitWindow *window, PulseFit *fit) {
    const FitBox box = fit_box_make(fit->first, fit->last, 1);
    pulse_fit_in_box(window, &box, fit);
    if (isfinite(fit->residual.sum))
        fit_climb(window, fit);
}
