// Small pictures, one for each metric:
//
//     one axis, or a list    a line over the axis, to scale where it is of numbers
//     a grid of two axes     a map, one cell for each point; of more axes the last two, the others
//                            at their first values
//
// What is missing or failed is a gap or a grey cell. Of many points a line keeps the extremes of
// each column, and a map every so manieth value.
#include "server/encode/chart_sweep.h"

#include <float.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "server/encode/svg.h"

enum { PICTURES = 6, CELLS = 48, COLUMNS = 560, LABEL = 40 };
static const double width = 640, left = 66, right = 622, panel = 110, gap = 34;
static const double map_width = 208, map_height = 168, map_left = 88, map_step = 306, map_row = 244;

typedef struct Chart {
    const Sweep *sweep;
    const long *rows; // by point: its row in the table, or -1
    Bytes *bytes;
} Chart;

static double value_of(const Chart *chart, size_t point, size_t metric) {
    const long row = chart->rows[point];
    return row < 0
               ? (double)NAN
               : chart->sweep->table.values.at[(size_t)row * chart->sweep->metrics.count + metric];
}

static size_t pictures(const Sweep *sweep) {
    return sweep->metrics.count < PICTURES ? sweep->metrics.count : PICTURES;
}

static void put_style(Bytes *bytes) {
    bytes_text(bytes,
               "<style>\n"
               "svg { font: 12px system-ui, sans-serif; color-scheme: light dark; }\n"
               ".page { fill: #ffffff; } text { fill: #222222; }\n"
               ".small { font-size: 10.5px; } .name { font-weight: 600; }\n"
               ".grid { stroke: #dddddd; fill: none; } .frame { stroke: #777777; fill: none; }\n"
               ".line { stroke: #0072b2; fill: none; stroke-width: 1.6; stroke-linejoin: round; }\n"
               ".dot { fill: #0072b2; } .bad { fill: #9a9a9a; } .miss { stroke: #d55e00; }\n"
               "@media (prefers-color-scheme: dark) {\n"
               ".page { fill: #16181c; } text { fill: #e4e4e4; } .grid { stroke: #363a41; }\n"
               ".frame { stroke: #8a8f98; } .line { stroke: #56b4e9; } .dot { fill: #56b4e9; }\n"
               ".bad { fill: #5c6068; } .miss { stroke: #f0944d; }\n"
               "}\n</style>\n");
}

// A scalar's text as it is shown: without quotes, short.
static void label_of(const char *json, char label[LABEL]) {
    const bool is_text = *json == '"';
    const size_t length = strlen(json) - (is_text ? 2 : 0);
    char text[256];
    if (!is_text && (*json == '-' || (*json >= '0' && *json <= '9'))) {
        snprintf(label, LABEL, "%.4g", strtod(json, NULL));
        return;
    }
    const size_t kept = length < sizeof text ? length : sizeof text - 1;
    memcpy(text, json + is_text, kept);
    text[kept] = '\0';
    text_fit(label, 18, text);
}

static void axis_name(const SweepTold *axis, char name[160]) {
    char pointer[120];
    text_fit(pointer, sizeof pointer, axis->pointer);
    snprintf(name, 160, "%s%s%s%s", pointer, axis->unit != NULL ? " [" : "",
             axis->unit != NULL ? axis->unit : "", axis->unit != NULL ? "]" : "");
}

static void metric_name(const Sweep *sweep, size_t metric, char name[96]) {
    const char *unit = sweep_metric_unit(sweep->metrics.at[metric]);
    snprintf(name, 96, "%.40s%s%s%s", sweep->metrics.at[metric], unit != NULL ? " [" : "",
             unit != NULL ? unit : "", unit != NULL ? "]" : "");
    for (char *c = name; *c != '\0' && *c != '['; c++)
        if (*c == '_')
            *c = ' ';
}

