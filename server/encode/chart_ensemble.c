// Above, the densities over frequency, both logarithmic: where frequencies lie closer than a third
// of a pixel their mean is drawn. Below, a line for each statistic: the whole of it reaches from
// the smallest run to the largest, the box holds half of the runs, the mark is the mean and its
// whiskers the interval, all in units of the mean.
#include "server/encode/chart_ensemble.h"

#include <float.h>
#include <math.h>
#include <stdio.h>
#include <string.h>

#include "server/encode/svg.h"

enum { SPECTRA_DRAWN = 4, COLUMNS = 1300, DECADES = 8, NAME = 48 };

static const double width = 640, left = 62, right = 626, top = 44, bottom = 300; // of the spectra
static const double label_right = 190, value_left = 470;                         // of the lines
static const double row_height = 24;
static const char *const light[] = {"#0072b2", "#d55e00", "#009e73", "#a8509a"};
static const char *const dark[] = {"#56b4e9", "#f0944d", "#3ad1a4", "#e29ad0"};

typedef struct Chart {
    const Ensemble *ensemble;
    int x_from, x_to, y_from, y_to; // decades
    double x_least, x_most;         // frequencies [Hz]
    Bytes *bytes;
} Chart;

static void put_style(Bytes *bytes) {
    bytes_text(bytes,
               "<style>\n"
               "svg { font: 12px system-ui, sans-serif; color-scheme: light dark; }\n"
               ".page { fill: #ffffff; } text { fill: #222222; }\n"
               ".grid { stroke: #dddddd; fill: none; } .frame { stroke: #777777; fill: none; }\n"
               ".line { fill: none; stroke-width: 1.5; } .band { fill-opacity: 0.4; }\n"
               ".all { stroke: #888888; } .half { fill: #888888; fill-opacity: 0.35; }\n"
               ".mean { stroke: #222222; stroke-width: 2; fill: none; }\n");
    for (size_t i = 0; i < SPECTRA_DRAWN; i++)
        bytes_format(bytes, ".line.s%zu { stroke: %s; } .band.s%zu { fill: %s; }\n", i, light[i], i,
                     light[i]);
    bytes_text(bytes, "@media (prefers-color-scheme: dark) {\n"
                      ".page { fill: #16181c; } text { fill: #e4e4e4; } .grid { stroke: #363a41; } "
                      ".frame, .all { stroke: #8a8f98; }\n"
                      ".half { fill: #8a8f98; } .mean { stroke: #f2f2f2; }\n");
    for (size_t i = 0; i < SPECTRA_DRAWN; i++)
        bytes_format(bytes, ".line.s%zu { stroke: %s; } .band.s%zu { fill: %s; }\n", i, dark[i], i,
                     dark[i]);
    bytes_text(bytes, "}\n</style>\n");
}

static size_t drawn(const Ensemble *ensemble) {
    return ensemble->spectra.count < SPECTRA_DRAWN ? ensemble->spectra.count : SPECTRA_DRAWN;
}

// False where there is nothing to draw.
static bool scale(Chart *chart) {
    const Reals *frequency = &chart->ensemble->frequency;
    double least = DBL_MAX, most = 0;
    chart->x_least = DBL_MAX;
    for (size_t i = 0; i < drawn(chart->ensemble); i++) {
        const Reals *mean = &chart->ensemble->spectra.at[i].mean;
        for (size_t k = 0; k < mean->count && k < frequency->count; k++) {
            if (!(frequency->at[k] > 0) || !(mean->at[k] > 0) || !isfinite(mean->at[k]))
                continue;
            least = fmin(least, mean->at[k]);
            most = fmax(most, mean->at[k]);
            chart->x_least = fmin(chart->x_least, frequency->at[k]);
            chart->x_most = fmax(chart->x_most, frequency->at[k]);
        }
    }
    if (!(most > 0) || !(chart->x_most > chart->x_least))
        return false;
    svg_decades(least, most, &chart->y_from, &chart->y_to);
    if (chart->y_from < chart->y_to - DECADES)
        chart->y_from = chart->y_to - DECADES;
    svg_decades(chart->x_least, chart->x_most, &chart->x_from, &chart->x_to);
    return true;
}

