// Where all readings state their uncertainty u and at least four do, each has the weight
// 1 / (u^2 + tau^2). tau is the scatter beyond the uncertainties: with it the weighted sum of
// squared distances from the mean is n - 1 (Paule and Mandel 1982); 0 where the sum is less without
// it. The error of the mean is scaled by that sum and has Student's t (Hartung and Knapp 2001), so
// that wrong uncertainties do little harm. Unweighted, a ruler's reading of a low drop would count
// as much as that of a high one with a tenth of its uncertainty.
//
// The score of an outlier is its distance from the median over the median distance, in standard
// deviations of normal readings (Iglewicz and Hoaglin 1993). The usual limit of 3.5 would mark
// every fifth sample of three to ten good readings, hence the table. Where a trend over speed is
// significant, distances are from its line.
//
// The line of a trend has the weights of the mean. Its slope over its standard error is Student's
// t.
#include "core/drop_test/reading_statistics.h"

#include <stdlib.h>

#include "core/base/status.h"
#include "core/math/student_t.h"

static const char *const trend_verdict_names[] = {"constant", "not_constant", "undecided", NULL};

// clang-format off
static const Field trend_fields[] = {
    FIELD_COUNT(Trend, count, NULL, AT_MIN(0), OPTIONAL, "readings with a speed"),
    FIELD_REAL(Trend, least_speed, "m/s", ANY, OPTIONAL, "the slowest of them"),
    FIELD_REAL(Trend, most_speed, "m/s", ANY, OPTIONAL, "the fastest"),
    FIELD_REAL(Trend, mean_speed, "m/s", ANY, OPTIONAL, "mean speed of these readings; a point of the line"),
    FIELD_REAL(Trend, mean_value, NULL, ANY, OPTIONAL, "value of the line at mean_speed"),
    FIELD_REAL(Trend, slope, NULL, ANY, OPTIONAL, "slope of the line by least squares, per m/s"),
    FIELD_REAL(Trend, standard_error, NULL, ANY, OPTIONAL, "of the slope"),
    FIELD_REAL(Trend, low, NULL, ANY, OPTIONAL, "95 % interval of the slope"),
    FIELD_REAL(Trend, high, NULL, ANY, OPTIONAL, "likewise"),
    FIELD_REAL(Trend, t, NULL, ANY, OPTIONAL, "slope over standard error"),
    FIELD_REAL(Trend, p, NULL, ANY, OPTIONAL, "probability of at least such a slope if there is none"),
    FIELD_REAL(Trend, change, NULL, ANY, OPTIONAL, "change of the line from the slowest to the fastest"),
    FIELD_REAL(Trend, missed_change, NULL, ANY, OPTIONAL, "largest such change that the data do not rule out, 95 %"),
    FIELD_CHOICE(Trend, verdict, trend_verdict_names, OPTIONAL, "not_constant: there is a significant slope, p < 0.05; constant: there is none, and a change of 20 % would have been detected; undecided: it would not have been; null: no test is possible"),
    FIELD_TEXT(Trend, detail, 0, PRESENCE_OPTIONAL, 0, "the verdict in words"),
    FIELD_END
};

