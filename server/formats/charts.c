#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "core/study/ensemble.h"
#include "core/study/model_comparison.h"
#include "core/study/sensitivity.h"
#include "core/study/tradeoff.h"
#include "server/formats/chart.h"
#include "server/formats/format.h"
#include "server/formats/study_formats.h"

enum { SPECTRA_DRAWN = 4, VARIANTS_DRAWN = 8, READINGS_DRAWN = 5000 };

static const double charts_edges[] = {-(double)INFINITY, (double)INFINITY};

// A name with spaces for its underscores.
static const char *charts_words(Chart *chart, const char *name) {
    char words[CHART_LABEL];
    text_fit(words, sizeof words, name);
    for (char *c = words; *c != '\0'; c++)
        *c = *c == '_' ? ' ' : *c;
    return chart_text(chart, "%s", words);
}

// Appends "Not drawn: NAME", and why.
static void charts_add_undrawn(Chart *chart, const char *name, const char *why) {
    chart_note(chart, " Not drawn: ",
               why != NULL ? chart_text(chart, "%.60s, because: %s", name, why) : name);
}

// Two values that live as long as the chart.
static const double *charts_pair(Chart *chart, double first, double second) {
    double *pair = chart_new(chart, 2, sizeof *pair);
    if (pair != NULL) {
        pair[0] = first;
        pair[1] = second;
    }
    return pair;
}

static size_t charts_shorter(const Reals *a, const Reals *b) {
    return a->count < b->count ? a->count : b->count;
}

// The spectra of many runs, each with a band.
static void charts_add_bands(Chart *chart, ChartPanel *panel, const Reals *frequency,
                             const RunSpectra *spectra) {
    for (size_t i = SPECTRA_DRAWN; i < spectra->count; i++)
        charts_add_undrawn(chart, spectra->at[i].channel, NULL);
    for (size_t i = 0; i < spectra->count && i < SPECTRA_DRAWN; i++) {
        const RunSpectrum *spectrum = &spectra->at[i];
        const bool has_quantiles = spectrum->q05.count > 0;
        const Reals *value = spectrum->value.count > 0 ? &spectrum->value
                             : has_quantiles           ? &spectrum->median
                                                       : &spectrum->mean;
        const Reals *low = has_quantiles ? &spectrum->q05 : &spectrum->low;
        const Reals *high = has_quantiles ? &spectrum->q95 : &spectrum->high;
        chart_add(
            panel,
            (ChartSeries){CHART_LINE, frequency->at, value->at, NULL,
                          charts_shorter(frequency, value), .colour = i, .name = spectrum->channel,
                          .legend = chart_quantity(chart, spectrum->channel, spectrum->unit)});
        const size_t count = charts_shorter(low, high);
        if (count > 0 && count <= frequency->count)
            chart_add(panel, (ChartSeries){CHART_BAND, frequency->at, low->at, high->at, count,
                                           .colour = i});
    }
}

// A row for each metric of a study's statistics, the first at the top.
static void charts_add_rows(Chart *chart, ChartPanel *panel, int metrics) {
    for (int metric = 0; metric < metrics; metric++)
        panel->y.ticks[metric] =
            (ChartTick){-metric, charts_words(chart, statistics_metric_names[metric]), NULL};
    panel->y.tick_count = (size_t)metrics;
}
_Static_assert((int)STATISTICS_METRICS <= (int)CHART_TICKS, "a row needs a label");

// --- tradeoff ---

// A point that is drawn, with its group: a solver, or a setting that is given up.
typedef struct TradeoffMark {
    const TradeoffPoint *point;
    const char *group, *name;
    double error;
} TradeoffMark;

static const char *tradeoff_group(const TradeoffPoint *point) {
    return point->contact_model != NULL     ? point->contact_model
           : !isnan(point->sample_rate)     ? "fewer samples"
           : point->modes != COUNT_ABSENT   ? "fewer modes"
           : point->segment != COUNT_ABSENT ? "shorter segments"
           : !isnan(point->duration)        ? "shorter run"
                                            : point->solver;
}

static int tradeoff_compare(const void *a, const void *b) {
    const TradeoffMark *x = a, *y = b;
    const double first = x->point->cpu_minimum, second = y->point->cpu_minimum;
    return first != second ? (first > second) - (first < second)
                           : (x->point > y->point) - (x->point < y->point);
}

// The points that are drawn, by CPU time; the others are named in the description.
static size_t tradeoff_list(Chart *chart, const Tradeoff *tradeoff, TradeoffMark *marks) {
    size_t count = 0;
    for (size_t i = 0; i < tradeoff->points.count; i++) {
        const TradeoffPoint *point = &tradeoff->points.at[i];
        const double error = error_metrics_by(&point->errors, tradeoff->metric);
        if (point->status != TRADEOFF_MEASURED || !(point->cpu_minimum > 0) || isnan(error)) {
            charts_add_undrawn(chart, point->name,
                               point->why != NULL ? point->why : "its error is unknown");
            continue;
        }
        marks[count++] =
            (TradeoffMark){point, tradeoff_group(point),
                           chart_text(chart, "%s: %.2g%s in %.3g s%s", point->name, error,
                                      metric_units[tradeoff->metric], point->cpu_minimum,
                                      point->is_best ? ", none is cheaper and closer" : ""),
                           error};
    }
    qsort(marks, count, sizeof *marks, tradeoff_compare);
    return count;
}

