// Above, the densities over frequency, both logarithmic: where frequencies lie closer than a third
// of a pixel their mean is drawn. Below, a line for each statistic: the whole of it reaches from
// the smallest run to the largest, the box holds half of the runs, the mark is the mean and its
// whiskers the interval, all in units of the mean.
#include "server/encode/chart_ensemble.h"

#include <math.h>
#include <stdio.h>
#include <string.h>

#include "server/encode/plot.h"
#include "server/encode/svg.h"

enum { SPECTRA_DRAWN = 4, NAME = 48 };

static const double width = 640, left = 62, right = 626, top = 44, bottom = 300; // of the spectra
static const double label_right = 190, value_left = 470;                         // of the lines
static const double row_height = 24;

static const char rules[] =
    ".all { stroke: #888888; } .half { fill: #888888; fill-opacity: 0.35; }\n"
    ".mean { stroke-width: 2; }\n";

static size_t drawn(const Ensemble *ensemble) {
    return ensemble->spectra.count < SPECTRA_DRAWN ? ensemble->spectra.count : SPECTRA_DRAWN;
}

static void put_spectrum(const Plot *plot, const Ensemble *ensemble, size_t index) {
    const RunSpectrum *spectrum = &ensemble->spectra.at[index];
    const char *name = spectrum->channel != NULL ? spectrum->channel : "";
    char text[2 * NAME];
    if (spectrum->low.count > 0 && spectrum->high.count > 0)
        plot_band(plot, &ensemble->frequency, &spectrum->low, &spectrum->high, index);
    plot_line(plot, &ensemble->frequency, &spectrum->mean, index, name);
    snprintf(text, sizeof text, "%s [%s]", name, spectrum->unit != NULL ? spectrum->unit : "");
    plot_legend(plot, index, index, text);
}

// The lines below share one scale, in units of each mean.
typedef struct Scale {
    double least, most;
} Scale;

static bool has_scale(const RunStatistic *statistic) {
    return statistic->mean > 0 && isfinite(statistic->mean);
}

static Scale scale_rows(const EnsembleStatistics *statistics) {
    Scale of = {1, 1};
    for (int metric = 0; metric < STATISTICS_METRICS; metric++) {
        const RunStatistic *statistic = &statistics->of[metric];
        if (!has_scale(statistic))
            continue;
        of.least = fmin(of.least, fmin(statistic->minimum, statistic->low) / statistic->mean);
        of.most = fmax(of.most, fmax(statistic->maximum, statistic->high) / statistic->mean);
    }
    if (!(of.most > of.least) || !isfinite(of.most) || !isfinite(of.least))
        of = (Scale){0, 2};
    return of;
}

static double row_x(const Scale *of, const RunStatistic *statistic, double value) {
    const double share = (value / statistic->mean - of->least) / (of->most - of->least);
    return label_right + 10 + (value_left - label_right - 20) * fmin(fmax(share, 0), 1);
}

static void plain_name(int metric, char name[NAME]) {
    snprintf(name, NAME, "%s", statistics_metric_names[metric]);
    for (char *c = name; *c != '\0'; c++)
        if (*c == '_')
            *c = ' ';
}

