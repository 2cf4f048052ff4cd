// Above, where runs were drawn, the densities of the scene itself with 5 to 95 % of the runs about
// them. Below, a column for each parameter and a row for each statistic.
#include "server/encode/chart_sensitivity.h"

#include <math.h>
#include <stdio.h>

#include "server/encode/plot.h"
#include "server/encode/svg.h"

enum { SPECTRA_DRAWN = 4 };

static const double width = 760, column_width = 98, row_height = 22, label_right = 160;

static size_t drawn(const Sensitivity *sensitivity) {
    return sensitivity->spectra.count < SPECTRA_DRAWN ? sensitivity->spectra.count : SPECTRA_DRAWN;
}

static void put_spectra(Plot *plot, const Sensitivity *sensitivity) {
    if (!plot_axes(plot))
        return;
    for (size_t i = 0; i < drawn(sensitivity); i++) {
        const RunSpectrum *spectrum = &sensitivity->spectra.at[i];
        char text[120];
        plot_band(plot, &sensitivity->frequency, &spectrum->q05, &spectrum->q95, i);
        plot_line(plot, &sensitivity->frequency, &spectrum->value, i, spectrum->channel);
        snprintf(text, sizeof text, "%s [%s]", spectrum->channel, spectrum->unit);
        plot_legend(plot, i, i, text);
    }
}

static void put_plain(Bytes *bytes, const char *name) {
    for (; *name != '\0'; name++)
        bytes_put(bytes, *name == '_' ? " " : name, 1);
}

static void put_slope(Bytes *bytes, const SensitivitySlope *slope, double x, double y) {
    bytes_format(bytes, "<text%s x=\"%.0f\" y=\"%.0f\" text-anchor=\"end\">",
                 slope->is_settled ? "" : " class=\"faint\"", x, y);
    if (isnan(slope->derivative))
        bytes_text(bytes, "not known");
    else
        bytes_format(bytes, "%.2g", slope->derivative);
    if (!slope->is_settled && !isnan(slope->spread))
        bytes_format(bytes, slope->spread < 10 ? " (%.1g)" : " (%.4g)",
                     slope->spread < 10 ? slope->spread : rint(slope->spread));
    bytes_text(bytes, "</text>\n");
}

static void put_table(const Sensitivity *sensitivity, double top, Bytes *bytes) {
    for (int metric = 0; metric < STATISTICS_METRICS; metric++) {
        bytes_format(bytes, "<text x=\"%.0f\" y=\"%.0f\" text-anchor=\"end\">", label_right,
                     top + row_height * (metric + 1));
        put_plain(bytes, statistics_metric_names[metric]);
        bytes_text(bytes, "</text>\n");
    }
    for (size_t i = 0; i < sensitivity->response.count; i++) {
        const SensitivityRow *row = &sensitivity->response.at[i];
        const double x = label_right + column_width * (double)(i + 1);
        bytes_format(bytes, "<text x=\"%.0f\" y=\"%.0f\" text-anchor=\"end\">", x, top);
        put_plain(bytes, sensitivity_parameter_names[row->parameter]);
        bytes_text(bytes, "</text>\n");
        for (size_t k = 0; k < row->slopes.count; k++)
            put_slope(bytes, &row->slopes.at[k], x,
                      top + row_height * (row->slopes.at[k].metric + 1));
    }
}

void chart_sensitivity(const Sensitivity *sensitivity, Bytes *bytes) {
    Plot plot = {.left = 70,
                 .right = width - 14,
                 .top = 44,
                 .bottom = 330,
                 .is_logarithmic = true,
                 .decades = PLOT_PSD_DECADES,
                 .x_title = "frequency [Hz]",
                 .bytes = bytes};
    plot_begin(&plot);
    for (size_t i = 0; i < drawn(sensitivity); i++) {
        plot_fit(&plot, &sensitivity->frequency, &sensitivity->spectra.at[i].value);
        plot_fit(&plot, &sensitivity->frequency, &sensitivity->spectra.at[i].q95);
    }
    const double top = plot.x_max > plot.x_min ? 420 : 60;
    const double height = top + row_height * (STATISTICS_METRICS + 2);
    svg_open(bytes, width, height, "Sensitivity");
    bytes_format(bytes,
                 "<desc>Relative change of each statistic over the relative change of each "
                 "parameter; grey ones do not settle, their spread stands in brackets. Bands: 5 to "
                 "95 %% of %llu drawn runs. ",
                 (unsigned long long)(sensitivity->made - sensitivity->failed));
    svg_text(bytes, sensitivity->why != NULL ? sensitivity->why : "");
    bytes_text(bytes, "</desc>\n");
    svg_page(bytes, width, height, NULL);
    if (top > 60)
        svg_heading(bytes, 70, 26, "Spectra, with 5 to 95 % of the drawn runs");
    svg_heading(bytes, 20, top - 28, "Relative change of the statistic over that of the parameter");
    put_spectra(&plot, sensitivity);
    put_table(sensitivity, top, bytes);
    bytes_format(bytes,
                 "<text class=\"faint\" x=\"20\" y=\"%.0f\">grey: does not settle, its spread in "
                 "brackets</text>\n",
                 height - 10);
    svg_close(bytes);
}
