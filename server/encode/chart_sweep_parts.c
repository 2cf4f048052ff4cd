#include "server/encode/chart_sweep_parts.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "server/encode/svg.h"

size_t sweep_pictures(const Sweep *sweep) {
    return sweep->metrics.count < SWEEP_PICTURES ? sweep->metrics.count : SWEEP_PICTURES;
}

void sweep_label(const char *json, char label[SWEEP_LABEL]) {
    const bool is_text = *json == '"';
    const size_t length = strlen(json) - (is_text ? 2 : 0);
    char text[256];
    if (!is_text && (*json == '-' || (*json >= '0' && *json <= '9'))) {
        snprintf(label, SWEEP_LABEL, "%.4g", strtod(json, NULL));
        return;
    }
    const size_t kept = length < sizeof text ? length : sizeof text - 1;
    memcpy(text, json + is_text, kept);
    text[kept] = '\0';
    text_fit(label, 18, text);
}

void sweep_axis_name(const SweepAxisValues *axis, char name[SWEEP_NAME]) {
    char pointer[120];
    text_fit(pointer, sizeof pointer, axis->pointer);
    snprintf(name, SWEEP_NAME, "%s%s%s%s", pointer, axis->unit != NULL ? " [" : "",
             axis->unit != NULL ? axis->unit : "", axis->unit != NULL ? "]" : "");
}

void sweep_metric_name(const Sweep *sweep, size_t metric, char name[SWEEP_NAME]) {
    const char *unit = sweep_metric_unit(sweep->metrics.at[metric]);
    snprintf(name, SWEEP_NAME, "%.40s%s%s%s", sweep->metrics.at[metric], unit != NULL ? " [" : "",
             unit != NULL ? unit : "", unit != NULL ? "]" : "");
    for (char *c = name; *c != '\0' && *c != '['; c++)
        if (*c == '_')
            *c = ' ';
}

void sweep_put_label(Bytes *bytes, double x, double y, const char *anchor, const char *class_,
                     const char *text) {
    bytes_format(bytes, "<text class=\"%s\" x=\"%.1f\" y=\"%.1f\" text-anchor=\"%s\">", class_, x,
                 y, anchor);
    svg_text(bytes, text);
    bytes_text(bytes, "</text>\n");
}

void sweep_scale_take(SweepScale *scale, double value) {
    if (!isfinite(value))
        return;
    scale->least = scale->is_known ? fmin(scale->least, value) : value;
    scale->most = scale->is_known ? fmax(scale->most, value) : value;
    scale->is_known = true;
}

// Of one number alone, in the middle.
double sweep_scale_share(const SweepScale *scale, double value) {
    if (!(scale->most > scale->least))
        return 0.5;
    return scale->is_logarithmic ? log(value / scale->least) / log(scale->most / scale->least)
                                 : (value - scale->least) / (scale->most - scale->least);
}
