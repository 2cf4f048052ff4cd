// A grid of two axes: one cell for each point; of more axes the last two, the others at their first
// values. What is missing or failed is grey. Of many values every so manieth has a cell.
#include "server/encode/chart_sweep_parts.h"

#include <math.h>
#include <stdio.h>

enum { CELLS = 48 };
static const double map_width = 208, map_height = 168, map_left = 88, map_step = 306, map_row = 244;

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
    const SweepAxisValues *x, *y;
    size_t columns, rows;
} Map;

static size_t map_index(size_t cell, size_t cells, size_t count) {
    return cells > 1 ? (size_t)((double)cell * (double)(count - 1) / (double)(cells - 1) + 0.5) : 0;
}

// Which of the axis's cells shows value `index`; SIZE_MAX: none.
static size_t map_cell(size_t index, size_t cells, size_t count) {
    const size_t cell =
        count > 1 ? (size_t)((double)index * (double)(cells - 1) / (double)(count - 1) + 0.5) : 0;
    return map_index(cell, cells, count) == index ? cell : SIZE_MAX;
}

static size_t cell_of(const void *of, size_t point) {
    const Map *map = of;
    const size_t wide = map->x->values.count;
    const size_t x = map_cell(point % wide, map->columns, wide);
    const size_t y = map_cell(point / wide, map->rows, map->y->values.count);
    return x == SIZE_MAX || y == SIZE_MAX ? SIZE_MAX : y * map->columns + x;
}

static void put_legend(const SweepChart *chart, const SweepScale *scale, double x, double y) {
    char colour[8], text[32];
    for (int i = 0; i < 24; i++) {
        colour_of((i + 0.5) / 24, colour);
        bytes_format(chart->bytes,
                     "<rect fill=\"%s\" x=\"%.1f\" y=\"%.1f\" width=\"%.2f\" height=\"6\"/>",
                     colour, x + map_width * i / 24, y, map_width / 24 + 0.3);
    }
    snprintf(text, sizeof text, "%.4g", scale->least);
    sweep_put_label(chart->bytes, x, y + 18, "start", "small", text);
    snprintf(text, sizeof text, "%.4g", scale->most);
    sweep_put_label(chart->bytes, x + map_width, y + 18, "end", "small", text);
}

static void put_sides(const SweepChart *chart, const Map *map, double x, double y) {
    char text[SWEEP_LABEL];
    sweep_label(map->x->values.at[0], text);
    sweep_put_label(chart->bytes, x, y + map_height + 14, "start", "small", text);
    sweep_label(map->x->values.at[map->x->values.count - 1], text);
    sweep_put_label(chart->bytes, x + map_width, y + map_height + 14, "end", "small", text);
    sweep_label(map->y->values.at[0], text);
    sweep_put_label(chart->bytes, x - 5, y + map_height, "end", "small", text);
    sweep_label(map->y->values.at[map->y->values.count - 1], text);
    sweep_put_label(chart->bytes, x - 5, y + 10, "end", "small", text);
}

// `values`: of the metric, cell by cell.
static void put_map(const SweepChart *chart, const Map *map, size_t metric, const double *values,
                    double x, double y) {
    SweepScale scale = {0};
    char name[SWEEP_NAME], colour[8];
    const double cell_width = map_width / (double)map->columns;
    const double cell_height = map_height / (double)map->rows;
    for (size_t i = 0; i < map->rows * map->columns; i++)
        sweep_scale_take(&scale, values[i]);
    sweep_metric_name(chart->sweep, metric, name);
    sweep_put_label(chart->bytes, x, y - 7, "start", "name", name);
    bytes_format(chart->bytes,
                 "<rect class=\"bad\" x=\"%.1f\" y=\"%.1f\" width=\"%.1f\" height=\"%.1f\"/>\n", x,
                 y, map_width, map_height);
    for (size_t i = 0; i < map->rows * map->columns; i++) {
        if (isnan(values[i]))
            continue;
        colour_of(sweep_scale_share(&scale, values[i]), colour);
        // The first value of the axis that goes up lies at the bottom.
        bytes_format(chart->bytes,
                     "<rect fill=\"%s\" x=\"%.1f\" y=\"%.1f\" width=\"%.1f\" height=\"%.1f\"/>",
                     colour, x + cell_width * (double)(i % map->columns),
                     y + map_height - cell_height * (double)(i / map->columns + 1),
                     cell_width + 0.2, cell_height + 0.2);
    }
    bytes_text(chart->bytes, "\n");
    put_sides(chart, map, x, y);
    if (scale.is_known)
        put_legend(chart, &scale, x, y + map_height + 22);
}

double sweep_put_maps(const SweepChart *chart, double top, Status *status) {
    const Sweep *sweep = chart->sweep;
    const size_t metrics = sweep_pictures(sweep);
    char name[SWEEP_NAME], line[SWEEP_NAME + 16];
    Map map = {.x = &sweep->axes.at[sweep->axes.count - 1],
               .y = &sweep->axes.at[sweep->axes.count - 2]};
    map.columns = map.x->values.count < CELLS ? map.x->values.count : CELLS;
    map.rows = map.y->values.count < CELLS ? map.y->values.count : CELLS;
    sweep_axis_name(map.x, name);
    snprintf(line, sizeof line, "across: %s", name);
    sweep_put_label(chart->bytes, map_left, top, "start", "axis", line);
    sweep_axis_name(map.y, name);
    snprintf(line, sizeof line, "upwards: %s", name);
    sweep_put_label(chart->bytes, map_left, top + 17, "start", "axis", line);
    top += 46;
    SweepSample sample;
    // The grid's first points have the other axes at their first values.
    *status = sweep_sample_make(chart->source, metrics, map.columns * map.rows,
                                map.x->values.count * map.y->values.count, cell_of, &map, &sample);
    for (size_t metric = 0; metric < metrics && *status == STATUS_OK; metric++)
        put_map(chart, &map, metric, sample.low + metric * sample.cells,
                map_left + map_step * (double)(metric % 2), top + map_row * (double)(metric / 2));
    sweep_sample_clear(&sample);
    return top + map_row * (double)((metrics + 1) / 2) - 16;
}