// The points of a group, or of all groups (NULL) the best ones alone, as `series` says.
static void tradeoff_add(Chart *chart, ChartPanel *panel, const TradeoffMark *marks, size_t count,
                         const char *group, ChartSeries series) {
    double *x = chart_new(chart, count, sizeof *x), *y = chart_new(chart, count, sizeof *y);
    const char **names = chart_new(chart, count, sizeof *names);
    for (size_t i = 0; i < count && !chart->is_failed; i++)
        if (group != NULL ? strcmp(marks[i].group, group) == 0 : marks[i].point->is_best) {
            x[series.count] = marks[i].point->cpu_minimum;
            y[series.count] = marks[i].error;
            names[series.count++] = marks[i].name;
        }
    series.x = x;
    series.y = y;
    if (group != NULL) {
        series.kind = CHART_MARKERS;
        series.names = names;
        chart_add(panel, series);
        series.legend = NULL;
    }
    series.kind = CHART_LINE;
    chart_add(panel, series);
}

static void tradeoff_fill(Chart *chart, ChartPanel *panel, const Tradeoff *tradeoff) {
    TradeoffMark *marks = chart_new(chart, tradeoff->points.count, sizeof *marks);
    if (marks == NULL)
        return;
    const size_t count = tradeoff_list(chart, tradeoff, marks);
    const char *unit = metric_units[tradeoff->metric];
    size_t groups = 0;
    for (size_t i = 0, k = 0; i < count; i++, k = 0) {
        while (strcmp(marks[k].group, marks[i].group) != 0)
            k++;
        if (k == i) // the first of its group
            tradeoff_add(chart, panel, marks, count, marks[i].group,
                         (ChartSeries){.colour = groups++, .legend = marks[i].group});
    }
    tradeoff_add(chart, panel, marks, count, NULL,
                 (ChartSeries){.colour = CHART_STRONG, .look = "best", .legend = "best of all"});
    if (tradeoff->error > 0)
        chart_add(panel, (ChartSeries){
                             CHART_LINE, charts_edges,
                             charts_pair(chart, tradeoff->error, tradeoff->error), NULL, 2,
                             CHART_STRONG, .look = "wanted",
                             .legend = chart_text(chart, "wanted: %.3g%s", tradeoff->error, unit)});
    for (size_t i = 0; i < count; i++)
        if ((uint64_t)(marks[i].point - tradeoff->points.at) + 1 == tradeoff->recommendation.point)
            chart_add(panel, (ChartSeries){CHART_MARKERS, &marks[i].point->cpu_minimum,
                                           &marks[i].error, NULL, 1, CHART_STRONG, CHART_RING,
                                           .look = "ring", .legend = "to take"});
}

void chart_tradeoff(const Variant *answer, Chart *chart) {
    const Tradeoff *tradeoff = (const Tradeoff *)(const void *)answer;
    *chart = (Chart){.width = 640, .left = 62, .right = 154};
    const char *metric = charts_words(chart, metric_names[tradeoff->metric]);
    chart->title = chart_text(chart, "Error of %s against CPU time", metric);
    chart->heading =
        chart_text(chart, "Error of %s%s", metric, tradeoff->metric == METRIC_PSD ? " [dB]" : "");
    chart_note(chart, "", tradeoff->recommendation.why);
    ChartPanel *panel = chart_panel(chart, NULL, 332);
    panel->x.is_logarithmic = panel->y.is_logarithmic = true;
    panel->x.title = "CPU time of a run [s]";
    tradeoff_fill(chart, panel, tradeoff);
}

// --- ensemble ---

// Of each metric a line from one of the RunStatistic's numbers to another, over the mean.
static void ensemble_add_ranges(Chart *chart, ChartPanel *panel, const Ensemble *ensemble,
                                size_t from, size_t to, ChartSeries series) {
    double *x = chart_new(chart, 3 * STATISTICS_METRICS, sizeof *x);
    double *y = chart_new(chart, 3 * STATISTICS_METRICS, sizeof *y);
    for (int metric = 0; metric < STATISTICS_METRICS && !chart->is_failed; metric++) {
        const RunStatistic *statistic = &ensemble->statistics.of[metric];
        const char *at = (const char *)statistic;
        const bool has_range =
            statistic->mean > 0 && isfinite(statistic->mean) && statistic->count > 1;
        for (int i = 0; i < 3; i++) { // the third separates the lines
            const double *value = (const double *)(const void *)(at + (i == 0 ? from : to));
            x[3 * metric + i] = *value / statistic->mean;
            y[3 * metric + i] = has_range && i < 2 ? -metric : (double)NAN;
        }
    }
    series.x = x;
    series.y = y;
    series.count = 3 * STATISTICS_METRICS;
    chart_add(panel, series);
}

