// A response curve as a table, without its sections and all multipliers but the largest, and as a
// chart.
#include <math.h>

#include "core/study/response_curve.h"
#include "server/formats/chart.h"
#include "server/formats/study_formats.h"

enum { SECTIONS_DRAWN = 20000 }; // points

// The orbits of one direction that are stable, or are not: a line with gaps between branches, which
// begins at the point before where stability changes on a branch.
static void response_add_orbits(Chart *chart, ChartPanel *panel, const ResponsePoints *points,
                                int direction, bool is_stable, ChartSeries series) {
    double *x = chart_new(chart, 3 * points->count + 1, sizeof *x),
           *y = chart_new(chart, 3 * points->count + 1, sizeof *y);
    const ResponsePoint *last = NULL;
    for (size_t i = 0; i < points->count && !chart->is_failed; i++) {
        const ResponsePoint *point = &points->at[i];
        if (point->direction != direction || point->period == COUNT_ABSENT ||
            point->stable != is_stable)
            continue;
        const bool goes_on = i > 0 && point[-1].branch == point->branch;
        if (last != NULL && !(goes_on && last == point - 1))
            x[series.count] = y[series.count] = (double)NAN, series.count++;
        if (goes_on && last != point - 1) {
            x[series.count] = point[-1].value;
            y[series.count++] = point[-1].peak_displacement;
        }
        x[series.count] = point->value;
        y[series.count++] = point->peak_displacement;
        last = point;
    }
    series.kind = CHART_LINE;
    series.x = x;
    series.y = y;
    if (series.count > 0)
        chart_add(panel, series);
}

// Points of which most lines would be too short: the only ones of their branch, and those without a
// period.
static void response_add_points(Chart *chart, ChartPanel *panel, const ResponsePoints *points,
                                bool is_periodic, ChartSeries series) {
    double *x = chart_new(chart, points->count + 1, sizeof *x),
           *y = chart_new(chart, points->count + 1, sizeof *y);
    for (size_t i = 0; i < points->count && !chart->is_failed; i++) {
        const ResponsePoint *point = &points->at[i];
        const bool is_alone = (i == 0 || point[-1].branch != point->branch) &&
                              (i + 1 == points->count || point[1].branch != point->branch);
        if ((point->period != COUNT_ABSENT) != is_periodic || (is_periodic && !is_alone))
            continue;
        x[series.count] = point->value;
        y[series.count++] = point->peak_displacement;
    }
    series.kind = CHART_MARKERS;
    series.x = x;
    series.y = y;
    if (series.count > 0)
        chart_add(panel, series);
}

static void response_add_undamped(Chart *chart, ChartPanel *panel, const ResponsePoints *points) {
    double *x = chart_new(chart, points->count + 1, sizeof *x),
           *y = chart_new(chart, points->count + 1, sizeof *y);
    size_t count = 0;
    for (size_t i = 0; i < points->count && points->at[i].direction == points->at[0].direction &&
                       !chart->is_failed;
         i++) {
        x[count] = points->at[i].value;
        y[count++] = points->at[i].undamped_peak_displacement;
    }
    if (count > 0)
        chart_add(panel, (ChartSeries){CHART_LINE, x, y, NULL, count, .colour = CHART_STRONG,
                                       .legend = "without dampers"});
}

static void response_add_sections(Chart *chart, const ResponseCurve *curve, const char *axis) {
    size_t all = 0, count = 0;
    for (size_t i = 0; i < curve->points.count; i++)
        all += curve->points.at[i].section.count;
    if (all == 0)
        return;
    const size_t step = 1 + all / SECTIONS_DRAWN;
    double *x = chart_new(chart, all / step + 1, sizeof *x),
           *y = chart_new(chart, all / step + 1, sizeof *y);
    size_t number = 0;
    for (size_t i = 0; i < curve->points.count && !chart->is_failed; i++)
        for (size_t k = 0; k < curve->points.at[i].section.count; k++)
            if (number++ % step == 0) {
                x[count] = curve->points.at[i].value;
                y[count++] = curve->points.at[i].section.at[k].at[0];
            }
    ChartPanel *panel = chart_panel(
        chart, "displacement [m] at the upward zero crossings, where no period was found", 200);
    panel->x.title = axis;
    chart_add(panel, (ChartSeries){CHART_MARKERS, x, y, NULL, count, .colour = 3});
    if (step > 1)
        chart_note(chart, " ",
                   chart_text(chart, "Drawn is one of %zu points of the sections", step));
}

