// In which gaps between samples a contact begins and ends is told by the jumps of the force, and by
// the pulse's form; where in its gap, by the form alone: for each pair of gaps that the trace
// leaves open the pulse is fitted once more to the same samples, its ends free to leave their gaps.
// That is a smooth fit, whose figures are right on average and spread as its covariance says
// wherever in the gaps the contact began and ended. Ends held in their gaps would be drawn away
// from the gaps' edges, and from there no interval would reach back to it.
//
// Each pair of gaps counts by its share of the likelihood, with size, baseline and noise integrated
// out, each value of start, end and e = exp(-L) counting alike beforehand.
//
// Where the form is vague, a gap that the jump tells for sure says more. Then start and end are
// drawn towards the middle of their gaps, though never by so much that what this may be wrong by
// matters beside the noise that remains: the interval has to hold at the edges of the gaps as well.
// A form that the pulse is not of anyhow leaves all to the gaps.
#include "core/drop_test/fit_confidence.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

enum { START, END, DECAY };
enum { REACH = 24, SIDE = 2 * REACH + 1 };
enum { CONTACT_TIME = FIT_PARTS, FIGURES };

// A form that tells T_c as well as this needs no gaps. What drawing to their middle may be wrong
// by, over the noise that remains; and where T_c is told worse than so, by how much it may.
static const double good = 0.01, bias_max = 0.35, bad = 0.04, bias_most_of_bad = 0.6;

// Of the contact, to which the pulse changes evenly with its start.
static const double step_max = 0.1;

// What one pair of gaps says: normal distributions.
typedef struct Piece {
    double weight; // its log, first
    double mean[FIGURES], deviation[FIGURES];
    double spread[FIT_PARTS][FIT_PARTS];      // of start, end and L
    double slope[FIGURES][FIT_PARTS];         // of the figures by these
    double least[FIT_PARTS], most[FIT_PARTS]; // the gaps
} Piece;

// The gaps of start and of end that matter.
typedef struct Gaps {
    double middle, half;
} Gaps;

