// The gaps between samples in which a contact starts and ends follow from the jumps of the force
// and from the form of the pulse; the position within a gap follows from the form alone. So the
// pulse is fitted for each plausible pair of gaps to the same samples, with start and end free to
// leave their gaps. That fit is smooth: its estimates are unbiased and its covariance holds
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
#include "core/drop_test/fit_confidence.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

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
    double covariance[FIT_PARTS][FIT_PARTS];  // of start, end and L
    double slope[FIGURES][FIT_PARTS];         // of the figures by start, end and L
    double least[FIT_PARTS], most[FIT_PARTS]; // the gaps
} Piece;

// The range of the likely gaps of the start, or of the end.
typedef struct Gaps {
    double middle, half;
} Gaps;

// False: the inverse is not a covariance.
static bool confidence_invert(double a[3][3], double inverse[3][3], double *det) {
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

// The probability of [a, b] under a standard normal distribution, accurate in the tails.
static double confidence_normal(double a, double b) {
    if (a > 0)
        return (erfc(a / sqrt(2)) - erfc(b / sqrt(2))) / 2;
    return (erfc(-b / sqrt(2)) - erfc(-a / sqrt(2))) / 2;
}

// The probability of a box under the normal distribution of start and end.
static double confidence_box(const FitBox *box, const double *mean, double spread[3][3]) {
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
        sum += confidence_normal(from, to) * confidence_normal((box->least[FIT_END] - about) / rest,
                                                               (box->most[FIT_END] - about) / rest);
    }
    return sum;
}

// T_c's derivatives by start, end and L.
static bool confidence_slopes(const FitWindow *window, const FitPoint *point, double *contact_time,
                              double *slope) {
    PulseModel model;
    if (!pulse_fit_model(window, point, &model, contact_time))
        return false;
    for (int p = 0; p < FIT_PARTS; p++) {
        const double step = 1e-4 * (p == FIT_DECAY ? 1 : *contact_time);
        FitPoint other = *point;
        double above, below;
        other.part[p] += step;
        const bool is_above = pulse_fit_model(window, &other, &model, &above);
        other.part[p] -= 2 * step;
        if (!is_above || !pulse_fit_model(window, &other, &model, &below))
            return false;
        slope[p] = (above - below) / (2 * step);
    }
    return true;
}

// One Newton step leads from the minimum within the gaps to the one without bounds.
static bool confidence_weigh(const FitWindow *window, const FitBox *box, const PulseFit *fit,
                             Piece *piece) {
    double inverse[3][3], curvature[3][3], det, gain = 0, T;
    const double variance = pulse_fit_variance(window, fit->residual.sum);
    memcpy(curvature, fit->curvature, sizeof curvature);
    *piece = (Piece){.slope = {{1, 0, 0}, {0, 1, 0}, {0, 0, 1}}};
    if (!confidence_slopes(window, &fit->at, &T, piece->slope[CONTACT_TIME]))
        return false;
    // Limits the step to a part of the contact, over which the pulse is linear.
    curvature[FIT_START][FIT_START] += variance / pow(1 + step_max * T, 2);
    if (!confidence_invert(curvature, inverse, &det))
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
    memcpy(piece->least, box->least, sizeof piece->least);
    memcpy(piece->most, box->most, sizeof piece->most);
    piece->weight = pulse_fit_log_likelihood(window, fit->residual.sum) + gain / variance / 2 -
                    log(det / pow(variance, 3)) / 2 - piece->mean[FIT_DECAY] -
                    log(fit->residual.model_square) / 2 +
                    log(confidence_box(box, piece->mean, piece->covariance));
    return isfinite(piece->weight);
}

static Gaps confidence_gaps(const Piece *pieces, size_t count, int end) {
    double least = (double)INFINITY, most = -(double)INFINITY;
    for (size_t i = 0; i < count; i++) {
        if (pieces[i].weight < 0.002)
            continue;
        least = fmin(least, pieces[i].least[end]);
        most = fmax(most, pieces[i].most[end]);
    }
    return (Gaps){(least + most) / 2, (most - least) / 2};
}

// A figure, its noise, and its largest bias over the positions of start and end within the gaps.
typedef struct Drawn {
    double mean, noise, bias, bias_square;
} Drawn;

