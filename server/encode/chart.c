// Lines join the points of one solver, a step line below them the best of all. An error of 0 has no
// logarithm: it stands on the floor, which is labelled 0.
#include "server/encode/chart.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "server/encode/plot.h"
#include "server/encode/svg.h"

enum { GROUPS = SVG_COLOURS, NAME = 32 };

static const double width = 640, height = 430;
static const double left = 62, right = 486, top = 44, bottom = 376; // of the plot

static const char rules[] =
    ".best { stroke-opacity: 0.28; stroke-width: 6; stroke-linejoin: round; }\n"
    ".wanted { stroke-dasharray: 5 4; } .ring { stroke-width: 1.5; }\n";
static const char *const marks[GROUPS] = {"M-5 0a5 5 0 1 0 10 0a5 5 0 1 0-10 0z",
                                          "M-4.5-4.5h9v9h-9z",
                                          "M0-6L6 0L0 6L-6 0z",
                                          "M0-6L5.5 4.5h-11z",
                                          "M0 6L5.5-4.5h-11z",
                                          "M-6-2h4v-4h4v4h4v4h-4v4h-4v-4h-4z",
                                          "M-5-2.5L0-5.5L5-2.5V2.5L0 5.5L-5 2.5z",
                                          "M-6 0L4.5-5.5v11z",
                                          "M6 0L-4.5-5.5v11z",
                                          "M-6-3h12v6h-12z",
                                          "M-3-6h6v12h-6z",
                                          "M-5-5h10L0 0L5 5h-10L0 0z"};

// One line of points: a solver, or one thing given up beside it.
typedef struct Chart {
    const Tradeoff *tradeoff;
    char groups[GROUPS][NAME];
    size_t group_count;
    Plot plot; // with a floor where an error is 0
    Bytes *bytes;
} Chart;

static const char *group_name(const TradeoffPoint *point) {
    return point->contact_model != NULL     ? point->contact_model
           : !isnan(point->sample_rate)     ? "fewer samples"
           : point->modes != COUNT_ABSENT   ? "fewer modes"
           : point->segment != COUNT_ABSENT ? "shorter segments"
           : !isnan(point->duration)        ? "shorter run"
                                            : point->solver;
}

static double error_of(const Chart *chart, const TradeoffPoint *point) {
    return error_metrics_by(&point->errors, chart->tradeoff->metric);
}

static bool is_drawn(const Chart *chart, const TradeoffPoint *point) {
    return point->status == TRADEOFF_MEASURED && point->cpu_minimum > 0 &&
           !isnan(error_of(chart, point));
}

static size_t group_of(Chart *chart, const TradeoffPoint *point) {
    const char *name = group_name(point);
    size_t at = 0;
    while (at < chart->group_count && strcmp(chart->groups[at], name) != 0)
        at++;
    if (at == chart->group_count && at < GROUPS)
        snprintf(chart->groups[chart->group_count++], NAME, "%s", name);
    return at < GROUPS ? at : GROUPS - 1;
}

static double x_of(const Chart *chart, double cpu) {
    return plot_x(&chart->plot, cpu);
}

static double y_of(const Chart *chart, double error) {
    return plot_y(&chart->plot, error);
}

// All points that are drawn, and the error that is wanted.
static void fit(Chart *chart) {
    Plot *plot = &chart->plot;
    double cpu = 1e-6;
    plot_begin(plot);
    for (size_t i = 0; i < chart->tradeoff->points.count; i++) {
        const TradeoffPoint *point = &chart->tradeoff->points.at[i];
        if (!is_drawn(chart, point))
            continue;
        (void)group_of(chart, point);
        cpu = point->cpu_minimum;
        plot->has_floor = plot->has_floor || !(error_of(chart, point) > 0);
        plot_fit_point(plot, cpu, error_of(chart, point));
    }
    plot_fit_point(plot, cpu, chart->tradeoff->error);
    // Nothing at all, or errors of 0 alone.
    if (!(plot->x_max > 0))
        plot_fit_point(plot, cpu, 0.1);
    for (size_t i = 0; i < chart->tradeoff->points.count; i++)
        if (is_drawn(chart, &chart->tradeoff->points.at[i]))
            plot_fit_point(plot, chart->tradeoff->points.at[i].cpu_minimum, plot->y_max);
}

