// Small pictures, one for each metric:
//
//     one axis, or a list    a line over the axis, to scale where it is of numbers
//     a grid of two axes     a map (chart_sweep_map.c)
//
// What is missing or failed is a gap or a cross. Of many points a line keeps the extremes of as
// many as fall into one column. Size and memory are the same for any number of points.
#include "server/encode/chart_sweep.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>

#include "server/encode/chart_sweep_parts.h"
#include "server/encode/svg.h"

enum { COLUMNS = 560, DOTS = 80 };
static const double width = 640, left = 66, right = 622, panel = 110, gap = 34;

static const char rules[] = ".small { font-size: 10.5px; } .name { font-weight: 600; }\n"
                            ".bad { fill: #9a9a9a; } .miss { stroke: #d55e00; }\n";

// Over the points' axis: to scale where all its values are numbers, else evenly.
typedef struct Across {
    const SweepAxisValues *axis;
    size_t count, group; // points, and as many of them as stand in one column
    SweepScale scale;
    bool is_numeric;
} Across;

static bool is_number(const char *json) {
    return *json == '-' || (*json >= '0' && *json <= '9');
}

static Across across(const Sweep *sweep) {
    Across of = {.axis = &sweep->axes.at[0], .is_numeric = true};
    of.count = of.axis->values.count;
    of.group = (of.count + COLUMNS - 1) / COLUMNS;
    for (size_t i = 0; i < of.count; i++) {
        of.is_numeric = of.is_numeric && is_number(of.axis->values.at[i]);
        if (of.is_numeric)
            sweep_scale_take(&of.scale, strtod(of.axis->values.at[i], NULL));
    }
    if (!of.is_numeric)
        of.scale = (SweepScale){.least = 0, .most = (double)of.count - 1, .is_known = true};
    of.scale.is_logarithmic =
        of.is_numeric && of.scale.least > 0 && of.scale.most > 30 * of.scale.least;
    return of;
}

static double across_x(const Across *of, size_t index) {
    const double at = of->is_numeric ? strtod(of->axis->values.at[index], NULL) : (double)index;
    return left + 8 + (right - left - 16) * sweep_scale_share(&of->scale, at);
}

static void put_frame(const SweepChart *chart, const SweepScale *scale, const char *name,
                      double top) {
    Bytes *bytes = chart->bytes;
    char text[32];
    sweep_put_label(bytes, left, top - 7, "start", "name", name);
    bytes_format(bytes,
                 "<rect class=\"frame\" x=\"%.0f\" y=\"%.0f\" width=\"%.0f\" height=\"%.0f\"/>\n",
                 left, top, right - left, panel);
    if (!scale->is_known) {
        sweep_put_label(bytes, (left + right) / 2, top + panel / 2, "middle", "small", "not known");
        return;
    }
    for (int i = 0; i <= 2; i++) {
        const double y = top + panel - 8 - (panel - 16) * i / 2;
        if (!(scale->most > scale->least) && i != 1)
            continue;
        bytes_format(bytes, "<path class=\"grid\" d=\"M%.0f %.1fH%.0f\"/>", left, y, right);
        snprintf(text, sizeof text, "%.4g", scale->least + (scale->most - scale->least) * i / 2);
        sweep_put_label(bytes, left - 7, y + 4, "end", "small", text);
    }
}

static double height_of(const SweepScale *scale, double value, double top) {
    return top + panel - 8 - (panel - 16) * sweep_scale_share(scale, value);
}

static size_t column_of(const void *of, size_t point) {
    return point / ((const Across *)of)->group;
}

static void put_dots(const SweepChart *chart, const Across *of, const SweepScale *scale,
                     const SweepSample *sample, const double *values, double top) {
    for (size_t i = 0; i < sample->cells; i++)
        if (!isnan(values[i]))
            bytes_format(chart->bytes,
                         "<circle class=\"mark s0\" cx=\"%.1f\" cy=\"%.1f\" r=\"2.4\"/>",
                         across_x(of, i), height_of(scale, values[i], top));
        else if (sample->is_there[i])
            bytes_format(chart->bytes, "<path class=\"miss\" d=\"M%.1f %.1fl5 5m0 -5l-5 5\"/>",
                         across_x(of, i) - 2.5, top + panel - 8);
}

