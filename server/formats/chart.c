// The page is in pixels, as its width and height say. Everything is drawn from the description:
// first the places of the panels and the ranges of their axes, then grid, series from the last to
// the first, legend and frame.
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

static const char *const chart_shapes[] = {[CHART_DOT] =
                                               "M-3.5 0a3.5 3.5 0 1 0 7 0a3.5 3.5 0 1 0-7 0z",
                                           [CHART_CROSS] = "M-4-4l8 8M4-4l-8 8",
                                           [CHART_RING] = "M-8 0a8 8 0 1 0 16 0a8 8 0 1 0-16 0z",
                                           [CHART_TICK] = "M-.75-8h1.5v8h-1.5z"};

enum { TICKS_MAX = 12, DECADES_LABELLED = 8, DECADES_SHOWN = 8, MAP_STEPS = 24, LEGEND_LINE = 20 };

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
    return chart_text(chart, "%.120s%s%.24s%s", name, has_unit ? " [" : "", has_unit ? unit : "",
                      has_unit ? "]" : "");
}

ChartPanel *chart_panel(Chart *chart, const char *heading, double height) {
    ChartPanel *panel = &chart->panels[chart->count < CHART_PANELS ? chart->count++ : 0];
    *panel = (ChartPanel){.heading = heading, .height = height};
    return panel;
}

ChartPanel *chart_spectra(Chart *chart, const char *heading, double height) {
    ChartPanel *panel = chart_panel(chart, heading, height);
    panel->x.is_logarithmic = panel->y.is_logarithmic = true;
    panel->y.max_decades = DECADES_SHOWN;
    panel->x.title = "frequency [Hz]";
    return panel;
}

void chart_add(ChartPanel *panel, ChartSeries series) {
    panel->series[panel->count < CHART_SERIES ? panel->count++ : 0] = series;
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
            bytes_put(bytes, (unsigned char)*c < ' ' && *c != '\n' ? " " : c, 1);
    }
}

void chart_note(Chart *chart, const char *before, const char *text) {
    if (text == NULL)
        return;
    bytes_text(&chart->description, before);
    chart_escape(&chart->description, text);
    bytes_text(&chart->description, ".");
}

// `style`: a class, or NULL; `anchor`: the side of the text that is at x; `text`: NULL: none.
static void chart_put_text(Bytes *bytes, double x, double y, const char *anchor, const char *style,
                           const char *text) {
    if (text == NULL)
        return;
    bytes_text(bytes, "<text");
    if (style != NULL)
        bytes_format(bytes, " class=\"%s\"", style);
    bytes_format(bytes, " x=\"%.1f\" y=\"%.1f\" text-anchor=\"%s\">", x, y, anchor);
    chart_escape(bytes, text);
    bytes_text(bytes, "</text>\n");
}

// Ends an open path, with a tooltip where there is a text.
static void chart_end_path(Bytes *bytes, const char *title) {
    bytes_text(bytes, title != NULL ? "><title>" : "/>\n");
    if (title == NULL)
        return;
    chart_escape(bytes, title);
    bytes_text(bytes, "</title></path>\n");
}

static void chart_put_colours(Bytes *bytes, const char *const colours[CHART_COLOURS]) {
    for (size_t i = 0; i < CHART_COLOURS; i++)
        bytes_format(
            bytes, ".line.s%zu { stroke: %s; } .area.s%zu, .band.s%zu, .mark.s%zu { fill: %s; }\n",
            i, colours[i], i, i, i, colours[i]);
}

static void chart_put_style(Bytes *bytes) {
    bytes_text(
        bytes,
        "<style>\n"
        "svg { font: 12px system-ui, sans-serif; color-scheme: light dark; }\n"
        ".grid, .frame, .line, .strong, .cross { fill: none; } .heading { font-size: 14px; }\n"
        ".line { stroke-width: 1.5; stroke-linejoin: round; } .area { stroke-width: 0.8; }\n"
        ".band { fill-opacity: 0.4; }\n"
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
               ".half { stroke: #888888; stroke-opacity: 0.35; stroke-width: 12; }\n"
               ".mean { stroke-width: 2.5; } .bad { fill: #9a9a9a; }\n</style>\n");
}

// --- axes ---

bool chart_axis_shows(const ChartAxis *axis, double value) {
    return isinf(value) || (!isnan(value) && (!axis->is_logarithmic || value > 0));
}

