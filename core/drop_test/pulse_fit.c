// Variable projection: for given start, end and L the pulse f is fixed but for its amplitude A and
// the baseline b, which are linear. What remains is to minimise the sum of squares of x - A f - b
// over start, end and L. The force jumps where a contact starts and ends, so the sum is smooth only
// while the same samples are in contact: within a box, start and end stay in their gaps between
// samples. Levenberg and Marquardt's method finds the minimum of a box; a search moves from box to
// box.
//
// Confidence: the gaps between samples in which a contact starts and ends follow from the jumps of
// the force and from the form of the pulse; the position within a gap follows from the form alone.
// So the pulse is fitted for each plausible pair of gaps to the same samples, with start and end
// free to leave their gaps. That fit is smooth: its estimates are unbiased and its covariance holds
// wherever in the gaps the contact started and ended. With start and end held in their gaps the
// estimates would be biased near the edges, and no interval would cover that.
//
// Each pair of gaps is weighted by its likelihood, with amplitude, baseline and noise integrated
// out and a uniform prior of start, end and e = exp(-L).
//
// Where the form is vague, a gap that is certain from the jump says more. Start and end are then
// drawn towards the middle of their gaps, but only so far that the possible bias stays small
// against the remaining noise: the interval must hold at the edges of the gaps too. Where the pulse
// does not have the model's form, the gaps decide.
#include "core/drop_test/pulse_fit.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "core/base/status.h"

// e from 2.7, which only noise causes, to 0.01.
static const double decay_min = -1, decay_max = 4.6;

// Bounds of start, end and L. The same samples are in contact all over a box of one gap.
typedef struct FitBox {
    double least[FIT_PARTS], most[FIT_PARTS];
    long first, last; // first sample in contact at least, last one at most
} FitBox;

// `start` in (first - gaps, first], `end` in [last, last + gaps).
static FitBox fit_box_make(long first, long last, long gaps) {
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
    *model = pulse_model_make(point->part[FIT_DECAY], window->pull_rate * length, true,
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
    double left = 0;
    for (size_t k = 0; k < window->blocks; k++) {
        const double r = window->mean[k] - b - (k >= from && k <= to ? A * f[k] : 0);
        left += r * r;
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
        FitPoint high = fit->at, low = fit->at;
        high.part[p] += step;
        low.part[p] = high.part[p] - 2 * step;
        if (!fit_pulse(window, &high, first, last, above, &from, &to) ||
            !fit_pulse(window, &low, first, last, d[p], &from, &to))
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

// The inverse and the determinant; false: it is not a covariance.
static bool fit_invert(double a[FIT_PARTS][FIT_PARTS], double inverse[FIT_PARTS][FIT_PARTS],
                       double *det) {
    *det = a[0][0] * (a[1][1] * a[2][2] - a[1][2] * a[2][1]) -
           a[0][1] * (a[1][0] * a[2][2] - a[1][2] * a[2][0]) +
           a[0][2] * (a[1][0] * a[2][1] - a[1][1] * a[2][0]);
    for (int i = 0; i < 3; i++)
        for (int j = 0; j < 3; j++) {
            const int p = (j + 1) % 3, q = (j + 2) % 3, r = (i + 1) % 3, s = (i + 2) % 3;
            inverse[i][j] = (a[p][r] * a[q][s] - a[p][s] * a[q][r]) / *det;
        }
    return *det > 0 && inverse[0][0] > 0 && inverse[1][1] > 0 && inverse[2][2] > 0;
}

// (curvature + damping diagonal) step = -slope over the free parts; the others do not move.
static bool fit_solve(const PulseFit *fit, const bool *is_free, double damping, double *step) {
    double a[FIT_PARTS][FIT_PARTS], inverse[FIT_PARTS][FIT_PARTS], det;
    for (int i = 0; i < FIT_PARTS; i++) {
        for (int j = 0; j < FIT_PARTS; j++)
            a[i][j] = is_free[i] && is_free[j] ? fit->curvature[i][j] : 0;
        a[i][i] = is_free[i] ? a[i][i] * (1 + damping) : 1;
    }
    if (!fit_invert(a, inverse, &det))
        return false;
    for (int i = 0; i < FIT_PARTS; i++) {
        step[i] = 0;
        for (int j = 0; j < FIT_PARTS; j++)
            step[i] -= is_free[j] ? inverse[i][j] * fit->slope[j] : 0;
    }
    return true;
}

// The variance of noise that leaves a sum of squares.
static double fit_variance(const FitWindow *window, double sum) {
    const double n = (double)window->blocks + window->noise_freedom;
    // 1e-16: rounding of data and model is noise as well.
    return (sum + window->noise_square) / fmax(n - 5, 1) + 1e-16;
}

// Logarithm of the likelihood of a sum of squares under noise of unknown variance, up to a
// constant.
static double fit_log_likelihood(const FitWindow *window, double sum) {
    const double n = (double)window->blocks + window->noise_freedom;
    return -fmax(n - 5, 1) / 2 * log((sum + window->noise_square) + fmax(n - 5, 1) * 1e-16);
}

// The minimum within a box, from `fit->at`.
static void fit_in_box(const FitWindow *window, const FitBox *box, PulseFit *fit) {
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
                                 1e-7 * fit_variance(window, next.residual.sum);
            *fit = next;
            is_derived = false;
            damping /= 10;
            if (is_done)
                break;
        } else {
            damping = 10 * damping + 1e-9;
            if (damping > 1e9 || size < 1e-12 ||
                gain < 1e-9 * fit_variance(window, fit->residual.sum))
                break;
        }
    }
    if (!is_derived)
        fit_derive(window, box, fit);
    fit_samples(window, &fit->at, box, &fit->first, &fit->last);
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
            fit_in_box(window, &box, &other);
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
        fit_in_box(window, &wide, &fit);
        const FitBox box = fit_box_make(fit.first, fit.last, 1);
        fit_in_box(window, &box, &fit);
        if (isfinite(fit.residual.sum) && !fit_is_found(seeds, seeded, &fit))
            seeded = fit_insert(seeds, seeded, &fit);
    }
    for (size_t i = 0; i < seeded; i++) {
        // Too much worse than the best: a search from here cannot reach it.
        if (i > 0 && fit_log_likelihood(window, seeds[i].residual.sum) <
                         fit_log_likelihood(window, fits[0].residual.sum) - 40)
            break;
        fit_climb(window, &seeds[i]);
        if (!fit_is_found(fits, count, &seeds[i]))
            count = fit_insert(fits, count, &seeds[i]);
    }
    return count;
}

