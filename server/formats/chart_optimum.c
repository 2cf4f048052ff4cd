// The candidates of an optimisation: over their number with the best so far, or of two objectives
// with the front.
#include <math.h>
#include <string.h>

#include "core/study/optimize.h"
#include "server/formats/chart.h"
#include "server/formats/study_formats.h"

// Values are at the edge beyond so many times the difference from the best to the median.
static const double optimum_outlier = 4;

static const char *optimum_quantity(Chart *chart, const Optimum *optimum, size_t objective) {
    const int metric = optimum->objectives.at[objective].metric;
    return chart_quantity(chart, study_metric_names[metric], study_metric_unit(metric));
}

static bool optimum_is_maximum(const Optimum *optimum, size_t objective) {
    return optimum->objectives.at[objective].goal == OPTIMIZE_MAXIMIZE;
}

// Values of an objective; those far worse than the better half become infinite, which are drawn at
// the edge.
static double *optimum_values_of(Chart *chart, const OptimumCandidates *rows, size_t objective,
                                 bool is_maximum) {
    double *values = chart_new(chart, rows->count + 1, sizeof *values);
    double *sorted = chart_new(chart, rows->count + 1, sizeof *sorted);
    const double sign = is_maximum ? -1 : 1;
    size_t known = 0;
    if (values == NULL || sorted == NULL)
        return NULL;
    for (size_t i = 0; i < rows->count; i++) {
        values[i] = rows->at[i].objectives.count > objective ? rows->at[i].objectives.at[objective]
                                                             : (double)NAN;
        if (!isnan(values[i]))
            sorted[known++] = sign * values[i];
    }
    reals_sort(sorted, known);
    if (known == 0)
        return values;
    const double limit = sorted[0] + optimum_outlier * (sorted[known / 2] - sorted[0]);
    for (size_t i = 0; i < rows->count; i++)
        if (sorted[known / 2] > sorted[0] && sign * values[i] > limit)
            values[i] = sign * (double)INFINITY;
    return values;
}

// Tooltips: the values of the variables.
static const char *optimum_name(Chart *chart, const OptimumCandidate *candidate) {
    char text[CHART_TEXT] = "";
    for (size_t i = 0; i < candidate->values.count; i++) {
        const OptimumValue *value = &candidate->values.at[i];
        const char *pointer = value->member.pointer, *last = strrchr(pointer, '/');
        text_list(text, sizeof text,
                  chart_text(chart, "%s %.24s", last != NULL ? last + 1 : pointer, value->value));
    }
    return chart_text(chart, "%llu: %s", (unsigned long long)candidate->index, text);
}

// Markers of the candidates that are feasible, or that are not.
static void optimum_add_markers(Chart *chart, ChartPanel *panel, const OptimumCandidates *rows,
                                const double *x, const double *y, bool is_feasible) {
    double *own_x = chart_new(chart, rows->count + 1, sizeof *own_x);
    double *own_y = chart_new(chart, rows->count + 1, sizeof *own_y);
    const char **names = chart_new(chart, rows->count + 1, sizeof *names);
    size_t count = 0;
    for (size_t i = 0; i < rows->count && names != NULL && own_x != NULL && own_y != NULL; i++)
        if (rows->at[i].feasible == is_feasible && !isnan(x[i]) && !isnan(y[i])) {
            own_x[count] = x[i];
            own_y[count] = y[i];
            names[count++] = optimum_name(chart, &rows->at[i]);
        }
    if (count > 0)
        chart_add(panel,
                  (ChartSeries){CHART_MARKERS, own_x, own_y, NULL, count,
                                .colour = is_feasible ? 0 : 1,
                                .shape = is_feasible ? CHART_DOT : CHART_CROSS, .names = names,
                                .legend = is_feasible ? "feasible" : "infeasible"});
}