static void ensemble_add_statistics(Chart *chart, const Ensemble *ensemble) {
    ChartPanel *panel = chart_panel(chart, NULL, 36 * STATISTICS_METRICS);
    charts_add_rows(chart, panel, STATISTICS_METRICS);
    panel->x.title = "over the mean";
    for (int metric = 0; metric < STATISTICS_METRICS; metric++) {
        const RunStatistic *statistic = &ensemble->statistics.of[metric];
        const double mean = statistic->mean, half = statistic->high - mean;
        const bool has_unit = statistic->unit != NULL && strcmp(statistic->unit, "1") != 0;
        panel->y.ticks[metric].note =
            isnan(mean) ? "not known"
                        : chart_text(chart, "%.4g%s%s%s", mean,
                                     isnan(half) ? "" : chart_text(chart, " \u00b1 %.2g", half),
                                     has_unit ? " " : "", has_unit ? statistic->unit : "");
    }
    const size_t mean = offsetof(RunStatistic, mean);
    ensemble_add_ranges(chart, panel, ensemble, mean, mean,
                        (ChartSeries){CHART_MARKERS, .colour = 0});
    ensemble_add_ranges(chart, panel, ensemble, offsetof(RunStatistic, low),
                        offsetof(RunStatistic, high),
                        (ChartSeries){CHART_LINE, .colour = CHART_STRONG, .look = "mean"});
    ensemble_add_ranges(chart, panel, ensemble, offsetof(RunStatistic, q25),
                        offsetof(RunStatistic, q75),
                        (ChartSeries){CHART_LINE, .colour = CHART_STRONG, .look = "half"});
    ensemble_add_ranges(chart, panel, ensemble, offsetof(RunStatistic, minimum),
                        offsetof(RunStatistic, maximum),
                        (ChartSeries){CHART_LINE, .colour = CHART_STRONG, .look = "all"});
}

// The displacement over time, and the Sobol indices of each metric: a dot for the first and a ring
// for the total one.
static void ensemble_add_history(Chart *chart, const Ensemble *ensemble) {
    if (ensemble->displacement.count == 0)
        return;
    const RunSpectrum *history = &ensemble->displacement.at[0];
    ChartPanel *panel =
        chart_panel(chart, chart_quantity(chart, history->channel, history->unit), 200);
    const double *time = ensemble->time.at;
    panel->x.title = "time [s]";
    chart_add(panel, (ChartSeries){CHART_LINE, time, history->median.at, NULL,
                                   charts_shorter(&ensemble->time, &history->median), .colour = 0,
                                   .name = "median"});
    chart_add(panel, (ChartSeries){CHART_BAND, time, history->q16.at, history->q84.at,
                                   charts_shorter(&history->q16, &history->q84), .colour = 0});
    chart_add(panel, (ChartSeries){CHART_BAND, time, history->q05.at, history->q95.at,
                                   charts_shorter(&history->q05, &history->q95), .colour = 0});
}

static void ensemble_add_indices(Chart *chart, const Ensemble *ensemble) {
    const size_t count = ensemble->indices.count;
    if (count == 0)
        return;
    ChartPanel *panel = chart_panel(chart, "Sobol indices", 36 * STATISTICS_METRICS);
    charts_add_rows(chart, panel, STATISTICS_METRICS);
    panel->x.title = "part of the variance, alone (dot) and in all (ring)";
    double *first = chart_new(chart, count, sizeof *first),
           *total = chart_new(chart, count, sizeof *total), *y = chart_new(chart, count, sizeof *y);
    const char **names = chart_new(chart, count, sizeof *names);
    for (size_t i = 0; i < count && !chart->is_failed; i++) {
        const EnsembleIndex *index = &ensemble->indices.at[i];
        first[i] = index->sobol.first;
        total[i] = index->sobol.total;
        y[i] = -index->metric;
        names[i] = index->pointer;
    }
    // The inputs of a metric follow each other.
    size_t inputs = 1;
    while (inputs < count && ensemble->indices.at[inputs].metric == ensemble->indices.at[0].metric)
        inputs++;
    for (size_t i = 0; i < count && !chart->is_failed; i++) {
        const ChartSeries dot = {CHART_MARKERS,
                                 &first[i],
                                 &y[i],
                                 NULL,
                                 1,
                                 i % inputs % CHART_COLOURS,
                                 CHART_DOT,
                                 .names = &names[i],
                                 .legend = i < inputs ? names[i] : NULL};
        ChartSeries ring = dot;
        ring.x = &total[i];
        ring.shape = CHART_RING;
        ring.legend = NULL;
        if (panel->count + 2 <= CHART_SERIES) {
            chart_add(panel, dot);
            chart_add(panel, ring);
        }
    }
}

void chart_ensemble(const Variant *answer, Chart *chart) {
    const Ensemble *ensemble = (const Ensemble *)(const void *)answer;
    *chart = (Chart){.width = 640, .left = 160, .right = 14};
    const bool has_inputs = ensemble->inputs.count > 0;
    unsigned long long runs = 0;
    for (size_t i = 0; i < ensemble->table.count; i++)
        runs += ensemble->table.at[i].why == NULL ? 1 : 0;
    chart->title = chart_text(chart, "Mean of %llu runs", runs);
    chart->heading = has_inputs ? chart_text(chart, "Median of %llu runs, with 90 %% of them", runs)
                                : chart_text(chart, "Mean of %llu runs, with its %g %% interval",
                                             runs, 100 * ensemble->confidence);
    bytes_format(&chart->description, "%llu runs, seeds from %llu; %llu failed.",
                 (unsigned long long)ensemble->made.runs, (unsigned long long)ensemble->first_seed,
                 (unsigned long long)ensemble->made.failed);
    chart_note(chart, " Target: ", ensemble->target.why);
    bytes_format(&chart->description,
                 " %s: %g %% intervals of the mean over all seeds; boxes: half of the runs; grey "
                 "lines: all of them.%s",
                 has_inputs ? "Black lines" : "Bands and black lines", 100 * ensemble->confidence,
                 has_inputs ? " Bands: 90 % of the runs, around their median." : "");
    if (ensemble->spectra.count > 0)
        charts_add_bands(chart, chart_spectra(chart, NULL, 256), &ensemble->frequency,
                         &ensemble->spectra);
    ensemble_add_history(chart, ensemble);
    ensemble_add_statistics(chart, ensemble);
    ensemble_add_indices(chart, ensemble);
}

