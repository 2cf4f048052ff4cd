// Where all readings state their uncertainty u and at least four do, each weighs 1 / (u^2 + tau^2).
// tau is the scatter that the uncertainties do not explain: with it the weighted squares of the
// distances from the mean come to n - 1 (Paule and Mandel 1982); 0 where they come to less. The
// error of the mean is then scaled by those squares and takes Student's t (Hartung and Knapp 2001),
// so that uncertainties that are wrong in size, or beside the point, do little harm. Without that a
// ruler's reading of a low drop, ten times as uncertain as that of a high one, would count as much.
//
// Outliers are told by the distance from the median over the median of all such distances, which a
// few wild readings do not move, in units that are standard deviations of normal readings (Iglewicz
// and Hoaglin 1993). Their common cut of 3.5 would mark every fifth sample of three to ten good
// readings, hence the table. Where a trend over speed is shown they are told from its line.
#include "core/drop_test/reading_statistics.h"

#include <stdlib.h>

#include "core/base/text_format.h"
#include "core/drop_test/evaluation_trend.h"
#include "core/math/student_t.h"

static const double rounding = 1e-12;    // of a mean: no spread at all
static const double implausible = 0.001; // the chance of so little spread
enum { WEIGHTED_MIN = 4, HALVINGS = 100 };

// 95 % quantiles of the largest score among so many normal readings, of 30,000 to 400,000 samples.
static const struct {
    size_t count;
    double cut;
} cuts[] = {{3, 22},    {4, 6.9},    {5, 7.9},   {6, 5.5},   {7, 5.9},    {8, 4.9},
            {9, 5.1},   {10, 4.6},   {12, 4.4},  {15, 4.3},  {20, 4.0},   {30, 3.85},
            {50, 3.75}, {100, 3.75}, {200, 3.8}, {300, 3.9}, {1000, 4.1}, {3000, 4.3}};

// How many robust deviations from the middle a reading may be among so many: one sample of normal
// readings in twenty has one beyond it.
static double outlier_cut(size_t count) {
    size_t i = 0;
    while (i < COUNT(cuts) && cuts[i].count < count)
        i++;
    if (i == COUNT(cuts))
        return cuts[i - 1].cut + log10((double)count / 3000) / 2;
    if (i == 0 || cuts[i].count == count)
        return cuts[i].cut;
    const double from = (double)cuts[i - 1].count, to = (double)cuts[i].count;
    const double share = ((double)count - from) / (to - from);
    return cuts[i - 1].cut + share * (cuts[i].cut - cuts[i - 1].cut);
}

static int by_size(const void *a, const void *b) {
    const double left = *(const double *)a, right = *(const double *)b;
    return left < right ? -1 : left > right ? 1 : 0;
}

// Sorts them.
static double median_of(double *values, size_t count) {
    qsort(values, count, sizeof *values, by_size);
    return count % 2 == 1 ? values[count / 2] : values[count / 2 - 1] / 2 + values[count / 2] / 2;
}

static double mean_of(const Reading *readings, size_t count, bool with_outliers) {
    double sum = 0, rest = 0, n = 0;
    for (size_t i = 0; i < count; i++)
        if (with_outliers || !readings[i].is_outlier) {
            sum += readings[i].weight * readings[i].value;
            n += readings[i].weight;
        }
    for (size_t i = 0; i < count; i++)
        if (with_outliers || !readings[i].is_outlier)
            rest += readings[i].weight * (readings[i].value - sum / n);
    return sum / n + rest / n;
}

// The weighted squares of the distances from the mean.
static double squares_of(const Reading *readings, size_t count, double mean) {
    double squares = 0;
    for (size_t i = 0; i < count; i++)
        squares += readings[i].weight * (readings[i].value - mean) * (readings[i].value - mean);
    return squares;
}

static double weigh(Reading *readings, size_t count, double scatter) {
    for (size_t i = 0; i < count; i++)
        readings[i].weight =
            1 / (readings[i].uncertainty * readings[i].uncertainty + scatter * scatter);
    return squares_of(readings, count, mean_of(readings, count, true));
}

