// Above, the densities over frequency, both logarithmic. Below, the displacements over time: the
// band from the least to the largest of each bucket, whose edges are lines where it is narrow.
#include "server/encode/chart_compare.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>

#include "server/encode/plot.h"
#include "server/encode/svg.h"

static const double width = 960, right = 660, height = 690;

// The entries that are drawn, the reference first, each with its colour.
static size_t choose(const Comparison *comparison, const CompareEntry *drawn[PLOT_COLOURS]) {
    size_t count = 0;
    for (size_t i = 0; i < comparison->entries.count && count < PLOT_COLOURS; i++)
        if (comparison->entries.at[i].status == COMPARE_RUN)
            drawn[count++] = &comparison->entries.at[i];
    return count;
}

static void put_description(const Comparison *comparison, Bytes *bytes) {
    size_t drawn = 0;
    bytes_text(bytes, "<desc>The first is the reference, the scene as it is.");
    for (size_t i = 0; i < comparison->entries.count; i++) {
        const CompareEntry *entry = &comparison->entries.at[i];
        if (entry->status == COMPARE_RUN && drawn++ < PLOT_COLOURS)
            continue;
        bytes_text(bytes, " Not drawn: ");
        svg_text(bytes, entry->name);
        if (entry->why != NULL) {
            bytes_text(bytes, " (");
            svg_text(bytes, entry->why);
            bytes_text(bytes, ")");
        }
        bytes_text(bytes, ".");
    }
    bytes_text(bytes, "</desc>\n");
}

static void put_spectra(const Comparison *comparison, const CompareEntry *const drawn[],
                        size_t count, Bytes *bytes) {
    Plot plot = {.left = 70,
                 .right = right,
                 .top = 44,
                 .bottom = 330,
                 .legend = width - 42,
                 .is_logarithmic = true,
                 .decades = PLOT_PSD_DECADES,
                 .x_title = "frequency [Hz]",
                 .bytes = bytes};
    plot_begin(&plot);
    for (size_t i = 0; i < count; i++)
        plot_fit(&plot, &comparison->frequency, &drawn[i]->density);
    if (!plot_axes(&plot))
        return;
    for (size_t i = count; i-- > 0;) // the reference on top
        plot_line(&plot, &comparison->frequency, &drawn[i]->density, i, drawn[i]->name);
    for (size_t i = 0; i < count; i++) {
        char text[160];
        if (i == 0 || isnan(drawn[i]->psd.level))
            snprintf(text, sizeof text, "%s", drawn[i]->name);
        else
            snprintf(text, sizeof text, "%s: %.2g dB off", drawn[i]->name, drawn[i]->psd.level);
        plot_legend(&plot, i, i, text);
    }
}

static void put_traces(const Comparison *comparison, const CompareEntry *const drawn[],
                       size_t count, Bytes *bytes) {
    Plot plot = {.left = 70,
                 .right = right,
                 .top = 400,
                 .bottom = 640,
                 .x_title = "time [s]",
                 .bytes = bytes};
    const size_t buckets = count > 0 ? drawn[0]->trace.minimum.count : 0;
    Reals time = {calloc(buckets + 1, sizeof(double)), 0};
    for (size_t i = 0; i < buckets && time.at != NULL; i++)
        time.at[time.count++] = (double)i / comparison->trace_rate;
    plot_begin(&plot);
    for (size_t i = 0; i < count; i++) {
        plot_fit(&plot, &time, &drawn[i]->trace.minimum);
        plot_fit(&plot, &time, &drawn[i]->trace.maximum);
    }
    if (plot_axes(&plot))
        for (size_t i = count; i-- > 0;) {
            plot_band(&plot, &time, &drawn[i]->trace.minimum, &drawn[i]->trace.maximum, i);
            plot_line(&plot, &time, &drawn[i]->trace.minimum, i, drawn[i]->name);
            plot_line(&plot, &time, &drawn[i]->trace.maximum, i, drawn[i]->name);
        }
    free(time.at);
}

void chart_compare(const Comparison *comparison, Bytes *bytes) {
    const CompareEntry *drawn[PLOT_COLOURS];
    const size_t count = choose(comparison, drawn);
    char heading[160];
    snprintf(heading, sizeof heading, "%.100s [%.40s]",
             comparison->channel != NULL ? comparison->channel : "",
             comparison->unit != NULL ? comparison->unit : "");
    svg_open(bytes, width, height, "Contact models compared");
    put_description(comparison, bytes);
    svg_page(bytes, width, height, NULL);
    svg_heading(bytes, 70, 26, heading);
    svg_heading(bytes, 70, 390, "displacement [m]");
    put_spectra(comparison, drawn, count, bytes);
    put_traces(comparison, drawn, count, bytes);
    svg_close(bytes);
}