static void axis_extend(ChartAxis *axis, double value) {
    const double at = axis->is_logarithmic ? log10(value) : value;
    if (isfinite(at)) {
        axis->min = fmin(axis->min, at);
        axis->max = fmax(axis->max, at);
    }
}

static void panel_extend(ChartPanel *panel, double x, double y) {
    if (chart_axis_shows(&panel->x, x) && !isnan(y)) {
        axis_extend(&panel->x, x);
        axis_extend(&panel->y, y);
    }
}

// Rounds the range of values outwards, so that it has a length.
static void axis_round(ChartAxis *axis, double padding, bool is_whole) {
    const bool is_long = axis->max > axis->min;
    if (axis->is_logarithmic && (is_whole || !is_long)) {
        axis->min = floor(axis->min);
        axis->max = fmax(ceil(axis->max), axis->min + 1);
        if (axis->max_decades > 0)
            axis->min = fmax(axis->min, axis->max - axis->max_decades);
        return;
    }
    const double room = axis->tick_count > 0 ? 0.5
                        : is_long            ? padding * (axis->max - axis->min)
                        : axis->max != 0     ? 0.1 * fabs(axis->max)
                                             : 1;
    axis->min -= room;
    axis->max += room;
}

// Sets the ranges of both axes. False: there is no value to be drawn.
static bool panel_fit(ChartPanel *panel) {
    double padding = 0; // room for markers
    panel->x.min = panel->y.min = DBL_MAX;
    panel->x.max = panel->y.max = -DBL_MAX;
    for (size_t i = 0; i < panel->y.tick_count; i++)
        axis_extend(&panel->y, panel->y.ticks[i].value);
    for (size_t i = 0; i < panel->count; i++) {
        const ChartSeries *series = &panel->series[i];
        padding = series->kind == CHART_MARKERS && series->shape != CHART_TICK ? 0.03 : padding;
        for (size_t k = 0; k < series->count; k++) {
            if (series->kind == CHART_MAP) {
                panel_extend(panel, (double)(k % series->columns), (double)(k / series->columns));
                continue;
            }
            panel_extend(panel, series->x[k], series->y[k]);
            if (series->high != NULL)
                panel_extend(panel, series->x[k], series->high[k]);
        }
    }
    if (panel->y.max < panel->y.min)
        return false;
    if (panel->x.max < panel->x.min) {
        panel->x.min = 0;
        panel->x.max = 1;
    }
    axis_round(&panel->x, padding, false);
    axis_round(&panel->y, 0.05, true);
    return true;
}

// 0 to 1; values outside, infinite ones and the 0 of a logarithmic axis are at an end.
double chart_axis_share(const ChartAxis *axis, double value) {
    const double at = axis->is_logarithmic ? log10(value) : value;
    return fmin(fmax((at - axis->min) / (axis->max - axis->min), 0), 1);
}

static double panel_x(const ChartPanel *panel, double x) {
    return panel->left + (panel->right - panel->left) * chart_axis_share(&panel->x, x);
}

static double panel_y(const ChartPanel *panel, double y) {
    return panel->bottom - (panel->bottom - panel->top) * chart_axis_share(&panel->y, y);
}

// A grid line and its label: `text`, or 10 to the power of `decade` where it is ""; NULL: none.
static void panel_put_tick(const ChartPanel *panel, bool is_x, double value, const char *text,
                           int decade, Bytes *bytes) {
    const double x = panel_x(panel, value), y = panel_y(panel, value);
    if (is_x)
        bytes_format(bytes, "<path class=\"grid\" d=\"M%.1f %.0fV%.0f\"/>\n", x, panel->top,
                     panel->bottom);
    else
        bytes_format(bytes, "<path class=\"grid\" d=\"M%.0f %.1fH%.0f\"/>\n", panel->left, y,
                     panel->right);
    if (text == NULL || (is_x ? &panel->x : &panel->y)->is_unlabelled)
        return;
    bytes_format(bytes, "<text x=\"%.1f\" y=\"%.1f\" text-anchor=\"%s\">",
                 is_x ? x : panel->left - 8, is_x ? panel->bottom + 18 : y + 4,
                 is_x ? "middle" : "end");
    if (*text != '\0')
        chart_escape(bytes, text);
    else if (decade >= -1 && decade <= 3)
        bytes_format(bytes, "%g", pow(10, decade));
    else
        bytes_format(bytes, "10<tspan dy=\"-5\" font-size=\"9\">%d</tspan>", decade);
    bytes_text(bytes, "</text>\n");
}