const Field reading_statistic_fields[] = {
    FIELD_COUNT(Statistic, count, NULL, AT_MIN(0), OPTIONAL, "readings that count"),
    FIELD_REAL(Statistic, mean, NULL, ANY, OPTIONAL, "mean of the readings that count; weighted by their uncertainty and scatter if at least four count and all state their uncertainty"),
    FIELD_REAL(Statistic, unweighted_mean, NULL, ANY, OPTIONAL, "unweighted mean of the readings"),
    FIELD_REAL(Statistic, deviation, NULL, ANY, OPTIONAL, "standard deviation of the readings"),
    FIELD_REAL(Statistic, scatter, NULL, ANY, OPTIONAL, "standard deviation beyond the stated uncertainties; null: the mean is not weighted"),
    FIELD_REAL(Statistic, standard_error, NULL, ANY, OPTIONAL, "of the mean"),
    FIELD_REAL(Statistic, spread, NULL, ANY, OPTIONAL, "standard deviation that a revision states with the mean: scatter where the mean is weighted, else deviation, and standard_error at least"),
    FIELD_REAL(Statistic, low, NULL, ANY, OPTIONAL, "95 % interval of the mean"),
    FIELD_REAL(Statistic, high, NULL, ANY, OPTIONAL, "likewise"),
    FIELD_REAL(Statistic, minimum, NULL, ANY, OPTIONAL, "smallest reading"),
    FIELD_REAL(Statistic, median, NULL, ANY, OPTIONAL, "median reading"),
    FIELD_REAL(Statistic, maximum, NULL, ANY, OPTIONAL, "largest reading"),
    FIELD_COUNT(Statistic, outliers, NULL, AT_MIN(0), OPTIONAL, "number of outliers; they are in the mean"),
    FIELD_REAL(Statistic, mean_without_outliers, NULL, ANY, OPTIONAL, "mean without the outliers; null if there are none"),
    FIELD_TEXT(Statistic, why, 0, PRESENCE_OPTIONAL, 0, "how the interval was made, or why there is none"),
    FIELD_ITEM(Statistic, trend, trend_fields, NULL, PRESENCE_DEFAULT, "whether it is constant over approach speed"),
    FIELD_END
};
// clang-format on

static const double rounding = 1e-12;    // of a mean: no spread at all
static const double resolved = 1e-6;     // of a value: less is neither an outlier nor a trend
static const double implausible = 0.001; // probability of so little spread
static const double significance = 0.05;
static const double span_min = 0.1; // of the mean speed, for a trend
enum { WEIGHTED_MIN = 4, HALVINGS = 100 };

// 95 % quantiles of the largest score among so many normal readings, of 30,000 to 400,000 samples.
static const struct {
    size_t count;
    double cut;
} cuts[] = {{3, 22},    {4, 6.9},    {5, 7.9},   {6, 5.5},   {7, 5.9},    {8, 4.9},
            {9, 5.1},   {10, 4.6},   {12, 4.4},  {15, 4.3},  {20, 4.0},   {30, 3.85},
            {50, 3.75}, {100, 3.75}, {200, 3.8}, {300, 3.9}, {1000, 4.1}, {3000, 4.3}};

