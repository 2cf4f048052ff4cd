// A panel of a chart as text: each character holds 2 x 4 dots of a Braille pattern, or in ASCII
// 1 x 2 dots. Markers are characters of their own where they are few.
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "core/base/status.h"
#include "server/formats/chart.h"

enum { GLYPHS_MAX = 24, SHADES = 4 };

// Of the palette of chart.c in the terminal's 256 colours: legible on light and on dark ground.
static const unsigned char text_colours[CHART_COLOURS] = {32,  166, 35, 133, 136, 244,
                                                          161, 63,  70, 38,  130, 30};
// Viridis.
static const unsigned char text_map_colours[] = {54, 60, 31, 36, 71, 112, 184};

typedef struct TextCell {
    unsigned char dots, colour;
    const char *glyph; // in place of the dots; NULL: none
} TextCell;

typedef struct TextCanvas {
    const ChartText *form;
    const ChartPanel *panel;
    size_t columns, rows;
    int width, height; // in dots
    TextCell *cells;   // and below them one row for marks on the axis
} TextCanvas;

static const char *text_glyph(const TextCanvas *canvas, ChartShape shape) {
    static const char *const utf8[] = {"\u2022", "\u00d7", "\u25cb", "\u2534"};
    static const char *const ascii[] = {"*", "x", "o", "'"};
    return (canvas->form->is_utf8 ? utf8 : ascii)[shape];
}

static TextCell *text_cell(const TextCanvas *canvas, int x, int y) {
    const int across = canvas->width / (int)canvas->columns;
    const int down = canvas->height / (int)canvas->rows;
    return &canvas->cells[(size_t)(y / down) * canvas->columns + (size_t)(x / across)];
}

static void text_dot(const TextCanvas *canvas, double at_x, double at_y, unsigned char colour) {
    static const unsigned char bits[4][2] = {
        {0x01, 0x08}, {0x02, 0x10}, {0x04, 0x20}, {0x40, 0x80}};
    const int x = (int)(at_x + 0.5), y = (int)(at_y + 0.5);
    if (x < 0 || y < 0 || x >= canvas->width || y >= canvas->height)
        return;
    TextCell *cell = text_cell(canvas, x, y);
    cell->dots =
        (unsigned char)(cell->dots | (canvas->form->is_utf8 ? bits[y % 4][x % 2] : 1 << y % 2));
    cell->colour = colour;
}

static double text_x(const TextCanvas *canvas, double x) {
    return chart_axis_share(&canvas->panel->x, x) * (canvas->width - 1);
}

static double text_y(const TextCanvas *canvas, double y) {
    return (1 - chart_axis_share(&canvas->panel->y, y)) * (canvas->height - 1);
}

static void text_line(const TextCanvas *canvas, double x, double y, double to_x, double to_y,
                      unsigned char colour) {
    const int steps = (int)fmax(1, ceil(fmax(fabs(to_x - x), fabs(to_y - y))));
    for (int i = 0; i <= steps; i++)
        text_dot(canvas, x + (to_x - x) * i / steps, y + (to_y - y) * i / steps, colour);
}

// Lines through `values`; of many points the mean of each dot.
static void text_put_line(const TextCanvas *canvas, const ChartSeries *series, const double *values,
                          unsigned char colour) {
    const bool is_thinned = series->high == NULL && series->count > 2 * (size_t)canvas->width;
    double last_x = (double)NAN, last_y = (double)NAN;
    for (size_t i = 0, end; i < series->count; i = end) {
        end = i + 1;
        if (!chart_axis_shows(&canvas->panel->x, series->x[i]) || isnan(values[i])) {
            last_x = (double)NAN;
            continue;
        }
        const double x = text_x(canvas, series->x[i]);
        double sum = values[i];
        while (is_thinned && end < series->count && text_x(canvas, series->x[end]) < floor(x) + 1 &&
               !isnan(values[end]))
            sum += values[end++];
        const double y = text_y(canvas, sum / (double)(end - i));
        text_line(canvas, isnan(last_x) ? x : last_x, isnan(last_x) ? y : last_y, x, y, colour);
        last_x = x;
        last_y = y;
    }
}

