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

const char chart_type[] = "image/svg+xml";

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
static void charts_add_undrawn(Chart *chart, const char *name, const char *before,
                               const char *why) {
    bytes_text(&chart->description, " Not drawn: ");
    chart_escape(&chart->description, name);
    chart_note(chart, before, why);
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
                             const RunSpectra *spectra, bool has_mean) {
    for (size_t i = SPECTRA_DRAWN; i < spectra->count; i++)
        chart_note(chart, " Not drawn: ", spectra->at[i].channel);
    for (size_t i = 0; i < spectra->count && i < SPECTRA_DRAWN; i++) {
        const RunSpectrum *spectrum = &spectra->at[i];
        const Reals *value = has_mean ? &spectrum->mean : &spectrum->value;
        const Reals *low = has_mean ? &spectrum->low : &spectrum->q05;
        const Reals *high = has_mean ? &spectrum->high : &spectrum->q95;
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

// --- tradeoff ---

// A point that is drawn, with its group: a solver, or a setting that is given up.
typedef struct TradeoffMark {
    const TradeoffPoint *point;
    int metric;
    double error;
    size_t group;
} TradeoffMark;

static const char *tradeoff_group(const TradeoffPoint *point) {
    return point->contact_model != NULL     ? point->contact_model
           : !isnan(point->sample_rate)     ? "fewer samples"
           : point->modes != COUNT_ABSENT   ? "fewer modes"
           : point->segment != COUNT_ABSENT ? "shorter segments"
           : !isnan(point->duration)        ? "shorter run"
                                            : point->solver;
}

static void tradeoff_describe(const void *context, size_t index, Bytes *bytes) {
    const TradeoffMark *mark = (const TradeoffMark *)context + index;
    chart_escape(bytes, mark->point->name);
    bytes_format(bytes, ": %.2g%s in %.3g s%s", mark->error, metric_units[mark->metric],
                 mark->point->cpu_minimum,
                 mark->point->is_best ? ", none is cheaper and closer" : "");
}

static int tradeoff_compare(const void *a, const void *b) {
    const TradeoffMark *x = a, *y = b;
    const double first = x->point->cpu_minimum, second = y->point->cpu_minimum;
    return first != second ? (first > second) - (first < second)
                           : (x->point > y->point) - (x->point < y->point);
}

// The points that are drawn, by CPU time; the others are named in the description.
static size_t tradeoff_list(Chart *chart, const Tradeoff *tradeoff, TradeoffMark *marks,
                            const char *groups[CHART_COLOURS]) {
    size_t count = 0, group_count = 0;
    for (size_t i = 0; i < tradeoff->points.count; i++) {
        const TradeoffPoint *point = &tradeoff->points.at[i];
        const double error = error_metrics_by(&point->errors, tradeoff->metric);
        if (point->status != TRADEOFF_MEASURED || !(point->cpu_minimum > 0) || isnan(error)) {
            charts_add_undrawn(chart, point->name, point->why != NULL ? ", because: " : "",
                               point->why != NULL ? point->why : ", whose error is unknown");
            continue;
        }
        size_t group = 0;
        while (group < group_count && strcmp(groups[group], tradeoff_group(point)) != 0)
            group++;
        if (group == CHART_COLOURS)
            group--; // more groups than colours share the last one
        else if (group == group_count)
            groups[group_count++] = tradeoff_group(point);
        marks[count++] = (TradeoffMark){point, tradeoff->metric, error, group};
    }
    qsort(marks, count, sizeof *marks, tradeoff_compare);
    return count;
}

// The Pareto front as steps: from each of its points horizontally to the CPU time of the next one.
static void tradeoff_add_best(Chart *chart, ChartPanel *panel, const TradeoffMark *marks,
                              size_t count) {
    double *x = chart_new(chart, 2 * count + 1, sizeof *x);
    double *y = chart_new(chart, 2 * count + 1, sizeof *y);
    size_t steps = 0;
    for (size_t i = 0; i < count && !chart->is_failed; i++)
        if (marks[i].point->is_best) {
            x[steps] = x[steps + 1] = marks[i].point->cpu_minimum;
            y[steps] = steps > 0 ? y[steps - 1] : marks[i].error;
            y[steps + 1] = marks[i].error;
            steps += 2;
        }
    if (steps > 0) {
        x[steps] = charts_edges[1];
        y[steps] = y[steps - 1];
        steps++;
    }
    chart_add(panel, (ChartSeries){CHART_LINE, x, y, y, steps, CHART_STRONG, .look = "best",
                                   .legend = "best of all"});
}

// The errors are those of all points; each series has the CPU times of its own.
static void tradeoff_fill(Chart *chart, ChartPanel *panel, const Tradeoff *tradeoff) {
    enum { CHOICE = CHART_COLOURS, LISTS };
    TradeoffMark *marks = chart_new(chart, tradeoff->points.count, sizeof *marks);
    double *x = chart_new(chart, LISTS * tradeoff->points.count, sizeof *x);
    double *y = chart_new(chart, tradeoff->points.count, sizeof *y);
    const char *groups[CHART_COLOURS] = {NULL};
    if (chart->is_failed)
        return;
    const size_t count = tradeoff_list(chart, tradeoff, marks, groups);
    for (size_t i = 0; i < count; i++) {
        const TradeoffPoint *point = marks[i].point;
        const uint64_t number = (uint64_t)(point - tradeoff->points.at) + 1;
        y[i] = marks[i].error;
        for (size_t list = 0; list < LISTS; list++)
            x[list * count + i] =
                (list == CHOICE ? number == tradeoff->recommendation.point : list == marks[i].group)
                    ? point->cpu_minimum
                    : (double)NAN;
    }
    for (size_t group = 0; group < CHART_COLOURS && groups[group] != NULL; group++)
        chart_add(panel, (ChartSeries){CHART_MARKERS, x + group * count, y, NULL, count, group,
                                       .is_joined = true, .legend = groups[group],
                                       .describe = tradeoff_describe, .context = marks});
    tradeoff_add_best(chart, panel, marks, count);
    const double *wanted = charts_pair(chart, tradeoff->error, tradeoff->error);
    if (tradeoff->error > 0)
        chart_add(panel,
                  (ChartSeries){CHART_LINE, charts_edges, wanted, NULL, 2, CHART_STRONG,
                                .look = "wanted",
                                .legend = chart_text(chart, "wanted: %.3g%s", tradeoff->error,
                                                     metric_units[tradeoff->metric])});
    chart_add(panel, (ChartSeries){CHART_MARKERS, x + CHOICE * count, y, NULL, count, CHART_STRONG,
                                   CHART_RING, .look = "ring", .legend = "to take"});
}

void chart_tradeoff(const Variant *answer, Bytes *bytes) {
    const Tradeoff *tradeoff = (const Tradeoff *)(const void *)answer;
    Chart chart = {.width = 640, .height = 430, .left = 62};
    const char *metric = charts_words(&chart, metric_names[tradeoff->metric]);
    chart.title = chart_text(&chart, "Error of %s against CPU time", metric);
    chart.heading =
        chart_text(&chart, "Error of %s%s", metric, tradeoff->metric == METRIC_PSD ? " [dB]" : "");
    chart_note(&chart, "", tradeoff->recommendation.why);
    ChartPanel *panel = chart_panel(&chart, NULL, 62, 486, 44, 376);
    panel->has_side_legend = true;
    panel->x.is_logarithmic = panel->y.is_logarithmic = panel->x.is_whole = true;
    panel->y.has_zero = true;
    panel->x.title = "CPU time of a run [s]";
    tradeoff_fill(&chart, panel, tradeoff);
    chart_write(&chart, bytes);
}

// --- ensemble ---

static ChartRow ensemble_row(Chart *chart, int metric, const RunStatistic *statistic) {
    const double mean = statistic->mean;
    const bool has_unit = statistic->unit != NULL && strcmp(statistic->unit, "1") != 0;
    ChartRow row = {.label = charts_words(chart, statistics_metric_names[metric]),
                    .has_interval = mean > 0 && isfinite(mean) && statistic->count > 1};
    if (row.has_interval) // in units of the mean
        row.interval = (ChartInterval){
            statistic->minimum / mean, statistic->q25 / mean, statistic->low / mean,    1,
            statistic->high / mean,    statistic->q75 / mean, statistic->maximum / mean};
    const char *half =
        isnan(statistic->high) ? "" : chart_text(chart, " \u00b1 %.2g", statistic->high - mean);
    row.cells[0].text = isnan(mean)
                            ? "not known"
                            : chart_text(chart, "%.4g%s%s%s", mean, half, has_unit ? " " : "",
                                         has_unit ? statistic->unit : "");
    return row;
}

void chart_ensemble(const Variant *answer, Bytes *bytes) {
    const Ensemble *ensemble = (const Ensemble *)(const void *)answer;
    Chart chart = {.width = 640, .left = 62};
    const unsigned long long runs = ensemble->made - ensemble->failed;
    chart.title = chart_text(&chart, "Mean of %llu runs", runs);
    chart.heading = chart_text(&chart, "Mean of %llu runs, with its %g %% interval", runs,
                               100 * ensemble->confidence);
    bytes_format(&chart.description, "%llu runs of %llu, seeds from %llu; %llu failed.",
                 (unsigned long long)ensemble->made, (unsigned long long)ensemble->runs,
                 (unsigned long long)ensemble->first_seed, (unsigned long long)ensemble->failed);
    chart_note(&chart, " Target: ", ensemble->target.why);
    bytes_format(&chart.description,
                 " Bands and whiskers: %g %% intervals of the mean over all seeds; boxes: half of "
                 "the runs; grey lines: all of them.",
                 100 * ensemble->confidence);
    ChartPanel *panel = chart_spectra(&chart, NULL, 62, 626, 44, 300);
    charts_add_bands(&chart, panel, &ensemble->frequency, &ensemble->spectra, true);
    ChartTable *table = &chart.table;
    table->top = chart_fit(panel) ? 362 : 56;
    table->label_right = 190;
    table->interval_width = 280;
    table->row_height = 24;
    table->rows_count = STATISTICS_METRICS;
    table->columns_count = 1;
    for (int metric = 0; metric < STATISTICS_METRICS; metric++)
        table->rows[metric] = ensemble_row(&chart, metric, &ensemble->statistics.of[metric]);
    chart.height = table->top + table->row_height * STATISTICS_METRICS + 12;
    chart_write(&chart, bytes);
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

void chart_compare(const Variant *answer, Bytes *bytes) {
    const Comparison *comparison = (const Comparison *)(const void *)answer;
    Chart chart = {.width = 960, .height = 690, .left = 70, .title = "Contact models compared"};
    bytes_text(&chart.description, "The first is the reference, the scene as it is.");
    ChartPanel *spectra = chart_spectra(
        &chart, chart_quantity(&chart, comparison->channel, comparison->unit), 70, 630, 44, 330);
    ChartPanel *traces = chart_panel(&chart, "displacement [m]", 70, 630, 404, 644);
    spectra->has_side_legend = true;
    traces->x.title = "time [s]";
    size_t drawn = 0;
    for (size_t i = 0; i < comparison->entries.count; i++) {
        const CompareEntry *entry = &comparison->entries.at[i];
        if (entry->status != COMPARE_RUN || drawn == VARIANTS_DRAWN) {
            charts_add_undrawn(&chart, entry->name, entry->why != NULL ? ": " : "",
                               entry->why != NULL ? entry->why : "");
            continue;
        }
        const bool has_level = drawn > 0 && !isnan(entry->psd.level);
        const char *legend =
            has_level ? chart_text(&chart, "%s: %.2g dB off", entry->name, entry->psd.level)
                      : entry->name;
        chart_add(spectra,
                  (ChartSeries){CHART_LINE, comparison->frequency.at, entry->density.at, NULL,
                                charts_shorter(&comparison->frequency, &entry->density), drawn,
                                .name = entry->name, .legend = legend});
        compare_add_trace(&chart, traces, comparison, entry, drawn++);
    }
    chart_write(&chart, bytes);
}

// --- sensitivity ---

// "DERIVATIVE", or in grey "DERIVATIVE (SPREAD)" where it does not settle.
static const char *sensitivity_cell(Chart *chart, const SensitivitySlope *slope) {
    const char *spread = "";
    if (!slope->is_settled && !isnan(slope->spread))
        spread = slope->spread < 10 ? chart_text(chart, " (%.1g)", slope->spread)
                                    : chart_text(chart, " (%.4g)", rint(slope->spread));
    return isnan(slope->derivative) ? chart_text(chart, "not known%s", spread)
                                    : chart_text(chart, "%.2g%s", slope->derivative, spread);
}

// The first row has the parameters.
static void sensitivity_fill_table(Chart *chart, const Sensitivity *sensitivity, double top) {
    ChartTable *table = &chart->table;
    table->heading = "Relative change of the statistic over that of the parameter";
    table->note = "grey: does not settle, its spread in brackets";
    table->top = top;
    table->label_right = 160;
    table->column_width = 98;
    table->row_height = 22;
    table->rows_count = STATISTICS_METRICS + 1;
    for (int metric = 0; metric < STATISTICS_METRICS; metric++)
        table->rows[metric + 1].label = charts_words(chart, statistics_metric_names[metric]);
    for (size_t i = 0; i < sensitivity->response.count && i < CHART_CELLS; i++) {
        const SensitivityRow *row = &sensitivity->response.at[i];
        table->rows[0].cells[i].text =
            charts_words(chart, sensitivity_parameter_names[row->parameter]);
        for (size_t k = 0; k < row->slopes.count; k++) {
            const SensitivitySlope *slope = &row->slopes.at[k];
            ChartRow *of = &table->rows[slope->metric + 1];
            of->cells[i].text = sensitivity_cell(chart, slope);
            of->cells[i].is_faint = !slope->is_settled;
        }
        table->columns_count++;
    }
}

void chart_sensitivity(const Variant *answer, Bytes *bytes) {
    const Sensitivity *sensitivity = (const Sensitivity *)(const void *)answer;
    Chart chart = {.width = 760, .left = 70, .title = "Sensitivity"};
    bytes_format(&chart.description,
                 "Relative change of each statistic over the relative change of each parameter; "
                 "grey ones do not settle, their spread is in brackets. Bands: 5 to 95 %% of %llu "
                 "drawn runs.",
                 (unsigned long long)(sensitivity->made - sensitivity->failed));
    chart_note(&chart, " ", sensitivity->why);
    ChartPanel *panel = chart_spectra(&chart, NULL, 70, 746, 44, 330);
    charts_add_bands(&chart, panel, &sensitivity->frequency, &sensitivity->spectra, false);
    const bool has_spectra = chart_fit(panel);
    panel->heading = has_spectra ? "Spectra, with 5 to 95 % of the drawn runs" : NULL;
    sensitivity_fill_table(&chart, sensitivity, has_spectra ? 416 : 50);
    chart.height = chart.table.top + 22 * (STATISTICS_METRICS + 2) + 14;
    chart_write(&chart, bytes);
}

// --- sweep ---

enum { SWEEP_COLUMNS = 560, SWEEP_DOTS = 80, SWEEP_MAP_CELLS = 48 };

// The cells of a chart: what is left of a sweep's rows. Of one axis each cell has `group` points;
// of a map, cells are values of both axes that are evenly spread.
typedef struct SweepCells {
    const SweepAxisValues *x, *y; // y: NULL without a map
    size_t columns, rows, group, points;
    double *low, *high; // of one metric after the other; NAN: none
    double *failed;     // of rows without a value: the lower edge of the panel
} SweepCells;

static size_t sweep_cells_index(size_t cell, size_t cells, size_t count) {
    return cells > 1 ? (size_t)((double)cell * (double)(count - 1) / (double)(cells - 1) + 0.5) : 0;
}

// The cell of value `index` of an axis; SIZE_MAX: none.
static size_t sweep_cells_find(size_t index, size_t cells, size_t count) {
    const size_t cell =
        count > 1 ? (size_t)((double)index * (double)(cells - 1) / (double)(count - 1) + 0.5) : 0;
    return sweep_cells_index(cell, cells, count) == index ? cell : SIZE_MAX;
}

static size_t sweep_cell(const SweepCells *cells, double number) {
    if (!(number < (double)cells->points))
        return SIZE_MAX;
    const size_t point = (size_t)number, wide = cells->x->values.count;
    if (cells->y == NULL)
        return point / cells->group;
    const size_t x = sweep_cells_find(point % wide, cells->columns, wide);
    const size_t y = sweep_cells_find(point / wide, cells->rows, cells->y->values.count);
    return x == SIZE_MAX || y == SIZE_MAX ? SIZE_MAX : y * cells->columns + x;
}

// Reads all rows once; memory is that of the cells. False: the rows cannot be read.
static bool sweep_cells_read(SweepCells *cells, const SweepDocument *source, size_t metrics) {
    double numbers[TABLE_PIECE], values[TABLE_PIECE];
    size_t places[TABLE_PIECE], piece;
    const size_t count = cells->columns * cells->rows;
    for (size_t i = 0; i < count * metrics; i++)
        cells->low[i] = cells->high[i] = cells->failed[i] = (double)NAN;
    for (size_t row = 0; row < source->rows; row += piece) {
        piece = source->rows - row < TABLE_PIECE ? source->rows - row : TABLE_PIECE;
        if (!source->read(source->context, SWEEP_CELL_POINT, row, piece, numbers))
            return false;
        if (numbers[0] >= (double)cells->points) // the other axes leave their first values
            break;
        for (size_t i = 0; i < piece; i++)
            places[i] = sweep_cell(cells, numbers[i]);
        for (size_t metric = 0; metric < metrics; metric++) {
            if (!source->read(source->context, SWEEP_CELL_METRIC + metric, row, piece, values))
                return false;
            for (size_t i = 0; i < piece; i++) {
                const size_t at = metric * count + places[i];
                if (places[i] < count && isfinite(values[i])) {
                    cells->low[at] = fmin(cells->low[at], values[i]); // of a NAN: the value
                    cells->high[at] = fmax(cells->high[at], values[i]);
                } else if (places[i] < count && cells->group == 1) {
                    cells->failed[at] = charts_edges[0];
                }
            }
        }
    }
    return true;
}

static bool sweep_is_number(const char *json) {
    return *json == '-' || (*json >= '0' && *json <= '9');
}

// A tick at a scalar of an axis: without quotes, short.
static void sweep_add_tick(Chart *chart, ChartAxis *axis, double value, const char *json) {
    char text[18];
    if (*json == '"')
        json = chart_text(chart, "%.*s", (int)strlen(json) - 2, json + 1);
    else if (sweep_is_number(json))
        json = chart_text(chart, "%.4g", strtod(json, NULL));
    text_fit(text, sizeof text, json);
    axis->ticks[axis->tick_count++] = (ChartTick){value, chart_text(chart, "%s", text)};
}

static ChartAxis sweep_end_ticks(Chart *chart, const Texts *values) {
    ChartAxis axis = {.tick_count = 0};
    sweep_add_tick(chart, &axis, 0, values->at[0]);
    sweep_add_tick(chart, &axis, 1, values->at[values->count - 1]);
    return axis;
}

// The places of the cells along the axis: to scale where all values are numbers, else evenly.
static bool sweep_places(Chart *chart, const SweepCells *cells, double *x, ChartAxis *axis) {
    const Texts *values = &cells->x->values;
    double min = (double)INFINITY, max = -min;
    bool is_numeric = true;
    for (size_t i = 0; i < values->count && is_numeric; i++) {
        const double value = strtod(values->at[i], NULL);
        is_numeric = sweep_is_number(values->at[i]);
        min = fmin(min, value);
        max = fmax(max, value);
    }
    for (size_t i = 0; i < cells->columns; i++)
        x[i] = is_numeric ? strtod(values->at[i * cells->group], NULL) : (double)(i * cells->group);
    axis->is_logarithmic = is_numeric && min > 0 && max > 30 * min;
    axis->padding = is_numeric ? 0.015 : 0.08; // room for half a word
    const size_t ticks = values->count < CHART_TICKS ? values->count : CHART_TICKS;
    for (size_t i = 0; i < ticks && !is_numeric; i++) {
        const size_t index = sweep_cells_index(i, ticks, values->count);
        sweep_add_tick(chart, axis, (double)index, values->at[index]);
    }
    axis->title = chart_quantity(chart, cells->x->pointer, cells->x->unit);
    return is_numeric;
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
        chart_note(chart, " Not drawn: ", sweep->metrics.at[i]);
    chart->title = chart_text(chart, "A sweep of %llu points", points);
    chart->heading =
        chart_text(chart, "%s%llu points%s",
                   source->rows < sweep->points ? chart_text(chart, "%zu of ", source->rows) : "",
                   points, failed > 0 ? chart_text(chart, ", %llu failed", failed) : "");
}

// Panels of all metrics: one below the other, or maps in two columns.
static void sweep_add_panels(Chart *chart, const Sweep *sweep, const SweepCells *cells,
                             size_t metrics, double *x) {
    ChartAxis axis = {.is_logarithmic = false};
    const size_t count = cells->columns * cells->rows;
    const bool is_map = cells->y != NULL;
    const bool is_numeric = !is_map && sweep_places(chart, cells, x, &axis);
    const bool has_markers = count <= SWEEP_DOTS || !is_numeric;
    for (size_t i = 0; i < metrics; i++) {
        const double *low = cells->low + i * count;
        const double left = is_map ? 88 + 306 * (double)(i % 2) : 66;
        const double top = is_map ? 102 + 244 * (double)(i / 2) : 62 + 144 * (double)i;
        ChartPanel *panel =
            chart_panel(chart,
                        chart_quantity(chart, charts_words(chart, sweep->metrics.at[i]),
                                       sweep_metric_unit(sweep->metrics.at[i])),
                        left, is_map ? left + 208 : 622, top, top + (is_map ? 168 : 110));
        panel->is_small = true;
        panel->x = axis;
        panel->x.is_unlabelled = !is_map && i + 1 < metrics;
        panel->empty = is_map ? NULL : "not known";
        if (is_map) {
            panel->x = sweep_end_ticks(chart, &cells->x->values);
            panel->y = sweep_end_ticks(chart, &cells->y->values);
            chart_add(panel, (ChartSeries){CHART_MAP, .y = low, .count = count,
                                           .columns = cells->columns});
        } else {
            chart_add(panel, (ChartSeries){has_markers ? CHART_MARKERS : CHART_LINE, x, low,
                                           has_markers ? NULL : cells->high + i * count, count, 0,
                                           CHART_DOT, .is_joined = is_numeric});
            chart_add(panel, (ChartSeries){CHART_MARKERS, x, cells->failed + i * count, NULL, count,
                                           0, .shape = CHART_CROSS});
        }
        chart->height = panel->bottom + (is_map ? 60 : 52);
    }
    if (!is_map)
        return;
    chart->notes[0] =
        chart_text(chart, "across: %s", chart_quantity(chart, cells->x->pointer, cells->x->unit));
    chart->notes[1] =
        chart_text(chart, "upwards: %s", chart_quantity(chart, cells->y->pointer, cells->y->unit));
}

bool chart_sweep(const SweepDocument *source, Bytes *bytes) {
    const Sweep *sweep = source->sweep;
    const bool is_map = sweep->axes.count > 1 && sweep->mode == SWEEP_GRID;
    const size_t metrics =
        sweep->metrics.count < CHART_PANELS ? sweep->metrics.count : CHART_PANELS;
    const SweepAxisValues *last = &sweep->axes.at[sweep->axes.count - 1];
    SweepCells cells = {.x = is_map ? last : &sweep->axes.at[0], .rows = 1, .group = 1};
    const size_t wide = cells.points = cells.x->values.count;
    if (is_map) { // of more axes the last two, the others at their first values
        cells.y = last - 1;
        const size_t high = cells.y->values.count;
        cells.columns = wide < SWEEP_MAP_CELLS ? wide : SWEEP_MAP_CELLS;
        cells.rows = high < SWEEP_MAP_CELLS ? high : SWEEP_MAP_CELLS;
        cells.points = wide * high;
    } else {
        cells.group = wide > SWEEP_COLUMNS ? (wide + SWEEP_COLUMNS - 1) / SWEEP_COLUMNS : 1;
        cells.columns = (wide + cells.group - 1) / cells.group;
    }
    Chart chart = {.width = 640, .left = is_map ? 88 : 66};
    const size_t count = cells.columns * cells.rows;
    cells.low = chart_new(&chart, count * metrics, sizeof *cells.low);
    cells.high = chart_new(&chart, count * metrics, sizeof *cells.high);
    cells.failed = chart_new(&chart, count * metrics, sizeof *cells.failed);
    double *x = chart_new(&chart, count, sizeof *x);
    const bool is_read = chart.is_failed || sweep_cells_read(&cells, source, metrics);
    sweep_add_notes(&chart, source, metrics, is_map);
    if (!chart.is_failed)
        sweep_add_panels(&chart, sweep, &cells, metrics, x);
    chart_write(&chart, bytes);
    return is_read;
}

// --- evaluation ---

// Restitution or contact time of all readings; their tooltips are of its rows.
typedef struct Quantity {
    const Evaluation *evaluation;
    bool is_time;
} Quantity;

typedef struct QuantityValue {
    double value;
    bool counts, is_outlier;
} QuantityValue;

static QuantityValue quantity_value(const Quantity *quantity, const EvaluationRow *row) {
    return quantity->is_time ? (QuantityValue){row->contact_time, row->contact_time_counts,
                                               row->contact_time_is_outlier}
                             : (QuantityValue){row->restitution, row->restitution_counts,
                                               row->restitution_is_outlier};
}

static void quantity_describe(const void *context, size_t index, Bytes *bytes) {
    const Quantity *quantity = context;
    const EvaluationRow *row = &quantity->evaluation->rows.at[index];
    const QuantityValue value = quantity_value(quantity, row);
    if (row->measurement != COUNT_ABSENT)
        bytes_format(bytes, "measurement %llu, ", (unsigned long long)row->measurement);
    chart_escape(bytes, row->from);
    bytes_format(bytes, ": %.4g%s", value.value,
                 value.is_outlier ? ", an outlier that counts" : "");
    if (row->excluded != NULL) {
        bytes_text(bytes, ", excluded: ");
        chart_escape(bytes, row->excluded);
    }
}

// The readings that count, the others as crosses, and rings about outliers.
static void quantity_add_readings(Chart *chart, ChartPanel *panel, const Quantity *quantity) {
    static const ChartShape shapes[] = {CHART_DOT, CHART_CROSS, CHART_RING};
    const EvaluationRows *rows = &quantity->evaluation->rows;
    const size_t count = rows->count < READINGS_DRAWN ? rows->count : READINGS_DRAWN;
    double *x = chart_new(chart, 4 * count, sizeof *x);
    for (size_t i = 0; i < count && x != NULL; i++) {
        const QuantityValue value = quantity_value(quantity, &rows->at[i]);
        const double speed = rows->at[i].approach_speed;
        x[i] = isnan(speed) ? charts_edges[0] : speed;
        x[count + i] = value.counts ? value.value : (double)NAN;
        x[2 * count + i] = value.counts ? (double)NAN : value.value;
        x[3 * count + i] = value.is_outlier ? value.value : (double)NAN;
    }
    for (size_t i = 0; i < COUNT(shapes) && x != NULL; i++) {
        const bool is_ring = shapes[i] == CHART_RING;
        chart_add(panel, (ChartSeries){CHART_MARKERS, x, x + (i + 1) * count, NULL, count,
                                       is_ring ? 3 : 0, shapes[i], .look = is_ring ? "ring" : NULL,
                                       .describe = quantity_describe, .context = quantity});
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
    const double top = is_time ? 356 : 44;
    Quantity *quantity = chart_new(chart, 1, sizeof *quantity);
    const char *interval = isnan(statistic->low) ? ""
                                                 : chart_text(chart, ", 95 %% within %.4g to %.4g",
                                                              statistic->low, statistic->high);
    const char *heading = statistic->count == 0 ? chart_text(chart, "%s: not known", name)
                                                : chart_text(chart, "%s: %.4g%s%s, %llu reading%s",
                                                             name, statistic->mean, unit, interval,
                                                             (unsigned long long)statistic->count,
                                                             statistic->count == 1 ? "" : "s");
    ChartPanel *panel = chart_panel(chart, heading, 78, 664, top, top + 230);
    panel->x.title = "approach speed [m/s]";
    panel->x.padding = 0.06;
    if (quantity == NULL)
        return;
    *quantity = (Quantity){.evaluation = evaluation, .is_time = is_time};
    quantity_add_readings(chart, panel, quantity);
    evaluation_add_mean(chart, panel, statistic);
}

void chart_evaluation(const Evaluation *evaluation, const char *slug, Bytes *bytes) {
    Chart chart = {.width = 680, .height = 640, .left = 78};
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
    return i < chart->count ? &chart->panels[i] : chart_panel(chart, NULL, 70, 946, 0, 0);
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

// Panels below each other over one axis of time.
static void svg_place_panels(Chart *chart, const Table *table, const char *const *units) {
    const double height = chart->count > 1 ? 150 : 300;
    const char *axis =
        chart_text(chart, "%s [%s]", table->axis_name != NULL ? table->axis_name : "row",
                   table->axis_name != NULL ? table->axis_unit : "1");
    bool has_legend = false;
    chart->height = 60;
    for (size_t i = 0; i < chart->count; i++)
        has_legend = has_legend || chart->panels[i].count > 1;
    for (size_t i = 0; i < chart->count; i++) {
        ChartPanel *panel = &chart->panels[i];
        char names[100] = "";
        panel->has_side_legend = true;
        panel->empty = "not known";
        panel->right = has_legend ? 750 : 946;
        panel->top = 40 + (height + 40) * (double)i;
        panel->bottom = panel->top + height;
        panel->x.is_unlabelled = i + 1 < chart->count;
        panel->x.title = axis;
        for (size_t k = 0; k < panel->count; k++) {
            text_list(names, sizeof names, panel->series[k].name);
            panel->series[k].legend = panel->count > 1 ? panel->series[k].name : NULL;
        }
        panel->heading = units[i][0] != '\0' ? chart_text(chart, "%s [%s]", names, units[i])
                                             : chart_text(chart, "%s", names);
        chart->height = panel->bottom + 46;
    }
}

static void svg_add_series(Chart *chart, const Table *table) {
    const char *units[CHART_PANELS];
    const size_t part = (table->count + SVG_POINTS - 1) / SVG_POINTS + (table->count == 0);
    const size_t points = (table->count + part - 1) / part;
    const size_t lines = table->bucket > 0 ? table->column_count / 2 : table->column_count;
    const size_t drawn =
        lines < CHART_PANELS * CHART_COLOURS ? lines : CHART_PANELS * CHART_COLOURS;
    double *x = chart_new(chart, (1 + 2 * drawn) * points, sizeof *x);
    if (x == NULL)
        return;
    for (size_t i = 0; i < points; i++)
        x[i] = table->axis != NULL ? table_values(table, table->axis)[i * part]
                                   : table_time(table, i * part);
    double *next = x + points;
    for (size_t i = 0; i < lines; i++) {
        const Column *column = svg_column(table, i, false);
        ChartPanel *panel = svg_find_panel(chart, units, column->unit);
        const size_t length = strlen(column->name) - (table->bucket > 0 ? strlen("_min") : 0);
        const char *name = chart_text(chart, "%.*s", (int)length, column->name);
        if (panel == NULL) {
            chart_note(chart, " Not drawn: ", name);
            continue;
        }
        svg_thin(table, i, part, next, next + points);
        chart_add(panel, (ChartSeries){CHART_LINE, x, next, next + points, points, panel->count,
                                       .name = name});
        next += 2 * points;
    }
    svg_place_panels(chart, table, units);
}

static void svg_add_spectra(Chart *chart, const Table *table) {
    ChartPanel *panel = chart_spectra(chart, NULL, 70, 946, 44, 424);
    panel->empty = "not known";
    chart->height = 476;
    for (size_t i = 0; i < table->column_count; i++) {
        const Column *column = table->columns[i];
        if (i >= CHART_COLOURS)
            chart_note(chart, " Not drawn: ", column->name);
        else
            chart_add(panel,
                      (ChartSeries){CHART_LINE, table_values(table, table->axis),
                                    table_values(table, column->values), NULL, table->count, i,
                                    .name = column->name,
                                    .legend = chart_quantity(chart, column->name, column->unit)});
    }
}

// In one piece: its size is limited.
static bool svg_next(const Table *table, TextPlace *place, Bytes *bytes) {
    Chart chart = {.width = 960, .left = 70};
    const bool is_spectra = table->axis_name != NULL && strcmp(table->axis_name, "frequency") == 0;
    (void)place;
    chart.title = is_spectra ? "Power spectral densities" : "Time series";
    if (is_spectra)
        svg_add_spectra(&chart, table);
    else
        svg_add_series(&chart, table);
    chart_write(&chart, bytes);
    return false;
}

const TableFormat format_svg = {
    .extension = "svg",
    .content_type = chart_type,
    .is_binary = false,
    .next = svg_next,
};
