#include "server/encode/plot.h"

#include <float.h>
#include <math.h>

#include "server/encode/svg.h"

enum { COLUMNS = 1300, LABELS = 8, TICKS = 12 };

void plot_begin(Plot *plot) {
    plot->x_min = plot->y_min = DBL_MAX;
    plot->x_max = plot->y_max = -DBL_MAX;
}

static bool is_shown(const Plot *plot, double x, double y) {
    return isfinite(x) && isfinite(y) && (!plot->is_logarithmic || (x > 0 && y > 0));
}

void plot_fit_point(Plot *plot, double x, double y) {
    if (!is_shown(plot, x, y))
        return;
    plot->x_min = fmin(plot->x_min, x);
    plot->x_max = fmax(plot->x_max, x);
    plot->y_min = fmin(plot->y_min, y);
    plot->y_max = fmax(plot->y_max, y);
}

void plot_fit(Plot *plot, const Reals *x, const Reals *y) {
    for (size_t i = 0; i < x->count && i < y->count; i++)
        plot_fit_point(plot, x->at[i], y->at[i]);
}

double plot_x(const Plot *plot, double x) {
    const double share = plot->is_logarithmic
                             ? log(x / plot->x_min) / log(plot->x_max / plot->x_min)
                             : (x - plot->x_min) / (plot->x_max - plot->x_min);
    return plot->left + (plot->right - plot->left) * share;
}

double plot_y(const Plot *plot, double y) {
    double share = (y - plot->y_min) / (plot->y_max - plot->y_min);
    if (plot->is_logarithmic)
        share = y > 0 ? log(y / plot->y_min) / log(plot->y_max / plot->y_min) : 0;
    return plot->bottom - (plot->bottom - plot->top) * fmin(fmax(share, 0), 1);
}

// The line, and where its label begins. False: it lies outside.
static bool put_grid(const Plot *plot, bool is_x, double value, bool has_label) {
    Bytes *bytes = plot->bytes;
    const double at = is_x ? plot_x(plot, value) : plot_y(plot, value);
    if (is_x && (at < plot->left - 0.5 || at > plot->right + 0.5))
        return false;
    if (is_x)
        bytes_format(bytes, "<path class=\"grid\" d=\"M%.1f %.0fV%.0f\"/>", at, plot->top,
                     plot->bottom);
    else
        bytes_format(bytes, "<path class=\"grid\" d=\"M%.0f %.1fH%.0f\"/>", plot->left, at,
                     plot->right);
    if (!has_label)
        bytes_text(bytes, "\n");
    else if (is_x)
        bytes_format(bytes, "<text x=\"%.1f\" y=\"%.0f\" text-anchor=\"middle\">", at,
                     plot->bottom + 18);
    else
        bytes_format(bytes, "<text x=\"%.0f\" y=\"%.1f\" text-anchor=\"end\">", plot->left - 8,
                     at + 4);
    return has_label;
}

// Not all are labelled where they are many; the floor stands for 0.
static void put_decades(const Plot *plot, bool is_x, int from, int to) {
    const int every =
        (to - from + LABELS) / (LABELS + 1) > 1 ? (to - from + LABELS) / (LABELS + 1) : 1;
    for (int d = from; d <= to; d++) {
        const bool is_floor = !is_x && plot->has_floor && d == from;
        if (!put_grid(plot, is_x, pow(10, d), (to - d) % every == 0 || is_floor))
            continue;
        if (is_floor)
            bytes_text(plot->bytes, "0");
        else
            svg_power(plot->bytes, d);
        bytes_text(plot->bytes, "</text>\n");
    }
}

// 1, 2 or 5 times a power of ten.
static double tick_step(double span) {
    const double power = pow(10, floor(log10(span / 4)));
    const double rest = span / 4 / power;
    return power * (rest < 2 ? 1 : rest < 5 ? 2 : 5);
}

static void put_steps(const Plot *plot, bool is_x) {
    const double from = is_x ? plot->x_min : plot->y_min;
    const double to = is_x ? plot->x_max : plot->y_max, step = tick_step(to - from);
    const double first = ceil(from / step - 1e-9);
    for (int i = 0; i < TICKS && (first + i) * step <= to + 1e-9 * step; i++)
        if (put_grid(plot, is_x, (first + i) * step, true))
            bytes_format(plot->bytes, "%.4g</text>\n", (first + i) * step);
}

