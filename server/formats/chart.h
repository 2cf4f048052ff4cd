// A chart as an SVG document of its own, in the reader's light or dark colours: panels of series
// over two axes, and a table with intervals, all from one description. The same description gives
// the same bytes. Values are borrowed until the document is written.
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
    CHART_BLOCKS = 24,
    CHART_DECADES = 8,
    CHART_TEXT = 160,
    CHART_LABEL = 48,
};

extern const char chart_type[]; // "image/svg+xml"

typedef struct ChartTick {
    double value;
    char text[CHART_LABEL];
} ChartTick;

typedef struct ChartAxis {
    char title[CHART_TEXT];
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
    // Infinite coordinates are at the edges of the panel. A point without x is passed over; one
    // without y interrupts the line.
    const double *x, *y;
    // Line: each point extends from `y` to `high`, and all are drawn; without it points of the same
    // pixel are drawn as their mean.
    const double *high;
    size_t count;
    size_t columns;          // of a map
    size_t colour;           // one of CHART_COLOURS, or CHART_STRONG
    ChartShape shape;        // CHART_SHAPE: that of the colour
    bool is_joined;          // markers: by a line
    const char *look;        // a further class of the style sheet; NULL: none
    char name[CHART_TEXT];   // tooltip of a line; "": none
    char legend[CHART_TEXT]; // "": none
    // Appends a marker's tooltip, escaped by chart_text; NULL: none.
    void (*describe)(const void *context, size_t index, Bytes *bytes);
    const void *context;
} ChartSeries;

typedef struct ChartPanel {
    char heading[CHART_TEXT];
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
    char label[CHART_LABEL];
    bool has_interval;
    ChartInterval interval;
    struct {
        char text[CHART_LABEL];
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
    char title[CHART_TEXT]; // of the document
    Bytes description;      // of the document, escaped
    double left;            // of the heading and the notes
    char heading[CHART_TEXT], notes[2][CHART_TEXT];
    ChartPanel panels[CHART_PANELS];
    size_t count;
    ChartTable table;
    void *blocks[CHART_BLOCKS]; // of chart_allocate
    bool is_failed;             // no memory
} Chart;

// Zeroed memory that is freed by chart_write. NULL without memory; the document fails then.
void *chart_allocate(Chart *chart, size_t count, size_t size);
// Adds an empty panel; there is room for CHART_PANELS.
ChartPanel *chart_panel(Chart *chart, double left, double right, double top, double bottom);
// Adds a series; there is room for CHART_SERIES.
ChartSeries *chart_series(ChartPanel *panel, ChartKind kind, const double *x, const double *y,
                          const double *high, size_t count);
// Formats a text of a chart; one that is too long ends with "...".
void chart_format(char *target, size_t size, const char *format, ...)
    __attribute__((format(printf, 3, 4)));

// Adds a panel for spectra over frequency, both logarithmic; not more than CHART_DECADES are shown.
ChartPanel *chart_spectra(Chart *chart, double left, double right, double top, double bottom);
// "NAME [UNIT]" in target[CHART_TEXT].
void chart_quantity(char *target, const char *name, const char *unit);
// Appends "BEFORE TEXT." to the description, TEXT escaped; nothing where `text` is NULL.
void chart_note(Chart *chart, const char *before, const char *text);

// Sets the ranges of both axes. False: there is no value to be drawn.
bool chart_fit(ChartPanel *panel);

// Appends the document and clears the chart.
void chart_write(Chart *chart, Bytes *bytes);

// Appends `text` as the content of an element.
void chart_text(Bytes *bytes, const char *text);

#endif