static void put_line(const SweepChart *chart, const Across *of, const SweepSample *sample,
                     size_t metric, double top) {
    const double *low = sample->low + metric * sample->cells;
    const double *high = sample->high + metric * sample->cells;
    char name[SWEEP_NAME];
    SweepScale scale = {0};
    bool is_open = false;
    for (size_t i = 0; i < sample->cells; i++) {
        sweep_scale_take(&scale, low[i]);
        sweep_scale_take(&scale, high[i]);
    }
    sweep_metric_name(chart->sweep, metric, name);
    put_frame(chart, &scale, name, top);
    bytes_text(chart->bytes, "<path class=\"line s0\" d=\"");
    for (size_t i = 0; i < sample->cells; i++) {
        const double x = across_x(of, i * of->group);
        if (!isnan(low[i])) {
            bytes_format(chart->bytes, "%s%.1f %.1f", is_open ? "L" : "M", x,
                         height_of(&scale, low[i], top));
            if (of->group > 1)
                bytes_format(chart->bytes, "L%.1f %.1f", x, height_of(&scale, high[i], top));
        }
        is_open = !isnan(low[i]) && of->is_numeric;
    }
    bytes_text(chart->bytes, "\"/>\n");
    if (sample->cells <= DOTS)
        put_dots(chart, of, &scale, sample, low, top);
}

static void put_across(const SweepChart *chart, const Across *of, double y) {
    char text[SWEEP_LABEL], name[SWEEP_NAME];
    const size_t ticks = of->is_numeric ? 5 : of->count < 6 ? of->count : 6;
    for (size_t i = 0; i < ticks; i++) {
        const double share = ticks > 1 ? (double)i / (double)(ticks - 1) : 0.5;
        const size_t index = (size_t)(share * (double)(of->count - 1) + 0.5);
        double x = left + 8 + (right - left - 16) * share;
        if (of->is_numeric) {
            const SweepScale *scale = &of->scale;
            const double at = scale->is_logarithmic
                                  ? scale->least * pow(scale->most / scale->least, share)
                                  : scale->least + (scale->most - scale->least) * share;
            snprintf(text, sizeof text, "%.4g", at);
            if (!(scale->most > scale->least) && i != ticks / 2)
                continue;
        } else {
            sweep_label(of->axis->values.at[index], text);
            x = across_x(of, index);
        }
        sweep_put_label(chart->bytes, x, y + 16, "middle", "small", text);
    }
    sweep_axis_name(of->axis, name);
    sweep_put_label(chart->bytes, (left + right) / 2, y + 34, "middle", "axis", name);
}

static double put_lines(const SweepChart *chart, double top, Status *status) {
    const size_t metrics = sweep_pictures(chart->sweep);
    const Across of = across(chart->sweep);
    SweepSample sample;
    *status = sweep_sample_make(chart->source, metrics, (of.count + of.group - 1) / of.group,
                                of.count, column_of, &of, &sample);
    for (size_t metric = 0; metric < metrics && *status == STATUS_OK; metric++)
        put_line(chart, &of, &sample, metric, top + (panel + gap) * (double)metric);
    sweep_sample_clear(&sample);
    const double bottom = top + (panel + gap) * (double)metrics - gap;
    put_across(chart, &of, bottom);
    return bottom + 46;
}

static bool is_map(const Sweep *sweep) {
    return sweep->axes.count > 1 && sweep->mode == SWEEP_GRID;
}

static void put_description(const Sweep *sweep, size_t rows, Bytes *bytes) {
    bytes_format(bytes, "<desc>%zu of %llu points, %llu failed. Gaps and grey cells: not there.",
                 rows, (unsigned long long)sweep->points, (unsigned long long)sweep->table.failed);
    for (size_t i = 0; is_map(sweep) && i + 2 < sweep->axes.count; i++) {
        bytes_text(bytes, " Drawn at the first value of ");
        svg_text(bytes, sweep->axes.at[i].pointer);
        bytes_text(bytes, ".");
    }
    for (size_t i = sweep_pictures(sweep); i < sweep->metrics.count; i++)
        bytes_format(bytes, " Not drawn: %s.", sweep->metrics.at[i]);
    bytes_text(bytes, "</desc>\n");
}

bool chart_sweep(const Sweep *sweep, const SweepSource *source, Bytes *bytes) {
    Bytes picture = {.most = bytes->most};
    const SweepChart chart = {sweep, source, &picture};
    Status status;
    const double bottom =
        is_map(sweep) ? sweep_put_maps(&chart, 56, &status) : put_lines(&chart, 62, &status);
    char text[96];
    size_t length = 0;
    snprintf(text, sizeof text, "A sweep of %llu points", (unsigned long long)sweep->points);
    svg_open(bytes, width, bottom + 6, text);
    put_description(sweep, source->rows, bytes);
    svg_page(bytes, width, bottom + 6, rules);
    if (source->rows < sweep->points)
        length = (size_t)snprintf(text, sizeof text, "%zu of ", source->rows);
    snprintf(text + length, sizeof text - length,
             sweep->table.failed > 0 ? "%llu points, %llu failed" : "%llu points",
             (unsigned long long)sweep->points, (unsigned long long)sweep->table.failed);
    svg_heading(bytes, left, 26, text);
    if (picture.is_failed || status == STATUS_NO_MEMORY)
        bytes->is_failed = true;
    else
        bytes_put(bytes, picture.at, picture.count);
    bytes_clear(&picture);
    svg_close(bytes);
    return status != STATUS_CONFLICT;
}