// Vertical lines from `y` to `high`; those of a band have gaps, so that lines stay visible.
static void text_put_bars(const TextCanvas *canvas, const ChartSeries *series,
                          unsigned char colour) {
    const bool is_band = series->kind == CHART_BAND;
    for (size_t i = 0; i < series->count; i++) {
        if (!chart_axis_shows(&canvas->panel->x, series->x[i]) || isnan(series->y[i]) ||
            isnan(series->high[i]))
            continue;
        const double x = text_x(canvas, series->x[i]);
        double y = ceil(text_y(canvas, series->high[i]) - 0.5);
        for (; y <= text_y(canvas, series->y[i]) + 0.5; y++)
            if (!is_band || ((int)(x + 0.5) % 2 == 0 && (int)y % 2 == 0))
                text_dot(canvas, x, y, colour);
    }
}

static void text_put_markers(const TextCanvas *canvas, const ChartSeries *series,
                             unsigned char colour) {
    const bool has_glyphs = series->count <= GLYPHS_MAX || series->shape == CHART_TICK;
    for (size_t i = 0; i < series->count; i++) {
        if (!chart_axis_shows(&canvas->panel->x, series->x[i]) || isnan(series->y[i]))
            continue;
        const double x = text_x(canvas, series->x[i]), y = text_y(canvas, series->y[i]);
        if (!has_glyphs) {
            text_dot(canvas, x, y, colour);
            continue;
        }
        TextCell *cell = text_cell(canvas, (int)(x + 0.5), (int)(y + 0.5));
        if (series->shape == CHART_TICK) // on the axis
            cell = &canvas->cells[canvas->rows * canvas->columns +
                                  (size_t)(x + 0.5) * canvas->columns / (size_t)canvas->width];
        cell->glyph = text_glyph(canvas, series->shape);
        cell->colour = colour;
    }
}

static const char *text_shade(const TextCanvas *canvas, size_t level) {
    static const char *const utf8[SHADES] = {"\u2591", "\u2592", "\u2593", "\u2588"};
    static const char *const ascii[SHADES] = {":", "+", "*", "#"};
    return canvas->form->is_utf8 ? utf8[canvas->form->has_colour ? SHADES - 1 : level]
                                 : ascii[level];
}

// Returns the smallest and the largest value.
static void text_put_map(const TextCanvas *canvas, const ChartSeries *series, double range[2]) {
    const size_t rows = series->count / series->columns;
    range[0] = (double)INFINITY;
    range[1] = -(double)INFINITY;
    for (size_t i = 0; i < series->count; i++) {
        range[0] = fmin(range[0], isnan(series->y[i]) ? range[0] : series->y[i]);
        range[1] = fmax(range[1], isnan(series->y[i]) ? range[1] : series->y[i]);
    }
    for (size_t y = 0; y < canvas->rows; y++)
        for (size_t x = 0; x < canvas->columns; x++) {
            const size_t row = (canvas->rows - 1 - y) * rows / canvas->rows;
            const size_t column = x * series->columns / canvas->columns;
            const double value = series->y[row * series->columns + column];
            const double share =
                range[1] > range[0] ? (value - range[0]) / (range[1] - range[0]) : 0.5;
            TextCell *cell = &canvas->cells[y * canvas->columns + x];
            if (isnan(value))
                continue;
            cell->glyph = text_shade(canvas, (size_t)(share * (SHADES - 1) + 0.5));
            cell->colour =
                text_map_colours[(size_t)(share * (double)(COUNT(text_map_colours) - 1) + 0.5)];
        }
}

// 0: that of the text.
static unsigned char text_colour(const ChartSeries *series) {
    return series->colour == CHART_STRONG ? 0 : text_colours[series->colour % CHART_COLOURS];
}