// The score beyond which one of `count` normal readings is in one sample of twenty.
static double statistic_cut(size_t count) {
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

// Sorts the values.
static double statistic_median(double *values, size_t count) {
    reals_sort(values, count);
    return count % 2 == 1 ? values[count / 2] : values[count / 2 - 1] / 2 + values[count / 2] / 2;
}

static double statistic_mean(const Reading *readings, size_t count) {
    double sum = 0, rest = 0, n = 0;
    for (size_t i = 0; i < count; i++) {
        sum += readings[i].weight * readings[i].value;
        n += readings[i].weight;
    }
    for (size_t i = 0; i < count; i++)
        rest += readings[i].weight * (readings[i].value - sum / n);
    return sum / n + rest / n;
}

// The weighted sum of squared distances from the mean.
static double statistic_squares(const Reading *readings, size_t count, double mean) {
    double squares = 0;
    for (size_t i = 0; i < count; i++)
        squares += readings[i].weight * (readings[i].value - mean) * (readings[i].value - mean);
    return squares;
}

static double statistic_weigh(Reading *readings, size_t count, double scatter) {
    for (size_t i = 0; i < count; i++)
        readings[i].weight =
            1 / (readings[i].uncertainty * readings[i].uncertainty + scatter * scatter);
    return statistic_squares(readings, count, statistic_mean(readings, count));
}

// Sets weights and scatter where all readings state their uncertainty.
static void statistic_set_weights(Reading *readings, size_t count, Statistic *statistic) {
    bool is_weighted = count >= WEIGHTED_MIN;
    for (size_t i = 0; i < count; i++)
        is_weighted = is_weighted && readings[i].uncertainty > 0;
    if (!is_weighted)
        return;
    double least = 0, most = 2 * sqrt((double)count) * statistic->deviation;
    const double freedom = (double)(count - 1);
    if (statistic_weigh(readings, count, 0) <= freedom)
        most = 0;
    for (int i = 0; i < HALVINGS && most > 0; i++) {
        const double middle = (least + most) / 2;
        *(statistic_weigh(readings, count, middle) > freedom ? &least : &most) = middle;
    }
    statistic->scatter = most;
    (void)statistic_weigh(readings, count, most);
}

// Whether normal readings with the stated uncertainties have so little spread at most once in a
// thousand samples, by Chernoff's bound of chi square: P(s^2 <= x u^2) <= (x exp(1 - x))^(n / 2).
static bool statistic_is_too_close(const Reading *readings, size_t count, double mean) {
    double x = 0;
    for (size_t i = 0; i < count; i++) {
        const double off = (readings[i].value - mean) / readings[i].uncertainty;
        x += off * off;
    }
    x /= (double)(count - 1);
    return x < 1 && (double)(count - 1) / 2 * (log(x) + 1 - x) < log(implausible);
}

static bool statistic_set_interval(const Reading *readings, size_t count, Statistic *statistic) {
    const double mean = statistic->mean;
    double t = student_t_quantile(EVALUATION_CONFIDENCE, 0), weights = 0, squares = 0;
    for (size_t i = 0; i < count; i++) {
        const double part = readings[i].weight * readings[i].uncertainty;
        squares += part * part;
        weights += readings[i].weight;
    }
    const double stated = sqrt(squares) / weights; // NAN unless all are stated
    bool is_made;
    if (count > 1 && statistic->deviation > rounding * fabs(mean) &&
        !(stated > 0 && statistic_is_too_close(readings, count, mean))) {
        t = student_t_quantile(EVALUATION_CONFIDENCE, count - 1);
        statistic->standard_error =
            sqrt(statistic_squares(readings, count, mean) / (double)(count - 1) / weights);
        is_made =
            isnan(statistic->scatter)
                ? text_format(&statistic->why,
                              "mean +- %.4g standard errors, Student's t for %zu readings", t,
                              count)
                : text_format(&statistic->why,
                              "mean weighted by the stated uncertainties and a scatter of %.3g "
                              "beyond them, +- %.4g standard errors, Student's t for %zu readings",
                              statistic->scatter, t, count);
    } else if (stated > 0) {
        statistic->standard_error = stated;
        is_made =
            count == 1
                ? text_format(
                      &statistic->why,
                      "one reading: the interval is that of its uncertainty; the spread is unknown")
                : text_format(&statistic->why,
                              "the %zu readings are closer together than their stated uncertainty "
                              "allows: the interval is that of the uncertainty",
                              count);
    } else {
        return text_format(&statistic->why,
                           count == 1 ? "one reading without a stated uncertainty: no interval"
                                      : "all readings are equal within the resolution of the "
                                        "instrument, whose uncertainty is not stated: no interval");
    }
    statistic->low = mean - t * statistic->standard_error;
    statistic->high = mean + t * statistic->standard_error;
    return is_made;
}

static bool trend_describe(const char *name, const char *unit, double mean, Trend *trend) {
    const double percent = 100 / fabs(mean), missed = trend->missed_change * percent;
    if (trend->verdict == TREND_NOT_CONSTANT)
        return text_format(
            &trend->detail,
            "%s %s by %.2g%s (%.3g %%) from %.3g to %.3g m/s (p = %.2g): it is not constant over "
            "speed, and a table over speed describes it better than a mean",
            name, trend->change < 0 ? "falls" : "rises", fabs(trend->change), unit,
            fabs(trend->change) * percent, trend->least_speed, trend->most_speed, trend->p);
    return text_format(
        &trend->detail,
        "%s shows no trend from %.3g to %.3g m/s (slope %.2g +- %.2g%s per m/s, p = %.2g)%s a "
        "change of up to %.2g%s (%.3g %%) over these speeds would not have been detected",
        name, trend->least_speed, trend->most_speed, trend->slope, trend->standard_error, unit,
        trend->p,
        trend->verdict == TREND_CONSTANT
            ? " and may be taken as constant there;"
            : ", but the readings are too few or too scattered for a verdict:",
        trend->missed_change, unit, missed);
}

// The slope of the line through mean_speed and mean_value, and its standard error, at least
// `least` relative to the range of speeds.
static void trend_fit(const Reading *readings, size_t count, double weights, double least,
                      Trend *trend) {
    double products = 0, squares = 0, left = 0; // of speeds, of residuals
    for (size_t i = 0; i < count; i++) {
        if (isnan(readings[i].speed))
            continue;
        const double off = readings[i].speed - trend->mean_speed;
        squares += readings[i].weight * off * off;
        products += readings[i].weight * off * (readings[i].value - trend->mean_value);
    }
    trend->slope = squares > 0 ? products / squares : 0;
    for (size_t i = 0; i < count; i++) {
        if (isnan(readings[i].speed))
            continue;
        const double off = readings[i].value - trend->mean_value -
                           trend->slope * (readings[i].speed - trend->mean_speed);
        left += readings[i].weight * off * off;
    }
    // In units of an average weight.
    left *= (double)trend->count / weights;
    squares *= (double)trend->count / weights;
    trend->standard_error = sqrt(fmax(left / (double)(trend->count - 2), least * least) / squares);
}

static bool trend_set(const Reading *readings, size_t count, const char *name, const char *unit,
                      Statistic *statistic) {
    Trend *trend = &statistic->trend;
    double weights = 0, speed = 0, value = 0;
    trend->count = 0;
    for (size_t i = 0; i < count; i++) {
        if (isnan(readings[i].speed))
            continue;
        trend->count++;
        weights += readings[i].weight;
        speed += readings[i].weight * readings[i].speed;
        value += readings[i].weight * readings[i].value;
        trend->least_speed = fmin(trend->least_speed, readings[i].speed);
        trend->most_speed = fmax(trend->most_speed, readings[i].speed);
    }
    const size_t with_speed = (size_t)trend->count;
    if (with_speed < 3)
        return text_format(
            &trend->detail,
            "whether %s is constant over speed is unknown: %zu reading%s with a speed, "
            "at least three are needed",
            name, with_speed, with_speed == 1 ? "" : "s");
    const double span = trend->most_speed - trend->least_speed, mean = fabs(statistic->mean);
    speed /= weights;
    if (!(span > span_min * speed))
        return text_format(
            &trend->detail,
            "whether %s is constant over speed is unknown: all readings were made at "
            "about %.3g m/s",
            name, speed);
    trend->mean_speed = speed;
    trend->mean_value = value / weights;
    trend_fit(readings, count, weights, resolved * mean, trend);
    const size_t freedom = with_speed - 2;
    const double half = student_t_quantile(EVALUATION_CONFIDENCE, freedom) * trend->standard_error;
    trend->low = trend->slope - half;
    trend->high = trend->slope + half;
    trend->t = trend->slope / trend->standard_error;
    trend->p = fmax(1 - student_t_probability(fabs(trend->t), freedom), 0);
    trend->change = trend->slope * span;
    trend->missed_change = fmax(fabs(trend->low), fabs(trend->high)) * span;
    trend->verdict = trend->p < significance                           ? TREND_NOT_CONSTANT
                     : trend->missed_change <= TREND_CHANGE_MAX * mean ? TREND_CONSTANT
                                                                       : TREND_UNDECIDED;
    return trend_describe(name, unit, statistic->mean, trend);
}

// `scratch` has room for two numbers a reading.
static void statistic_set_outliers(Reading *readings, size_t count, double *scratch,
                                   Statistic *statistic) {
    const Trend *trend = &statistic->trend;
    double *values = scratch, *sorted = values + count, mean = 0;
    for (size_t i = 0; i < count; i++) {
        values[i] = readings[i].value;
        if (trend->verdict == TREND_NOT_CONSTANT && !isnan(readings[i].speed))
            values[i] -= trend->slope * (readings[i].speed - trend->mean_speed);
        sorted[i] = values[i];
    }
    const double middle = statistic_median(sorted, count);
    for (size_t i = 0; i < count; i++) {
        sorted[i] = fabs(values[i] - middle);
        mean += sorted[i] / (double)count;
    }
    // Where most readings are equal, the mean distance replaces the median distance.
    const double median = statistic_median(sorted, count);
    const double spread = median > rounding * fabs(middle) ? 1.482602 * median : 1.253314 * mean;
    for (size_t i = 0; i < count; i++) {
        const double own = readings[i].uncertainty > 0 ? readings[i].uncertainty : 0;
        const double scale = fmax(fmax(spread, own), resolved * fabs(middle));
        readings[i].score = scale > 0 ? (values[i] - middle) / scale : 0;
        readings[i].is_outlier = fabs(readings[i].score) > statistic_cut(count);
        if (readings[i].is_outlier) {
            readings[i].weight = 0;
            statistic->outliers++;
        }
    }
    if (statistic->outliers > 0 && statistic->outliers < count)
        statistic->mean_without_outliers = statistic_mean(readings, count);
}

static void statistic_set_spread(const Reading *readings, size_t count, double *scratch,
                                 Statistic *statistic) {
    double squares = 0;
    for (size_t i = 0; i < count; i++) {
        const double off = readings[i].value - statistic->unweighted_mean;
        scratch[i] = readings[i].value;
        squares += off * off;
    }
    statistic->median = statistic_median(scratch, count);
    statistic->minimum = scratch[0];
    statistic->maximum = scratch[count - 1];
    if (count > 1)
        statistic->deviation = sqrt(squares / (double)(count - 1));
}

Status reading_statistics_run(Reading *readings, size_t count, const char *name, const char *unit,
                              Statistic *statistic) {
    *statistic = (Statistic){.why = NULL};
    fields_clear(reading_statistic_fields, statistic);
    statistic->count = count;
    statistic->outliers = 0;
    for (size_t i = 0; i < count; i++) {
        Reading *reading = &readings[i];
        reading->weight = 1;
        reading->score = (double)NAN;
        if (!(reading->uncertainty > rounding * fabs(reading->value)))
            reading->uncertainty = (double)NAN;
    }
    double *scratch = calloc(2 * count + 1, sizeof *scratch);
    bool is_made = scratch != NULL;
    if (is_made && count == 0) {
        is_made = text_format(&statistic->why, "no reading that counts gives the %s", name);
    } else if (is_made) {
        statistic->unweighted_mean = statistic_mean(readings, count);
        statistic_set_spread(readings, count, scratch, statistic);
        statistic_set_weights(readings, count, statistic);
        statistic->mean = statistic_mean(readings, count);
        is_made = statistic_set_interval(readings, count, statistic);
    }
    statistic->spread = fmax(isnan(statistic->scatter) ? statistic->deviation : statistic->scatter,
                             statistic->standard_error);
    if (!(statistic->spread > rounding * fabs(statistic->mean)))
        statistic->spread = (double)NAN;
    is_made = is_made && trend_set(readings, count, name, unit, statistic);
    if (is_made && count > 2)
        statistic_set_outliers(readings, count, scratch, statistic);
    free(scratch);
    return status_made(is_made);
}
