// Two frames, e above T_c. A dot is a reading that counts, a ring about it one that lies far off, a
// cross one that is excluded or does not count; the band is the mean's interval, and where e or T_c
// changes with speed the line of that goes through.
#include "server/encode/chart_evaluation.h"

#include <math.h>
#include <stdio.h>

#include "server/encode/plot.h"
#include "server/encode/svg.h"

enum { ROWS_DRAWN = 5000 };

static const double width = 680, height = 640, left = 78, right = 664;
static const double tops[] = {44, 356}, bottoms[] = {274, 586};

static const char rules[] = ".ring, .cross { fill: none; stroke-width: 1.5; } .cross { stroke: "
                            "#888888; }\n.mean { stroke-width: 1.5; } .trend { stroke-dasharray: "
                            "6 4; }\n";

// One of the two quantities.
typedef struct Panel {
    const Statistic *of;
    bool is_time;
    const char *name, *unit;
    double without_speed; // where readings that have none are drawn
} Panel;

static double value_of(const Panel *panel, const EvaluationRow *row) {
    return panel->is_time ? row->contact_time : row->restitution;
}

static bool counts(const Panel *panel, const EvaluationRow *row) {
    return panel->is_time ? row->contact_time_counts : row->restitution_counts;
}

static double speed_of(const Panel *panel, const EvaluationRow *row) {
    return isnan(row->approach_speed) ? panel->without_speed : row->approach_speed;
}

static void fit(Plot *plot, Panel *panel, const Evaluation *evaluation) {
    double least = (double)INFINITY, most = -(double)INFINITY, low = least, high = most;
    for (size_t i = 0; i < evaluation->rows.count; i++) {
        const EvaluationRow *row = &evaluation->rows.at[i];
        const double value = value_of(panel, row);
        if (isnan(value))
            continue;
        low = fmin(low, value);
        high = fmax(high, value);
        least = fmin(least, row->approach_speed); // fmin passes a NAN over
        most = fmax(most, row->approach_speed);
    }
    if (!(high >= low))
        return;
    low = fmin(low, panel->of->low);
    high = fmax(high, panel->of->high);
    if (!(most >= least)) {
        least = 0;
        most = 1;
    }
    const double room = most > least ? 0.06 * (most - least) : 0.1 * most;
    const double above = high > low ? 0 : 0.1 * fmax(fabs(high), 1e-12);
    panel->without_speed = fmax(least - room / 2, 0);
    plot_fit_point(plot, fmax(least - room, 0), low - above);
    plot_fit_point(plot, most + room, high + above);
}

static void put_mean(const Plot *plot, const Panel *panel) {
    const Statistic *of = panel->of;
    if (isnan(of->mean))
        return;
    if (!isnan(of->low))
        bytes_format(plot->bytes,
                     "<rect class=\"band s0\" x=\"%.1f\" y=\"%.1f\" width=\"%.1f\" "
                     "height=\"%.1f\"/>\n",
                     plot->left, plot_y(plot, of->high), plot->right - plot->left,
                     fmax(plot_y(plot, of->low) - plot_y(plot, of->high), 0.5));
    bytes_format(plot->bytes,
                 "<path class=\"line s0 mean\" d=\"M%.1f %.1fH%.1f\"><title>mean %.4g</title>"
                 "</path>\n",
                 plot->left, plot_y(plot, of->mean), plot->right, of->mean);
    const Trend *trend = &of->trend;
    if (trend->verdict != TREND_NOT_CONSTANT)
        return;
    const double middle = trend->mean_speed, value = trend->mean_value;
    bytes_format(plot->bytes,
                 "<path class=\"line s1 trend\" d=\"M%.1f %.1fL%.1f %.1f\"><title>%.3g per m/s"
                 "</title></path>\n",
                 plot_x(plot, trend->least_speed),
                 plot_y(plot, value + trend->slope * (trend->least_speed - middle)),
                 plot_x(plot, trend->most_speed),
                 plot_y(plot, value + trend->slope * (trend->most_speed - middle)), trend->slope);
}

