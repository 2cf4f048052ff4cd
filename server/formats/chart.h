// A chart as an SVG document, in the reader's light or dark colours: panels of series over two
// axes, one below the other, all from one description. The same description gives the same bytes.
// Values and texts are borrowed until the document is written; chart_new and chart_text make some
// that live as long.
#ifndef SERVER_FORMATS_CHART_H
#define SERVER_FORMATS_CHART_H

#include "server/util/bytes.h"

enum {
    CHART_COLOURS = 12, // of lines, bands and markers
    CHART_STRONG,       // a colour: that of the text
    CHART_PANELS = 6,
    CHART_SERIES = 48, // of a panel
    CHART_TICKS = 8,
    CHART_TEXT = 160,
    CHART_LABEL = 48,
    CHART_LABELS = 100,
    CHART_LEGEND_MARGIN = 100, // a wider margin on the right has the legends, else they are inside
};

typedef struct ChartTick {
    double value;
    const char *text;
    const char *note; // below the text of a vertical axis; NULL: none
} ChartTick;

typedef struct ChartAxis {
    const char *title; // of x alone, below its labels; NULL: none
    bool is_logarithmic;
    bool is_unlabelled; // the panel below has the labels
    int max_decades;    // logarithmic: shown, from the largest value down; 0: all
    // Labels of whole numbers, which are places of cells or rows; none: labels at round values.
    ChartTick ticks[CHART_TICKS];
    size_t tick_count;
    double min, max; // by chart_write, of the values or of their decimal logarithms
} ChartAxis;

typedef enum ChartKind {
    CHART_LINE,    // joins the points
    CHART_BAND,    // between `y` and `high`
    CHART_MARKERS, // each point's shape
    CHART_MAP,     // a cell for each value of `y`, row by row from the bottom
} ChartKind;

typedef enum ChartShape { CHART_DOT, CHART_CROSS, CHART_RING, CHART_TICK } ChartShape;

typedef struct ChartSeries {
    ChartKind kind;
    // Infinite coordinates are at the edges of the panel. A point that lacks one is left out and
    // interrupts the line.
    const double *x, *y;
    // Line: each point extends from `y` to `high`, and all are drawn; without it points of the same
    // pixel are drawn as their mean.
    const double *high;
    size_t count;
    size_t colour; // one of CHART_COLOURS, or CHART_STRONG
    ChartShape shape;
    size_t columns;           // of a map
    const char *look;         // a further class of the style sheet; NULL: none
    const char *name;         // tooltip of a line; NULL: none
    const char *const *names; // tooltips of markers; NULL: none
    const char *legend;       // NULL: none
} ChartSeries;

typedef struct ChartPanel {
    const char *heading; // NULL: none
    double height;       // of the frame [px]
    ChartAxis x, y;
    ChartSeries series[CHART_SERIES]; // the first in front
    size_t count;
    double left, right, top, bottom; // of the frame, by chart_write
    bool has_values;                 // likewise: there is something to be drawn
} ChartPanel;

typedef struct Chart {
    double width, left, right; // of the document and its margins [px]
    const char *title;         // of the document
    const char *heading;       // NULL: none
    Bytes description;         // of the document, escaped
    ChartPanel panels[CHART_PANELS];
    size_t count;
    struct ChartBlock *blocks; // of chart_new
    bool is_failed;            // no memory
} Chart;

// Zeroed memory that is freed by chart_write and chart_clear. NULL without memory; the document
// fails then.
void *chart_new(Chart *chart, size_t count, size_t size);
// A text in such memory, of CHART_TEXT at most: a longer one ends with "..."; "" without memory.
const char *chart_text(Chart *chart, const char *format, ...) __attribute__((format(printf, 2, 3)));
// "NAME [UNIT]"; the unit may be NULL.
const char *chart_quantity(Chart *chart, const char *name, const char *unit);
// Adds a panel below the others; there is room for CHART_PANELS.
ChartPanel *chart_panel(Chart *chart, const char *heading, double height);
// The same for spectra over frequency, both logarithmic; at most 8 decades are shown.
ChartPanel *chart_spectra(Chart *chart, const char *heading, double height);
// Adds a series; there is room for CHART_SERIES.
void chart_add(ChartPanel *panel, ChartSeries series);
// Appends "BEFORE TEXT." to the description, TEXT escaped; nothing where `text` is NULL.
void chart_note(Chart *chart, const char *before, const char *text);
// Appends a text escaped for HTML and SVG.
void chart_escape(Bytes *bytes, const char *text);
// Appends the document and clears the chart.
void chart_write(Chart *chart, Bytes *bytes);
void chart_clear(Chart *chart);

// How a panel is written as text, of at most `columns` characters a line.
typedef struct ChartText {
    size_t columns, rows; // rows: of the frame
    bool is_utf8;         // Braille patterns and box drawing, else ASCII
    bool has_colour;      // escape sequences of a terminal
} ChartText;

// Appends one panel, with its heading, labels and legend; the chart remains.
void chart_write_text(Chart *chart, size_t panel, const ChartText *form, Bytes *bytes);

// Of chart.c, for other renderings: the ranges of all axes, whether a value is on an axis, its
// place there from 0 to 1, and its labels at round values, about `parts` or more of them.
typedef struct ChartLabel {
    double value;
    char text[CHART_LABEL];
    const char *note;         // as in a ChartTick
    int decade;               // of a logarithmic axis
    bool is_power, is_hidden; // ten to the power of `decade`; there is no room for its text
} ChartLabel;
void chart_fit(Chart *chart);
bool chart_axis_shows(const ChartAxis *axis, double value);
double chart_axis_share(const ChartAxis *axis, double value);
size_t chart_axis_labels(const ChartAxis *axis, double parts, ChartLabel labels[CHART_LABELS]);

#endif