bool plot_axes(Plot *plot) {
    if (!(plot->x_max > plot->x_min) && !(plot->has_whole_decades && plot->x_max > 0))
        return false;
    if (plot->is_logarithmic) {
        int x_from, x_to, y_from, y_to;
        svg_decades(plot->y_min, plot->y_max, &y_from, &y_to);
        if (plot->decades > 0 && y_from < y_to - plot->decades)
            y_from = y_to - plot->decades;
        y_from -= plot->has_floor;
        plot->y_min = pow(10, y_from);
        plot->y_max = pow(10, y_to);
        svg_decades(plot->x_min, plot->x_max, &x_from, &x_to);
        if (plot->has_whole_decades) {
            plot->x_min = pow(10, x_from);
            plot->x_max = pow(10, x_to);
        }
        put_decades(plot, true, x_from, x_to);
        put_decades(plot, false, y_from, y_to);
    } else {
        const double room = plot->y_max > plot->y_min ? 0.05 * (plot->y_max - plot->y_min)
                                                      : fmax(fabs(plot->y_max), 1);
        plot->y_min -= room;
        plot->y_max += room;
        put_steps(plot, true);
        put_steps(plot, false);
    }
    bytes_format(plot->bytes,
                 "<rect class=\"frame\" x=\"%.0f\" y=\"%.0f\" width=\"%.0f\" height=\"%.0f\"/>\n"
                 "<text x=\"%.0f\" y=\"%.0f\" text-anchor=\"middle\">",
                 plot->left, plot->top, plot->right - plot->left, plot->bottom - plot->top,
                 (plot->left + plot->right) / 2, plot->bottom + 36);
    svg_text(plot->bytes, plot->x_title);
    bytes_text(plot->bytes, "</text>\n");
    return true;
}

// Points of the page, from left to right.
typedef struct Curve {
    double x[COLUMNS], y[COLUMNS];
    size_t count;
} Curve;

static void curve_make(const Plot *plot, const Reals *x, const Reals *y, Curve *curve) {
    const double column = (plot->right - plot->left) / (COLUMNS / 2);
    const size_t count = x->count < y->count ? x->count : y->count;
    size_t k = 0;
    curve->count = 0;
    while (k < count && !(x->at[k] >= plot->x_min))
        k++;
    while (k < count && curve->count < COLUMNS) {
        const double from = plot_x(plot, x->at[k]);
        double along = 0, sum = 0, among = 0;
        for (; k < count && x->at[k] <= plot->x_max; k++) {
            const double at = plot_x(plot, x->at[k]);
            if (at - from > column)
                break;
            along += at;
            sum += y->at[k];
            among++;
        }
        if (among == 0)
            break;
        curve->x[curve->count] = along / among;
        curve->y[curve->count++] = plot_y(plot, sum / among);
    }
}

static void put_points(Bytes *bytes, const Curve *curve) {
    for (size_t i = 0; i < curve->count; i++)
        bytes_format(bytes, "%s%.1f %.1f", i == 0 ? "M" : "L", curve->x[i], curve->y[i]);
}

void plot_line(const Plot *plot, const Reals *x, const Reals *y, size_t colour, const char *title) {
    Curve curve;
    curve_make(plot, x, y, &curve);
    bytes_format(plot->bytes, "<path class=\"line s%zu\" d=\"", colour % PLOT_COLOURS);
    put_points(plot->bytes, &curve);
    bytes_text(plot->bytes, "\"><title>");
    svg_text(plot->bytes, title != NULL ? title : "");
    bytes_text(plot->bytes, "</title></path>\n");
}

void plot_band(const Plot *plot, const Reals *x, const Reals *low, const Reals *high,
               size_t colour) {
    Curve curve;
    curve_make(plot, x, high, &curve);
    bytes_format(plot->bytes, "<path class=\"band s%zu\" d=\"", colour % PLOT_COLOURS);
    put_points(plot->bytes, &curve);
    curve_make(plot, x, low, &curve);
    for (size_t i = curve.count; i-- > 0;)
        bytes_format(plot->bytes, "L%.1f %.1f", curve.x[i], curve.y[i]);
    bytes_text(plot->bytes, "z\"/>\n");
}

void plot_legend(const Plot *plot, size_t line, size_t colour, const char *text) {
    const double y = plot->top + 18 + 18 * (double)line;
    const double x = plot->legend > 0 ? plot->legend : plot->right - 38;
    bytes_format(plot->bytes,
                 "<path class=\"line s%zu\" d=\"M%.0f %.0fh20\"/><text x=\"%.0f\" y=\"%.0f\" "
                 "text-anchor=\"end\">",
                 colour % PLOT_COLOURS, x + 8, y, x, y + 4);
    svg_text(plot->bytes, text);
    bytes_text(plot->bytes, "</text>\n");
}