void pulse_fit_continue(const FitWindow *window, PulseFit *fit) {
    const FitBox box = fit_box_make(fit->first, fit->last, 1);
    fit_in_box(window, &box, fit);
    if (isfinite(fit->residual.sum))
        fit_climb(window, fit);
}

enum { REACH = 24, SIDE = 2 * REACH + 1 };
enum { CONTACT_TIME = FIT_PARTS, FIGURES };

// Below noise_good, relative to T_c, the form suffices without the gaps. bias_max: the bias from
// drawing to the middle of the gaps over the remaining noise; bias_max_vague: where the noise
// exceeds noise_vague.
static const double noise_good = 0.01, noise_vague = 0.04, bias_max = 0.35, bias_max_vague = 0.6;

// Part of the contact over which the pulse is linear in its start.
static const double step_max = 0.1;

// The normal distribution of one pair of gaps.
typedef struct Piece {
    double weight; // at first its logarithm
    double mean[FIGURES], deviation[FIGURES];
    double covariance[FIT_PARTS][FIT_PARTS]; // of start, end and L
    double slope[FIGURES][FIT_PARTS];        // of the figures by start, end and L
    FitBox gaps;
} Piece;

// The range of the likely gaps of the start, or of the end.
typedef struct Gaps {
    double middle, half;
} Gaps;

// The probability of [a, b] under a standard normal distribution, accurate in the tails.
static double fit_confidence_normal(double a, double b) {
    if (a > 0)
        return (erfc(a / sqrt(2)) - erfc(b / sqrt(2))) / 2;
    return (erfc(-b / sqrt(2)) - erfc(-a / sqrt(2))) / 2;
}

// The probability of a box under the normal distribution of start and end.
static double fit_confidence_box(const FitBox *box, const double *mean, double spread[3][3]) {
    enum { PLACES = 16 };
    const double width = sqrt(spread[FIT_START][FIT_START]);
    const double tilt = spread[FIT_START][FIT_END] / spread[FIT_START][FIT_START];
    const double rest = sqrt(fmax(spread[FIT_END][FIT_END] - tilt * spread[FIT_START][FIT_END], 0));
    double low = (box->least[FIT_START] - mean[FIT_START]) / width;
    double high = (box->most[FIT_START] - mean[FIT_START]) / width;
    const double nearest = fmin(fmax(0, low), high), reach = sqrt(nearest * nearest + 36);
    low = fmax(low, -reach);
    high = fmin(high, reach);
    double sum = 0;
    for (int i = 0; i < PLACES; i++) {
        const double from = low + (high - low) * i / PLACES, to = from + (high - low) / PLACES;
        const double about = mean[FIT_END] + tilt * width * (from + to) / 2;
        sum += fit_confidence_normal(from, to) *
               fit_confidence_normal((box->least[FIT_END] - about) / rest,
                                     (box->most[FIT_END] - about) / rest);
    }
    return sum;
}