// Steps of 1, 2 or 5 times a power of ten.
static double axis_step(const ChartAxis *axis, double parts) {
    const double part = (axis->max - axis->min) / parts;
    const double power = pow(10, floor(log10(part))), rest = part / power;
    return power * (rest < 2 ? 1 : rest < 5 ? 2 : 5);
}

static size_t axis_label(ChartLabel labels[CHART_LABELS], size_t count, double value) {
    if (count == CHART_LABELS)
        return count;
    labels[count] = (ChartLabel){.value = value};
    snprintf(labels[count].text, sizeof labels[count].text, "%.4g", value);
    return count + 1;
}

size_t chart_axis_labels(const ChartAxis *axis, double parts, ChartLabel labels[CHART_LABELS]) {
    size_t count = 0;
    for (; count < axis->tick_count; count++) {
        labels[count] = (ChartLabel){axis->ticks[count].value, .note = axis->ticks[count].note};
        text_fit(labels[count].text, sizeof labels[count].text, axis->ticks[count].text);
    }
    if (count > 0)
        return count;
    if (!axis->is_logarithmic) {
        const double step = axis_step(axis, parts), first = ceil(axis->min / step - 1e-9);
        for (int i = 0; i < TICKS_MAX && (first + i) * step <= axis->max + 1e-9 * step; i++)
            count = axis_label(labels, count, (first + i) * step);
        return count;
    }
    // Not every decade is labelled where there are many; of few, 2 and 5 times them are too.
    const int from = (int)floor(axis->min), to = (int)floor(axis->max);
    const int every = (int)fmax(1, ceil((to - from) / parts));
    const bool has_parts = axis->max - axis->min < 2;
    static const int factors[] = {1, 2, 5};
    for (int decade = from; decade <= to; decade++)
        for (size_t i = 0; i < (has_parts ? COUNT(factors) : 1); i++) {
            const double at = decade + log10(factors[i]);
            if (at < axis->min - 1e-9 || at > axis->max + 1e-9 || count == CHART_LABELS)
                continue;
            count = axis_label(labels, count, factors[i] * pow(10, decade));
            labels[count - 1].decade = decade;
            labels[count - 1].is_power = !has_parts;
            labels[count - 1].is_hidden = (to - decade) % every != 0;
        }
    return count;
}

static void panel_put_axis(const ChartPanel *panel, bool is_x, Bytes *bytes) {
    const ChartAxis *axis = is_x ? &panel->x : &panel->y;
    ChartLabel labels[CHART_LABELS];
    const size_t count = chart_axis_labels(axis,
                                           axis->is_logarithmic           ? DECADES_LABELLED + 1
                                           : !is_x && panel->height < 120 ? 2
                                                                          : 4,
                                           labels);
    for (size_t i = 0; i < count; i++) {
        const ChartLabel *label = &labels[i];
        panel_put_tick(panel, is_x, label->value,
                       label->is_hidden  ? NULL
                       : label->is_power ? ""
                                         : label->text,
                       label->decade, bytes);
        chart_put_text(bytes, panel->left - 8, panel_y(panel, label->value) + 18, "end", "faint",
                       label->note);
    }
}

// --- series ---

static void series_put_class(const ChartSeries *series, const char *kind, Bytes *bytes) {
    if (series->colour == CHART_STRONG)
        bytes_text(bytes, "<path class=\"strong");
    else
        bytes_format(bytes, "<path class=\"%s s%zu", kind, series->colour % CHART_COLOURS);
    bytes_format(bytes, "%s%s\"", series->look != NULL ? " " : "",
                 series->look != NULL ? series->look : "");
}

// Points first ... end - 1 of `values` as a path, forwards or back again.
static void series_put_points(const ChartPanel *panel, const ChartSeries *series,
                              const double *values, size_t first, size_t end, bool is_back,
                              Bytes *bytes) {
    enum { PIXELS = 650 };
    const bool is_area = series->kind == CHART_LINE && series->high != NULL;
    const double pixel =
        is_area || series->count <= PIXELS ? 0 : (panel->right - panel->left) / PIXELS;
    double start = 0, x = 0, y = 0, count = 0;
    char command = is_back ? 'L' : 'M';
    for (size_t i = first; i <= end; i++) {
        const size_t k = is_back ? first + end - 1 - i : i;
        const double at = i < end ? panel_x(panel, series->x[k]) : (double)INFINITY;
        if (count > 0 && fabs(at - start) >= pixel) {
            bytes_format(bytes, "%c%.1f %.1f", command, x / count, panel_y(panel, y / count));
            command = 'L';
            x = y = count = 0;
        }
        if (i == end)
            return;
        start = count > 0 ? start : at;
        x += at;
        y += values[k];
        count++;
    }
}

