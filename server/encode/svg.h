// What charts share: escaped text and powers of ten. Not a chart. Used by chart.c,
// the other chart_*.c and plot.c.
#ifndef SERVER_ENCODE_SVG_H
#define SERVER_ENCODE_SVG_H

#include "server/base/bytes.h"

extern const char svg_type[]; // "image/svg+xml"

// Appends `text` as the content of an element or attribute.
void svg_text(Bytes *bytes, const char *text);

// Appends 10 to the power of `decade`, as the content of a text.
void svg_power(Bytes *bytes, int decade);

// The decades that enclose two positive numbers, one at least.
void svg_decades(double least, double most, int *from, int *to);

#endif
