// What the pictures of a sweep share, lines over one axis and maps over two: names, labels, scales.
// Not a chart: chart_sweep.c is, and chart_sweep_map.c draws its maps. Used by those.
#ifndef SERVER_ENCODE_CHART_SWEEP_PARTS_H
#define SERVER_ENCODE_CHART_SWEEP_PARTS_H

#include "server/base/bytes.h"
#include "server/encode/sweep_sample.h"

enum { SWEEP_PICTURES = 6, SWEEP_LABEL = 40, SWEEP_NAME = 160 };

typedef struct SweepChart {
    const Sweep *sweep;
    const SweepSource *source;
    Bytes *bytes;
} SweepChart;

size_t sweep_pictures(const Sweep *sweep);
// A scalar's text as it is shown: without quotes, short.
void sweep_label(const char *json, char label[SWEEP_LABEL]);
void sweep_axis_name(const SweepAxisValues *axis, char name[SWEEP_NAME]);
void sweep_metric_name(const Sweep *sweep, size_t metric, char name[SWEEP_NAME]);
void sweep_put_label(Bytes *bytes, double x, double y, const char *anchor, const char *class_,
                     const char *text);

typedef struct SweepScale {
    double least, most;
    bool is_known, is_logarithmic;
} SweepScale;
void sweep_scale_take(SweepScale *scale, double value);
double sweep_scale_share(const SweepScale *scale, double value);

// Draws a map of each metric from `top` on, and returns where they end; *status what came of it.
double sweep_put_maps(const SweepChart *chart, double top, Status *status);

#endif