static void put_label(Bytes *bytes, double x, double y, const char *anchor, const char *class_,
                      const char *text) {
    bytes_format(bytes, "<text class=\"%s\" x=\"%.1f\" y=\"%.1f\" text-anchor=\"%s\">", class_, x,
                 y, anchor);
    svg_text(bytes, text);
    bytes_text(bytes, "</text>\n");
}

typedef struct Scale {
    double least, most;
    bool is_known, is_logarithmic;
} Scale;

static void scale_take(Scale *scale, double value) {
    if (!isfinite(value))
        return;
    scale->least = scale->is_known ? fmin(scale->least, value) : value;
    scale->most = scale->is_known ? fmax(scale->most, value) : value;
    scale->is_known = true;
}

// Of one number alone, in the middle.
static double scale_share(const Scale *scale, double value) {
    if (!(scale->most > scale->least))
        return 0.5;
    return scale->is_logarithmic ? log(value / scale->least) / log(scale->most / scale->least)
                                 : (value - scale->least) / (scale->most - scale->least);
}

// Over the points' axis: to scale where all its values are numbers, else evenly.
typedef struct Across {
    const SweepTold *axis;
    size_t count;
    Scale scale;
    bool is_numeric;
} Across;

static bool is_number(const char *json) {
    return *json == '-' || (*json >= '0' && *json <= '9');
}

static Across across(const Sweep *sweep) {
    Across of = {.axis = &sweep->axes.at[0], .is_numeric = true};
    of.count = of.axis->values.count;
    for (size_t i = 0; i < of.count; i++) {
        of.is_numeric = of.is_numeric && is_number(of.axis->values.at[i]);
        if (of.is_numeric)
            scale_take(&of.scale, strtod(of.axis->values.at[i], NULL));
    }
    if (!of.is_numeric)
        of.scale = (Scale){.least = 0, .most = (double)of.count - 1, .is_known = true};
    of.scale.is_logarithmic =
        of.is_numeric && of.scale.least > 0 && of.scale.most > 30 * of.scale.least;
    return of;
}

static double across_x(const Across *of, size_t index) {
    const double at = of->is_numeric ? strtod(of->axis->values.at[index], NULL) : (double)index;
    return left + 8 + (right - left - 16) * scale_share(&of->scale, at);
}

static void put_frame(const Chart *chart, const Scale *scale, const char *name, double top) {
    Bytes *bytes = chart->bytes;
    char text[32];
    put_label(bytes, left, top - 7, "start", "name", name);
    bytes_format(bytes,
                 "<rect class=\"frame\" x=\"%.0f\" y=\"%.0f\" width=\"%.0f\" height=\"%.0f\"/>\n",
                 left, top, right - left, panel);
    if (!scale->is_known) {
        put_label(bytes, (left + right) / 2, top + panel / 2, "middle", "small", "not known");
        return;
    }
    for (int i = 0; i <= 2; i++) {
        const double y = top + panel - 8 - (panel - 16) * i / 2;
        if (!(scale->most > scale->least) && i != 1)
            continue;
        bytes_format(bytes, "<path class=\"grid\" d=\"M%.0f %.1fH%.0f\"/>", left, y, right);
        snprintf(text, sizeof text, "%.4g", scale->least + (scale->most - scale->least) * i / 2);
        put_label(bytes, left - 7, y + 4, "end", "small", text);
    }
}