static bool series_has(const ChartPanel *panel, const ChartSeries *series, size_t i) {
    return chart_axis_shows(&panel->x, series->x[i]) && !isnan(series->y[i]);
}

// Lines and bands: from gap to gap along `y`, and back along `high` where there is one.
static void series_put_line(const ChartPanel *panel, const ChartSeries *series, Bytes *bytes) {
    const bool is_band = series->kind == CHART_BAND;
    series_put_class(series, is_band ? "band" : series->high != NULL ? "line area" : "line", bytes);
    bytes_text(bytes, " d=\"");
    for (size_t i = 0, end; i < series->count; i = end + 1) {
        end = i;
        while (end < series->count && series_has(panel, series, end))
            end++;
        if (end == i)
            continue;
        series_put_points(panel, series, series->y, i, end, false, bytes);
        if (series->high != NULL)
            series_put_points(panel, series, series->high, i, end, true, bytes);
    }
    bytes_text(bytes, "\"");
    chart_end_path(bytes, series->name);
}

static void series_put_marker(const ChartSeries *series, double x, double y, const char *name,
                              Bytes *bytes) {
    if (series->shape == CHART_CROSS)
        bytes_text(bytes, "<path class=\"cross\"");
    else
        series_put_class(series, series->shape == CHART_RING ? "line" : "mark", bytes);
    bytes_format(bytes, " transform=\"translate(%.1f %.1f)\" d=\"%s\"", x, y,
                 chart_shapes[series->shape]);
    chart_end_path(bytes, name);
}

