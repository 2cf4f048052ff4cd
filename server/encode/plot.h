// Lines and bands over one pair of axes, logarithmic or not, as parts of an SVG that stands in
// light and dark. Not a chart: chart_*.c make those of it. Used by them.
#ifndef SERVER_ENCODE_PLOT_H
#define SERVER_ENCODE_PLOT_H

#include "core/base/field.h"
#include "server/base/bytes.h"

enum { PLOT_COLOURS = 8 };

typedef struct Plot {
    double left, right, top, bottom; // of the frame
    double legend;                   // right end of its texts; 0: inside the frame
    bool is_logarithmic;             // both axes
    const char *x_title;
    double x_least, x_most, y_least, y_most; // what was fitted in
    Bytes *bytes;
} Plot;

// The colours, as classes "line s0" and "band s0", and those of page, grid and text.
void plot_style(Bytes *bytes);

// An empty one; then everything that will be drawn is fitted in, as far as the axes can show it.
void plot_begin(Plot *plot);
void plot_fit(Plot *plot, const Reals *x, const Reals *y);

// Rounds the axes and draws them. False where there is nothing to draw.
bool plot_axes(Plot *plot);

// Where points lie closer than a third of a pixel their mean is drawn.
void plot_line(const Plot *plot, const Reals *x, const Reals *y, size_t colour, const char *title);
void plot_band(const Plot *plot, const Reals *x, const Reals *low, const Reals *high,
               size_t colour);

// The line of the legend, from 0 at the top.
void plot_legend(const Plot *plot, size_t line, size_t colour, const char *text);

#endif