static const char *response_direction(int direction) {
    return direction == CURVE_UP ? "up" : direction == CURVE_DOWN ? "down" : "continued";
}

void response_table(const Variant *answer, StudyTable *table) {
    const ResponseCurve *curve = (const ResponseCurve *)(const void *)answer;
    for (size_t k = 0; k < curve->points.count; k++) {
        const ResponsePoint *point = &curve->points.at[k];
        const bool is_periodic = point->period != COUNT_ABSENT;
        const double unknown = (double)NAN;
        const double *first = point->multipliers.count > 0 ? point->multipliers.at[0].at : NULL;
        study_table_row(table);
        study_table_number(table, "index", NULL, (double)point->index);
        study_table_number(table, "branch", NULL, (double)point->branch);
        study_table_number(table, "value", curve->unit, point->value);
        study_table_text(table, "direction", response_direction(point->direction));
        study_table_number(table, "period", NULL, is_periodic ? (double)point->period : unknown);
        study_table_number(table, "stable", NULL,
                           point->stable != CHOICE_ABSENT ? (double)point->stable : unknown);
        study_table_number(table, "impacts_per_period", NULL,
                           is_periodic ? (double)point->impacts_per_period : unknown);
        study_table_number(table, "largest_multiplier", NULL,
                           first != NULL ? hypot(first[0], first[1]) : unknown);
        study_table_number(table, "peak_displacement", "m", point->peak_displacement);
        study_table_number(table, "rms_displacement", "m", point->rms_displacement);
        study_table_number(table, "undamped_peak_displacement", "m",
                           point->undamped_peak_displacement);
        study_table_number(table, "lyapunov", "1/s", point->lyapunov);
    }
}

void chart_response(const Variant *answer, Chart *chart) {
    static const struct {
        int direction;
        const char *stable, *unstable;
    } directions[] = {{CURVE_UP, "stable, up", "unstable, up"},
                      {CURVE_DOWN, "stable, down", "unstable, down"},
                      {CHOICE_ABSENT, "stable, continued", "unstable, continued"}};
    const ResponseCurve *curve = (const ResponseCurve *)(const void *)answer;
    *chart = (Chart){.width = 720, .left = 90, .right = 180, .title = "Response curve"};
    const char *axis = chart_quantity(
        chart, curve->member.pointer != NULL ? curve->member.pointer : "value", curve->unit);
    ChartPanel *panel = chart_panel(chart, "peak displacement of the steady motion [m]", 320);
    panel->x.title = axis;
    for (size_t i = 0; i < COUNT(directions); i++) {
        response_add_orbits(chart, panel, &curve->points, directions[i].direction, true,
                            (ChartSeries){.colour = i, .legend = directions[i].stable});
        response_add_orbits(
            chart, panel, &curve->points, directions[i].direction, false,
            (ChartSeries){.colour = i, .look = "wanted", .legend = directions[i].unstable});
    }
    response_add_points(chart, panel, &curve->points, true,
                        (ChartSeries){.colour = 0, .legend = "a branch of one point"});
    response_add_points(chart, panel, &curve->points, false,
                        (ChartSeries){.colour = 3, .legend = "no period found"});
    response_add_undamped(chart, panel, &curve->points);
    response_add_sections(chart, curve, axis);
    chart_note(chart, " ",
               chart_text(chart, "%llu points, of which %llu failed",
                          (unsigned long long)curve->made.runs,
                          (unsigned long long)curve->made.failed));
}