// Points of one pixel column: the first, the extremes and the last would look like the extremes.
static void put_line(const Chart *chart, const Across *of, const Scale *scale, size_t metric,
                     double top) {
    Bytes *bytes = chart->bytes;
    bool is_open = false;
    size_t drawn = 0;
    bytes_text(bytes, "<path class=\"line\" d=\"");
    for (size_t i = 0; i < of->count;) {
        const double x = across_x(of, i);
        double low = (double)NAN, high = (double)NAN;
        size_t among = 0;
        for (; i < of->count &&
               (among == 0 || (of->count > COLUMNS && fabs(across_x(of, i) - x) < 1));
             i++, among++) {
            const double value = value_of(chart, i, metric);
            if (isnan(value))
                continue;
            low = isnan(low) ? value : fmin(low, value);
            high = isnan(high) ? value : fmax(high, value);
        }
        if (isnan(low)) {
            is_open = false;
            continue;
        }
        const double y0 = top + panel - 8 - (panel - 16) * scale_share(scale, low);
        const double y1 = top + panel - 8 - (panel - 16) * scale_share(scale, high);
        bytes_format(bytes, "%s%.1f %.1f", is_open ? "L" : "M", x, y0);
        if (among > 1)
            bytes_format(bytes, "L%.1f %.1f", x, y1);
        is_open = of->is_numeric;
        drawn++;
    }
    bytes_text(bytes, "\"/>\n");
    if (drawn > 80)
        return;
    for (size_t i = 0; i < of->count; i++) {
        const double value = value_of(chart, i, metric);
        if (!isnan(value))
            bytes_format(bytes, "<circle class=\"dot\" cx=\"%.1f\" cy=\"%.1f\" r=\"2.4\"/>",
                         across_x(of, i),
                         top + panel - 8 - (panel - 16) * scale_share(scale, value));
        else if (chart->rows[i] >= 0)
            bytes_format(bytes, "<path class=\"miss\" d=\"M%.1f %.1fl5 5m0 -5l-5 5\"/>",
                         across_x(of, i) - 2.5, top + panel - 8);
    }
}

static void put_across(const Chart *chart, const Across *of, double y) {
    char text[LABEL], name[160];
    const size_t ticks = of->is_numeric ? 5 : of->count < 6 ? of->count : 6;
    for (size_t i = 0; i < ticks; i++) {
        const double share = ticks > 1 ? (double)i / (double)(ticks - 1) : 0.5;
        const size_t index = (size_t)(share * (double)(of->count - 1) + 0.5);
        double x = left + 8 + (right - left - 16) * share;
        if (of->is_numeric) {
            const Scale *scale = &of->scale;
            const double at = scale->is_logarithmic
                                  ? scale->least * pow(scale->most / scale->least, share)
                                  : scale->least + (scale->most - scale->least) * share;
            snprintf(text, sizeof text, "%.4g", at);
            if (!(scale->most > scale->least) && i != ticks / 2)
                continue;
        } else {
            label_of(of->axis->values.at[index], text);
            x = across_x(of, index);
        }
        put_label(chart->bytes, x, y + 16, "middle", "small", text);
    }
    axis_name(of->axis, name);
    put_label(chart->bytes, (left + right) / 2, y + 34, "middle", "axis", name);
}

static double put_lines(const Chart *chart, double top) {
    const Across of = across(chart->sweep);
    char name[96];
    for (size_t metric = 0; metric < pictures(chart->sweep); metric++) {
        Scale scale = {0};
        for (size_t i = 0; i < of.count; i++)
            scale_take(&scale, value_of(chart, i, metric));
        metric_name(chart->sweep, metric, name);
        put_frame(chart, &scale, name, top);
        put_line(chart, &of, &scale, metric, top);
        top += panel + gap;
    }
    put_across(chart, &of, top - gap);
    return top - gap + 46;
}

// Viridis, by six of its colours.
static void colour_of(double share, char colour[8]) {
    static const double stops[][3] = {{68, 1, 84},    {65, 68, 135},  {42, 120, 142},
                                      {34, 168, 132}, {122, 209, 81}, {253, 231, 37}};
    const double at = fmin(fmax(share, 0), 1) * (COUNT(stops) - 1);
    const size_t i = at >= COUNT(stops) - 1 ? COUNT(stops) - 2 : (size_t)at;
    unsigned parts[3];
    for (size_t k = 0; k < 3; k++)
        parts[k] =
            (unsigned)(stops[i][k] + (stops[i + 1][k] - stops[i][k]) * (at - (double)i) + 0.5);
    snprintf(colour, 8, "#%02x%02x%02x", parts[0] & 255, parts[1] & 255, parts[2] & 255);
}