// The figure with start and end drawn to the middle of their gaps, as if the middle had been
// measured with a variance of `laxity` times the square of half the range.
static Drawn confidence_draw(const Piece *piece, const Gaps gaps[2], int figure, double laxity) {
    double with[2], own = 0, part[2] = {0, 0}, extra[2];
    for (int i = 0; i < FIT_PARTS; i++)
        for (int j = 0; j < FIT_PARTS; j++)
            own += piece->slope[figure][i] * piece->slope[figure][j] * piece->covariance[i][j];
    for (int i = 0; i < 2; i++) {
        with[i] = 0;
        for (int j = 0; j < FIT_PARTS; j++)
            with[i] += piece->slope[figure][j] * piece->covariance[i][j];
        // A gap wider than the form leaves it follows from the form and adds nothing.
        const bool is_known = gaps[i].half > 1.5 * sqrt(piece->covariance[i][i]);
        extra[i] = is_known ? (double)INFINITY : laxity * gaps[i].half * gaps[i].half;
    }
    const double a = piece->covariance[0][0] + extra[0], b = piece->covariance[0][1];
    const double c = piece->covariance[1][1] + extra[1];
    if (isinf(extra[0]) || isinf(extra[1])) {
        part[0] = isinf(extra[0]) ? 0 : with[0] / a;
        part[1] = isinf(extra[1]) ? 0 : with[1] / c;
    } else {
        part[0] = (with[0] * c - with[1] * b) / (a * c - b * b);
        part[1] = (with[1] * a - with[0] * b) / (a * c - b * b);
    }
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
static void confidence_settle(Piece *piece, const Gaps gaps[2], bool is_form_sure) {
    const double enough = noise_good * piece->mean[CONTACT_TIME];
    double low = log(1.0 / 3), high = log(1e9);
    for (int step = 0; step < 40 && is_form_sure; step++) {
        const double middle = low + (high - low) / 2;
        const Drawn time = confidence_draw(piece, gaps, CONTACT_TIME, exp(middle));
        const Drawn decay = confidence_draw(piece, gaps, FIT_DECAY, exp(middle));
        const double most =
            time.noise > noise_vague * piece->mean[CONTACT_TIME] ? bias_max_vague : bias_max;
        const bool is_fair = time.noise >= enough && time.bias <= most * time.noise &&
                             decay.bias <= most * decay.noise;
        *(is_fair ? &high : &low) = middle;
    }
    Piece settled = *piece;
    for (int figure = 0; figure < FIGURES; figure++) {
        const Drawn drawn = confidence_draw(piece, gaps, figure, exp(is_form_sure ? high : low));
        settled.mean[figure] = drawn.mean;
        settled.deviation[figure] = sqrt(drawn.noise * drawn.noise + drawn.bias_square);
    }
    *piece = settled;
}

// How many gaps are taken together: neither the pulse nor the jump distinguishes them.
static long confidence_gap_count(const FitWindow *window, const PulseFit *fit) {
    double curvature[3][3], spread[3][3], det;
    const double variance = pulse_fit_variance(window, fit->residual.sum);
    memcpy(curvature, fit->curvature, sizeof curvature);
    if (!confidence_invert(curvature, spread, &det))
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
static size_t confidence_explore(const FitWindow *window, const PulseFit *fits, size_t count,
                                 Piece *pieces) {
    const PulseFit *fit = fits;
    static const int moves[8][2] = {{-1, 0},  {1, 0}, {0, -1}, {0, 1},
                                    {-1, -1}, {1, 1}, {-1, 1}, {1, -1}};
    bool is_seen[SIDE][SIDE] = {{false}};
    PulseFit from[SIDE * SIDE];
    int queue[SIDE * SIDE][2], head = 0, tail = 0;
    size_t found = 0;
    const long gaps = confidence_gap_count(window, fit);
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
        pulse_fit_in_box(window, &box, &here);
        const double gain = pulse_fit_log_likelihood(window, here.residual.sum) -
                            pulse_fit_log_likelihood(window, fit->residual.sum);
        if (!(gain > -14) || !confidence_weigh(window, &box, &here, &pieces[found]))
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

static Posterior confidence_posterior(const Piece *pieces, size_t count, int figure) {
    double mean = 0, square = 0;
    for (size_t i = 0; i < count; i++)
        mean += pieces[i].weight * pieces[i].mean[figure];
    for (size_t i = 0; i < count; i++)
        square += pieces[i].weight *
                  (pow(pieces[i].mean[figure] - mean, 2) + pow(pieces[i].deviation[figure], 2));
    return (Posterior){mean, sqrt(square)};
}

// The quantile of T_c; `widening` approximates Student's distribution.
static double confidence_quantile(const Piece *pieces, size_t count, double share,
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

Status fit_confidence_run(const FitWindow *window, const PulseFit *fits, size_t count,
                          bool is_form_sure, FitConfidence *confidence) {
    Piece *pieces = malloc(SIDE * SIDE * sizeof *pieces);
    *confidence = (FitConfidence){.least = (double)NAN, .most = (double)NAN};
    if (pieces == NULL)
        return STATUS_NO_MEMORY;
    const size_t found = confidence_explore(window, fits, count, pieces);
    double height = -(double)INFINITY, sum = 0;
    for (size_t i = 0; i < found; i++)
        height = fmax(height, pieces[i].weight);
    for (size_t i = 0; i < found; i++) {
        pieces[i].weight = exp(pieces[i].weight - height);
        sum += pieces[i].weight;
    }
    for (size_t i = 0; i < found; i++)
        pieces[i].weight /= sum;
    const Gaps gaps[2] = {confidence_gaps(pieces, found, FIT_START),
                          confidence_gaps(pieces, found, FIT_END)};
    for (size_t i = 0; i < found; i++)
        confidence_settle(&pieces[i], gaps, is_form_sure);
    if (found > 0) {
        const double freedom = fmax((double)window->blocks + window->noise_freedom - 5, 1);
        const double widening = 1 + 1.2 / freedom;
        confidence->contact_time = confidence_posterior(pieces, found, CONTACT_TIME);
        confidence->decay = confidence_posterior(pieces, found, FIT_DECAY);
        confidence->least = confidence_quantile(pieces, found, 0.025, widening);
        confidence->most = confidence_quantile(pieces, found, 0.975, widening);
    }
    free(pieces);
    return STATUS_OK;
}