static void put_row(Bytes *bytes, const Scale *of, int metric, const RunStatistic *statistic,
                    double y) {
    char name[NAME];
    plain_name(metric, name);
    bytes_format(bytes, "<text x=\"%.0f\" y=\"%.0f\" text-anchor=\"end\">%s</text>\n", label_right,
                 y + 4, name);
    if (has_scale(statistic) && statistic->count > 1) {
        const double half = row_x(of, statistic, statistic->q25);
        bytes_format(bytes, "<path class=\"all\" d=\"M%.1f %.0fH%.1f\"/>",
                     row_x(of, statistic, statistic->minimum), y,
                     row_x(of, statistic, statistic->maximum));
        bytes_format(bytes,
                     "<rect class=\"half\" x=\"%.1f\" y=\"%.0f\" width=\"%.1f\" height=\"12\"/>",
                     half, y - 6, row_x(of, statistic, statistic->q75) - half);
        bytes_format(
            bytes, "<path class=\"strong mean\" d=\"M%.1f %.0fv8M%.1f %.0fv8M%.1f %.0fH%.1f",
            row_x(of, statistic, statistic->low), y - 4, row_x(of, statistic, statistic->high),
            y - 4, row_x(of, statistic, statistic->low), y, row_x(of, statistic, statistic->high));
        bytes_format(bytes, "M%.1f %.0fv16\"><title>%s: %.4g to %.4g</title></path>\n",
                     row_x(of, statistic, statistic->mean), y - 8, name, statistic->low,
                     statistic->high);
    }
    bytes_format(bytes, "<text x=\"%.0f\" y=\"%.0f\">", value_left, y + 4);
    if (isnan(statistic->mean))
        bytes_text(bytes, "not known");
    else
        bytes_format(bytes, "%.4g", statistic->mean);
    if (!isnan(statistic->high))
        bytes_format(bytes, " &#177; %.2g", statistic->high - statistic->mean);
    if (statistic->unit != NULL && strcmp(statistic->unit, "1") != 0 && !isnan(statistic->mean)) {
        bytes_text(bytes, " ");
        svg_text(bytes, statistic->unit);
    }
    bytes_text(bytes, "</text>\n");
}

static void put_description(const Ensemble *ensemble, Bytes *bytes) {
    bytes_format(bytes, "<desc>%llu runs of %llu, seeds from %llu; %llu failed.",
                 (unsigned long long)ensemble->made, (unsigned long long)ensemble->runs,
                 (unsigned long long)ensemble->first_seed, (unsigned long long)ensemble->failed);
    if (ensemble->target.why != NULL) {
        bytes_text(bytes, " Target: ");
        svg_text(bytes, ensemble->target.why);
        bytes_text(bytes, ".");
    }
    bytes_format(bytes,
                 " Bands and whiskers: %g %% intervals of the mean over all seeds; boxes: half of "
                 "the runs; grey lines: all of them.",
                 100 * ensemble->confidence);
    for (size_t i = drawn(ensemble); i < ensemble->spectra.count; i++) {
        bytes_text(bytes, " Not drawn: ");
        svg_text(bytes, ensemble->spectra.at[i].channel);
        bytes_text(bytes, ".");
    }
    bytes_text(bytes, "</desc>\n");
}

void chart_ensemble(const Ensemble *ensemble, Bytes *bytes) {
    Plot plot = {.left = left,
                 .right = right,
                 .top = top,
                 .bottom = bottom,
                 .is_logarithmic = true,
                 .decades = PLOT_PSD_DECADES,
                 .x_title = "frequency [Hz]",
                 .bytes = bytes};
    plot_begin(&plot);
    for (size_t i = 0; i < drawn(ensemble); i++)
        plot_fit(&plot, &ensemble->frequency, &ensemble->spectra.at[i].mean);
    const bool has_spectra = plot.x_max > plot.x_min;
    const double from = has_spectra ? bottom + 62 : top + 12;
    const double height = from + row_height * STATISTICS_METRICS + 12;
    char text[96];
    snprintf(text, sizeof text, "Mean of %llu runs",
             (unsigned long long)(ensemble->made - ensemble->failed));
    svg_open(bytes, width, height, text);
    put_description(ensemble, bytes);
    svg_page(bytes, width, height, rules);
    snprintf(text, sizeof text, "Mean of %llu runs, with its %g %% interval",
             (unsigned long long)(ensemble->made - ensemble->failed), 100 * ensemble->confidence);
    svg_heading(bytes, left, 26, text);
    if (plot_axes(&plot))
        for (size_t i = 0; i < drawn(ensemble); i++)
            put_spectrum(&plot, ensemble, i);
    const Scale of = scale_rows(&ensemble->statistics);
    for (int metric = 0; metric < STATISTICS_METRICS; metric++)
        put_row(bytes, &of, metric, &ensemble->statistics.of[metric],
                from + row_height * (metric + 0.5));
    svg_close(bytes);
}