// The last two axes, thinned out to what can be seen.
typedef struct Map {
    const SweepTold *x, *y;
    size_t columns, rows;
} Map;

static size_t map_index(size_t cell, size_t cells, size_t count) {
    return cells > 1 ? (size_t)((double)cell * (double)(count - 1) / (double)(cells - 1) + 0.5) : 0;
}

static double map_value(const Chart *chart, const Map *map, size_t metric, size_t column,
                        size_t row) {
    const size_t x = map_index(column, map->columns, map->x->values.count);
    const size_t y = map_index(row, map->rows, map->y->values.count);
    // Other axes at their first values: the first points of the grid.
    return value_of(chart, y * map->x->values.count + x, metric);
}

static void put_legend(const Chart *chart, const Scale *scale, double x, double y) {
    char colour[8], text[32];
    for (int i = 0; i < 24; i++) {
        colour_of((i + 0.5) / 24, colour);
        bytes_format(chart->bytes,
                     "<rect fill=\"%s\" x=\"%.1f\" y=\"%.1f\" width=\"%.2f\" height=\"6\"/>",
                     colour, x + map_width * i / 24, y, map_width / 24 + 0.3);
    }
    snprintf(text, sizeof text, "%.4g", scale->least);
    put_label(chart->bytes, x, y + 18, "start", "small", text);
    snprintf(text, sizeof text, "%.4g", scale->most);
    put_label(chart->bytes, x + map_width, y + 18, "end", "small", text);
}

static void put_sides(const Chart *chart, const Map *map, double x, double y) {
    char text[LABEL];
    label_of(map->x->values.at[0], text);
    put_label(chart->bytes, x, y + map_height + 14, "start", "small", text);
    label_of(map->x->values.at[map->x->values.count - 1], text);
    put_label(chart->bytes, x + map_width, y + map_height + 14, "end", "small", text);
    label_of(map->y->values.at[0], text);
    put_label(chart->bytes, x - 5, y + map_height, "end", "small", text);
    label_of(map->y->values.at[map->y->values.count - 1], text);
    put_label(chart->bytes, x - 5, y + 10, "end", "small", text);
}

static void put_map(const Chart *chart, const Map *map, size_t metric, double x, double y) {
    Scale scale = {0};
    char name[96], colour[8];
    const double cell_width = map_width / (double)map->columns;
    const double cell_height = map_height / (double)map->rows;
    for (size_t row = 0; row < map->rows; row++)
        for (size_t column = 0; column < map->columns; column++)
            scale_take(&scale, map_value(chart, map, metric, column, row));
    metric_name(chart->sweep, metric, name);
    put_label(chart->bytes, x, y - 7, "start", "name", name);
    bytes_format(chart->bytes,
                 "<rect class=\"bad\" x=\"%.1f\" y=\"%.1f\" width=\"%.1f\" height=\"%.1f\"/>\n", x,
                 y, map_width, map_height);
    for (size_t row = 0; row < map->rows; row++)
        for (size_t column = 0; column < map->columns; column++) {
            const double value = map_value(chart, map, metric, column, row);
            if (isnan(value))
                continue;
            colour_of(scale_share(&scale, value), colour);
            // The first value of the axis that goes up lies at the bottom.
            bytes_format(chart->bytes,
                         "<rect fill=\"%s\" x=\"%.1f\" y=\"%.1f\" width=\"%.1f\" height=\"%.1f\"/>",
                         colour, x + cell_width * (double)column,
                         y + map_height - cell_height * (double)(row + 1), cell_width + 0.2,
                         cell_height + 0.2);
        }
    bytes_text(chart->bytes, "\n");
    put_sides(chart, map, x, y);
    if (scale.is_known)
        put_legend(chart, &scale, x, y + map_height + 22);
}