static int by_cpu(const void *a, const void *b) {
    const TradeoffPoint *const *x = a, *const *y = b;
    return ((*x)->cpu_minimum > (*y)->cpu_minimum) - ((*x)->cpu_minimum < (*y)->cpu_minimum);
}

// From each best point along its error to the next one, which is slower and closer.
static void put_best(const Chart *chart) {
    const TradeoffPoints *points = &chart->tradeoff->points;
    const TradeoffPoint **best = calloc(points->count + 1, sizeof *best);
    size_t count = 0;
    if (best == NULL) {
        chart->bytes->is_failed = true;
        return;
    }
    for (size_t i = 0; i < points->count; i++)
        if (points->at[i].is_best && is_drawn(chart, &points->at[i]))
            best[count++] = &points->at[i];
    qsort(best, count, sizeof *best, by_cpu);
    for (size_t i = 0; i < count; i++)
        bytes_format(chart->bytes,
                     i == 0 ? "<path class=\"strong best\" d=\"M%.1f %.1f" : "H%.1fV%.1f",
                     x_of(chart, best[i]->cpu_minimum), y_of(chart, error_of(chart, best[i])));
    if (count > 0)
        bytes_format(chart->bytes, "H%.0f\"/>\n", right);
    free(best);
}

static void put_wanted(const Chart *chart) {
    const double error = chart->tradeoff->error;
    if (error > 0)
        bytes_format(chart->bytes, "<path class=\"strong wanted\" d=\"M%.0f %.1fH%.0f\"/>\n", left,
                     y_of(chart, error), right);
}

static void put_point(Chart *chart, const TradeoffPoint *point) {
    Bytes *bytes = chart->bytes;
    const size_t group = group_of(chart, point);
    bytes_format(bytes, "<path class=\"mark s%zu\" transform=\"translate(%.1f %.1f)\" d=\"%s\">",
                 group, x_of(chart, point->cpu_minimum), y_of(chart, error_of(chart, point)),
                 marks[group]);
    bytes_text(bytes, "<title>");
    svg_text(bytes, point->name);
    bytes_format(bytes, ": %.2g%s in %.3g s%s</title></path>\n", error_of(chart, point),
                 metric_units[chart->tradeoff->metric], point->cpu_minimum,
                 point->is_best ? ", none is cheaper and closer" : "");
}

static void put_group(Chart *chart, size_t group) {
    Bytes *bytes = chart->bytes;
    const TradeoffPoints *points = &chart->tradeoff->points;
    size_t count = 0;
    for (size_t i = 0; i < points->count; i++) {
        const TradeoffPoint *point = &points->at[i];
        if (!is_drawn(chart, point) || group_of(chart, point) != group)
            continue;
        if (count++ == 0)
            bytes_format(bytes, "<path class=\"line s%zu\" d=\"M", group);
        else
            bytes_text(bytes, "L");
        bytes_format(bytes, "%.1f %.1f", x_of(chart, point->cpu_minimum),
                     y_of(chart, error_of(chart, point)));
    }
    if (count > 0)
        bytes_text(bytes, "\"/>\n");
}

static void put_choice(const Chart *chart) {
    const uint64_t number = chart->tradeoff->recommendation.point;
    if (number == COUNT_ABSENT || number < 1 || number > chart->tradeoff->points.count)
        return;
    const TradeoffPoint *point = &chart->tradeoff->points.at[number - 1];
    if (is_drawn(chart, point))
        bytes_format(chart->bytes,
                     "<circle class=\"strong ring\" cx=\"%.1f\" cy=\"%.1f\" r=\"10\"/>\n",
                     x_of(chart, point->cpu_minimum), y_of(chart, error_of(chart, point)));
}

