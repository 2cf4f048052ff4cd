// Lines and bands over one pair of axes, logarithmic or not, as parts of an SVG that stands in
// light and dark. Not a chart: chart_*.c make those of it. Used by them.
#ifndef SERVER_ENCODE_PLOT_H
#define SERVER_ENCODE_PLOT_H

#include "core/base/field.h"
#include "server/base/bytes.h"

enum { PLOT_COLOURS = 8, PLOT_PSD_DECADES = 8 };

typedef struct Plot {
    double left, right, top, bottom; // of the frame
    double legend;                   // right end of its texts; 0: inside the frame
    bool is_logarithmic;             // both axes
    bool has_whole_decades;          // also across
    int decades;                     // shown upwards, at most; 0: all
    bool has_floor;                  // the lowest decade stands for 0
    const char *x_title;
    double x_min, x_max, y_min, y_max; // what was fitted in
    Bytes *bytes;
} Plot;

// An empty one; then everything that will be drawn is fitted in, as far as the axes can show it.
void plot_begin(Plot *plot);
void plot_fit(Plot *plot, const Reals *x, const Reals *y);
void plot_fit_point(Plot *plot, double x, double y);

// Rounds the axes and draws them. False where there is nothing to draw.
bool plot_axes(Plot *plot);

// Where a number lies on the page, once there are axes.
double plot_x(const Plot *plot, double x);
double plot_y(const Plot *plot, double y);

// Where points lie closer than a third of a pixel their mean is drawn.
void plot_line(const Plot *plot, const Reals *x, const Reals *y, size_t colour, const char *title);
void plot_band(const Plot *plot, const Reals *x, const Reals *low, const Reals *high,
               size_t colour);

// The line of the legend, from 0 at the top.
void plot_legend(const Plot *plot, size_t line, size_t colour, const char *text);

#endif