// Fills the weights where there are any.
static void make_weights(Reading *readings, size_t count, Statistic *quantity) {
    bool is_weighted = count >= WEIGHTED_MIN;
    for (size_t i = 0; i < count; i++)
        is_weighted = is_weighted && readings[i].uncertainty > 0;
    if (!is_weighted)
        return;
    double least = 0, most = 2 * sqrt((double)count) * quantity->deviation;
    const double freedom = (double)(count - 1);
    if (weigh(readings, count, 0) <= freedom)
        most = 0;
    for (int i = 0; i < HALVINGS && most > 0; i++) {
        const double middle = (least + most) / 2;
        if (weigh(readings, count, middle) > freedom)
            least = middle;
        else
            most = middle;
    }
    quantity->scatter = most;
    (void)weigh(readings, count, most);
}

// The squares that are left over those that the stated uncertainties would leave; NAN unless all
// are stated.
static double excess(const Reading *readings, size_t count, double mean) {
    double squares = 0;
    for (size_t i = 0; i < count; i++) {
        if (!(readings[i].uncertainty > 0))
            return (double)NAN;
        const double off = (readings[i].value - mean) / readings[i].uncertainty;
        squares += off * off;
    }
    return squares / (double)(count - 1);
}

// Whether normal readings have so little spread at most once in a thousand times, by Chernoff's
// bound of chi square: P(s^2 <= x u^2) <= (x exp(1 - x))^(n / 2).
static bool is_too_small(double x, size_t freedom) {
    return x < 1 && (double)freedom / 2 * (log(x) + 1 - x) < log(implausible);
}

// Of the mean, by the stated uncertainties alone; NAN unless all are stated.
static double stated_error(const Reading *readings, size_t count) {
    double squares = 0, sum = 0;
    for (size_t i = 0; i < count; i++) {
        const double part = readings[i].weight * readings[i].uncertainty;
        squares += part * part;
        sum += readings[i].weight;
    }
    return sqrt(squares) / sum > 0 ? sqrt(squares) / sum : (double)NAN;
}

static bool make_interval(const Reading *readings, size_t count, Statistic *quantity) {
    const double stated = stated_error(readings, count);
    const double mean = quantity->mean;
    double t = student_quantile(EVALUATION_CONFIDENCE, 0), sum = 0;
    bool has_spread = count > 1 && quantity->deviation > rounding * fabs(mean);
    if (has_spread && stated > 0)
        has_spread = !is_too_small(excess(readings, count, mean), count - 1);
    bool is_said;
    if (has_spread) {
        t = student_quantile(EVALUATION_CONFIDENCE, count - 1);
        for (size_t i = 0; i < count; i++)
            sum += readings[i].weight;
        quantity->standard_error =
            sqrt(squares_of(readings, count, mean) / (double)(count - 1) / sum);
        is_said =
            isnan(quantity->scatter)
                ? sentence(&quantity->why,
                           "mean +- %.4g standard errors, Student's t for %zu readings", t, count)
                : sentence(&quantity->why,
                           "mean weighted by the stated uncertainties and a scatter of %.3g "
                           "beyond them, +- %.4g standard errors, Student's t for %zu "
                           "readings",
                           quantity->scatter, t, count);
    } else if (stated > 0) {
        quantity->standard_error = stated;
        is_said =
            count == 1
                ? sentence(&quantity->why,
                           "one reading: the interval is what its uncertainty alone leaves, "
                           "nothing is known of the spread")
                : sentence(&quantity->why,
                           "the %zu readings lie closer together than their stated uncertainty "
                           "would have it: the interval is made of that",
                           count);
    } else {
        return sentence(&quantity->why,
                        count == 1 ? "one reading without a stated uncertainty: no interval"
                                   : "all readings are the same, to what the instrument resolves, "
                                     "whose uncertainty is not stated: no interval");
    }
    quantity->low = mean - t * quantity->standard_error;
    quantity->high = mean + t * quantity->standard_error;
    return is_said;
}

