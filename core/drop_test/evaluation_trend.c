// The line has the weights of the mean. Its slope over its standard error is Student's t.
#include "core/drop_test/evaluation_trend.h"

#include "core/base/text_format.h"
#include "core/math/student_t.h"

static const double significance = 0.05;
static const double speeds_alike = 0.1; // of their mean: a span that shows no trend

Line line_fit(const Reading *readings, size_t count) {
    Line line = {.least = (double)INFINITY, .most = -(double)INFINITY};
    double weights = 0, products = 0;
    for (size_t i = 0; i < count; i++) {
        if (isnan(readings[i].speed))
            continue;
        line.count++;
        weights += readings[i].weight;
        line.speed += readings[i].weight * readings[i].speed;
        line.value += readings[i].weight * readings[i].value;
        line.least = fmin(line.least, readings[i].speed);
        line.most = fmax(line.most, readings[i].speed);
    }
    line.speed /= weights;
    line.value /= weights;
    for (size_t i = 0; i < count; i++) {
        if (isnan(readings[i].speed))
            continue;
        const double off = readings[i].speed - line.speed;
        line.squares += readings[i].weight * off * off;
        products += readings[i].weight * off * (readings[i].value - line.value);
    }
    line.slope = line.squares > 0 ? products / line.squares : 0;
    for (size_t i = 0; i < count; i++) {
        if (isnan(readings[i].speed))
            continue;
        const double off =
            readings[i].value - line.value - line.slope * (readings[i].speed - line.speed);
        line.left += readings[i].weight * off * off;
    }
    // In units of an average weight.
    line.left *= (double)line.count / weights;
    line.squares *= (double)line.count / weights;
    return line;
}

static bool say_trend(const char *name, const char *unit, double mean, Trend *trend) {
    const double percent = 100 / fabs(mean), missed = trend->missed_change * percent;
    if (trend->verdict == TREND_NOT_CONSTANT)
        return sentence(&trend->detail,
                        "%s %s by %.2g%s (%.3g %%) from %.3g to %.3g m/s (p = %.2g): it is not "
                        "constant over speed, and a table over speed says more than a mean",
                        name, trend->change < 0 ? "falls" : "rises", fabs(trend->change), unit,
                        fabs(trend->change) * percent, trend->least_speed, trend->most_speed,
                        trend->p);
    const bool is_constant = trend->verdict == TREND_CONSTANT;
    return sentence(&trend->detail,
                    "%s shows no trend from %.3g to %.3g m/s (slope %.2g +- %.2g%s per m/s, p = "
                    "%.2g)%s a change of up to %.2g%s (%.3g %%) over these speeds would not have "
                    "been seen",
                    name, trend->least_speed, trend->most_speed, trend->slope,
                    trend->standard_error, unit, trend->p,
                    is_constant ? " and may be taken as constant there;"
                                : ", but the readings are too few or too scattered to tell:",
                    trend->missed_change, unit, missed);
}

bool trend_make(const Reading *readings, size_t count, const char *name, const char *unit,
                Statistic *quantity) {
    const Line line = line_fit(readings, count);
    Trend *trend = &quantity->trend;
    trend->count = line.count;
    if (line.count > 0) {
        trend->least_speed = line.least;
        trend->most_speed = line.most;
    }
    if (line.count < 3)
        return sentence(&trend->detail,
                        "whether %s is constant over speed cannot be told: %zu reading%s with a "
                        "speed, at least three are needed",
                        name, line.count, line.count == 1 ? "" : "s");
    const double span = line.most - line.least;
    if (!(span > speeds_alike * line.speed))
        return sentence(&trend->detail,
                        "whether %s is constant over speed cannot be told: all readings were made "
                        "at about %.3g m/s",
                        name, line.speed);
    const double least = EVALUATION_RESOLVED * fabs(quantity->mean);
    const size_t freedom = line.count - 2;
    const double t = student_quantile(EVALUATION_CONFIDENCE, freedom);
    trend->mean_speed = line.speed;
    trend->mean_value = line.value;
    trend->slope = line.slope;
    trend->standard_error = sqrt(fmax(line.left / (double)freedom, least * least) / line.squares);
    trend->low = line.slope - t * trend->standard_error;
    trend->high = line.slope + t * trend->standard_error;
    trend->t = line.slope / trend->standard_error;
    trend->p = fmax(1 - student_share(fabs(trend->t), freedom), 0);
    trend->change = line.slope * span;
    trend->missed_change = fmax(fabs(trend->low), fabs(trend->high)) * span;
    trend->verdict = trend->p < significance ? TREND_NOT_CONSTANT
                     : trend->missed_change <= TREND_MATTERS * fabs(quantity->mean)
                         ? TREND_CONSTANT
                         : TREND_UNDECIDED;
    return say_trend(name, unit, quantity->mean, trend);
}