// T_c's derivatives by start, end and L.
static bool fit_confidence_slopes(const FitWindow *window, const FitPoint *point,
                                  double *contact_time, double *slope) {
    PulseModel model;
    if (!pulse_fit_model(window, point, &model, contact_time))
        return false;
    for (int p = 0; p < FIT_PARTS; p++) {
        const double step = 1e-4 * (p == FIT_DECAY ? 1 : *contact_time);
        FitPoint high = *point, low = *point;
        double above, below;
        high.part[p] += step;
        low.part[p] = high.part[p] - 2 * step;
        if (!pulse_fit_model(window, &high, &model, &above) ||
            !pulse_fit_model(window, &low, &model, &below))
            return false;
        slope[p] = (above - below) / (2 * step);
    }
    return true;
}

// One Newton step leads from the minimum within the gaps to the one without bounds.
static bool fit_confidence_weigh(const FitWindow *window, const FitBox *box, const PulseFit *fit,
                                 Piece *piece) {
    double inverse[3][3], curvature[3][3], det, gain = 0, T;
    const double variance = fit_variance(window, fit->residual.sum);
    memcpy(curvature, fit->curvature, sizeof curvature);
    *piece = (Piece){.slope = {{1, 0, 0}, {0, 1, 0}, {0, 0, 1}}, .gaps = *box};
    if (!fit_confidence_slopes(window, &fit->at, &T, piece->slope[CONTACT_TIME]))
        return false;
    // Limits the step to a part of the contact, over which the pulse is linear.
    curvature[FIT_START][FIT_START] += variance / pow(1 + step_max * T, 2);
    if (!fit_invert(curvature, inverse, &det))
        return false;
    piece->mean[CONTACT_TIME] = T;
    for (int i = 0; i < FIT_PARTS; i++) {
        double step = 0;
        for (int j = 0; j < FIT_PARTS; j++)
            step -= inverse[i][j] * fit->slope[j];
        piece->mean[i] = fit->at.part[i] + step;
        piece->mean[CONTACT_TIME] += piece->slope[CONTACT_TIME][i] * step;
        gain -= fit->slope[i] * step;
    }
    for (int i = 0; i < 3; i++)
        for (int j = 0; j < 3; j++)
            piece->covariance[i][j] = inverse[i][j] * variance;
    piece->weight = fit_log_likelihood(window, fit->residual.sum) + gain / variance / 2 -
                    log(det / pow(variance, 3)) / 2 - piece->mean[FIT_DECAY] -
                    log(fit->residual.model_square) / 2 +
                    log(fit_confidence_box(box, piece->mean, piece->covariance));
    return isfinite(piece->weight);
}

static Gaps fit_confidence_gaps(const Piece *pieces, size_t count, int end) {
    double least = (double)INFINITY, most = -(double)INFINITY;
    for (size_t i = 0; i < count; i++) {
        if (pieces[i].weight < 0.002)
            continue;
        least = fmin(least, pieces[i].gaps.least[end]);
        most = fmax(most, pieces[i].gaps.most[end]);
    }
    return (Gaps){(least + most) / 2, (most - least) / 2};
}

// A figure, its noise, and its largest bias over the positions of start and end within the gaps.
typedef struct Drawn {
    double mean, noise, bias, bias_square;
} Drawn;