// --- compare ---

static void compare_add_trace(Chart *chart, ChartPanel *panel, const Comparison *comparison,
                              const CompareEntry *entry, size_t colour) {
    const size_t count = charts_shorter(&entry->trace.minimum, &entry->trace.maximum);
    double *time = chart_new(chart, count, sizeof *time);
    for (size_t i = 0; i < count && time != NULL; i++)
        time[i] = (double)i / comparison->trace_rate;
    chart_add(panel,
              (ChartSeries){CHART_LINE, time, entry->trace.minimum.at, entry->trace.maximum.at,
                            time != NULL ? count : 0, colour, .name = entry->name});
}

void chart_compare(const Variant *answer, Chart *chart) {
    const Comparison *comparison = (const Comparison *)(const void *)answer;
    *chart = (Chart){.width = 960, .left = 70, .right = 330, .title = "Contact models compared"};
    bytes_text(&chart->description, "The first is the reference, the scene as it is.");
    ChartPanel *spectra =
        chart_spectra(chart, chart_quantity(chart, comparison->channel, comparison->unit), 286);
    ChartPanel *traces = chart_panel(chart, "displacement [m]", 240);
    traces->x.title = "time [s]";
    size_t drawn = 0;
    for (size_t i = 0; i < comparison->entries.count; i++) {
        const CompareEntry *entry = &comparison->entries.at[i];
        if (entry->status != COMPARE_RUN || drawn == VARIANTS_DRAWN) {
            charts_add_undrawn(chart, entry->name, entry->why);
            continue;
        }
        const bool has_level = drawn > 0 && !isnan(entry->psd.level);
        const char *legend =
            has_level ? chart_text(chart, "%s: %.2g dB off", entry->name, entry->psd.level)
                      : entry->name;
        chart_add(spectra,
                  (ChartSeries){CHART_LINE, comparison->frequency.at, entry->density.at, NULL,
                                charts_shorter(&comparison->frequency, &entry->density), drawn,
                                .name = entry->name, .legend = legend});
        compare_add_trace(chart, traces, comparison, entry, drawn++);
    }
}

// --- sensitivity ---

// The slopes of one parameter: dots, and at the edge crosses of those that do not settle.
static void sensitivity_add_slopes(Chart *chart, ChartPanel *panel, const SensitivityRow *row,
                                   size_t colour, double shift) {
    const size_t count = row->slopes.count;
    const char *parameter = charts_words(chart, sensitivity_parameter_names[row->parameter]);
    const char **names = chart_new(chart, count, sizeof *names);
    double *x = chart_new(chart, 3 * count, sizeof *x);
    for (size_t i = 0; i < count && !chart->is_failed; i++) {
        const SensitivitySlope *slope = &row->slopes.at[i];
        const double y = shift - slope->metric, derivative = slope->derivative;
        names[i] = chart_text(chart, "%s: %.3g, spread %.2g", parameter, derivative, slope->spread);
        x[i] = slope->is_settled ? derivative : charts_edges[derivative > 0];
        x[count + i] = slope->is_settled && !isnan(derivative) ? y : (double)NAN;
        x[2 * count + i] = !slope->is_settled && !isnan(derivative) ? y : (double)NAN;
    }
    chart_add(panel, (ChartSeries){CHART_MARKERS, x, x + count, NULL, count, colour, CHART_DOT,
                                   .names = names, .legend = parameter});
    chart_add(panel, (ChartSeries){CHART_MARKERS, x, x + 2 * count, NULL, count, colour,
                                   CHART_CROSS, .names = names});
}

void chart_sensitivity(const Variant *answer, Chart *chart) {
    const Sensitivity *sensitivity = (const Sensitivity *)(const void *)answer;
    const size_t count = sensitivity->response.count;
    *chart = (Chart){.width = 760, .left = 136, .right = 14, .title = "Sensitivity"};
    bytes_format(&chart->description,
                 "Relative change of each statistic over the relative change of each parameter; "
                 "crosses at the edge do not settle. Bands: 5 to 95 %% of %llu drawn runs.",
                 (unsigned long long)(sensitivity->made - sensitivity->failed));
    chart_note(chart, " ", sensitivity->why);
    if (sensitivity->spectra.count > 0)
        charts_add_bands(chart,
                         chart_spectra(chart, "Spectra, with 5 to 95 % of the drawn runs", 286),
                         &sensitivity->frequency, &sensitivity->spectra);
    ChartPanel *panel =
        chart_panel(chart, "Relative change of the statistic over that of the parameter", 300);
    charts_add_rows(chart, panel, STATISTICS_USUAL);
    for (size_t i = 0; i < count; i++)
        sensitivity_add_slopes(chart, panel, &sensitivity->response.at[i], i,
                               0.6 * (0.5 - ((double)i + 0.5) / (double)count));
    const double *zero = charts_pair(chart, 0, 0);
    chart_add(panel,
              (ChartSeries){CHART_LINE, zero, charts_edges, .count = 2, .colour = CHART_STRONG});
}