static void put_row(const Plot *plot, const Panel *panel, const EvaluationRow *row) {
    const double value = value_of(panel, row);
    if (isnan(value))
        return;
    Bytes *bytes = plot->bytes;
    const double x = plot_x(plot, speed_of(panel, row)), y = plot_y(plot, value);
    const bool is_outlier =
        panel->is_time ? row->contact_time_is_outlier : row->restitution_is_outlier;
    bytes_text(bytes, "<g>");
    if (counts(panel, row))
        bytes_format(bytes, "<circle class=\"mark s0\" cx=\"%.1f\" cy=\"%.1f\" r=\"3\"/>", x, y);
    else
        bytes_format(bytes, "<path class=\"cross\" d=\"M%.1f %.1fl8 8M%.1f %.1fl-8 8\"/>", x - 4,
                     y - 4, x + 4, y - 4);
    if (is_outlier)
        bytes_format(bytes, "<circle class=\"line s3 ring\" cx=\"%.1f\" cy=\"%.1f\" r=\"7\"/>", x,
                     y);
    bytes_text(bytes, "<title>");
    if (row->measurement != COUNT_ABSENT)
        bytes_format(bytes, "measurement %llu, ", (unsigned long long)row->measurement);
    svg_text(bytes, row->from);
    bytes_format(bytes, ": %.4g%s", value, is_outlier ? ", an outlier that counts" : "");
    if (row->excluded != NULL) {
        bytes_text(bytes, ", excluded: ");
        svg_text(bytes, row->excluded);
    }
    bytes_text(bytes, "</title></g>\n");
}

static void put_panel(const Evaluation *evaluation, Panel panel, int index, Bytes *bytes) {
    Plot plot = {.left = left,
                 .right = right,
                 .top = tops[index],
                 .bottom = bottoms[index],
                 .x_title = "approach speed [m/s]",
                 .bytes = bytes};
    char text[160];
    plot_begin(&plot);
    fit(&plot, &panel, evaluation);
    const Statistic *of = panel.of;
    if (of->count == 0)
        snprintf(text, sizeof text, "%s: not known", panel.name);
    else if (isnan(of->low))
        snprintf(text, sizeof text, "%s: %.4g%s, %llu reading%s", panel.name, of->mean, panel.unit,
                 (unsigned long long)of->count, of->count == 1 ? "" : "s");
    else
        snprintf(text, sizeof text, "%s: %.4g%s, 95 %% within %.4g to %.4g, %llu reading%s",
                 panel.name, of->mean, panel.unit, of->low, of->high, (unsigned long long)of->count,
                 of->count == 1 ? "" : "s");
    svg_heading(bytes, left, plot.top - 18, text);
    if (!(plot.x_max > plot.x_min) || !plot_axes(&plot))
        return;
    put_mean(&plot, &panel);
    for (size_t i = 0; i < evaluation->rows.count && i < ROWS_DRAWN; i++)
        put_row(&plot, &panel, &evaluation->rows.at[i]);
}

void chart_evaluation(const Evaluation *evaluation, const char *slug, Bytes *bytes) {
    char title[120];
    snprintf(title, sizeof title, "Drop tests of %.63s", slug);
    svg_open(bytes, width, height, title);
    bytes_text(bytes, "<desc>Dots: readings that count; rings: outliers, which count; crosses: "
                      "readings that do not. Band: 95 % interval of the mean. ");
    svg_text(bytes, evaluation->restitution.trend.detail != NULL
                        ? evaluation->restitution.trend.detail
                        : "");
    bytes_text(bytes, ". ");
    svg_text(bytes, evaluation->contact_time.trend.detail != NULL
                        ? evaluation->contact_time.trend.detail
                        : "");
    bytes_text(bytes, "</desc>\n");
    svg_page(bytes, width, height, rules);
    put_panel(evaluation, (Panel){&evaluation->restitution, false, "Restitution e", "", 0}, 0,
              bytes);
    put_panel(evaluation, (Panel){&evaluation->contact_time, true, "Contact time T_c", " s", 0}, 1,
              bytes);
    svg_close(bytes);
}