static double put_maps(const Chart *chart, double top) {
    const Sweep *sweep = chart->sweep;
    char name[160], line[200];
    Map map = {.x = &sweep->axes.at[sweep->axes.count - 1],
               .y = &sweep->axes.at[sweep->axes.count - 2]};
    map.columns = map.x->values.count < CELLS ? map.x->values.count : CELLS;
    map.rows = map.y->values.count < CELLS ? map.y->values.count : CELLS;
    axis_name(map.x, name);
    snprintf(line, sizeof line, "across: %s", name);
    put_label(chart->bytes, map_left, top, "start", "axis", line);
    axis_name(map.y, name);
    snprintf(line, sizeof line, "upwards: %s", name);
    put_label(chart->bytes, map_left, top + 17, "start", "axis", line);
    top += 46;
    for (size_t metric = 0; metric < pictures(sweep); metric++)
        put_map(chart, &map, metric, map_left + map_step * (double)(metric % 2),
                top + map_row * (double)(metric / 2));
    return top + map_row * (double)((pictures(sweep) + 1) / 2) - 16;
}

static bool is_map(const Sweep *sweep) {
    return sweep->axes.count > 1 && sweep->mode == SWEEP_GRID;
}

static void put_description(const Sweep *sweep, Bytes *bytes) {
    bytes_format(bytes, "<desc>%zu of %llu points, %llu failed. Gaps and grey cells: not there.",
                 sweep->table.points.count, (unsigned long long)sweep->points,
                 (unsigned long long)sweep->table.failed);
    for (size_t i = 0; is_map(sweep) && i + 2 < sweep->axes.count; i++) {
        bytes_text(bytes, " Drawn at the first value of ");
        svg_text(bytes, sweep->axes.at[i].pointer);
        bytes_text(bytes, ".");
    }
    for (size_t i = pictures(sweep); i < sweep->metrics.count; i++)
        bytes_format(bytes, " Not drawn: %s.", sweep->metrics.at[i]);
    bytes_text(bytes, "</desc>\n");
}

void chart_sweep(const Sweep *sweep, Bytes *bytes) {
    long *rows = malloc(sweep->points * sizeof *rows);
    Bytes picture = {.most = bytes->most};
    const Chart chart = {sweep, rows, &picture};
    if (rows == NULL) {
        bytes->is_failed = true;
        return;
    }
    for (size_t i = 0; i < sweep->points; i++)
        rows[i] = -1;
    for (size_t i = 0; i < sweep->table.points.count; i++)
        rows[(size_t)sweep->table.points.at[i]] = (long)i;
    const double bottom = is_map(sweep) ? put_maps(&chart, 56) : put_lines(&chart, 62);
    free(rows);
    bytes_format(
        bytes,
        "<svg xmlns=\"http://www.w3.org/2000/svg\" viewBox=\"0 0 %.0f %.0f\" role=\"img\">\n",
        width, bottom + 6);
    bytes_format(bytes, "<title>A sweep of %llu points</title>\n",
                 (unsigned long long)sweep->points);
    put_description(sweep, bytes);
    put_style(bytes);
    bytes_format(bytes, "<rect class=\"page\" width=\"%.0f\" height=\"%.0f\"/>\n", width,
                 bottom + 6);
    bytes_format(bytes, "<text x=\"%.0f\" y=\"26\" font-size=\"14\">", left);
    if (sweep->table.points.count < sweep->points)
        bytes_format(bytes, "%zu of ", sweep->table.points.count);
    bytes_format(bytes, "%llu points", (unsigned long long)sweep->points);
    if (sweep->table.failed > 0)
        bytes_format(bytes, ", %llu failed", (unsigned long long)sweep->table.failed);
    bytes_text(bytes, "</text>\n");
    if (picture.is_failed)
        bytes->is_failed = true;
    else
        bytes_put(bytes, picture.at, picture.count);
    bytes_clear(&picture);
    bytes_text(bytes, "</svg>\n");
}