// The figure with start and end drawn to the middle of their gaps, as if the middle had been
// measured with a variance of `laxity` times the square of half the range.
static Drawn fit_confidence_draw(const Piece *piece, const Gaps gaps[2], int figure,
                                 double laxity) {
    double with[2], own = 0, part[2], extra[2];
    for (int i = 0; i < FIT_PARTS; i++)
        for (int j = 0; j < FIT_PARTS; j++)
            own += piece->slope[figure][i] * piece->slope[figure][j] * piece->covariance[i][j];
    for (int i = 0; i < 2; i++) {
        with[i] = 0;
        for (int j = 0; j < FIT_PARTS; j++)
            with[i] += piece->slope[figure][j] * piece->covariance[i][j];
        // A gap wider than the form leaves it follows from the form and adds nothing.
        const bool is_known = gaps[i].half > 1.5 * sqrt(piece->covariance[i][i]);
        extra[i] = is_known ? 1e30 * piece->covariance[i][i] : laxity * gaps[i].half * gaps[i].half;
    }
    const double a = piece->covariance[0][0] + extra[0], b = piece->covariance[0][1];
    const double c = piece->covariance[1][1] + extra[1];
    const double det = a * c - b * b;
    part[0] = (with[0] * c - with[1] * b) / det;
    part[1] = (with[1] * a - with[0] * b) / det;
    Drawn drawn = {.mean = piece->mean[figure]};
    double square = own;
    for (int i = 0; i < 2; i++) {
        const double off = part[i] * gaps[i].half;
        drawn.mean += part[i] * (gaps[i].middle - piece->mean[i]);
        drawn.bias += fabs(off);
        drawn.bias_square += off * off / 3;
        square -= 2 * part[i] * with[i];
        for (int j = 0; j < 2; j++)
            square += part[i] * part[j] * piece->covariance[i][j];
    }
    drawn.noise = sqrt(fmax(square, 0));
    return drawn;
}

// Draws no further than necessary and allowed; all figures equally, so that they describe one
// pulse.
static void fit_confidence_settle(Piece *piece, const Gaps gaps[2], bool is_form_sure) {
    const double enough = noise_good * piece->mean[CONTACT_TIME];
    double low = log(1.0 / 3), high = log(1e9);
    for (int step = 0; step < 40 && is_form_sure; step++) {
        const double middle = low + (high - low) / 2;
        const Drawn time = fit_confidence_draw(piece, gaps, CONTACT_TIME, exp(middle));
        const Drawn decay = fit_confidence_draw(piece, gaps, FIT_DECAY, exp(middle));
        const double most =
            time.noise > noise_vague * piece->mean[CONTACT_TIME] ? bias_max_vague : bias_max;
        const bool is_fair = time.noise >= enough && time.bias <= most * time.noise &&
                             decay.bias <= most * decay.noise;
        *(is_fair ? &high : &low) = middle;
    }
    Piece settled = *piece;
    for (int figure = 0; figure < FIGURES; figure++) {
        const Drawn drawn =
            fit_confidence_draw(piece, gaps, figure, exp(is_form_sure ? high : low));
        settled.mean[figure] = drawn.mean;
        settled.deviation[figure] = sqrt(drawn.noise * drawn.noise + drawn.bias_square);
    }
    *piece = settled;
}

// How many gaps are taken together: neither the pulse nor the jump distinguishes them.
static long fit_confidence_gap_count(const FitWindow *window, const PulseFit *fit) {
    double curvature[3][3], spread[3][3], det;
    const double variance = fit_variance(window, fit->residual.sum);
    memcpy(curvature, fit->curvature, sizeof curvature);
    if (!fit_invert(curvature, spread, &det))
        return 1;
    PulseModel model;
    double T;
    pulse_fit_model(window, &fit->at, &model, &T);
    const double A = fit->residual.amplitude;
    const double jump = fmax(fabs(A * pulse_model_force(&model, 0)),
                             fabs(A * pulse_model_force(&model, model.length)));
    const double deviation =
        sqrt(fmin(spread[FIT_START][FIT_START], spread[FIT_END][FIT_END]) * variance);
    return (long)fmin(fmax(floor(fmin(deviation, variance / (jump * jump)) / 2), 1), 1e6);
}