// Without colours each of several lines has a letter, which stands on it and in the legend: "a", or
// NULL. `count` is that of the lines with a legend, `index` this one's place among them.
static const char *text_letter(const TextCanvas *canvas, const ChartSeries *series, size_t *index,
                               size_t *count) {
    static const char *const letters[] = {"a", "b", "c", "d", "e", "f", "g", "h"};
    const ChartSeries *const all = canvas->panel->series;
    *index = *count = 0;
    for (size_t i = 0; i < canvas->panel->count; i++) {
        const bool is_line = all[i].kind == CHART_LINE && all[i].legend != NULL;
        *count += is_line;
        *index += is_line && &all[i] < series;
    }
    return canvas->form->has_colour || series->kind != CHART_LINE || series->legend == NULL ||
                   *count < 2 || *index >= COUNT(letters)
               ? NULL
               : letters[*index];
}

// Three times, at places where no other line has its letter.
static void text_put_letters(const TextCanvas *canvas, const ChartSeries *series) {
    enum { TIMES = 3 };
    size_t index, count;
    const char *letter = text_letter(canvas, series, &index, &count);
    for (size_t k = 0; letter != NULL && k < TIMES; k++) {
        const double wanted =
            ((double)(index + k * count) + 0.5) / (double)(TIMES * count) * (canvas->width - 1);
        size_t nearest = series->count;
        double distance = (double)INFINITY;
        for (size_t i = 0; i < series->count; i++)
            if (chart_axis_shows(&canvas->panel->x, series->x[i]) && !isnan(series->y[i]) &&
                fabs(text_x(canvas, series->x[i]) - wanted) < distance) {
                distance = fabs(text_x(canvas, series->x[i]) - wanted);
                nearest = i;
            }
        const double y = nearest < series->count ? text_y(canvas, series->y[nearest]) : -1;
        if (distance < canvas->width / 8.0 && y > -0.5 && y < canvas->height - 0.5)
            text_cell(canvas, (int)(text_x(canvas, series->x[nearest]) + 0.5), (int)(y + 0.5))
                ->glyph = letter;
    }
}

static void text_put_series(const TextCanvas *canvas, const ChartSeries *series) {
    const unsigned char colour = text_colour(series);
    if (series->kind == CHART_MARKERS)
        text_put_markers(canvas, series, colour);
    else if (series->high != NULL)
        text_put_bars(canvas, series, colour);
    if (series->kind != CHART_LINE)
        return;
    text_put_line(canvas, series, series->y, colour);
    if (series->high != NULL)
        text_put_line(canvas, series, series->high, colour);
    text_put_letters(canvas, series);
}

// --- labels ---

typedef struct TextLabels {
    ChartLabel of[CHART_LABELS];
    size_t at[CHART_LABELS]; // columns, or rows from the bottom
    size_t count, width;
} TextLabels;

static void text_find_labels(const ChartAxis *axis, size_t cells, double parts,
                             TextLabels *labels) {
    labels->width = 0;
    labels->count = chart_axis_labels(axis, parts, labels->of);
    for (size_t i = 0; i < labels->count; i++) {
        ChartLabel *label = &labels->of[i];
        const size_t width = text_width(label->text);
        labels->at[i] = (size_t)(chart_axis_share(axis, label->value) * (double)cells * (1 - 1e-9));
        if (!label->is_hidden && width > labels->width)
            labels->width = width;
    }
}

// --- lines ---

static void text_paint(const ChartText *form, unsigned char colour, Bytes *bytes) {
    if (form->has_colour && colour > 0)
        bytes_format(bytes, "\033[38;5;%dm", colour);
    else if (form->has_colour)
        bytes_text(bytes, "\033[0m");
}

static void text_style(const ChartText *form, const char *style, Bytes *bytes) {
    if (form->has_colour)
        bytes_format(bytes, "\033[%sm", style);
}

static void text_repeat(Bytes *bytes, const char *text, size_t count) {
    while (count-- > 0)
        bytes_text(bytes, text);
}