static double x_of(const Chart *chart, double frequency) {
    return left +
           (right - left) * log(frequency / chart->x_least) / log(chart->x_most / chart->x_least);
}

static double y_of(const Chart *chart, double density) {
    const double level = density > 0 ? log10(density) : chart->y_from;
    const double share = (level - chart->y_from) / (chart->y_to - chart->y_from);
    return bottom - (bottom - top) * fmin(fmax(share, 0), 1);
}

static void put_axes(const Chart *chart) {
    Bytes *bytes = chart->bytes;
    for (int d = chart->x_from; d <= chart->x_to; d++) {
        const double x = x_of(chart, pow(10, d));
        if (x < left - 0.5 || x > right + 0.5)
            continue;
        bytes_format(bytes, "<path class=\"grid\" d=\"M%.1f %.0fV%.0f\"/>", x, top, bottom);
        bytes_format(bytes, "<text x=\"%.1f\" y=\"%.0f\" text-anchor=\"middle\">", x, bottom + 18);
        svg_power(bytes, d);
        bytes_text(bytes, "</text>\n");
    }
    for (int d = chart->y_from; d <= chart->y_to; d++) {
        const double y = y_of(chart, pow(10, d));
        bytes_format(bytes, "<path class=\"grid\" d=\"M%.0f %.1fH%.0f\"/>", left, y, right);
        bytes_format(bytes, "<text x=\"%.0f\" y=\"%.1f\" text-anchor=\"end\">", left - 8, y + 4);
        svg_power(bytes, d);
        bytes_text(bytes, "</text>\n");
    }
    bytes_format(bytes,
                 "<rect class=\"frame\" x=\"%.0f\" y=\"%.0f\" width=\"%.0f\" height=\"%.0f\"/>\n",
                 left, top, right - left, bottom - top);
    bytes_format(bytes,
                 "<text x=\"%.0f\" y=\"%.0f\" text-anchor=\"middle\">frequency [Hz]</text>\n",
                 (left + right) / 2, bottom + 36);
}

// Densities as points of the chart, in the order of the frequencies.
typedef struct Curve {
    double x[COLUMNS], y[COLUMNS];
    size_t count;
} Curve;

static void curve_make(const Chart *chart, const Reals *density, Curve *curve) {
    const Reals *frequency = &chart->ensemble->frequency;
    const double column = (right - left) / (COLUMNS / 2);
    size_t k = 0;
    curve->count = 0;
    while (k < density->count && !(frequency->at[k] >= chart->x_least))
        k++;
    while (k < density->count && curve->count < COLUMNS) {
        const double from = x_of(chart, frequency->at[k]);
        double x = 0, sum = 0, among = 0;
        for (; k < density->count && frequency->at[k] <= chart->x_most; k++) {
            const double at = x_of(chart, frequency->at[k]);
            if (at - from > column)
                break;
            x += at;
            sum += density->at[k];
            among++;
        }
        if (among == 0)
            break;
        curve->x[curve->count] = x / among;
        curve->y[curve->count++] = y_of(chart, sum / among);
    }
}

static void put_spectrum(const Chart *chart, size_t index) {
    const EnsembleSpectrum *spectrum = &chart->ensemble->spectra.at[index];
    Bytes *bytes = chart->bytes;
    Curve curve;
    if (spectrum->low.count > 0 && spectrum->high.count > 0) {
        curve_make(chart, &spectrum->high, &curve);
        bytes_format(bytes, "<path class=\"band s%zu\" d=\"", index);
        for (size_t i = 0; i < curve.count; i++)
            bytes_format(bytes, "%s%.1f %.1f", i == 0 ? "M" : "L", curve.x[i], curve.y[i]);
        curve_make(chart, &spectrum->low, &curve);
        for (size_t i = curve.count; i-- > 0;)
            bytes_format(bytes, "L%.1f %.1f", curve.x[i], curve.y[i]);
        bytes_text(bytes, "z\"/>\n");
    }
    curve_make(chart, &spectrum->mean, &curve);
    bytes_format(bytes, "<path class=\"line s%zu\" d=\"", index);
    for (size_t i = 0; i < curve.count; i++)
        bytes_format(bytes, "%s%.1f %.1f", i == 0 ? "M" : "L", curve.x[i], curve.y[i]);
    bytes_text(bytes, "\"><title>");
    svg_text(bytes, spectrum->channel != NULL ? spectrum->channel : "");
    bytes_text(bytes, "</title></path>\n");
    const double y = top + 18 + 18 * (double)index;
    bytes_format(bytes,
                 "<path class=\"line s%zu\" d=\"M%.0f %.0fh20\"/><text x=\"%.0f\" y=\"%.0f\" "
                 "text-anchor=\"end\">",
                 index, right - 30, y, right - 38, y + 4);
    svg_text(bytes, spectrum->channel != NULL ? spectrum->channel : "");
    bytes_text(bytes, " [");
    svg_text(bytes, spectrum->unit != NULL ? spectrum->unit : "");
    bytes_text(bytes, "]</text>\n");
}