static void series_put_cell(double share, double x, double y, double width, double height,
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

// The colours of a map are explained to the right of it, from the smallest value to the largest.
static void series_put_map(const ChartPanel *panel, const ChartSeries *series, Bytes *bytes) {
    const double width = (panel->right - panel->left) / (panel->x.max - panel->x.min);
    const double height = panel->height / (panel->y.max - panel->y.min);
    const double x = panel->right + 16, step = panel->height / MAP_STEPS;
    double min = DBL_MAX, max = -DBL_MAX;
    char text[CHART_LABEL];
    bytes_format(bytes,
                 "<rect class=\"bad\" x=\"%.1f\" y=\"%.1f\" width=\"%.1f\" height=\"%.1f\"/>\n",
                 panel->left, panel->top, panel->right - panel->left, panel->height);
    for (size_t i = 0; i < series->count; i++) {
        min = isnan(series->y[i]) ? min : fmin(min, series->y[i]);
        max = isnan(series->y[i]) ? max : fmax(max, series->y[i]);
    }
    for (size_t i = 0; i < series->count; i++)
        if (!isnan(series->y[i]))
            series_put_cell(max > min ? (series->y[i] - min) / (max - min) : 0.5,
                            panel->left + width * (double)(i % series->columns),
                            panel->bottom - height * (double)(i / series->columns + 1), width + 0.2,
                            height + 0.2, bytes);
    bytes_text(bytes, "\n");
    for (int i = 0; i < MAP_STEPS && min <= max; i++)
        series_put_cell((i + 0.5) / MAP_STEPS, x, panel->bottom - step * (i + 1), 10, step + 0.3,
                        bytes);
    snprintf(text, sizeof text, "%.4g", min);
    chart_put_text(bytes, x + 16, panel->bottom, "start", NULL, min <= max ? text : NULL);
    snprintf(text, sizeof text, "%.4g", max);
    chart_put_text(bytes, x + 16, panel->top + 10, "start", NULL, min <= max ? text : NULL);
}

static void panel_put_series(const ChartPanel *panel, const ChartSeries *series, Bytes *bytes) {
    if (series->kind == CHART_MAP)
        series_put_map(panel, series, bytes);
    else if (series->kind != CHART_MARKERS)
        series_put_line(panel, series, bytes);
    else
        for (size_t i = 0; i < series->count; i++)
            if (series_has(panel, series, i))
                series_put_marker(series, panel_x(panel, series->x[i]),
                                  panel_y(panel, series->y[i]),
                                  series->names != NULL ? series->names[i] : NULL, bytes);
}

// Beside the frame the samples are on the left of the texts, in it on the right.
static void panel_put_legend(const ChartPanel *panel, bool is_beside, Bytes *bytes) {
    const double x = is_beside ? panel->right + 10 : panel->right - 30;
    double y = panel->top + (is_beside ? 10 : 18), count = 0;
    for (size_t i = 0; i < panel->count; i++)
        count += panel->series[i].legend != NULL;
    for (size_t i = 0; i < panel->count; i++) {
        const ChartSeries *series = &panel->series[i];
        if (series->legend == NULL)
            continue;
        if (series->kind == CHART_MARKERS) {
            series_put_marker(series, x + 9, y, NULL, bytes);
        } else {
            series_put_class(series, "line", bytes);
            bytes_format(bytes, " d=\"M%.0f %.0fh18\"/>", x, y);
        }
        chart_put_text(bytes, is_beside ? x + 24 : x - 8, y + 4, is_beside ? "start" : "end", NULL,
                       series->legend);
        y += fmin(LEGEND_LINE, panel->height / count);
    }
}

static void panel_write(ChartPanel *panel, bool has_legend_beside, Bytes *bytes) {
    const bool has_values = panel->has_values;
    const double middle = (panel->left + panel->right) / 2;
    chart_put_text(bytes, panel->left, panel->top - 8, "start", "heading", panel->heading);
    if (has_values) {
        panel_put_axis(panel, true, bytes);
        panel_put_axis(panel, false, bytes);
    } else {
        chart_put_text(bytes, middle, (panel->top + panel->bottom) / 2, "middle", NULL,
                       "not known");
    }
    for (size_t i = panel->count; has_values && i-- > 0;)
        panel_put_series(panel, &panel->series[i], bytes);
    bytes_format(bytes,
                 "<rect class=\"frame\" x=\"%.0f\" y=\"%.0f\" width=\"%.0f\" height=\"%.0f\"/>\n",
                 panel->left, panel->top, panel->right - panel->left, panel->height);
    if (!panel->x.is_unlabelled)
        chart_put_text(bytes, middle, panel->bottom + 36, "middle", NULL, panel->x.title);
    panel_put_legend(panel, has_legend_beside, bytes);
}

// --- document ---

// Places the panels below the heading; returns the document's height.
static double chart_place(Chart *chart) {
    double y = chart->heading != NULL ? 42 : 12;
    for (size_t i = 0; i < chart->count; i++) {
        ChartPanel *panel = &chart->panels[i];
        panel->left = chart->left;
        panel->right = chart->width - chart->right;
        panel->top = y + (panel->heading != NULL ? 18 : 0);
        panel->bottom = panel->top + panel->height;
        y = panel->bottom + (panel->x.is_unlabelled ? 16 : 52);
    }
    return y;
}

// Panels with one labelled axis have the same range of it.
void chart_fit(Chart *chart) {
    ChartPanel *panels = chart->panels;
    for (size_t i = 0; i < chart->count; i++) {
        panels[i].has_values = panel_fit(&panels[i]);
        if (i > 0 && panels[i - 1].x.is_unlabelled && panels[i - 1].has_values) {
            panels[i].x.min = fmin(panels[i].x.min, panels[i - 1].x.min);
            panels[i].x.max = fmax(panels[i].x.max, panels[i - 1].x.max);
        }
    }
    for (size_t i = chart->count; i-- > 1;)
        if (panels[i - 1].x.is_unlabelled && panels[i].has_values) {
            panels[i - 1].x.min = panels[i].x.min;
            panels[i - 1].x.max = panels[i].x.max;
        }
}

void chart_clear(Chart *chart) {
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
    const double height = chart_place(chart);
    chart_fit(chart);
    bytes_format(bytes,
                 "<svg xmlns=\"http://www.w3.org/2000/svg\" viewBox=\"0 0 %.0f %.0f\" "
                 "role=\"img\">\n<title>",
                 chart->width, height);
    chart_escape(bytes, chart->title);
    bytes_text(bytes, "</title>\n<desc>");
    bytes_put(bytes, chart->description.at, chart->description.count);
    bytes_text(bytes, "</desc>\n");
    chart_put_style(bytes);
    bytes_format(bytes, "<rect class=\"page\" width=\"%.0f\" height=\"%.0f\"/>\n", chart->width,
                 height);
    chart_put_text(bytes, chart->left, 26, "start", "heading", chart->heading);
    for (size_t i = 0; i < chart->count; i++)
        panel_write(&chart->panels[i], chart->right > CHART_LEGEND_MARGIN, bytes);
    bytes_text(bytes, "</svg>\n");
    chart_clear(chart);
}
