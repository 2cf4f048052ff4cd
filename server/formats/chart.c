// The page is in pixels, as its width and height say. Everything is drawn from the description:
// first the ranges of the axes (chart_fit), then grid, series from the last to the first, legend
// and frame.
#include "server/formats/chart.h"

#include <float.h>
#include <math.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "core/base/status.h"

// The palette of Okabe and Ito, which most people can distinguish, and further colours; lighter
// ones on a dark page.
static const char *const chart_light[CHART_COLOURS] = {"#0072b2", "#d55e00", "#009e73", "#a8509a",
                                                       "#8a6d00", "#444444", "#b0003a", "#3f51b5",
                                                       "#4b7f00", "#1f8fc4", "#994f00", "#006d6d"};
static const char *const chart_dark[CHART_COLOURS] = {"#56b4e9", "#f0944d", "#3ad1a4", "#e29ad0",
                                                      "#e6c23c", "#c8c8c8", "#ff7a9c", "#9fa8ff",
                                                      "#a5d65a", "#8fd0f5", "#d9a066", "#5fd0d0"};

static const char *const chart_shapes[CHART_COLOURS] = {"M-5 0a5 5 0 1 0 10 0a5 5 0 1 0-10 0z",
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

static const char *const chart_marks[] = {[CHART_DOT] = "M-3 0a3 3 0 1 0 6 0a3 3 0 1 0-6 0z",
                                          [CHART_CROSS] = "M-4-4l8 8M4-4l-8 8",
                                          [CHART_RING] = "M-8 0a8 8 0 1 0 16 0a8 8 0 1 0-16 0z"};

enum { TICKS_MAX = 12, DECADES_LABELLED = 8, MAP_STEPS = 24, LEGEND_LINE = 20 };

struct ChartBlock {
    struct ChartBlock *next;
    double at[];
};

void *chart_new(Chart *chart, size_t count, size_t size) {
    struct ChartBlock *block = calloc(1, sizeof *block + (count + 1) * size);
    if (block == NULL) {
        chart->is_failed = true;
        return NULL;
    }
    block->next = chart->blocks;
    chart->blocks = block;
    return block->at;
}

const char *chart_text(Chart *chart, const char *format, ...) {
    char *text = chart_new(chart, CHART_TEXT, 1);
    va_list arguments;
    va_start(arguments, format);
    if (text != NULL)
        text_fit_format(text, CHART_TEXT, format, arguments);
    va_end(arguments);
    return text != NULL ? text : "";
}

const char *chart_quantity(Chart *chart, const char *name, const char *unit) {
    const bool has_unit = unit != NULL && *unit != '\0';
    return chart_text(chart, "%.120s%s%.24s%s", name != NULL ? name : "", has_unit ? " [" : "",
                      has_unit ? unit : "", has_unit ? "]" : "");
}

ChartPanel *chart_panel(Chart *chart, const char *heading, double left, double right, double top,
                        double bottom) {
    ChartPanel *panel = &chart->panels[chart->count < CHART_PANELS ? chart->count++ : 0];
    *panel = (ChartPanel){.heading = heading, .left = left, .right = right, .top = top};
    panel->bottom = bottom;
    return panel;
}

ChartPanel *chart_spectra(Chart *chart, const char *heading, double left, double right, double top,
                          double bottom) {
    ChartPanel *panel = chart_panel(chart, heading, left, right, top, bottom);
    panel->x.is_logarithmic = panel->y.is_logarithmic = true;
    panel->y.max_decades = CHART_DECADES;
    panel->x.title = "frequency [Hz]";
    return panel;
}

void chart_add(ChartPanel *panel, ChartSeries series) {
    panel->series[panel->count < CHART_SERIES ? panel->count++ : 0] = series;
}

void chart_note(Chart *chart, const char *before, const char *text) {
    if (text == NULL)
        return;
    bytes_text(&chart->description, before);
    chart_escape(&chart->description, text);
    bytes_text(&chart->description, ".");
}

// --- text ---

void chart_escape(Bytes *bytes, const char *text) {
    static const char marks[] = "&<>\"";
    static const char *const entities[] = {"&amp;", "&lt;", "&gt;", "&quot;"};
    for (const char *c = text; *c != '\0'; c++) {
        const char *mark = strchr(marks, *c);
        if (mark != NULL)
            bytes_text(bytes, entities[mark - marks]);
        else
            bytes_put(bytes, (unsigned char)*c < ' ' ? " " : c, 1);
    }
}

// `style`: a class, or NULL; `anchor`: the side of the text that is at x; `text`: NULL: none.
static void chart_put_text(Bytes *bytes, double x, double y, const char *anchor, const char *style,
                           const char *text) {
    if (text == NULL)
        return;
    bytes_text(bytes, "<text");
    if (style != NULL)
        bytes_format(bytes, " class=\"%s\"", style);
    bytes_format(bytes, " x=\"%.1f\" y=\"%.1f\"", x, y);
    if (strcmp(anchor, "start") != 0)
        bytes_format(bytes, " text-anchor=\"%s\"", anchor);
    bytes_text(bytes, ">");
    chart_escape(bytes, text);
    bytes_text(bytes, "</text>\n");
}

static void chart_put_title(Bytes *bytes, const char *text) {
    bytes_text(bytes, "<title>");
    chart_escape(bytes, text);
    bytes_text(bytes, "</title>");
}

static void chart_put_colours(Bytes *bytes, const char *const colours[CHART_COLOURS]) {
    for (size_t i = 0; i < CHART_COLOURS; i++)
        bytes_format(bytes, ".line.s%zu { stroke: %s; } .band.s%zu, .mark.s%zu { fill: %s; }\n", i,
                     colours[i], i, i, colours[i]);
}

static void chart_put_style(Bytes *bytes) {
    bytes_text(bytes,
               "<style>\n"
               "svg { font: 12px system-ui, sans-serif; color-scheme: light dark; }\n"
               ".grid, .frame, .line, .strong, .cross { fill: none; } .heading { font-size: 14px; "
               "}\n.small { font-size: 10.5px; } .name { font-weight: 600; }\n"
               ".line { stroke-width: 1.5; stroke-linejoin: round; } .band { fill-opacity: 0.4; }\n"
               ".page { fill: #ffffff; } text { fill: #222222; } .faint { fill: #666666; }\n"
               ".grid { stroke: #dddddd; } .frame { stroke: #777777; } "
               ".strong { stroke: #222222; }\n");
    chart_put_colours(bytes, chart_light);
    bytes_text(bytes, "@media (prefers-color-scheme: dark) {\n"
                      ".page { fill: #16181c; } text { fill: #e4e4e4; } .faint { fill: #a0a0a0; }\n"
                      ".grid { stroke: #363a41; } .frame { stroke: #8a8f98; } "
                      ".strong { stroke: #f2f2f2; }\n");
    chart_put_colours(bytes, chart_dark);
    bytes_text(bytes,
               "}\n.best { stroke-opacity: 0.28; stroke-width: 6; stroke-linejoin: round; }\n"
               ".wanted { stroke-dasharray: 5 4; } .trend { stroke-dasharray: 6 4; }\n"
               ".ring, .cross { stroke-width: 1.5; } .cross, .all { stroke: #888888; }\n"
               ".half { fill: #888888; fill-opacity: 0.35; } .mean { stroke-width: 2; }\n"
               ".bad { fill: #9a9a9a; }\n</style>\n");
}

// --- axes ---

static bool axis_shows(const ChartAxis *axis, double value) {
    return isfinite(value) && (!axis->is_logarithmic || value > 0);
}

static void axis_extend(ChartAxis *axis, double value) {
    const double at = axis->is_logarithmic ? log10(value) : value;
    if (axis_shows(axis, value)) {
        axis->min = fmin(axis->min, at);
        axis->max = fmax(axis->max, at);
    }
}

static void panel_extend(ChartPanel *panel, double x, double y, bool *has_zero) {
    const bool is_zero = y == 0 && panel->y.has_zero;
    if (!(axis_shows(&panel->x, x) || isinf(x)) ||
        !(axis_shows(&panel->y, y) || isinf(y) || is_zero))
        return;
    *has_zero = *has_zero || is_zero;
    axis_extend(&panel->x, x);
    axis_extend(&panel->y, y);
}

// Rounds the range of values outwards, so that it has a length.
static void axis_round(ChartAxis *axis, double padding, bool is_whole) {
    if (axis->is_logarithmic && (is_whole || !(axis->max > axis->min))) {
        axis->min = floor(axis->min);
        axis->max = fmax(ceil(axis->max), axis->min + 1);
        if (axis->max_decades > 0)
            axis->min = fmax(axis->min, axis->max - axis->max_decades);
        return;
    }
    double room = padding * (axis->max - axis->min);
    if (!(axis->max > axis->min))
        room = axis->max != 0 ? 0.1 * fabs(axis->max) : 1;
    axis->min -= room;
    axis->max += room;
}

bool chart_fit(ChartPanel *panel) {
    bool has_zero = false;
    panel->x.min = panel->y.min = DBL_MAX;
    panel->x.max = panel->y.max = -DBL_MAX;
    for (size_t i = 0; i < panel->count; i++) {
        const ChartSeries *series = &panel->series[i];
        if (series->kind == CHART_MAP) // has no axes
            return true;
        for (size_t k = 0; k < series->count; k++) {
            panel_extend(panel, series->x[k], series->y[k], &has_zero);
            if (series->high != NULL)
                panel_extend(panel, series->x[k], series->high[k], &has_zero);
        }
    }
    if (panel->y.max < panel->y.min && !has_zero)
        return false;
    if (panel->y.max < panel->y.min)
        panel->y.min = panel->y.max = 0;
    if (panel->x.max < panel->x.min) {
        panel->x.min = 0;
        panel->x.max = 1;
    }
    axis_round(&panel->x, panel->x.padding, panel->x.is_whole);
    axis_round(&panel->y, 0.05, true);
    panel->y.min -= has_zero;
    panel->y.has_zero = has_zero;
    return true;
}

// 0 to 1; values outside, infinite ones and the 0 of a logarithmic axis are at an end.
static double axis_share(const ChartAxis *axis, double value) {
    const double at = axis->is_logarithmic ? log10(value) : value;
    return fmin(fmax((at - axis->min) / (axis->max - axis->min), 0), 1);
}

static double panel_x(const ChartPanel *panel, double x) {
    return panel->left + (panel->right - panel->left) * axis_share(&panel->x, x);
}

static double panel_y(const ChartPanel *panel, double y) {
    return panel->bottom - (panel->bottom - panel->top) * axis_share(&panel->y, y);
}

// A grid line and its label: `text`, or 10 to the power of `decade` without one; NULL: no label.
static void panel_put_tick(const ChartPanel *panel, bool is_x, double share, const char *text,
                           int decade, Bytes *bytes) {
    const double x = panel->left + (panel->right - panel->left) * share;
    const double y = panel->bottom - (panel->bottom - panel->top) * share;
    if (is_x)
        bytes_format(bytes, "<path class=\"grid\" d=\"M%.1f %.0fV%.0f\"/>", x, panel->top,
                     panel->bottom);
    else
        bytes_format(bytes, "<path class=\"grid\" d=\"M%.0f %.1fH%.0f\"/>", panel->left, y,
                     panel->right);
    if (text == NULL || (is_x ? &panel->x : &panel->y)->is_unlabelled) {
        bytes_text(bytes, "\n");
        return;
    }
    bytes_format(bytes, "<text%s x=\"%.1f\" y=\"%.1f\" text-anchor=\"%s\">",
                 panel->is_small ? " class=\"small\"" : "", is_x ? x : panel->left - 8,
                 is_x ? panel->bottom + (panel->is_small ? 16 : 18) : y + 4,
                 is_x ? "middle" : "end");
    if (*text != '\0')
        chart_escape(bytes, text);
    else if (decade >= -1 && decade <= 3)
        bytes_format(bytes, "%g", pow(10, decade));
    else
        bytes_format(bytes, "10<tspan dy=\"-5\" font-size=\"9\">%d</tspan>", decade);
    bytes_text(bytes, "</text>\n");
}

// Not every decade is labelled where there are many; where there are few, 2 and 5 times it are too.
static void panel_put_decades(const ChartPanel *panel, bool is_x, Bytes *bytes) {
    const ChartAxis *axis = is_x ? &panel->x : &panel->y;
    const double length = axis->max - axis->min;
    const int from = (int)floor(axis->min), to = (int)floor(axis->max);
    const int every = (to - from + DECADES_LABELLED) / (DECADES_LABELLED + 1);
    const int steps[] = {1, 2, 5}, count = length < 2 ? 3 : 1;
    char text[CHART_LABEL];
    for (int decade = from; decade <= to; decade++)
        for (int i = 0; i < count; i++) {
            const double share = (decade + log10(steps[i]) - axis->min) / length;
            const bool is_zero = axis->has_zero && decade == from;
            if (share < -1e-9 || share > 1 + 1e-9 || (is_zero && i > 0))
                continue;
            snprintf(text, sizeof text, "%.4g", steps[i] * pow(10, decade));
            panel_put_tick(panel, is_x, share,
                           is_zero                                   ? "0"
                           : every > 1 && (to - decade) % every != 0 ? NULL
                           : count > 1                               ? text
                                                                     : "",
                           decade, bytes);
        }
}

// Steps of 1, 2 or 5 times a power of ten.
static void panel_put_steps(const ChartPanel *panel, bool is_x, Bytes *bytes) {
    const ChartAxis *axis = is_x ? &panel->x : &panel->y;
    const double length = axis->max - axis->min;
    const double part = length / (!is_x && panel->is_small ? 2 : 4);
    const double power = pow(10, floor(log10(part))), rest = part / power;
    const double step = power * (rest < 2 ? 1 : rest < 5 ? 2 : 5);
    const double first = ceil(axis->min / step - 1e-9);
    char text[CHART_LABEL];
    for (int i = 0; i < TICKS_MAX && (first + i) * step <= axis->max + 1e-9 * step; i++) {
        snprintf(text, sizeof text, "%.4g", (first + i) * step);
        panel_put_tick(panel, is_x, ((first + i) * step - axis->min) / length, text, 0, bytes);
    }
}

static void panel_put_axis(const ChartPanel *panel, bool is_x, Bytes *bytes) {
    const ChartAxis *axis = is_x ? &panel->x : &panel->y;
    for (size_t i = 0; i < axis->tick_count; i++)
        panel_put_tick(panel, is_x, axis_share(axis, axis->ticks[i].value), axis->ticks[i].text, 0,
                       bytes);
    if (axis->tick_count > 0)
        return;
    if (axis->is_logarithmic)
        panel_put_decades(panel, is_x, bytes);
    else
        panel_put_steps(panel, is_x, bytes);
}

// --- series ---

static void series_put_class(const ChartSeries *series, const char *kind, Bytes *bytes) {
    bytes_text(bytes, "class=\"");
    if (series->colour == CHART_STRONG)
        bytes_text(bytes, "strong");
    else
        bytes_format(bytes, "%s s%zu", kind, series->colour % CHART_COLOURS);
    if (series->look != NULL)
        bytes_format(bytes, " %s", series->look);
    bytes_text(bytes, "\"");
}

static bool series_has_x(const ChartPanel *panel, const ChartSeries *series, size_t i) {
    const double x = series->x[i];
    return axis_shows(&panel->x, x) || isinf(x);
}

// The points of `values` as a path, forwards or backwards: the mean of those of one pixel.
static void series_put_means(const ChartPanel *panel, const ChartSeries *series,
                             const double *values, bool is_backwards, Bytes *bytes) {
    const double pixel = (panel->right - panel->left) / 650;
    bool is_open = is_backwards; // continues a path
    double first = 0, x = 0, y = 0, count = 0;
    for (size_t i = 0; i <= series->count; i++) {
        const size_t k = is_backwards ? series->count - 1 - i : i;
        const bool is_end = i == series->count;
        if (!is_end && !series_has_x(panel, series, k))
            continue;
        const double at = is_end ? 0 : panel_x(panel, series->x[k]);
        const bool is_gap = is_end || isnan(values[k]);
        if (count > 0 && (is_gap || fabs(at - first) > pixel)) {
            bytes_format(bytes, "%s%.1f %.1f", is_open ? "L" : "M", x / count,
                         panel_y(panel, y / count));
            is_open = true;
            x = y = count = 0;
        }
        is_open = is_open && !is_gap;
        if (is_gap)
            continue;
        first = count > 0 ? first : at;
        x += at;
        y += values[k];
        count++;
    }
}

// Each point from its nearer end to the other one, which is halfway to the next point: close to the
// curve of which the points are the extremes.
static void series_put_extents(const ChartPanel *panel, const ChartSeries *series, Bytes *bytes) {
    const double *highs = series->high != NULL ? series->high : series->y;
    bool is_open = false;
    double last = 0;
    for (size_t i = 0; i < series->count; i++) {
        if (!series_has_x(panel, series, i))
            continue;
        if (isnan(series->y[i])) {
            is_open = false;
            continue;
        }
        const double x = panel_x(panel, series->x[i]);
        const double next = panel_x(panel, series->x[i + 1 < series->count ? i + 1 : i]);
        const double low = panel_y(panel, series->y[i]), high = panel_y(panel, highs[i]);
        const bool is_falling = is_open && fabs(high - last) < fabs(low - last);
        last = is_falling ? low : high;
        bytes_format(bytes, "%s%.1f %.1f", is_open ? "L" : "M", x, is_falling ? high : low);
        if (fabs(high - low) >= 0.05)
            bytes_format(bytes, "L%.1f %.1f", (x + next) / 2, last);
        is_open = true;
    }
}

static void series_put_line(const ChartPanel *panel, const ChartSeries *series, Bytes *bytes) {
    if (series->count == 0)
        return;
    bytes_text(bytes, "<path ");
    series_put_class(series, series->kind == CHART_BAND ? "band" : "line", bytes);
    bytes_text(bytes, " d=\"");
    if (series->kind == CHART_BAND) {
        series_put_means(panel, series, series->high, false, bytes);
        series_put_means(panel, series, series->y, true, bytes);
        bytes_text(bytes, "z");
    } else if (series->high != NULL || series->is_joined) {
        series_put_extents(panel, series, bytes);
    } else {
        series_put_means(panel, series, series->y, false, bytes);
    }
    bytes_text(bytes, "\"");
    if (series->name != NULL) {
        bytes_text(bytes, ">");
        chart_put_title(bytes, series->name);
        bytes_text(bytes, "</path>\n");
    } else {
        bytes_text(bytes, "/>\n");
    }
}

// Without the end of its element.
static void series_put_marker(const ChartSeries *series, double x, double y, Bytes *bytes) {
    const char *shape = series->shape == CHART_SHAPE ? chart_shapes[series->colour % CHART_COLOURS]
                                                     : chart_marks[series->shape];
    bytes_text(bytes, "<path ");
    if (series->shape == CHART_CROSS)
        bytes_text(bytes, "class=\"cross\"");
    else
        series_put_class(series, series->shape == CHART_RING ? "line" : "mark", bytes);
    bytes_format(bytes, " transform=\"translate(%.1f %.1f)\" d=\"%s\"", x, y, shape);
}

static void series_put_markers(const ChartPanel *panel, const ChartSeries *series, Bytes *bytes) {
    for (size_t i = 0; i < series->count; i++) {
        if (!series_has_x(panel, series, i) || isnan(series->y[i]))
            continue;
        series_put_marker(series, panel_x(panel, series->x[i]), panel_y(panel, series->y[i]),
                          bytes);
        bytes_text(bytes, series->describe != NULL ? "><title>" : "/>\n");
        if (series->describe == NULL)
            continue;
        series->describe(series->context, i, bytes);
        bytes_text(bytes, "</title></path>\n");
    }
}

static void chart_put_cell(double share, double x, double y, double width, double height,
                           Bytes *bytes) {
    // Viridis, interpolated between six of its colours.
    static const double stops[][3] = {{68, 1, 84},    {65, 68, 135},  {42, 120, 142},
                                      {34, 168, 132}, {122, 209, 81}, {253, 231, 37}};
    const double at = fmin(fmax(share, 0), 1) * (COUNT(stops) - 1);
    const size_t i = at >= COUNT(stops) - 1 ? COUNT(stops) - 2 : (size_t)at;
    unsigned parts[3];
    for (size_t k = 0; k < 3; k++)
        parts[k] =
            (unsigned)(stops[i][k] + (stops[i + 1][k] - stops[i][k]) * (at - (double)i) + 0.5);
    bytes_format(bytes,
                 "<rect fill=\"#%02x%02x%02x\" x=\"%.1f\" y=\"%.1f\" width=\"%.1f\" "
                 "height=\"%.1f\"/>",
                 parts[0], parts[1], parts[2], x, y, width, height);
}

// The colours of a map below it, from the smallest value to the largest.
static void panel_put_map(const ChartPanel *panel, const ChartSeries *series, Bytes *bytes) {
    const size_t rows = series->count / series->columns;
    const double width = panel->right - panel->left, cell_width = width / (double)series->columns;
    const double cell_height = (panel->bottom - panel->top) / (double)rows;
    double min = DBL_MAX, max = -DBL_MAX;
    char text[CHART_LABEL];
    bytes_format(bytes,
                 "<rect class=\"bad\" x=\"%.1f\" y=\"%.1f\" width=\"%.1f\" height=\"%.1f\"/>\n",
                 panel->left, panel->top, width, panel->bottom - panel->top);
    for (size_t i = 0; i < series->count; i++) {
        min = isnan(series->y[i]) ? min : fmin(min, series->y[i]);
        max = isnan(series->y[i]) ? max : fmax(max, series->y[i]);
    }
    for (size_t i = 0; i < series->count; i++)
        if (!isnan(series->y[i]))
            chart_put_cell(max > min ? (series->y[i] - min) / (max - min) : 0.5,
                           panel->left + cell_width * (double)(i % series->columns),
                           panel->bottom - cell_height * (double)(i / series->columns + 1),
                           cell_width + 0.2, cell_height + 0.2, bytes);
    bytes_text(bytes, "\n");
    for (int side = 0; side < 2; side++) {
        const ChartTick *x = &panel->x.ticks[side], *y = &panel->y.ticks[side];
        chart_put_text(bytes, side == 0 ? panel->left : panel->right, panel->bottom + 14,
                       side == 0 ? "start" : "end", "small", x->text);
        chart_put_text(bytes, panel->left - 5, side == 0 ? panel->bottom : panel->top + 10, "end",
                       "small", y->text);
    }
    if (min > max)
        return;
    for (int i = 0; i < MAP_STEPS; i++)
        chart_put_cell((i + 0.5) / MAP_STEPS, panel->left + width * i / MAP_STEPS,
                       panel->bottom + 22, width / MAP_STEPS + 0.3, 6, bytes);
    snprintf(text, sizeof text, "%.4g", min);
    chart_put_text(bytes, panel->left, panel->bottom + 40, "start", "small", text);
    snprintf(text, sizeof text, "%.4g", max);
    chart_put_text(bytes, panel->right, panel->bottom + 40, "end", "small", text);
}

static void panel_put_series(const ChartPanel *panel, const ChartSeries *series, Bytes *bytes) {
    if (series->kind == CHART_MAP)
        panel_put_map(panel, series, bytes);
    else if (series->kind != CHART_MARKERS || series->is_joined)
        series_put_line(panel, series, bytes);
    if (series->kind == CHART_MARKERS)
        series_put_markers(panel, series, bytes);
}

// Beside the frame the samples are on the left of the texts, in it on the right.
static void panel_put_legend(const ChartPanel *panel, Bytes *bytes) {
    double y = panel->top + (panel->has_side_legend ? 10 : 18), count = 0;
    for (size_t i = 0; i < panel->count; i++)
        count += panel->series[i].legend != NULL;
    const double step = fmin(LEGEND_LINE, (panel->bottom - panel->top) / count);
    for (size_t i = 0; i < panel->count; i++) {
        const ChartSeries *series = &panel->series[i];
        if (series->legend == NULL)
            continue;
        const double x = panel->has_side_legend ? panel->right + 10 : panel->right - 30;
        if (series->kind == CHART_MARKERS) {
            series_put_marker(series, x + 8, y, bytes);
            bytes_text(bytes, "/>");
        } else {
            bytes_text(bytes, "<path ");
            series_put_class(series, "line", bytes);
            bytes_format(bytes, " d=\"M%.0f %.0fh18\"/>", x, y);
        }
        chart_put_text(bytes, panel->has_side_legend ? x + 24 : x - 8, y + 4,
                       panel->has_side_legend ? "start" : "end", NULL, series->legend);
        y += step;
    }
}

static void panel_write(ChartPanel *panel, Bytes *bytes) {
    const bool is_map = panel->count > 0 && panel->series[0].kind == CHART_MAP;
    const bool has_values = chart_fit(panel);
    chart_put_text(bytes, panel->left, panel->top - (panel->is_small ? 7 : 18), "start",
                   panel->is_small ? "name" : "heading", panel->heading);
    if (!has_values && panel->empty == NULL)
        return;
    if (has_values && !is_map) {
        panel_put_axis(panel, true, bytes);
        panel_put_axis(panel, false, bytes);
    }
    for (size_t i = panel->count; has_values && i-- > 0;)
        panel_put_series(panel, &panel->series[i], bytes);
    if (!is_map)
        bytes_format(bytes,
                     "<rect class=\"frame\" x=\"%.0f\" y=\"%.0f\" width=\"%.0f\" "
                     "height=\"%.0f\"/>\n",
                     panel->left, panel->top, panel->right - panel->left,
                     panel->bottom - panel->top);
    const double middle = (panel->left + panel->right) / 2;
    if (!has_values)
        chart_put_text(bytes, middle, (panel->top + panel->bottom) / 2, "middle", "small",
                       panel->empty);
    if (!panel->x.is_unlabelled)
        chart_put_text(bytes, middle, panel->bottom + 36, "middle", NULL, panel->x.title);
    panel_put_legend(panel, bytes);
}

// --- table ---

static double table_x(const ChartTable *table, double value, double min, double max) {
    const double share = max > min ? (value - min) / (max - min) : 0.5;
    return table->label_right + 10 + (table->interval_width - 20) * fmin(fmax(share, 0), 1);
}

// A line over all values, a box over half of them, the mean and the whiskers of its interval.
static void table_put_interval(const ChartTable *table, const ChartInterval *interval, double y,
                               double min, double max, Bytes *bytes) {
    const double left = table_x(table, interval->q25, min, max);
    const double low = table_x(table, interval->low, min, max);
    const double high = table_x(table, interval->high, min, max);
    bytes_format(bytes, "<path class=\"all\" d=\"M%.1f %.0fH%.1f\"/>",
                 table_x(table, interval->minimum, min, max), y,
                 table_x(table, interval->maximum, min, max));
    bytes_format(bytes, "<rect class=\"half\" x=\"%.1f\" y=\"%.0f\" width=\"%.1f\" height=\"12\"/>",
                 left, y - 6, table_x(table, interval->q75, min, max) - left);
    bytes_format(bytes,
                 "<path class=\"strong mean\" d=\"M%.1f %.0fv8M%.1f %.0fv8M%.1f %.0fH%.1fM%.1f "
                 "%.0fv16\"/>\n",
                 low, y - 4, high, y - 4, low, y, high, table_x(table, interval->mean, min, max),
                 y - 8);
}

static void table_write(const ChartTable *table, Bytes *bytes) {
    const bool has_intervals = table->interval_width > 0;
    double min = DBL_MAX, max = -DBL_MAX;
    for (size_t i = 0; i < table->rows_count; i++)
        if (table->rows[i].has_interval) {
            const ChartInterval *interval = &table->rows[i].interval;
            min = fmin(min, fmin(interval->minimum, interval->low));
            max = fmax(max, fmax(interval->maximum, interval->high));
        }
    chart_put_text(bytes, 20, table->top - 24, "start", "heading", table->heading);
    for (size_t i = 0; i < table->rows_count; i++) {
        const ChartRow *row = &table->rows[i];
        const double y = table->top + table->row_height * ((double)i + 0.5);
        chart_put_text(bytes, table->label_right, y + 4, "end", NULL,
                       row->label != NULL ? row->label : "");
        if (row->has_interval)
            table_put_interval(table, &row->interval, y, min, max, bytes);
        for (size_t k = 0; k < table->columns_count; k++)
            chart_put_text(bytes,
                           table->label_right + table->interval_width +
                               table->column_width * (double)(k + !has_intervals),
                           y + 4, has_intervals ? "start" : "end",
                           row->cells[k].is_faint ? "faint" : NULL,
                           row->cells[k].text != NULL ? row->cells[k].text : "");
    }
    chart_put_text(bytes, 20, table->top + table->row_height * ((double)table->rows_count + 1),
                   "start", "faint", table->note);
}

static void chart_clear(Chart *chart) {
    for (struct ChartBlock *block = chart->blocks, *next; block != NULL; block = next) {
        next = block->next;
        free(block);
    }
    bytes_clear(&chart->description);
    *chart = (Chart){.width = 0};
}

void chart_write(Chart *chart, Bytes *bytes) {
    if (chart->is_failed || chart->description.is_failed) {
        bytes->is_failed = true;
        chart_clear(chart);
        return;
    }
    bytes_format(bytes,
                 "<svg xmlns=\"http://www.w3.org/2000/svg\" viewBox=\"0 0 %.0f %.0f\" "
                 "role=\"img\">\n",
                 chart->width, chart->height);
    chart_put_title(bytes, chart->title);
    bytes_text(bytes, "\n<desc>");
    if (chart->description.at != NULL)
        bytes_put(bytes, chart->description.at, chart->description.count);
    bytes_text(bytes, "</desc>\n");
    chart_put_style(bytes);
    bytes_format(bytes, "<rect class=\"page\" width=\"%.0f\" height=\"%.0f\"/>\n", chart->width,
                 chart->height);
    chart_put_text(bytes, chart->left, 26, "start", "heading", chart->heading);
    for (size_t i = 0; i < COUNT(chart->notes); i++)
        chart_put_text(bytes, chart->left, 50 + 17 * (double)i, "start", NULL, chart->notes[i]);
    for (size_t i = 0; i < chart->count; i++)
        panel_write(&chart->panels[i], bytes);
    table_write(&chart->table, bytes);
    bytes_text(bytes, "</svg>\n");
    chart_clear(chart);
}