static void text_put_cells(const TextCanvas *canvas, size_t row, Bytes *bytes) {
    static const char *const ascii[] = {" ", "'", ".", ":"};
    unsigned char colour = 0;
    for (size_t i = 0; i < canvas->columns; i++) {
        const TextCell *cell = &canvas->cells[row * canvas->columns + i];
        const bool is_blank = cell->glyph == NULL && cell->dots == 0;
        if (!is_blank && cell->colour != colour)
            text_paint(canvas->form, colour = cell->colour, bytes);
        const char braille[] = {(char)0xE2, (char)(0xA0 | cell->dots >> 6),
                                (char)(0x80 | (cell->dots & 0x3F))};
        if (cell->glyph != NULL || is_blank)
            bytes_text(bytes, is_blank ? " " : cell->glyph);
        else if (canvas->form->is_utf8)
            bytes_put(bytes, braille, sizeof braille);
        else
            bytes_text(bytes, ascii[cell->dots & 3]);
    }
    if (colour != 0)
        text_paint(canvas->form, 0, bytes);
}

static void text_put_rows(const TextCanvas *canvas, const TextLabels *labels, Bytes *bytes) {
    for (size_t row = 0; row < canvas->rows; row++) {
        const char *text = "";
        for (size_t i = 0; i < labels->count; i++)
            if (canvas->rows - 1 - labels->at[i] == row && !labels->of[i].is_hidden)
                text = labels->of[i].text;
        text_repeat(bytes, " ", labels->width - text_width(text));
        bytes_format(bytes, "%s %s", text,
                     !canvas->form->is_utf8 ? "|"
                     : *text != '\0'        ? "\u2524"
                                            : "\u2502");
        text_put_cells(canvas, row, bytes);
        bytes_text(bytes, "\n");
    }
}

// The axis with the marks on it, and its labels below where there is room.
static void text_put_axis(const TextCanvas *canvas, size_t margin, const TextLabels *labels,
                          Bytes *bytes) {
    const bool is_utf8 = canvas->form->is_utf8;
    TextCell *line = &canvas->cells[canvas->rows * canvas->columns];
    size_t end = 0;
    Bytes below = {.count = 0};
    for (size_t i = 0; i < labels->count; i++) {
        const size_t at = labels->at[i], width = text_width(labels->of[i].text);
        size_t start = margin + 2 + at;
        start -= width / 2 < start ? width / 2 : start;
        if (start + width > canvas->form->columns)
            start = canvas->form->columns - width;
        if (line[at].glyph == NULL)
            line[at].glyph = is_utf8 ? "\u252c" : "+";
        if (labels->of[i].is_hidden || (end > 0 && start < end + 1))
            continue;
        text_repeat(&below, " ", start - end);
        bytes_text(&below, labels->of[i].text);
        end = start + width;
    }
    for (size_t i = 0; i < canvas->columns; i++)
        if (line[i].glyph == NULL)
            line[i].glyph = is_utf8 ? "\u2500" : "-";
    text_repeat(bytes, " ", margin + 1);
    bytes_text(bytes, is_utf8 ? "\u2514" : "+");
    text_put_cells(canvas, canvas->rows, bytes);
    bytes_text(bytes, "\n");
    bytes_put(bytes, below.at, below.count);
    bytes_text(bytes, "\n");
    bytes_clear(&below);
}

// The legends, behind the heading of `used` characters or else on lines of their own.
static void text_put_legend(const TextCanvas *canvas, size_t used, Bytes *bytes) {
    const ChartPanel *panel = canvas->panel;
    size_t total = used;
    for (size_t i = 0; i < panel->count; i++)
        total += panel->series[i].legend != NULL ? text_width(panel->series[i].legend) + 4 : 0;
    if (panel->count > 1 && total > canvas->form->columns) {
        bytes_text(bytes, "\n");
        used = 0;
    }
    for (size_t i = 0; i < panel->count && panel->count > 1; i++) {
        const ChartSeries *series = &panel->series[i];
        const size_t width = series->legend != NULL ? text_width(series->legend) + 4 : 0;
        if (width == 0 || width > canvas->form->columns)
            continue;
        if (used + width > canvas->form->columns) {
            bytes_text(bytes, "\n");
            used = 0;
        }
        bytes_text(bytes, "  ");
        text_paint(canvas->form, text_colour(series), bytes);
        size_t index, lines;
        const char *letter = text_letter(canvas, series, &index, &lines);
        bytes_text(bytes, letter != NULL                  ? letter
                          : series->kind == CHART_MARKERS ? text_glyph(canvas, series->shape)
                          : canvas->form->is_utf8         ? "\u2500"
                                                          : "-");
        text_paint(canvas->form, 0, bytes);
        bytes_format(bytes, " %s", series->legend);
        used += width;
    }
    bytes_text(bytes, "\n");
}