// --- sweep ---

enum { SWEEP_COLUMNS = 560, SWEEP_DOTS = 80, SWEEP_MAP_CELLS = 48 };

// The cells of a chart: what is left of a sweep's rows. Over one axis a cell has the smallest and
// largest value of `x_group` points; a cell of a map is the first point of its group.
typedef struct SweepCells {
    const SweepAxisValues *x, *y; // y: NULL without a map
    size_t x_group, y_group, columns, rows, points;
    double *low, *high; // of one metric after the other; NAN: none
} SweepCells;

static size_t sweep_cells_group(const SweepAxisValues *axis, size_t max) {
    return (axis->values.count + max - 1) / max;
}

// The cell of a point; SIZE_MAX: none.
static size_t sweep_cells_find(const SweepCells *cells, size_t point) {
    if (cells->y == NULL)
        return point / cells->x_group;
    const size_t x = point % cells->x->values.count, y = point / cells->x->values.count;
    return x % cells->x_group == 0 && y % cells->y_group == 0
               ? y / cells->y_group * cells->columns + x / cells->x_group
               : SIZE_MAX;
}

// Reads all rows once; memory is that of the cells. False: the rows cannot be read.
static bool sweep_cells_read(SweepCells *cells, const SweepDocument *source, size_t metrics) {
    double numbers[TABLE_PIECE], values[TABLE_PIECE];
    size_t piece;
    const size_t count = cells->columns * cells->rows;
    for (size_t i = 0; i < count * metrics; i++)
        cells->low[i] = cells->high[i] = (double)NAN;
    for (size_t row = 0; row < source->rows; row += piece) {
        piece = source->rows - row < TABLE_PIECE ? source->rows - row : TABLE_PIECE;
        if (!source->read(source->context, SWEEP_CELL_POINT, row, piece, numbers))
            return false;
        if (numbers[0] >= (double)cells->points) // the other axes leave their first values
            break;
        for (size_t metric = 0; metric < metrics; metric++) {
            if (!source->read(source->context, SWEEP_CELL_METRIC + metric, row, piece, values))
                return false;
            for (size_t i = 0; i < piece && numbers[i] < (double)cells->points; i++) {
                const size_t cell = sweep_cells_find(cells, (size_t)numbers[i]);
                if (cell >= count || !isfinite(values[i]))
                    continue;
                double *low = &cells->low[metric * count + cell];
                double *high = &cells->high[metric * count + cell];
                *low = fmin(*low, values[i]); // of a NAN: the value
                *high = fmax(*high, values[i]);
            }
        }
    }
    return true;
}

static bool sweep_is_number(const char *json) {
    return *json == '-' || (*json >= '0' && *json <= '9');
}

// Labels at some values of an axis, each of which is a place: short, without quotes.
static void sweep_add_ticks(Chart *chart, ChartAxis *axis, const Texts *values, size_t group) {
    const size_t places = (values->count + group - 1) / group;
    const size_t ticks = places < CHART_TICKS ? places : CHART_TICKS;
    for (size_t i = 0; i < ticks; i++) {
        const size_t place = ticks > 1 ? i * (places - 1) / (ticks - 1) : 0;
        const char *json = values->at[place * group];
        char text[18];
        if (*json == '"')
            json = chart_text(chart, "%.*s", (int)strlen(json) - 2, json + 1);
        else if (sweep_is_number(json))
            json = chart_text(chart, "%.4g", strtod(json, NULL));
        text_fit(text, sizeof text, json);
        axis->ticks[axis->tick_count++] =
            (ChartTick){(double)place, chart_text(chart, "%s", text), NULL};
    }
}

// The axis of one of the sweep's axes, and the place of each cell on it: to scale where all values
// are numbers and it is no map's, else one after the other.
static ChartAxis sweep_axis(Chart *chart, const SweepAxisValues *values, size_t group,
                            double *places) {
    const Texts *texts = &values->values;
    ChartAxis axis = {.title = chart_quantity(chart, values->pointer, values->unit)};
    double min = (double)INFINITY, max = -min;
    bool is_numeric = places != NULL;
    for (size_t i = 0; i < texts->count && is_numeric; i++) {
        const double value = strtod(texts->at[i], NULL);
        is_numeric = sweep_is_number(texts->at[i]);
        min = fmin(min, value);
        max = fmax(max, value);
    }
    for (size_t i = 0; i * group < texts->count && places != NULL; i++)
        places[i] = is_numeric ? strtod(texts->at[i * group], NULL) : (double)i;
    if (!is_numeric)
        sweep_add_ticks(chart, &axis, texts, group);
    axis.is_logarithmic = is_numeric && min > 0 && max > 30 * min;
    return axis;
}