static void put_legend(const Chart *chart) {
    Bytes *bytes = chart->bytes;
    double y = top + 10;
    for (size_t i = 0; i < chart->group_count; i++, y += 22) {
        bytes_format(bytes,
                     "<path class=\"mark s%zu\" transform=\"translate(%.0f %.0f)\" d=\"%s\"/>", i,
                     right + 18, y, marks[i]);
        bytes_format(bytes, "<text x=\"%.0f\" y=\"%.0f\">", right + 30, y + 4);
        svg_text(bytes, chart->groups[i]);
        bytes_text(bytes, "</text>\n");
    }
    bytes_format(bytes, "<path class=\"strong best\" d=\"M%.0f %.0fh16\"/>", right + 10, y);
    bytes_format(bytes, "<text x=\"%.0f\" y=\"%.0f\">best of all</text>\n", right + 32, y + 4);
    y += 22;
    const double error = chart->tradeoff->error;
    if (error > 0) {
        bytes_format(bytes, "<path class=\"strong wanted\" d=\"M%.0f %.0fh16\"/>", right + 10, y);
        bytes_format(bytes, "<text x=\"%.0f\" y=\"%.0f\">wanted: %.3g%s</text>\n", right + 32,
                     y + 4, error, metric_units[chart->tradeoff->metric]);
        y += 22;
    }
    bytes_format(bytes, "<circle class=\"strong ring\" cx=\"%.0f\" cy=\"%.0f\" r=\"7\"/>",
                 right + 18, y);
    bytes_format(bytes, "<text x=\"%.0f\" y=\"%.0f\">to take</text>\n", right + 32, y + 4);
}

// For those who cannot see it, and what it cannot show.
static void put_description(const Chart *chart) {
    Bytes *bytes = chart->bytes;
    const TradeoffPoints *points = &chart->tradeoff->points;
    bytes_text(bytes, "<desc>");
    if (chart->tradeoff->recommendation.why != NULL)
        svg_text(bytes, chart->tradeoff->recommendation.why);
    bytes_text(bytes, ".");
    for (size_t i = 0; i < points->count; i++) {
        const TradeoffPoint *point = &points->at[i];
        if (is_drawn(chart, point))
            continue;
        bytes_text(bytes, " Not drawn: ");
        svg_text(bytes, point->name);
        bytes_text(bytes, point->why != NULL ? ", because: " : ", whose error is not known");
        if (point->why != NULL)
            svg_text(bytes, point->why);
        bytes_text(bytes, ".");
    }
    bytes_text(bytes, "</desc>\n");
}

void chart_tradeoff(const Tradeoff *tradeoff, Bytes *bytes) {
    Chart chart = {.tradeoff = tradeoff,
                   .plot = {.left = left,
                            .right = right,
                            .top = top,
                            .bottom = bottom,
                            .is_logarithmic = true,
                            .has_whole_decades = true,
                            .x_title = "CPU time of a run [s]",
                            .bytes = bytes},
                   .bytes = bytes};
    char metric[NAME];
    snprintf(metric, sizeof metric, "%s", metric_names[tradeoff->metric]);
    for (char *c = metric; *c != '\0'; c++)
        if (*c == '_')
            *c = ' ';
    char title[2 * NAME + 32], heading[2 * NAME];
    snprintf(title, sizeof title, "Error of %s against CPU time", metric);
    snprintf(heading, sizeof heading, "Error of %s%s", metric,
             tradeoff->metric == METRIC_PSD ? " [dB]" : "");
    fit(&chart);
    svg_open(bytes, width, height, title);
    put_description(&chart);
    svg_page(bytes, width, height, rules);
    svg_heading(bytes, left, 26, heading);
    (void)plot_axes(&chart.plot);
    put_best(&chart);
    put_wanted(&chart);
    for (size_t i = 0; i < chart.group_count; i++)
        put_group(&chart, i);
    for (size_t i = 0; i < tradeoff->points.count; i++)
        if (is_drawn(&chart, &tradeoff->points.at[i]))
            put_point(&chart, &tradeoff->points.at[i]);
    put_choice(&chart);
    put_legend(&chart);
    svg_close(bytes);
}
