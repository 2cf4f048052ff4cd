// A chart as an SVG document, in the reader's light or dark colours: panels of series over two
// axes, and a table with intervals, all from one description. The same description gives the same
// bytes. Values and texts are borrowed until the document is written; chart_new and chart_text make
// some that live as long.
#ifndef SERVER_FORMATS_CHART_H
#define SERVER_FORMATS_CHART_H

#include "server/util/bytes.h"

enum {
    CHART_COLOURS = 12, // of lines, bands and markers, and of the markers' shapes
    CHART_STRONG,       // a colour: that of the text
    CHART_PANELS = 6,
    CHART_SERIES = 32, // of a panel
    CHART_TICKS = 6,
    CHART_ROWS = 8,
    CHART_CELLS = 8,
    CHART_DECADES = 8,
    CHART_TEXT = 160,
    CHART_LABEL = 48,
};

typedef struct ChartTick {
    double value;
    const char *text; // ""
} ChartTick;

typedef struct ChartAxis {
    const char *title; // NULL: none
    bool is_logarithmic;
    bool is_whole;      // logarithmic: begins and ends with a decade; the vertical axis always does
    bool has_zero;      // logarithmic: one decade more stands for 0, if there is a 0
    bool is_unlabelled; // the panel below has the labels
    int max_decades;    // logarithmic: shown, from the largest value down; 0: all
    double padding;     // on either side, relative; of the horizontal axis
    ChartTick ticks[CHART_TICKS];
    size_t tick_count; // 0: round values
    double min, max;   // by chart_fit, of the values or of their decimal logarithms
} ChartAxis;

typedef enum ChartKind {
    CHART_LINE,    // joins the points
    CHART_BAND,    // between `y` and `high`
    CHART_MARKERS, // each point's shape
    CHART_MAP,     // a cell for each value, row by row from the bottom
} ChartKind;

typedef enum ChartShape { CHART_SHAPE, CHART_DOT, CHART_CROSS, CHART_RING } ChartShape;

typedef struct ChartSeries {
    ChartKind kind;
    // Infinite coordinates are at the edges of the panel. A point without x is left out; one
    // without y interrupts the line.
    const double *x, *y;
    // Line: each point extends from `y` to `high`, and all are drawn; without it points of the same
    // pixel are drawn as their mean.
    const double *high;
    size_t count;
    size_t colour;      // one of CHART_COLOURS, or CHART_STRONG
    ChartShape shape;   // CHART_SHAPE: that of the colour
    bool is_joined;     // markers: by a line
    size_t columns;     // of a map
    const char *look;   // a further class of the style sheet; NULL: none
    const char *name;   // tooltip of a line; NULL: none
    const char *legend; // NULL: none
    // Appends a marker's tooltip, escaped by chart_escape; NULL: none.
    void (*describe)(const void *context, size_t index, Bytes *bytes);
    const void *context;
} ChartSeries;

typedef struct ChartPanel {
    const char *heading;             // NULL: none
    double left, right, top, bottom; // of the frame [px]
    bool is_small;                   // one of many: smaller texts
    bool has_side_legend;            // to the right of the frame, not in it
    const char *empty;               // shown where there is no value; NULL: no frame then
    ChartAxis x, y;
    ChartSeries series[CHART_SERIES]; // the first in front
    size_t count;
} ChartPanel;

// Intervals of one quantity, in ascending order; drawn over the common scale of all rows.
typedef struct ChartInterval {
    double minimum, q25, low, mean, high, q75, maximum;
} ChartInterval;

typedef struct ChartRow {
    const char *label; // NULL: none
    bool has_interval;
    ChartInterval interval;
    struct {
        const char *text; // NULL: none
        bool is_faint;
    } cells[CHART_CELLS];
} ChartRow;

// Rows of texts, with the intervals, if there are any, between the labels and the cells.
typedef struct ChartTable {
    const char *heading, *note; // NULL: none
    double top, label_right, interval_width, column_width, row_height;
    ChartRow rows[CHART_ROWS];
    size_t rows_count, columns_count;
} ChartTable;

typedef struct Chart {
    double width, height;
    const char *title;              // of the document
    Bytes description;              // of the document, escaped
    double left;                    // of the heading and the notes
    const char *heading, *notes[2]; // NULL: none
    ChartPanel panels[CHART_PANELS];
    size_t count;
    ChartTable table;
    struct ChartBlock *blocks; // of chart_new
    bool is_failed;            // no memory
} Chart;

// Zeroed memory that is freed by chart_write. NULL without memory; the document fails then.
void *chart_new(Chart *chart, size_t count, size_t size);
// A text in such memory, of CHART_TEXT at most: a longer one ends with "..."; "" without memory.
const char *chart_text(Chart *chart, const char *format, ...) __attribute__((format(printf, 2, 3)));
// "NAME [UNIT]"; both may be NULL.
const char *chart_quantity(Chart *chart, const char *name, const char *unit);
// Adds a panel within that frame; there is room for CHART_PANELS.
ChartPanel *chart_panel(Chart *chart, const char *heading, double left, double right, double top,
                        double bottom);
// The same for spectra over frequency, both logarithmic; at most CHART_DECADES are shown.
ChartPanel *chart_spectra(Chart *chart, const char *heading, double left, double right, double top,
                          double bottom);
// Adds a series, whose `y` of a map are its values; there is room for CHART_SERIES.
void chart_add(ChartPanel *panel, ChartSeries series);
// Appends "BEFORE TEXT." to the description, TEXT escaped; nothing where `text` is NULL.
void chart_note(Chart *chart, const char *before, const char *text);

// Sets the ranges of both axes. False: there is no value to be drawn.
bool chart_fit(ChartPanel *panel);
// Appends the document and clears the chart.
void chart_write(Chart *chart, Bytes *bytes);
// Appends `text` as the content of an element.
void chart_escape(Bytes *bytes, const char *text);

#endif
