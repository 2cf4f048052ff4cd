#include "server/formats/format.h"

#include <math.h>
#include <string.h>

#include "server/formats/chart.h"
#include "server/formats/downsample.h"

enum { SVG_POINTS = 800 }; // of a line over time

// The columns of one line: the same one twice, or the least and the largest values of buckets.
static const Column *svg_column(const Table *table, size_t line, bool is_high) {
    return table->columns[table->bucket > 0 ? 2 * line + is_high : line];
}

static void svg_set_name(const Table *table, const Column *column, char *name) {
    const size_t length = strlen(column->name) - (table->bucket > 0 ? strlen("_min") : 0);
    chart_format(name, CHART_LABEL, "%.*s", (int)length, column->name);
}

// The panel with that unit that has room, or a new one; NULL: none.
static ChartPanel *svg_find_panel(Chart *chart, const char *units[CHART_PANELS], const char *unit) {
    size_t i = 0;
    while (i < chart->count && strcmp(units[i], unit) != 0)
        i++;
    if (i == CHART_PANELS || (i < chart->count && chart->panels[i].count == CHART_COLOURS))
        return NULL;
    units[i] = unit;
    return i < chart->count ? &chart->panels[i] : chart_panel(chart, 70, 946, 0, 0);
}

// The least and the largest value of each part of the rows, so that no peak is lost.
static void svg_thin(const Table *table, size_t line, size_t part, double *low, double *high) {
    const double *least = table_values(table, svg_column(table, line, false)->values);
    const double *most = table_values(table, svg_column(table, line, true)->values);
    double other;
    for (size_t i = 0; i * part < table->count; i++) {
        const size_t left = table->count - i * part, count = left < part ? left : part;
        downsample_extremes(least + i * part, count, &low[i], &other);
        downsample_extremes(most + i * part, count, &other, &high[i]);
    }
}

// Panels below each other over one axis of time.
static void svg_place_panels(Chart *chart, const Table *table, const char *const *units) {
    const double height = chart->count > 1 ? 150 : 300;
    const char *axis = table->axis_name != NULL ? table->axis_name : "row";
    const char *unit = table->axis_name != NULL ? table->axis_unit : "1";
    bool has_legend = false;
    chart->height = 60;
    for (size_t i = 0; i < chart->count; i++)
        has_legend = has_legend || chart->panels[i].count > 1;
    for (size_t i = 0; i < chart->count; i++) {
        ChartPanel *panel = &chart->panels[i];
        panel->has_side_legend = true;
        panel->right = has_legend ? 750 : 946;
        panel->top = 40 + (height + 40) * (double)i;
        panel->bottom = panel->top + height;
        panel->empty = "not known";
        panel->x.is_unlabelled = i + 1 < chart->count;
        chart_format(panel->x.title, CHART_TEXT, "%s [%s]", axis, unit);
        for (size_t k = 0; k < panel->count; k++)
            text_list(panel->heading, 100, panel->series[k].name);
        if (units[i][0] != '\0')
            chart_format(panel->heading + strlen(panel->heading), CHART_TEXT - 100, " [%s]",
                         units[i]);
        for (size_t k = 0; k < panel->count && panel->count > 1; k++)
            text_fit(panel->series[k].legend, CHART_TEXT, panel->series[k].name);
        chart->height = panel->bottom + 46;
    }
}

static void svg_add_series(Chart *chart, const Table *table) {
    const char *units[CHART_PANELS];
    const size_t part = (table->count + SVG_POINTS - 1) / SVG_POINTS + (table->count == 0);
    const size_t points = (table->count + part - 1) / part;
    const size_t lines = table->bucket > 0 ? table->column_count / 2 : table->column_count;
    const size_t drawn =
        lines < CHART_PANELS * CHART_COLOURS ? lines : CHART_PANELS * CHART_COLOURS;
    double *x = chart_allocate(chart, (1 + 2 * drawn) * points, sizeof *x);
    if (x == NULL)
        return;
    for (size_t i = 0; i < points; i++)
        x[i] = table->axis != NULL ? table_values(table, table->axis)[i * part]
                                   : table_time(table, i * part);
    double *next = x + points;
    for (size_t i = 0; i < lines; i++) {
        const Column *column = svg_column(table, i, false);
        ChartPanel *panel = svg_find_panel(chart, units, column->unit);
        char name[CHART_LABEL];
        svg_set_name(table, column, name);
        if (panel == NULL) {
            chart_note(chart, " Not drawn: ", name);
            continue;
        }
        svg_thin(table, i, part, next, next + points);
        ChartSeries *series = chart_series(panel, CHART_LINE, x, next, next + points, points);
        series->colour = panel->count - 1;
        text_fit(series->name, CHART_TEXT, name);
        next += 2 * points;
    }
    svg_place_panels(chart, table, units);
}

static void svg_add_spectra(Chart *chart, const Table *table) {
    ChartPanel *panel = chart_spectra(chart, 70, 946, 44, 424);
    chart->height = 476;
    panel->empty = "not known";
    for (size_t i = 0; i < table->column_count; i++) {
        const Column *column = table->columns[i];
        if (i >= CHART_COLOURS) {
            chart_note(chart, " Not drawn: ", column->name);
            continue;
        }
        ChartSeries *series = chart_series(panel, CHART_LINE, table_values(table, table->axis),
                                           table_values(table, column->values), NULL, table->count);
        series->colour = i;
        text_fit(series->name, CHART_TEXT, column->name);
        chart_quantity(series->legend, column->name, column->unit);
    }
}

// In one piece: its size is limited.
static bool svg_next(const Table *table, TextPlace *place, Bytes *bytes) {
    Chart chart = {.width = 960, .left = 70};
    const bool is_spectra = table->axis_name != NULL && strcmp(table->axis_name, "frequency") == 0;
    (void)place;
    text_fit(chart.title, CHART_TEXT, is_spectra ? "Power spectral densities" : "Time series");
    if (is_spectra)
        svg_add_spectra(&chart, table);
    else
        svg_add_series(&chart, table);
    chart_write(&chart, bytes);
    return false;
}

const TableFormat format_svg = {
    .extension = "svg",
    .content_type = chart_type,
    .is_binary = false,
    .next = svg_next,
};