// The lines below share one scale, in units of each mean.
typedef struct Scale {
    double least, most;
} Scale;

static bool has_scale(const EnsembleStatistic *statistic) {
    return statistic->mean > 0 && isfinite(statistic->mean);
}

static Scale scale_rows(EnsembleStatistics *statistics) {
    Scale of = {1, 1};
    for (int metric = 0; metric < ENSEMBLE_STATISTICS; metric++) {
        const EnsembleStatistic *statistic = ensemble_statistic(statistics, metric);
        if (!has_scale(statistic))
            continue;
        of.least = fmin(of.least, fmin(statistic->minimum, statistic->low) / statistic->mean);
        of.most = fmax(of.most, fmax(statistic->maximum, statistic->high) / statistic->mean);
    }
    if (!(of.most > of.least) || !isfinite(of.most) || !isfinite(of.least))
        of = (Scale){0, 2};
    return of;
}

static double row_x(const Scale *of, const EnsembleStatistic *statistic, double value) {
    const double share = (value / statistic->mean - of->least) / (of->most - of->least);
    return label_right + 10 + (value_left - label_right - 20) * fmin(fmax(share, 0), 1);
}

static void plain_name(int metric, char name[NAME]) {
    snprintf(name, NAME, "%s", ensemble_metric_names[metric]);
    for (char *c = name; *c != '\0'; c++)
        if (*c == '_')
            *c = ' ';
}

static void put_row(Bytes *bytes, const Scale *of, int metric, const EnsembleStatistic *statistic,
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
            bytes, "<path class=\"mean\" d=\"M%.1f %.0fv8M%.1f %.0fv8M%.1f %.0fH%.1f",
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
    Chart chart = {.ensemble = ensemble, .bytes = bytes};
    EnsembleStatistics statistics = ensemble->statistics; // a borrowed view
    const bool has_spectra = scale(&chart);
    const double from = has_spectra ? bottom + 62 : top + 12;
    bytes_format(
        bytes,
        "<svg xmlns=\"http://www.w3.org/2000/svg\" viewBox=\"0 0 %.0f %.0f\" role=\"img\">\n",
        width, from + row_height * ENSEMBLE_STATISTICS + 12);
    bytes_format(bytes, "<title>Mean of %llu runs</title>\n",
                 (unsigned long long)(ensemble->made - ensemble->failed));
    put_description(ensemble, bytes);
    put_style(bytes);
    bytes_format(bytes, "<rect class=\"page\" width=\"%.0f\" height=\"%.0f\"/>\n", width,
                 from + row_height * ENSEMBLE_STATISTICS + 12);
    bytes_format(bytes,
                 "<text x=\"%.0f\" y=\"26\" font-size=\"14\">Mean of %llu runs, with its %g %% "
                 "interval</text>\n",
                 left, (unsigned long long)(ensemble->made - ensemble->failed),
                 100 * ensemble->confidence);
    if (has_spectra) {
        put_axes(&chart);
        for (size_t i = 0; i < drawn(ensemble); i++)
            put_spectrum(&chart, i);
    }
    const Scale of = scale_rows(&statistics);
    for (int metric = 0; metric < ENSEMBLE_STATISTICS; metric++)
        put_row(bytes, &of, metric, ensemble_statistic(&statistics, metric),
                from + row_height * (metric + 0.5));
    bytes_text(bytes, "</svg>\n");
}
