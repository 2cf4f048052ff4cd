// The chart of a fragility: the probability of exceeding each limit over the intensity, fitted and
// counted, and below it the fractiles of the limits' metrics.
#include <math.h>

#include "core/study/fragility.h"
#include "server/formats/chart.h"
#include "server/formats/study_formats.h"

enum { LIMITS_DRAWN = 8, METRICS_DRAWN = CHART_PANELS - 1, POINTS = 121 };

static const char *fragility_axis(Chart *chart, const FragilityIntensity *intensity) {
    if (intensity->measure != CHOICE_ABSENT)
        return "peak ground acceleration [m/s^2]";
    return chart_text(chart, "pseudo-acceleration at %g s, damping ratio %g [m/s^2]",
                      intensity->period, intensity->damping_ratio);
}

// Share of the records that exceeded the limit at some level up to `level`; NAN: none is known.
static double fragility_share(const Fragility *answer, const FragilityState *limit, size_t level) {
    size_t known = 0, exceeded = 0;
    for (size_t r = 0; r < answer->curves.count; r++) {
        const FragilityPoint *points = answer->curves.at[r].points.at;
        bool is_known = false, is_exceeded = false;
        for (size_t l = 0; l <= level; l++) {
            const double value = points[l].metrics.of[limit->metric];
            is_known = is_known || !isnan(value);
            is_exceeded = is_exceeded || value > limit->value;
        }
        known += is_known;
        exceeded += is_exceeded;
    }
    return known > 0 ? (double)exceeded / (double)known : (double)NAN;
}

static const char *fragility_limit_text(Chart *chart, const FragilityState *limit) {
    const char *unit = study_metric_unit(limit->metric);
    return chart_text(chart, "%s above %g%s%s", study_metric_names[limit->metric], limit->value,
                      unit != NULL ? " " : "", unit != NULL ? unit : "");
}

static void fragility_add_limit(Chart *chart, ChartPanel *panel, const Fragility *answer,
                                size_t index, const double *levels, size_t count) {
    const FragilityState *limit = &answer->limits.at[index];
    const char *name = fragility_limit_text(chart, limit);
    const size_t colour = index % CHART_COLOURS;
    double *shares = chart_new(chart, count, sizeof *shares);
    double *x = chart_new(chart, POINTS, sizeof *x), *y = chart_new(chart, POINTS, sizeof *y);
    const char **names = chart_new(chart, count, sizeof *names);
    for (size_t l = 0; l < count && !chart->is_failed; l++) {
        shares[l] = fragility_share(answer, limit, l);
        names[l] = chart_text(chart, "%.3g of the records at %g m/s^2", shares[l], levels[l]);
    }
    for (size_t i = 0; i < POINTS && !chart->is_failed; i++) {
        x[i] = levels[0] + (levels[count - 1] - levels[0]) * (double)i / (POINTS - 1);
        y[i] = erfc(-log(x[i] / limit->median) / limit->dispersion / sqrt(2)) / 2;
    }
    chart_add(panel, (ChartSeries){.kind = CHART_MARKERS,
                                   .x = levels,
                                   .y = shares,
                                   .count = count,
                                   .colour = colour,
                                   .names = names});
    chart_add(panel, (ChartSeries){.kind = CHART_LINE,
                                   .x = x,
                                   .y = y,
                                   .count = isnan(limit->median) ? 0 : POINTS,
                                   .colour = colour,
                                   .name = name,
                                   .legend = name});
}

static void fragility_add_metric(Chart *chart, const Fragility *answer, int metric,
                                 const double *levels, size_t count) {
    const char *name = study_metric_names[metric];
    ChartPanel *panel =
        chart_panel(chart, chart_quantity(chart, name, study_metric_unit(metric)), 150);
    double *fractiles[3];
    for (int k = 0; k < 3; k++)
        fractiles[k] = chart_new(chart, count, sizeof(double));
    size_t found = 0;
    for (size_t i = 0; i < answer->fractiles.count && found < count && !chart->is_failed; i++) {
        const FragilityFractile *fractile = &answer->fractiles.at[i];
        if (fractile->metric != metric)
            continue;
        fractiles[0][found] = fractile->p16;
        fractiles[1][found] = fractile->p50;
        fractiles[2][found++] = fractile->p84;
    }
    chart_add(panel, (ChartSeries){CHART_LINE, levels, fractiles[1], NULL, found, 0,
                                   .name = "half of the records are below"});
    chart_add(panel, (ChartSeries){.kind = CHART_BAND,
                                   .x = levels,
                                   .y = fractiles[0],
                                   .high = fractiles[2],
                                   .count = found});
    for (size_t i = 0; i < answer->limits.count && panel->count < CHART_SERIES; i++) {
        const FragilityState *limit = &answer->limits.at[i];
        if (limit->metric != metric)
            continue;
        double *x = chart_new(chart, 2, sizeof *x), *y = chart_new(chart, 2, sizeof *y);
        if (x == NULL || y == NULL)
            return;
        x[0] = levels[0];
        x[1] = levels[count - 1];
        y[0] = y[1] = limit->value;
        chart_add(panel,
                  (ChartSeries){CHART_LINE, x, y, NULL, 2, i % CHART_COLOURS, .name = "limit"});
    }
}

void chart_fragility(const Variant *variant, Chart *chart) {
    const Fragility *answer = (const Fragility *)(const void *)variant;
    *chart = (Chart){.width = 820, .left = 80, .right = 300, .title = "Fragility"};
    const size_t count = answer->curves.count > 0 ? answer->curves.at[0].points.count : 0;
    double *levels = chart_new(chart, count + 1, sizeof *levels);
    for (size_t l = 0; l < count && levels != NULL; l++)
        levels[l] = answer->curves.at[0].points.at[l].level;
    chart->heading = chart_text(chart, "Fragility of %zu ground motions", answer->curves.count);
    bytes_format(&chart->description,
                 "Dots: shares of the records; lines: lognormal distributions. Below: medians and "
                 "bands of 16 to 84 %% of the records. %llu of %llu runs failed.",
                 (unsigned long long)answer->made.failed, (unsigned long long)answer->made.runs);
    ChartPanel *panel = chart_panel(chart, "probability of exceeding a limit", 240);
    for (size_t i = 0; i < answer->limits.count && count > 0; i++)
        if (i < LIMITS_DRAWN)
            fragility_add_limit(chart, panel, answer, i, levels, count);
        else
            chart_note(chart, " Not drawn: ", fragility_limit_text(chart, &answer->limits.at[i]));
    for (size_t i = 0; i < answer->limits.count && count > 0; i++) {
        size_t first = 0;
        while (answer->limits.at[first].metric != answer->limits.at[i].metric)
            first++;
        const int metric = answer->limits.at[i].metric;
        if (first == i && chart->count <= METRICS_DRAWN)
            fragility_add_metric(chart, answer, metric, levels, count);
        else if (first == i)
            chart_note(chart, " Not drawn: fractiles of ", study_metric_names[metric]);
    }
    for (size_t i = 0; i < chart->count; i++) {
        chart->panels[i].x.is_unlabelled = i + 1 < chart->count;
        chart->panels[i].x.title = fragility_axis(chart, &answer->intensity);
    }
    for (size_t i = 0; i < answer->made.warnings.count; i++)
        chart_note(chart, " ", answer->made.warnings.at[i].detail);
}
