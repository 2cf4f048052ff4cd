// Lines join the points of one solver, a step line below them the best of all. An error of 0 has no
// logarithm: it stands on the floor, which is labelled 0.
#include "server/encode/chart.h"

#include <float.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "server/encode/svg.h"

enum { GROUPS = 12, NAME = 32, DECADES_LABELLED = 7 };

static const double width = 640, height = 430;
static const double left = 62, right = 486, top = 44, bottom = 376; // of the plot

// Okabe and Ito's colours, which most eyes tell apart, and lighter ones for a dark page.
static const char *const light[] = {"#0072b2", "#d55e00", "#009e73", "#a8509a",
                                    "#8a6d00", "#1f8fc4", "#555555", "#b03060",
                                    "#4b7f00", "#6a51a3", "#994f00", "#006d6d"};
static const char *const dark[] = {"#56b4e9", "#f0944d", "#3ad1a4", "#e29ad0",
                                   "#e6c23c", "#8fd0f5", "#bbbbbb", "#ff8fb0",
                                   "#a5d65a", "#b9a5f0", "#d9a066", "#5fd0d0"};
static const char *const marks[] = {"M-5 0a5 5 0 1 0 10 0a5 5 0 1 0-10 0z",
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
    int x_from, x_to, y_from, y_to; // decades
    bool has_floor;                 // an error of 0: then the lowest decade stands for it
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
    return errors_by(&point->errors, chart->tradeoff->metric);
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

static void scale(Chart *chart) {
    double x_least = DBL_MAX, x_most = 0, y_least = DBL_MAX, y_most = 0;
    for (size_t i = 0; i < chart->tradeoff->points.count; i++) {
        const TradeoffPoint *point = &chart->tradeoff->points.at[i];
        if (!is_drawn(chart, point))
            continue;
        (void)group_of(chart, point);
        const double error = error_of(chart, point);
        x_least = fmin(x_least, point->cpu_minimum);
        x_most = fmax(x_most, point->cpu_minimum);
        chart->has_floor = chart->has_floor || !(error > 0);
        if (error > 0) {
            y_least = fmin(y_least, error);
            y_most = fmax(y_most, error);
        }
    }
    const double wanted = chart->tradeoff->error;
    if (wanted > 0) {
        y_least = fmin(y_least, wanted);
        y_most = fmax(y_most, wanted);
    }
    svg_decades(x_most > 0 ? x_least : 1e-6, x_most > 0 ? x_most : 1, &chart->x_from, &chart->x_to);
    svg_decades(y_most > 0 ? y_least : 0.1, y_most > 0 ? y_most : 1, &chart->y_from, &chart->y_to);
    if (chart->has_floor)
        chart->y_from--;
}

static double x_of(const Chart *chart, double cpu) {
    return left + (right - left) * (log10(cpu) - chart->x_from) / (chart->x_to - chart->x_from);
}

static double y_of(const Chart *chart, double error) {
    const double level = error > 0 ? log10(error) : chart->y_from;
    return bottom - (bottom - top) * (level - chart->y_from) / (chart->y_to - chart->y_from);
}

static void put_style(Bytes *bytes) {
    bytes_text(bytes,
               "<style>\n"
               "svg { font: 12px system-ui, sans-serif; color-scheme: light dark; }\n"
               ".page { fill: #ffffff; } text { fill: #222222; }\n"
               ".grid { stroke: #dddddd; fill: none; } .frame { stroke: #777777; fill: none; }\n"
               ".best { stroke: #222222; stroke-opacity: 0.28; stroke-width: 6; fill: none; "
               "stroke-linejoin: round; }\n"
               ".wanted { stroke: #222222; stroke-dasharray: 5 4; }\n"
               ".ring { stroke: #222222; stroke-width: 1.5; fill: none; }\n"
               ".line { fill: none; stroke-width: 1.5; }\n");
    for (size_t i = 0; i < GROUPS; i++)
        bytes_format(bytes, ".mark.s%zu { fill: %s; } .line.s%zu { stroke: %s; }\n", i, light[i], i,
                     light[i]);
    bytes_text(bytes, "@media (prefers-color-scheme: dark) {\n"
                      ".page { fill: #16181c; } text { fill: #e4e4e4; } .grid { stroke: #363a41; } "
                      ".frame { stroke: #8a8f98; }\n"
                      ".best, .wanted, .ring { stroke: #f2f2f2; }\n");
    for (size_t i = 0; i < GROUPS; i++)
        bytes_format(bytes, ".mark.s%zu { fill: %s; } .line.s%zu { stroke: %s; }\n", i, dark[i], i,
                     dark[i]);
    bytes_text(bytes, "}\n</style>\n");
}

static int label_every(int decades) {
    return (decades + DECADES_LABELLED - 1) / DECADES_LABELLED;
}

static void put_axes(const Chart *chart) {
    Bytes *bytes = chart->bytes;
    const int x_every = label_every(chart->x_to - chart->x_from);
    const int y_every = label_every(chart->y_to - chart->y_from);
    for (int d = chart->x_from; d <= chart->x_to; d++) {
        const double x = x_of(chart, pow(10, d));
        bytes_format(bytes, "<path class=\"grid\" d=\"M%.1f %.0fV%.0f\"/>", x, top, bottom);
        if ((chart->x_to - d) % x_every != 0)
            continue;
        bytes_format(bytes, "<text x=\"%.1f\" y=\"%.0f\" text-anchor=\"middle\">", x, bottom + 18);
        svg_power(bytes, d);
        bytes_text(bytes, "</text>\n");
    }
    for (int d = chart->y_from; d <= chart->y_to; d++) {
        const double y = y_of(chart, pow(10, d));
        const bool is_floor = chart->has_floor && d == chart->y_from;
        bytes_format(bytes, "<path class=\"grid\" d=\"M%.0f %.1fH%.0f\"/>", left, y, right);
        if ((chart->y_to - d) % y_every != 0 && !is_floor)
            continue;
        bytes_format(bytes, "<text x=\"%.0f\" y=\"%.1f\" text-anchor=\"end\">", left - 8, y + 4);
        if (is_floor)
            bytes_text(bytes, "0");
        else
            svg_power(bytes, d);
        bytes_text(bytes, "</text>\n");
    }
    bytes_format(bytes,
                 "<rect class=\"frame\" x=\"%.0f\" y=\"%.0f\" width=\"%.0f\" height=\"%.0f\"/>\n",
                 left, top, right - left, bottom - top);
    bytes_format(
        bytes, "<text x=\"%.0f\" y=\"%.0f\" text-anchor=\"middle\">CPU time of a run [s]</text>\n",
        (left + right) / 2, bottom + 40);
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
        bytes_format(chart->bytes, i == 0 ? "<path class=\"best\" d=\"M%.1f %.1f" : "H%.1fV%.1f",
                     x_of(chart, best[i]->cpu_minimum), y_of(chart, error_of(chart, best[i])));
    if (count > 0)
        bytes_format(chart->bytes, "H%.0f\"/>\n", right);
    free(best);
}

static void put_wanted(const Chart *chart) {
    const double error = chart->tradeoff->error;
    if (error > 0)
        bytes_format(chart->bytes, "<path class=\"wanted\" d=\"M%.0f %.1fH%.0f\"/>\n", left,
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
        bytes_format(chart->bytes, "<circle class=\"ring\" cx=\"%.1f\" cy=\"%.1f\" r=\"10\"/>\n",
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
    bytes_format(bytes, "<path class=\"best\" d=\"M%.0f %.0fh16\"/>", right + 10, y);
    bytes_format(bytes, "<text x=\"%.0f\" y=\"%.0f\">best of all</text>\n", right + 32, y + 4);
    y += 22;
    const double error = chart->tradeoff->error;
    if (error > 0) {
        bytes_format(bytes, "<path class=\"wanted\" d=\"M%.0f %.0fh16\"/>", right + 10, y);
        bytes_format(bytes, "<text x=\"%.0f\" y=\"%.0f\">wanted: %.3g%s</text>\n", right + 32,
                     y + 4, error, metric_units[chart->tradeoff->metric]);
        y += 22;
    }
    bytes_format(bytes, "<circle class=\"ring\" cx=\"%.0f\" cy=\"%.0f\" r=\"7\"/>", right + 18, y);
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
    Chart chart = {.tradeoff = tradeoff, .bytes = bytes};
    char metric[NAME];
    snprintf(metric, sizeof metric, "%s", metric_names[tradeoff->metric]);
    for (char *c = metric; *c != '\0'; c++)
        if (*c == '_')
            *c = ' ';
    scale(&chart);
    bytes_format(
        bytes,
        "<svg xmlns=\"http://www.w3.org/2000/svg\" viewBox=\"0 0 %.0f %.0f\" role=\"img\">\n",
        width, height);
    bytes_format(bytes, "<title>Error of %s against CPU time</title>\n", metric);
    put_description(&chart);
    put_style(bytes);
    bytes_format(bytes, "<rect class=\"page\" width=\"%.0f\" height=\"%.0f\"/>\n", width, height);
    bytes_format(bytes, "<text x=\"%.0f\" y=\"26\" font-size=\"14\">Error of %s%s</text>\n", left,
                 metric, tradeoff->metric == METRIC_PSD ? " [dB]" : "");
    put_axes(&chart);
    put_best(&chart);
    put_wanted(&chart);
    for (size_t i = 0; i < chart.group_count; i++)
        put_group(&chart, i);
    for (size_t i = 0; i < tradeoff->points.count; i++)
        if (is_drawn(&chart, &tradeoff->points.at[i]))
            put_point(&chart, &tradeoff->points.at[i]);
    put_choice(&chart);
    put_legend(&chart);
    bytes_text(bytes, "</svg>\n");
}
