// A table as a chart: lines over time with a panel for each unit, or spectra over frequency.
#ifndef SERVER_FORMATS_SVG_H
#define SERVER_FORMATS_SVG_H

#include "server/formats/format.h"

extern const TableFormat encoder_svg;

#endif