static void sweep_add_notes(Chart *chart, const SweepDocument *source, size_t metrics,
                            bool is_map) {
    const Sweep *sweep = source->sweep;
    const unsigned long long points = sweep->points, failed = sweep->table.failed;
    bytes_format(&chart->description,
                 "%zu of %llu points, %llu failed. Gaps and grey cells: not there.", source->rows,
                 points, failed);
    for (size_t i = 0; is_map && i + 2 < sweep->axes.count; i++)
        chart_note(chart, " Drawn at the first value of ", sweep->axes.at[i].pointer);
    for (size_t i = metrics; i < sweep->metrics.count; i++)
        charts_add_undrawn(chart, sweep->metrics.at[i], NULL);
    chart->title = chart_text(chart, "A sweep of %llu points", points);
    chart->heading =
        chart_text(chart, "%s%llu points%s",
                   source->rows < sweep->points ? chart_text(chart, "%zu of ", source->rows) : "",
                   points, failed > 0 ? chart_text(chart, ", %llu failed", failed) : "");
}

// A panel for each metric.
static void sweep_add_panels(Chart *chart, const Sweep *sweep, const SweepCells *cells,
                             size_t metrics, double *x) {
    const size_t count = cells->columns * cells->rows;
    const bool is_map = cells->y != NULL;
    const ChartAxis axis = sweep_axis(chart, cells->x, cells->x_group, is_map ? NULL : x);
    for (size_t i = 0; i < metrics; i++) {
        const char *name = sweep->metrics.at[i];
        const double *low = cells->low + i * count;
        ChartPanel *panel = chart_panel(
            chart, chart_quantity(chart, charts_words(chart, name), sweep_metric_unit(name)),
            is_map ? 180 : 110);
        panel->x = axis;
        panel->x.is_unlabelled = i + 1 < metrics;
        if (is_map) {
            panel->y = sweep_axis(chart, cells->y, cells->y_group, NULL);
            chart_add(panel, (ChartSeries){CHART_MAP, .y = low, .count = count,
                                           .columns = cells->columns});
            continue;
        }
        if (count <= SWEEP_DOTS || axis.tick_count > 0)
            chart_add(panel, (ChartSeries){CHART_MARKERS, x, low, .count = count});
        if (axis.tick_count == 0)
            chart_add(panel, (ChartSeries){CHART_LINE, x, low, .count = count,
                                           .high = cells->high + i * count});
    }
    if (is_map)
        chart->heading = chart_text(chart, "%s, upwards: %s", chart->heading,
                                    chart_quantity(chart, cells->y->pointer, cells->y->unit));
}

bool chart_sweep(const SweepDocument *source, Chart *chart) {
    const Sweep *sweep = source->sweep;
    const bool is_map = sweep->axes.count > 1 && sweep->mode == SWEEP_GRID;
    const size_t metrics =
        sweep->metrics.count < CHART_PANELS ? sweep->metrics.count : CHART_PANELS;
    const SweepAxisValues *last = &sweep->axes.at[sweep->axes.count - 1];
    SweepCells cells = {.x = is_map ? last : &sweep->axes.at[0], .rows = 1};
    cells.x_group = sweep_cells_group(cells.x, is_map ? SWEEP_MAP_CELLS : SWEEP_COLUMNS);
    cells.columns = (cells.x->values.count + cells.x_group - 1) / cells.x_group;
    cells.points = cells.x->values.count;
    if (is_map) { // of more axes the last two, the others at their first values
        cells.y = last - 1;
        cells.y_group = sweep_cells_group(cells.y, SWEEP_MAP_CELLS);
        cells.rows = (cells.y->values.count + cells.y_group - 1) / cells.y_group;
        cells.points *= cells.y->values.count;
    }
    *chart = (Chart){.width = 640, .left = is_map ? 128 : 88, .right = is_map ? 100 : 18};
    const size_t count = cells.columns * cells.rows;
    cells.low = chart_new(chart, count * metrics, sizeof *cells.low);
    cells.high = chart_new(chart, count * metrics, sizeof *cells.high);
    double *x = chart_new(chart, count, sizeof *x);
    const bool is_read = chart->is_failed || sweep_cells_read(&cells, source, metrics);
    sweep_add_notes(chart, source, metrics, is_map);
    if (!chart->is_failed)
        sweep_add_panels(chart, sweep, &cells, metrics, x);
    return is_read;
}

// --- evaluation ---

typedef struct EvaluationValue {
    double value;
    bool counts, is_outlier;
} EvaluationValue;

static EvaluationValue evaluation_value(const EvaluationRow *row, bool is_time) {
    return is_time ? (EvaluationValue){row->contact_time, row->contact_time_counts,
                                       row->contact_time_is_outlier}
                   : (EvaluationValue){row->restitution, row->restitution_counts,
                                       row->restitution_is_outlier};
}

static const char *evaluation_name(Chart *chart, const EvaluationRow *row, EvaluationValue value) {
    const char *measurement =
        row->measurement != COUNT_ABSENT
            ? chart_text(chart, "measurement %llu, ", (unsigned long long)row->measurement)
            : "";
    return chart_text(chart, "%s%s: %.4g%s%s%s", measurement, row->from, value.value,
                      value.is_outlier ? ", an outlier that counts" : "",
                      row->excluded != NULL ? ", excluded: " : "",
                      row->excluded != NULL ? row->excluded : "");
}