// Distances from the median, or where a trend is shown from its line.
static bool find_outliers(Reading *readings, size_t count, Statistic *quantity) {
    double *values = calloc(2 * count, sizeof *values);
    if (values == NULL)
        return false;
    const bool has_line = quantity->trend.verdict == TREND_NOT_CONSTANT;
    const Line line = line_fit(readings, count);
    for (size_t i = 0; i < count; i++) {
        values[i] = readings[i].value;
        if (has_line && !isnan(readings[i].speed))
            values[i] -= line.slope * (readings[i].speed - line.speed);
    }
    double *sorted = values + count, mean = 0;
    for (size_t i = 0; i < count; i++)
        sorted[i] = values[i];
    const double middle = median_of(sorted, count);
    for (size_t i = 0; i < count; i++) {
        sorted[i] = fabs(values[i] - middle);
        mean += sorted[i] / (double)count;
    }
    // Where most are the same, their mean distance stands for the median one.
    const double median = median_of(sorted, count);
    const double spread = median > rounding * fabs(middle) ? 1.482602 * median : 1.253314 * mean;
    for (size_t i = 0; i < count; i++) {
        const double own = readings[i].uncertainty > 0 ? readings[i].uncertainty : 0;
        const double scale = fmax(fmax(spread, own), EVALUATION_RESOLVED * fabs(middle));
        readings[i].score = scale > 0 ? (values[i] - middle) / scale : 0;
        readings[i].is_outlier = fabs(readings[i].score) > outlier_cut(count);
        quantity->outliers += readings[i].is_outlier ? 1 : 0;
    }
    if (quantity->outliers > 0 && quantity->outliers < count)
        quantity->mean_without_outliers = mean_of(readings, count, false);
    free(values);
    return true;
}

static bool make_spread(const Reading *readings, size_t count, Statistic *quantity) {
    double *sorted = calloc(count, sizeof *sorted), squares = 0;
    if (sorted == NULL)
        return false;
    for (size_t i = 0; i < count; i++) {
        sorted[i] = readings[i].value;
        squares +=
            (sorted[i] - quantity->unweighted_mean) * (sorted[i] - quantity->unweighted_mean);
    }
    quantity->median = median_of(sorted, count);
    quantity->minimum = sorted[0];
    quantity->maximum = sorted[count - 1];
    if (count > 1)
        quantity->deviation = sqrt(squares / (double)(count - 1));
    free(sorted);
    return true;
}

void statistic_clear(Statistic *quantity) {
    free(quantity->why);
    free(quantity->trend.detail);
    *quantity = (Statistic){.why = NULL};
}

Status statistic_make(Reading *readings, size_t count, const char *name, const char *unit,
                      Statistic *quantity, Problem *problem) {
    const double none = (double)NAN;
    *quantity = (Statistic){
        .count = count,
        .mean = none,
        .unweighted_mean = none,
        .deviation = none,
        .scatter = none,
        .standard_error = none,
        .spread = none,
        .low = none,
        .high = none,
        .minimum = none,
        .median = none,
        .maximum = none,
        .mean_without_outliers = none,
        .trend = {.least_speed = none,
                  .most_speed = none,
                  .mean_speed = none,
                  .mean_value = none,
                  .slope = none,
                  .standard_error = none,
                  .low = none,
                  .high = none,
                  .t = none,
                  .p = none,
                  .change = none,
                  .missed_change = none,
                  .verdict = CHOICE_ABSENT},
    };
    for (size_t i = 0; i < count; i++) {
        Reading *reading = &readings[i];
        reading->weight = 1;
        reading->score = none;
        if (!(reading->uncertainty > rounding * fabs(reading->value)))
            reading->uncertainty = none;
    }
    bool is_made = true;
    if (count == 0) {
        is_made = sentence(&quantity->why, "no reading that counts tells the %s", name);
    } else {
        quantity->unweighted_mean = mean_of(readings, count, true);
        is_made = make_spread(readings, count, quantity);
        make_weights(readings, count, quantity);
        quantity->mean = mean_of(readings, count, true);
        is_made = is_made && make_interval(readings, count, quantity);
    }
    quantity->spread = fmax(isnan(quantity->scatter) ? quantity->deviation : quantity->scatter,
                            quantity->standard_error);
    if (!(quantity->spread > rounding * fabs(quantity->mean)))
        quantity->spread = none;
    is_made = is_made && trend_make(readings, count, name, unit, quantity);
    if (is_made && count > 2)
        is_made = find_outliers(readings, count, quantity);
    return is_made ? STATUS_OK
                   : problem_set(problem, STATUS_NO_MEMORY, "no memory for the evaluation");
}
