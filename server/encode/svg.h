// A table as a chart: lines over time with a panel for each unit, or spectra over frequency.
#ifndef SERVER_ENCODE_SVG_H
#define SERVER_ENCODE_SVG_H

#include "server/encode/encoder.h"

extern const Encoder encoder_svg;

#endif