// The readings that count, the others as crosses, and rings about outliers.
static void evaluation_add_readings(Chart *chart, ChartPanel *panel, const Evaluation *evaluation,
                                    bool is_time) {
    static const ChartShape shapes[] = {CHART_DOT, CHART_CROSS, CHART_RING};
    const EvaluationRows *rows = &evaluation->rows;
    const size_t count = rows->count < READINGS_DRAWN ? rows->count : READINGS_DRAWN;
    double *x = chart_new(chart, 4 * count, sizeof *x);
    const char **names = chart_new(chart, count, sizeof *names);
    for (size_t i = 0; i < count && !chart->is_failed; i++) {
        const EvaluationValue value = evaluation_value(&rows->at[i], is_time);
        const double speed = rows->at[i].approach_speed;
        x[i] = isnan(speed) ? charts_edges[0] : speed;
        x[count + i] = value.counts ? value.value : (double)NAN;
        x[2 * count + i] = value.counts ? (double)NAN : value.value;
        x[3 * count + i] = value.is_outlier ? value.value : (double)NAN;
        names[i] = evaluation_name(chart, &rows->at[i], value);
    }
    for (size_t i = 0; i < COUNT(shapes) && !chart->is_failed; i++) {
        const bool is_ring = shapes[i] == CHART_RING;
        chart_add(panel,
                  (ChartSeries){CHART_MARKERS, x, x + (i + 1) * count, NULL, count, is_ring ? 3 : 0,
                                shapes[i], .look = is_ring ? "ring" : NULL, .names = names});
    }
}

static void evaluation_add_mean(Chart *chart, ChartPanel *panel, const Statistic *statistic) {
    const Trend *trend = &statistic->trend;
    const double from = trend->least_speed, to = trend->most_speed, mean = statistic->mean;
    const double low = statistic->low, high = statistic->high;
    if (trend->verdict == TREND_NOT_CONSTANT) {
        const double *y =
            charts_pair(chart, trend->mean_value + trend->slope * (from - trend->mean_speed),
                        trend->mean_value + trend->slope * (to - trend->mean_speed));
        chart_add(panel, (ChartSeries){CHART_LINE, charts_pair(chart, from, to), y, NULL, 2, 1,
                                       .name = chart_text(chart, "%.3g per m/s", trend->slope),
                                       .look = "trend"});
    }
    if (isnan(mean))
        return;
    chart_add(panel, (ChartSeries){CHART_LINE, charts_edges, charts_pair(chart, mean, mean), NULL,
                                   2, 0, .name = chart_text(chart, "mean %.4g", mean)});
    if (!isnan(low))
        chart_add(panel, (ChartSeries){CHART_BAND, charts_edges, charts_pair(chart, low, low),
                                       charts_pair(chart, high, high), 2, .colour = 0});
}

static void evaluation_add_panel(Chart *chart, const Evaluation *evaluation, bool is_time) {
    const Statistic *statistic = is_time ? &evaluation->contact_time : &evaluation->restitution;
    const char *name = is_time ? "Contact time T_c" : "Restitution e", *unit = is_time ? " s" : "";
    const char *interval = isnan(statistic->low) ? ""
                                                 : chart_text(chart, ", 95 %% within %.4g to %.4g",
                                                              statistic->low, statistic->high);
    const char *heading = statistic->count == 0 ? chart_text(chart, "%s: not known", name)
                                                : chart_text(chart, "%s: %.4g%s%s, %llu reading%s",
                                                             name, statistic->mean, unit, interval,
                                                             (unsigned long long)statistic->count,
                                                             statistic->count == 1 ? "" : "s");
    ChartPanel *panel = chart_panel(chart, heading, 230);
    panel->x.title = "approach speed [m/s]";
    evaluation_add_readings(chart, panel, evaluation, is_time);
    evaluation_add_mean(chart, panel, statistic);
}

void chart_evaluation(const Evaluation *evaluation, const char *slug, Bytes *bytes) {
    Chart chart = {.width = 680, .left = 78, .right = 16};
    chart.title = chart_text(&chart, "Drop tests of %.63s", slug);
    bytes_text(&chart.description,
               "Dots: readings that count; rings: outliers, which count; crosses: readings that do "
               "not. Band: 95 % interval of the mean.");
    chart_note(&chart, " ", evaluation->restitution.trend.detail);
    chart_note(&chart, " ", evaluation->contact_time.trend.detail);
    evaluation_add_panel(&chart, evaluation, false);
    evaluation_add_panel(&chart, evaluation, true);
    chart_write(&chart, bytes);
}

// --- response spectrum ---

void chart_response_spectrum(const char *record, double damping_ratio, const Columns *columns,
                             Bytes *bytes) {
    Chart chart = {.width = 760, .left = 80, .right = 14, .title = "Response spectrum"};
    chart.heading =
        chart_text(&chart, "Response spectrum of %s, damping ratio %g", record, damping_ratio);
    for (size_t i = columns->count; i-- > 1;) {
        const Column *column = &columns->at[i];
        const char *name = chart_quantity(&chart, charts_words(&chart, column->name), column->unit);
        ChartPanel *panel = chart_panel(&chart, name, 180);
        panel->x.is_logarithmic = panel->y.is_logarithmic = true;
        panel->x.is_unlabelled = i > 1;
        panel->x.title = chart_quantity(&chart, columns->at[0].name, columns->at[0].unit);
        chart_add(panel, (ChartSeries){CHART_LINE, columns->at[0].values, column->values, NULL,
                                       columns->rows, 0, .name = column->name});
    }
    chart_write(&chart, bytes);
}