// What the panel shows, and over what.
static void text_put_heading(const Chart *chart, const TextCanvas *canvas, Bytes *bytes) {
    const ChartPanel *panel = canvas->panel, *titled = panel;
    const char *heading = panel->heading != NULL ? panel->heading : chart->heading;
    while (titled->x.is_unlabelled && titled + 1 < chart->panels + chart->count)
        titled++;
    if (heading == NULL && panel->count > 0)
        heading = panel->series[0].legend != NULL ? panel->series[0].legend : panel->series[0].name;
    const char *title = titled->x.title != NULL ? titled->x.title : "";
    const char *over = *title != '\0' ? "over " : "";
    char lines[2][CHART_TEXT + 8], fitted[CHART_TEXT + 8] = "";
    snprintf(lines[0], sizeof lines[0], "%s", heading != NULL ? heading : "");
    snprintf(lines[1], sizeof lines[1], "%s%s", over, title);
    const bool is_one = text_width(lines[0]) + 1 + text_width(lines[1]) <= canvas->form->columns;
    for (int i = 0; i < 2; i++) {
        const size_t room = canvas->form->columns + 1;
        text_fit(fitted, room < sizeof fitted ? room : sizeof fitted, lines[i]);
        text_style(canvas->form, "1", bytes);
        bytes_format(bytes, "%s%s", i > 0 && is_one ? " " : "", fitted);
        text_style(canvas->form, "0", bytes);
        bytes_text(bytes, i == 0 && !is_one ? "\n" : "");
    }
    const size_t used = text_width(fitted) + (is_one ? text_width(lines[0]) + 1 : 0);
    text_put_legend(canvas, used, bytes);
}

void chart_write_text(Chart *chart, size_t index, const ChartText *form, Bytes *bytes) {
    if (chart->is_failed || index >= chart->count)
        return;
    chart_fit(chart);
    ChartPanel *panel = &chart->panels[index];
    TextCanvas canvas = {.form = form, .panel = panel, .rows = form->rows};
    text_put_heading(chart, &canvas, bytes);
    if (!panel->has_values) {
        bytes_text(bytes, "  not known\n");
        return;
    }
    TextLabels x, y;
    text_find_labels(&panel->y, form->rows, (double)form->rows / 3, &y);
    canvas.columns = form->columns > y.width + 12 ? form->columns - y.width - 2 : 10;
    canvas.width = (int)canvas.columns * (form->is_utf8 ? 2 : 1);
    canvas.height = (int)canvas.rows * (form->is_utf8 ? 4 : 2);
    canvas.cells = calloc((canvas.rows + 1) * canvas.columns, sizeof *canvas.cells);
    if (canvas.cells == NULL) {
        bytes->is_failed = true;
        return;
    }
    text_find_labels(&panel->x, canvas.columns, (double)canvas.columns / 14, &x);
    double range[2] = {(double)INFINITY, -(double)INFINITY};
    for (size_t i = panel->count; i-- > 0;)
        if (panel->series[i].kind == CHART_MAP)
            text_put_map(&canvas, &panel->series[i], range);
        else
            text_put_series(&canvas, &panel->series[i]);
    text_put_rows(&canvas, &y, bytes);
    text_put_axis(&canvas, y.width, &x, bytes);
    if (panel->count > 0 && panel->series[0].kind == CHART_MAP && range[0] <= range[1]) {
        text_repeat(bytes, " ", y.width + 2);
        for (size_t i = 0; i < COUNT(text_map_colours); i++) {
            text_paint(form, text_map_colours[i], bytes);
            bytes_text(bytes,
                       text_shade(&canvas, i * (SHADES - 1) / (COUNT(text_map_colours) - 1)));
        }
        text_paint(form, 0, bytes);
        bytes_format(bytes, " %.4g to %.4g\n", range[0], range[1]);
    }
    free(canvas.cells);
}