static void optimum_add_history(Chart *chart, const Optimum *optimum) {
    const OptimumCandidates *rows = &optimum->history;
    const bool is_maximum = optimum_is_maximum(optimum, 0);
    ChartPanel *panel = chart_panel(chart, optimum_quantity(chart, optimum, 0), 320);
    double *x = chart_new(chart, rows->count + 1, sizeof *x);
    double *best = chart_new(chart, rows->count + 1, sizeof *best);
    const double *y = optimum_values_of(chart, rows, 0, is_maximum);
    panel->x.title = "candidate";
    if (x == NULL || best == NULL || y == NULL)
        return;
    for (size_t i = 0; i < rows->count; i++) {
        const double last = i > 0 ? best[i - 1] : (double)NAN;
        x[i] = (double)rows->at[i].index;
        best[i] = !rows->at[i].feasible ? last
                  : is_maximum          ? fmax(last, y[i])
                                        : fmin(last, y[i]); // ignore NAN
    }
    chart_add(panel, (ChartSeries){CHART_LINE, x, best, NULL, rows->count, .colour = CHART_STRONG,
                                   .legend = "best so far"});
    optimum_add_markers(chart, panel, rows, x, y, true);
    optimum_add_markers(chart, panel, rows, x, y, false);
}

static void optimum_add_front(Chart *chart, const Optimum *optimum) {
    const OptimumCandidates *rows = &optimum->history, *front = &optimum->front;
    ChartPanel *panel = chart_panel(chart, optimum_quantity(chart, optimum, 1), 320);
    double *x = chart_new(chart, front->count + 1, sizeof *x);
    double *y = chart_new(chart, front->count + 1, sizeof *y);
    const double *all_x = optimum_values_of(chart, rows, 0, optimum_is_maximum(optimum, 0));
    const double *all_y = optimum_values_of(chart, rows, 1, optimum_is_maximum(optimum, 1));
    panel->x.title = optimum_quantity(chart, optimum, 0);
    if (x == NULL || y == NULL || all_x == NULL || all_y == NULL)
        return;
    for (size_t i = 0; i < front->count; i++) {
        x[i] = front->at[i].objectives.at[0];
        y[i] = front->at[i].objectives.at[1];
    }
    chart_add(panel, (ChartSeries){CHART_LINE, x, y, NULL, front->count, .colour = CHART_STRONG,
                                   .legend = "front"});
    optimum_add_markers(chart, panel, rows, all_x, all_y, true);
    optimum_add_markers(chart, panel, rows, all_x, all_y, false);
}

void chart_optimum(const Variant *answer, Chart *chart) {
    const Optimum *optimum = (const Optimum *)(const void *)answer;
    *chart = (Chart){.width = 720, .left = 84, .right = 130, .title = "Optimisation"};
    bytes_format(&chart->description, "%llu candidates, %llu runs, of which %llu failed.",
                 (unsigned long long)optimum->candidates, (unsigned long long)optimum->made.runs,
                 (unsigned long long)optimum->made.failed);
    for (size_t i = 0; i < optimum->best.objectives.count; i++) {
        const OptimumObjective *objective = &optimum->best.objectives.at[i];
        chart_note(
            chart, " Best: ",
            chart_text(chart, "%s %.4g", study_metric_names[objective->metric], objective->value));
    }
    for (size_t i = 0; i < optimum->made.warnings.count; i++)
        chart_note(chart, " ", optimum->made.warnings.at[i].detail);
    if (optimum->objectives.count == 2)
        optimum_add_front(chart, optimum);
    else if (optimum->objectives.count == 1)
        optimum_add_history(chart, optimum);
}

// A row for each candidate.
void optimum_table(const Variant *answer, StudyTable *table) {
    const Optimum *optimum = (const Optimum *)(const void *)answer;
    const OptimumCandidates *rows = &optimum->history;
    for (size_t i = 0; i < rows->count; i++) {
        const OptimumCandidate *row = &rows->at[i];
        study_table_row(table);
        study_table_number(table, "index", NULL, (double)row->index);
        for (size_t j = 0; j < row->values.count; j++)
            study_table_scalar(table, row->values.at[j].member.pointer, row->values.at[j].value);
        for (size_t k = 0; k < optimum->objectives.count; k++) {
            const int metric = optimum->objectives.at[k].metric;
            const bool is_known = k < row->objectives.count;
            study_table_number(table, study_metric_names[metric], study_metric_unit(metric),
                               is_known ? row->objectives.at[k] : (double)NAN);
        }
        study_table_text(table, "feasible", row->feasible ? "true" : "false");
    }
}