// det > 0 and so on: the inverse is a covariance.
static bool invert(double a[3][3], double inverse[3][3], double *det) {
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

// The share of a standard normal distribution from a to b, exact in its tails.
static double normal_share(double a, double b) {
    if (a > 0)
        return (erfc(a / sqrt(2)) - erfc(b / sqrt(2))) / 2;
    return (erfc(-b / sqrt(2)) - erfc(-a / sqrt(2))) / 2;
}

// The share of start's and end's normal distribution that lies in a box.
static double share_in(const FitBox *box, const double *mean, double spread[3][3]) {
    enum { PLACES = 16 };
    const double width = sqrt(spread[START][START]);
    const double tilt = spread[START][END] / spread[START][START];
    const double rest = sqrt(fmax(spread[END][END] - tilt * spread[START][END], 0));
    double low = (box->least[START] - mean[START]) / width;
    double high = (box->most[START] - mean[START]) / width;
    const double nearest = fmin(fmax(0, low), high), reach = sqrt(nearest * nearest + 36);
    low = fmax(low, -reach);
    high = fmin(high, reach);
    double sum = 0;
    for (int i = 0; i < PLACES; i++) {
        const double from = low + (high - low) * i / PLACES, to = from + (high - low) / PLACES;
        const double about = mean[END] + tilt * width * (from + to) / 2;
        sum += normal_share(from, to) *
               normal_share((box->least[END] - about) / rest, (box->most[END] - about) / rest);
    }
    return sum;
}

// T_c's derivatives by start, end and L.
static bool slopes(const FitWindow *window, const FitPoint *point, double *contact_time,
                   double *slope) {
    PulseModel shape;
    if (!pulse_fit_model(window, point, &shape, contact_time))
        return false;
    for (int p = 0; p < FIT_PARTS; p++) {
        const double step = 1e-4 * (p == DECAY ? 1 : *contact_time);
        FitPoint other = *point;
        double above, below;
        other.part[p] += step;
        const bool is_above = pulse_fit_model(window, &other, &shape, &above);
        other.part[p] -= 2 * step;
        if (!is_above || !pulse_fit_model(window, &other, &shape, &below))
            return false;
        slope[p] = (above - below) / (2 * step);
    }
    return true;
}

// From the best within the gaps one step of Newton's leads to the best beyond them.
static bool weigh(const FitWindow *window, const FitBox *box, const PulseFit *fit, Piece *piece) {
    double inverse[3][3], curvature[3][3], det, gain = 0, T;
    const double variance = pulse_fit_variance(window, fit->residue.sum);
    memcpy(curvature, fit->curvature, sizeof curvature);
    *piece = (Piece){.slope = {{1, 0, 0}, {0, 1, 0}, {0, 0, 1}}};
    if (!slopes(window, &fit->at, &T, piece->slope[CONTACT_TIME]))
        return false;
    // A step leads no further than a part of the contact: there the pulse is another.
    curvature[START][START] += variance / pow(1 + step_max * T, 2);
    if (!invert(curvature, inverse, &det))
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
            piece->spread[i][j] = inverse[i][j] * variance;
    memcpy(piece->least, box->least, sizeof piece->least);
    memcpy(piece->most, box->most, sizeof piece->most);
    piece->weight = pulse_fit_log_likelihood(window, fit->residue.sum) + gain / variance / 2 -
                    log(det / pow(variance, 3)) / 2 - piece->mean[DECAY] -
                    log(fit->residue.model_square) / 2 +
                    log(share_in(box, piece->mean, piece->spread));
    return isfinite(piece->weight);
}

static Gaps gaps_between(const Piece *pieces, size_t count, int end) {
    double least = (double)INFINITY, most = -(double)INFINITY;
    for (size_t i = 0; i < count; i++) {
        if (pieces[i].weight < 0.002)
            continue;
        least = fmin(least, pieces[i].least[end]);
        most = fmax(most, pieces[i].most[end]);
    }
    return (Gaps){(least + most) / 2, (most - least) / 2};
}

// A figure, and what it is wrong by: by noise, and at most by where in the gaps_told start and end
// are.
typedef struct Drawn {
    double mean, noise, bias, bias_square;
} Drawn;

// With start and end drawn to the middle of their gaps_told as if that had been measured with
// `laxity` times the square of half the range as its variance.
static Drawn draw(const Piece *piece, const Gaps gaps_told[2], int figure, double laxity) {
    double with[2], own = 0, part[2] = {0, 0}, extra[2];
    for (int i = 0; i < FIT_PARTS; i++)
        for (int j = 0; j < FIT_PARTS; j++)
            own += piece->slope[figure][i] * piece->slope[figure][j] * piece->spread[i][j];
    for (int i = 0; i < 2; i++) {
        with[i] = 0;
        for (int j = 0; j < FIT_PARTS; j++)
            with[i] += piece->slope[figure][j] * piece->spread[i][j];
        // What the form tells as well: there the gap came from it.
        const bool is_told = gaps_told[i].half > 1.5 * sqrt(piece->spread[i][i]);
        extra[i] = is_told ? (double)INFINITY : laxity * gaps_told[i].half * gaps_told[i].half;
    }
    const double a = piece->spread[0][0] + extra[0], b = piece->spread[0][1];
    const double c = piece->spread[1][1] + extra[1];
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
        const double off = part[i] * gaps_told[i].half;
        drawn.mean += part[i] * (gaps_told[i].middle - piece->mean[i]);
        drawn.bias += fabs(off);
        drawn.bias_square += off * off / 3;
        square -= 2 * part[i] * with[i];
        for (int j = 0; j < 2; j++)
            square += part[i] * part[j] * piece->spread[i][j];
    }
    drawn.noise = sqrt(fmax(square, 0));
    return drawn;
}

// No more than is needed, nor than is allowed; all figures by the same, so that they stay of one
// pulse.
static void settle(Piece *piece, const Gaps gaps_told[2], bool is_form_sure) {
    const double enough = good * piece->mean[CONTACT_TIME];
    double low = log(1.0 / 3), high = log(1e9);
    for (int step = 0; step < 40 && is_form_sure; step++) {
        const double middle = low + (high - low) / 2;
        const Drawn time = draw(piece, gaps_told, CONTACT_TIME, exp(middle));
        const Drawn decay = draw(piece, gaps_told, DECAY, exp(middle));
        const double most =
            time.noise > bad * piece->mean[CONTACT_TIME] ? bias_most_of_bad : bias_max;
        const bool is_fair = time.noise >= enough && time.bias <= most * time.noise &&
                             decay.bias <= most * decay.noise;
        *(is_fair ? &high : &low) = middle;
    }
    Piece settled = *piece;
    for (int figure = 0; figure < FIGURES; figure++) {
        const Drawn drawn = draw(piece, gaps_told, figure, exp(is_form_sure ? high : low));
        settled.mean[figure] = drawn.mean;
        settled.deviation[figure] = sqrt(drawn.noise * drawn.noise + drawn.bias_square);
    }
    *piece = settled;
}

