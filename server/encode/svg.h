// What charts share: how they look, in light and dark, escaped text and powers of ten. Not a chart.
// Used by chart.c, the other chart_*.c and plot.c.
#ifndef SERVER_ENCODE_SVG_H
#define SERVER_ENCODE_SVG_H

#include "server/base/bytes.h"

enum { SVG_COLOURS = 12 };

extern const char svg_type[]; // "image/svg+xml"

// Begins the document with its title, for those who cannot see it. A description may follow, then
// the page.
void svg_open(Bytes *bytes, double width, double height, const char *title);

// Style and ground. Classes: "line s0", "band s0", "mark s0" and so on in the colours, "grid",
// "frame", "strong" for lines as dark as the text, "faint" for texts that count less. `rules`: what
// a chart has of its own, that looks the same in light and dark; NULL: nothing.
void svg_page(Bytes *bytes, double width, double height, const char *rules);
void svg_close(Bytes *bytes);

// The heading of a picture, which begins with the plot's left side.
void svg_heading(Bytes *bytes, double x, double y, const char *text);

// Appends `text` as the content of an element or attribute.
void svg_text(Bytes *bytes, const char *text);

// Appends 10 to the power of `decade`, as the content of a text.
void svg_power(Bytes *bytes, int decade);

// The decades that enclose two positive numbers, one at least.
void svg_decades(double least, double most, int *from, int *to);

#endif