// --- series and spectra ---

enum { SVG_POINTS = 800 }; // of a line over time

// The columns of one line: the same one twice, or the minima and the maxima of buckets.
static const Column *svg_column(const Table *table, size_t line, bool is_high) {
    return table->columns[table->bucket > 0 ? 2 * line + is_high : line];
}

// The panel with that unit that has room, or a new one; NULL: none.
static ChartPanel *svg_find_panel(Chart *chart, const char *units[CHART_PANELS], const char *unit) {
    size_t i = 0;
    while (i < chart->count && strcmp(units[i], unit) != 0)
        i++;
    if (i == CHART_PANELS || (i < chart->count && chart->panels[i].count == CHART_COLOURS))
        return NULL;
    units[i] = unit;
    return i < chart->count ? &chart->panels[i] : chart_panel(chart, NULL, 150);
}

// The minimum and the maximum of each part of the rows, so that no peak is lost.
static void svg_thin(const Table *table, size_t line, size_t part, double *low, double *high) {
    const double *minima = table_values(table, svg_column(table, line, false)->values);
    const double *maxima = table_values(table, svg_column(table, line, true)->values);
    double other;
    for (size_t i = 0; i * part < table->count; i++) {
        const size_t left = table->count - i * part, count = left < part ? left : part;
        downsample_extremes(minima + i * part, count, &low[i], &other);
        downsample_extremes(maxima + i * part, count, &other, &high[i]);
    }
}

// Headings and legends of panels below each other over one axis of time.
static void svg_name_panels(Chart *chart, const Table *table, const char *const *units) {
    const char *axis = table->axis_name != NULL
                           ? chart_quantity(chart, table->axis_name, table->axis_unit)
                           : "row [1]";
    for (size_t i = 0; i < chart->count; i++) {
        ChartPanel *panel = &chart->panels[i];
        char names[100] = "";
        panel->height = chart->count > 1 ? 150 : 300;
        panel->x.is_unlabelled = i + 1 < chart->count;
        panel->x.title = axis;
        for (size_t k = 0; k < panel->count; k++) {
            text_list(names, sizeof names, panel->series[k].name);
            panel->series[k].legend = panel->count > 1 ? panel->series[k].name : NULL;
        }
        panel->heading = chart_quantity(chart, names, units[i]);
        if (panel->count > 1)
            chart->right = 210;
    }
}

static void svg_add_series(Chart *chart, const Table *table) {
    const char *units[CHART_PANELS];
    const size_t part = (table->count + SVG_POINTS - 1) / SVG_POINTS + (table->count == 0);
    const size_t points = (table->count + part - 1) / part;
    const size_t lines = table->bucket > 0 ? table->column_count / 2 : table->column_count;
    double *x = chart_new(chart, points, sizeof *x);
    for (size_t i = 0; i < points && x != NULL; i++)
        x[i] = table->axis != NULL ? table_values(table, table->axis)[i * part]
                                   : table_time(table, i * part);
    for (size_t i = 0; i < lines; i++) {
        const Column *column = svg_column(table, i, false);
        ChartPanel *panel = svg_find_panel(chart, units, column->unit);
        const size_t length = strlen(column->name) - (table->bucket > 0 ? strlen("_min") : 0);
        const char *name = chart_text(chart, "%.*s", (int)length, column->name);
        double *low = panel != NULL ? chart_new(chart, 2 * points, sizeof *low) : NULL;
        if (low == NULL) {
            charts_add_undrawn(chart, name, NULL);
            continue;
        }
        svg_thin(table, i, part, low, low + points);
        chart_add(panel, (ChartSeries){CHART_LINE, x, low, low + points, points, panel->count,
                                       .name = name});
    }
    svg_name_panels(chart, table, units);
}

static void svg_add_spectra(Chart *chart, const Table *table) {
    ChartPanel *panel = chart_spectra(chart, NULL, 380);
    for (size_t i = 0; i < table->column_count; i++) {
        const Column *column = table->columns[i];
        if (i >= CHART_COLOURS)
            charts_add_undrawn(chart, column->name, NULL);
        else
            chart_add(panel,
                      (ChartSeries){CHART_LINE, table_values(table, table->axis),
                                    table_values(table, column->values), NULL, table->count, i,
                                    .name = column->name,
                                    .legend = chart_quantity(chart, column->name, column->unit)});
    }
}

void chart_table(const Table *table, Chart *chart) {
    const bool is_spectra = table->axis_name != NULL && strcmp(table->axis_name, "frequency") == 0;
    *chart = (Chart){.width = 960, .left = 70, .right = 14};
    chart->title = is_spectra ? "Power spectral densities" : "Time series";
    if (is_spectra)
        svg_add_spectra(chart, table);
    else
        svg_add_series(chart, table);
}

// In one piece: its size is limited.
static bool svg_next(const Table *table, TextPlace *place, Bytes *bytes) {
    Chart chart;
    (void)place;
    chart_table(table, &chart);
    chart_write(&chart, bytes);
    return false;
}

const TableFormat format_svg = {
    .extension = "svg",
    .content_type = "image/svg+xml",
    .is_binary = false,
    .next = svg_next,
};