// So many gaps at once that neither the pulse nor the jump tells them apart.
static long gaps_of(const FitWindow *window, const PulseFit *fit) {
    double curvature[3][3], spread[3][3], det;
    const double variance = pulse_fit_variance(window, fit->residue.sum);
    memcpy(curvature, fit->curvature, sizeof curvature);
    if (!invert(curvature, spread, &det))
        return 1;
    PulseModel shape;
    double T;
    pulse_fit_model(window, &fit->at, &shape, &T);
    const double A = fit->residue.amplitude;
    const double jump = fmax(fabs(A * pulse_model_force(&shape, 0)),
                             fabs(A * pulse_model_force(&shape, shape.length)));
    const double deviation = sqrt(fmin(spread[START][START], spread[END][END]) * variance);
    return (long)fmin(fmax(floor(fmin(deviation, variance / (jump * jump)) / 2), 1), 1e6);
}

// From the best pair of gaps outwards as long as they matter; how many pieces these are.
static size_t spread_out(const FitWindow *window, const PulseFit *fits, size_t count,
                         Piece *pieces) {
    const PulseFit *fit = fits;
    static const int moves[8][2] = {{-1, 0},  {1, 0}, {0, -1}, {0, 1},
                                    {-1, -1}, {1, 1}, {-1, 1}, {1, -1}};
    bool is_seen[SIDE][SIDE] = {{false}};
    PulseFit from[SIDE * SIDE];
    int queue[SIDE * SIDE][2], head = 0, tail = 0;
    size_t found = 0;
    const long gaps = gaps_of(window, fit);
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
        const double gain = pulse_fit_log_likelihood(window, here.residue.sum) -
                            pulse_fit_log_likelihood(window, fit->residue.sum);
        if (!(gain > -14) || !weigh(window, &box, &here, &pieces[found]))
            continue;
        found++;
        for (int way = 0; way < 8; way++) {
            const int r = p + moves[way][0], s = q + moves[way][1];
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

static Posterior belief(const Piece *pieces, size_t count, int figure) {
    double mean = 0, square = 0;
    for (size_t i = 0; i < count; i++)
        mean += pieces[i].weight * pieces[i].mean[figure];
    for (size_t i = 0; i < count; i++)
        square += pieces[i].weight *
                  (pow(pieces[i].mean[figure] - mean, 2) + pow(pieces[i].deviation[figure], 2));
    return (Posterior){mean, sqrt(square)};
}

// Below which T_c lies with that share; `widening` is that of a Student distribution.
static double quantile(const Piece *pieces, size_t count, double share, double widening) {
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
                          bool is_form_sure, FitConfidence *interval) {
    Piece *pieces = malloc(SIDE * SIDE * sizeof *pieces);
    *interval = (FitConfidence){.least = (double)NAN, .most = (double)NAN};
    if (pieces == NULL)
        return STATUS_NO_MEMORY;
    const size_t found = spread_out(window, fits, count, pieces);
    double height = -(double)INFINITY, sum = 0;
    for (size_t i = 0; i < found; i++)
        height = fmax(height, pieces[i].weight);
    for (size_t i = 0; i < found; i++) {
        pieces[i].weight = exp(pieces[i].weight - height);
        sum += pieces[i].weight;
    }
    for (size_t i = 0; i < found; i++)
        pieces[i].weight /= sum;
    const Gaps gaps_told[2] = {gaps_between(pieces, found, START),
                               gaps_between(pieces, found, END)};
    for (size_t i = 0; i < found; i++)
        settle(&pieces[i], gaps_told, is_form_sure);
    if (found > 0) {
        const double freedom = fmax((double)window->blocks + window->noise_freedom - 5, 1);
        const double widening = 1 + 1.2 / freedom;
        interval->contact_time = belief(pieces, found, CONTACT_TIME);
        interval->decay = belief(pieces, found, DECAY);
        interval->least = quantile(pieces, found, 0.025, widening);
        interval->most = quantile(pieces, found, 0.975, widening);
    }
    free(pieces);
    return STATUS_OK;
}