// Visits pairs of gaps outward from the best one while they are likely. Returns their number.
static size_t fit_confidence_explore(const FitWindow *window, const PulseFit *fits, size_t count,
                                     Piece *pieces) {
    const PulseFit *fit = fits;
    static const int moves[8][2] = {{-1, 0},  {1, 0}, {0, -1}, {0, 1},
                                    {-1, -1}, {1, 1}, {-1, 1}, {1, -1}};
    bool is_seen[SIDE][SIDE] = {{false}};
    PulseFit from[SIDE * SIDE];
    int queue[SIDE * SIDE][2], head = 0, tail = 0;
    size_t found = 0;
    const long gaps = fit_confidence_gap_count(window, fit);
    for (size_t i = 0; i < count; i++) {
        const long p = REACH + lround((double)(fits[i].first - fit->first) / (double)gaps);
        const long q = REACH + lround((double)(fits[i].last - fit->last) / (double)gaps);
        if (p < 0 || q < 0 || p >= SIDE || q >= SIDE || is_seen[p][q])
            continue;
        is_seen[p][q] = true;
        from[tail] = fits[i];
        queue[tail][0] = (int)p;
        queue[tail][1] = (int)q;
        tail++;
    }
    while (head < tail) {
        PulseFit here = from[head];
        const int p = queue[head][0], q = queue[head][1];
        head++;
        const FitBox box =
            fit_box_make(fit->first + (p - REACH) * gaps, fit->last + (q - REACH) * gaps, gaps);
        fit_in_box(window, &box, &here);
        const double gain = fit_log_likelihood(window, here.residual.sum) -
                            fit_log_likelihood(window, fit->residual.sum);
        if (!(gain > -14) || !fit_confidence_weigh(window, &box, &here, &pieces[found]))
            continue;
        found++;
        for (int move = 0; move < 8; move++) {
            const int r = p + moves[move][0], s = q + moves[move][1];
            if (r < 0 || s < 0 || r >= SIDE || s >= SIDE || is_seen[r][s])
                continue;
            is_seen[r][s] = true;
            from[tail] = here;
            queue[tail][0] = r;
            queue[tail][1] = s;
            tail++;
        }
    }
    return found;
}

static Posterior fit_confidence_posterior(const Piece *pieces, size_t count, int figure) {
    double mean = 0, square = 0;
    for (size_t i = 0; i < count; i++)
        mean += pieces[i].weight * pieces[i].mean[figure];
    for (size_t i = 0; i < count; i++)
        square += pieces[i].weight *
                  (pow(pieces[i].mean[figure] - mean, 2) + pow(pieces[i].deviation[figure], 2));
    return (Posterior){mean, sqrt(square)};
}

// The quantile of T_c; `widening` approximates Student's distribution.
static double fit_confidence_quantile(const Piece *pieces, size_t count, double share,
                                      double widening) {
    double low = (double)INFINITY, high = -(double)INFINITY;
    for (size_t i = 0; i < count; i++) {
        const double reach = 8 * widening * pieces[i].deviation[CONTACT_TIME];
        low = fmin(low, pieces[i].mean[CONTACT_TIME] - reach);
        high = fmax(high, pieces[i].mean[CONTACT_TIME] + reach);
    }
    for (int step = 0; step < 50; step++) {
        const double middle = low + (high - low) / 2;
        double below = 0;
        for (size_t i = 0; i < count; i++)
            below += pieces[i].weight *
                     erfc((pieces[i].mean[CONTACT_TIME] - middle) /
                          (sqrt(2) * widening * pieces[i].deviation[CONTACT_TIME])) /
                     2;
        *(below < share ? &low : &high) = middle;
    }
    return low + (high - low) / 2;
}

Status pulse_fit_confidence(const FitWindow *window, const PulseFit *fits, size_t count,
                            bool is_form_sure, FitConfidence *confidence) {
    Piece *pieces = malloc(SIDE * SIDE * sizeof *pieces);
    *confidence = (FitConfidence){.least = (double)NAN, .most = (double)NAN};
    TRY(status_made(pieces != NULL));
    const size_t found = fit_confidence_explore(window, fits, count, pieces);
    double height = -(double)INFINITY, sum = 0;
    for (size_t i = 0; i < found; i++)
        height = fmax(height, pieces[i].weight);
    for (size_t i = 0; i < found; i++) {
        pieces[i].weight = exp(pieces[i].weight - height);
        sum += pieces[i].weight;
    }
    for (size_t i = 0; i < found; i++)
        pieces[i].weight /= sum;
    const Gaps gaps[2] = {fit_confidence_gaps(pieces, found, FIT_START),
                          fit_confidence_gaps(pieces, found, FIT_END)};
    for (size_t i = 0; i < found; i++)
        fit_confidence_settle(&pieces[i], gaps, is_form_sure);
    if (found > 0) {
        const double freedom = fmax((double)window->blocks + window->noise_freedom - 5, 1);
        const double widening = 1 + 1.2 / freedom;
        confidence->contact_time = fit_confidence_posterior(pieces, found, CONTACT_TIME);
        confidence->decay = fit_confidence_posterior(pieces, found, FIT_DECAY);
        confidence->least = fit_confidence_quantile(pieces, found, 0.025, widening);
        confidence->most = fit_confidence_quantile(pieces, found, 0.975, widening);
    }
    free(pieces);
    return STATUS_OK;
}
