#include "server/formats/charts.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "server/formats/chart.h"

enum { SPECTRA_DRAWN = 4, VARIANTS_DRAWN = 8, READINGS_DRAWN = 5000 };

static const double charts_edges[] = {-(double)INFINITY, (double)INFINITY};

// A name with spaces for its underscores.
static void charts_words(char *target, size_t size, const char *name) {
    text_fit(target, size, name);
    for (char *c = target; *c != '\0'; c++)
        if (*c == '_')
            *c = ' ';
}

// Appends "Not drawn: NAME", and why.
static void charts_add_undrawn(Chart *chart, const char *name, const char *before,
                               const char *why) {
    bytes_text(&chart->description, " Not drawn: ");
    chart_text(&chart->description, name);
    chart_note(chart, before, why);
}

// Two values that are kept with the chart.
static const double *charts_pair(Chart *chart, double first, double second) {
    double *pair = chart_allocate(chart, 2, sizeof *pair);
    if (pair != NULL) {
        pair[0] = first;
        pair[1] = second;
    }
    return pair;
}

// A line across the panel; with `high` a band up to that.
static ChartSeries *charts_add_level(Chart *chart, ChartPanel *panel, double value, double high) {
    return chart_series(panel, isnan(high) ? CHART_LINE : CHART_BAND, charts_edges,
                        charts_pair(chart, value, value),
                        isnan(high) ? NULL : charts_pair(chart, high, high), 2);
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
        ChartSeries *line = chart_series(panel, CHART_LINE, frequency->at, value->at, NULL,
                                         charts_shorter(frequency, value));
        line->colour = i;
        text_fit(line->name, CHART_TEXT, spectrum->channel != NULL ? spectrum->channel : "");
        chart_quantity(line->legend, spectrum->channel, spectrum->unit);
        const size_t count = charts_shorter(low, high);
        if (count > 0 && count <= frequency->count)
            chart_series(panel, CHART_BAND, frequency->at, low->at, high->at, count)->colour = i;
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
    chart_text(bytes, mark->point->name);
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

// From each point that none is cheaper and closer than along its error to the next one.
static void tradeoff_add_best(Chart *chart, ChartPanel *panel, const TradeoffMark *marks,
                              size_t count) {
    double *x = chart_allocate(chart, 2 * count + 1, sizeof *x);
    double *y = chart_allocate(chart, 2 * count + 1, sizeof *y);
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
    ChartSeries *best = chart_series(panel, CHART_LINE, x, y, y, steps);
    best->colour = CHART_STRONG;
    best->look = "best";
    text_fit(best->legend, CHART_TEXT, "best of all");
}

// The errors are those of all points; each series has the CPU times of its own.
static void tradeoff_fill(Chart *chart, ChartPanel *panel, const Tradeoff *tradeoff) {
    enum { CHOICE = CHART_COLOURS, LISTS };
    TradeoffMark *marks = chart_allocate(chart, tradeoff->points.count, sizeof *marks);
    double *x = chart_allocate(chart, LISTS * tradeoff->points.count, sizeof *x);
    double *y = chart_allocate(chart, tradeoff->points.count, sizeof *y);
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
    for (size_t group = 0; group < CHART_COLOURS && groups[group] != NULL; group++) {
        ChartSeries *series = chart_series(panel, CHART_MARKERS, x + group * count, y, NULL, count);
        series->colour = group;
        series->is_joined = true;
        series->describe = tradeoff_describe;
        series->context = marks;
        text_fit(series->legend, CHART_TEXT, groups[group]);
    }
    tradeoff_add_best(chart, panel, marks, count);
    if (tradeoff->error > 0) {
        ChartSeries *wanted = charts_add_level(chart, panel, tradeoff->error, (double)NAN);
        wanted->colour = CHART_STRONG;
        wanted->look = "wanted";
        chart_format(wanted->legend, CHART_TEXT, "wanted: %.3g%s", tradeoff->error,
                     metric_units[tradeoff->metric]);
    }
    ChartSeries *choice = chart_series(panel, CHART_MARKERS, x + CHOICE * count, y, NULL, count);
    choice->colour = CHART_STRONG;
    choice->shape = CHART_RING;
    choice->look = "ring";
    text_fit(choice->legend, CHART_TEXT, "to take");
}

void charts_tradeoff(const Tradeoff *tradeoff, Bytes *bytes) {
    Chart chart = {.width = 640, .height = 430, .left = 62};
    char metric[CHART_LABEL];
    charts_words(metric, sizeof metric, metric_names[tradeoff->metric]);
    chart_format(chart.title, CHART_TEXT, "Error of %s against CPU time", metric);
    chart_format(chart.heading, CHART_TEXT, "Error of %s%s", metric,
                 tradeoff->metric == METRIC_PSD ? " [dB]" : "");
    chart_note(&chart, "", tradeoff->recommendation.why);
    ChartPanel *panel = chart_panel(&chart, 62, 486, 44, 376);
    panel->has_side_legend = true;
    panel->x.is_logarithmic = panel->y.is_logarithmic = panel->x.is_whole = true;
    panel->y.has_zero = true;
    text_fit(panel->x.title, CHART_TEXT, "CPU time of a run [s]");
    tradeoff_fill(&chart, panel, tradeoff);
    chart_write(&chart, bytes);
}

// --- ensemble ---

static void ensemble_fill_row(ChartRow *row, int metric, const RunStatistic *statistic) {
    const double mean = statistic->mean;
    charts_words(row->label, sizeof row->label, statistics_metric_names[metric]);
    row->has_interval = mean > 0 && isfinite(mean) && statistic->count > 1;
    if (row->has_interval) // in units of the mean
        row->interval = (ChartInterval){
            statistic->minimum / mean, statistic->q25 / mean, statistic->low / mean,    1,
            statistic->high / mean,    statistic->q75 / mean, statistic->maximum / mean};
    char *text = row->cells[0].text, half[CHART_LABEL] = "";
    const size_t size = sizeof row->cells[0].text;
    const bool has_unit = statistic->unit != NULL && strcmp(statistic->unit, "1") != 0;
    if (!isnan(statistic->high))
        chart_format(half, sizeof half, " \u00b1 %.2g", statistic->high - mean);
    if (isnan(mean))
        text_fit(text, size, "not known");
    else
        chart_format(text, size, "%.4g%s%s%s", mean, half, has_unit ? " " : "",
                     has_unit ? statistic->unit : "");
}

void charts_ensemble(const Ensemble *ensemble, Bytes *bytes) {
    Chart chart = {.width = 640, .left = 62};
    const unsigned long long runs = ensemble->made - ensemble->failed;
    ChartTable *table = &chart.table;
    chart_format(chart.title, CHART_TEXT, "Mean of %llu runs", runs);
    chart_format(chart.heading, CHART_TEXT, "Mean of %llu runs, with its %g %% interval", runs,
                 100 * ensemble->confidence);
    bytes_format(&chart.description, "%llu runs of %llu, seeds from %llu; %llu failed.",
                 (unsigned long long)ensemble->made, (unsigned long long)ensemble->runs,
                 (unsigned long long)ensemble->first_seed, (unsigned long long)ensemble->failed);
    chart_note(&chart, " Target: ", ensemble->target.why);
    bytes_format(&chart.description,
                 " Bands and whiskers: %g %% intervals of the mean over all seeds; boxes: half of "
                 "the runs; grey lines: all of them.",
                 100 * ensemble->confidence);
    ChartPanel *panel = chart_spectra(&chart, 62, 626, 44, 300);
    charts_add_bands(&chart, panel, &ensemble->frequency, &ensemble->spectra, true);
    table->top = chart_fit(panel) ? 362 : 56;
    table->label_right = 190;
    table->interval_width = 280;
    table->row_height = 24;
    table->columns_count = 1;
    for (int metric = 0; metric < STATISTICS_METRICS; metric++)
        ensemble_fill_row(&table->rows[table->rows_count++], metric,
                          &ensemble->statistics.of[metric]);
    chart.height = table->top + table->row_height * STATISTICS_METRICS + 12;
    chart_write(&chart, bytes);
}

// --- compare ---

static void compare_add_trace(Chart *chart, ChartPanel *panel, const Comparison *comparison,
                              const CompareEntry *entry, size_t colour) {
    const size_t count = charts_shorter(&entry->trace.minimum, &entry->trace.maximum);
    double *time = chart_allocate(chart, count, sizeof *time);
    for (size_t i = 0; i < count && time != NULL; i++)
        time[i] = (double)i / comparison->trace_rate;
    ChartSeries *series = chart_series(panel, CHART_LINE, time, entry->trace.minimum.at,
                                       entry->trace.maximum.at, time != NULL ? count : 0);
    series->colour = colour;
    text_fit(series->name, CHART_TEXT, entry->name);
}

void charts_compare(const Comparison *comparison, Bytes *bytes) {
    Chart chart = {.width = 960, .height = 690, .left = 70, .title = "Contact models compared"};
    bytes_text(&chart.description, "The first is the reference, the scene as it is.");
    ChartPanel *spectra = chart_spectra(&chart, 70, 630, 44, 330);
    ChartPanel *traces = chart_panel(&chart, 70, 630, 404, 644);
    spectra->has_side_legend = true;
    chart_quantity(spectra->heading, comparison->channel, comparison->unit);
    text_fit(traces->heading, CHART_TEXT, "displacement [m]");
    text_fit(traces->x.title, CHART_TEXT, "time [s]");
    size_t drawn = 0;
    for (size_t i = 0; i < comparison->entries.count; i++) {
        const CompareEntry *entry = &comparison->entries.at[i];
        if (entry->status != COMPARE_RUN || drawn == VARIANTS_DRAWN) {
            charts_add_undrawn(&chart, entry->name, entry->why != NULL ? ": " : "",
                               entry->why != NULL ? entry->why : "");
            continue;
        }
        ChartSeries *line =
            chart_series(spectra, CHART_LINE, comparison->frequency.at, entry->density.at, NULL,
                         charts_shorter(&comparison->frequency, &entry->density));
        line->colour = drawn;
        text_fit(line->name, CHART_TEXT, entry->name);
        if (drawn == 0 || isnan(entry->psd.level))
            text_fit(line->legend, CHART_TEXT, entry->name);
        else
            chart_format(line->legend, CHART_TEXT, "%s: %.2g dB off", entry->name,
                         entry->psd.level);
        compare_add_trace(&chart, traces, comparison, entry, drawn++);
    }
    chart_write(&chart, bytes);
}

// --- sensitivity ---

// "DERIVATIVE", or in grey "DERIVATIVE (SPREAD)" where it does not settle.
static void sensitivity_fill_cell(ChartRow *row, size_t column, const SensitivitySlope *slope) {
    char *text = row->cells[column].text, spread[CHART_LABEL] = "";
    row->cells[column].is_faint = !slope->is_settled;
    if (!slope->is_settled && !isnan(slope->spread))
        chart_format(spread, sizeof spread, slope->spread < 10 ? " (%.1g)" : " (%.4g)",
                     slope->spread < 10 ? slope->spread : rint(slope->spread));
    if (isnan(slope->derivative))
        chart_format(text, sizeof row->cells[column].text, "not known%s", spread);
    else
        chart_format(text, sizeof row->cells[column].text, "%.2g%s", slope->derivative, spread);
}

static void sensitivity_fill_table(ChartTable *table, const Sensitivity *sensitivity) {
    table->heading = "Relative change of the statistic over that of the parameter";
    table->note = "grey: does not settle, its spread in brackets";
    table->label_right = 160;
    table->column_width = 98;
    table->row_height = 22;
    table->rows_count = STATISTICS_METRICS + 1; // the first one has the parameters
    for (int metric = 0; metric < STATISTICS_METRICS; metric++)
        charts_words(table->rows[metric + 1].label, CHART_LABEL, statistics_metric_names[metric]);
    for (size_t i = 0; i < sensitivity->response.count && i < CHART_CELLS; i++) {
        const SensitivityRow *row = &sensitivity->response.at[i];
        charts_words(table->rows[0].cells[i].text, CHART_LABEL,
                     sensitivity_parameter_names[row->parameter]);
        for (size_t k = 0; k < row->slopes.count; k++)
            sensitivity_fill_cell(&table->rows[row->slopes.at[k].metric + 1], i,
                                  &row->slopes.at[k]);
        table->columns_count++;
    }
}

void charts_sensitivity(const Sensitivity *sensitivity, Bytes *bytes) {
    Chart chart = {.width = 760, .left = 70, .title = "Sensitivity"};
    bytes_format(&chart.description,
                 "Relative change of each statistic over the relative change of each parameter; "
                 "grey ones do not settle, their spread is in brackets. Bands: 5 to 95 %% of %llu "
                 "drawn runs.",
                 (unsigned long long)(sensitivity->made - sensitivity->failed));
    chart_note(&chart, " ", sensitivity->why);
    ChartPanel *panel = chart_spectra(&chart, 70, 746, 44, 330);
    charts_add_bands(&chart, panel, &sensitivity->frequency, &sensitivity->spectra, false);
    const bool has_spectra = chart_fit(panel);
    if (has_spectra)
        text_fit(panel->heading, CHART_TEXT, "Spectra, with 5 to 95 % of the drawn runs");
    sensitivity_fill_table(&chart.table, sensitivity);
    chart.table.top = has_spectra ? 416 : 50;
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
static bool sweep_cells_read(SweepCells *cells, const SweepSource *source, size_t metrics) {
    double numbers[SWEEP_PIECE], values[SWEEP_PIECE];
    size_t places[SWEEP_PIECE], piece;
    const size_t count = cells->columns * cells->rows;
    for (size_t i = 0; i < count * metrics; i++)
        cells->low[i] = cells->high[i] = cells->failed[i] = (double)NAN;
    for (size_t row = 0; row < source->rows; row += piece) {
        piece = source->rows - row < SWEEP_PIECE ? source->rows - row : SWEEP_PIECE;
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
static void sweep_add_tick(ChartAxis *axis, double value, const char *json) {
    ChartTick *tick = &axis->ticks[axis->tick_count++];
    tick->value = value;
    if (sweep_is_number(json))
        chart_format(tick->text, sizeof tick->text, "%.4g", strtod(json, NULL));
    else if (*json == '"')
        chart_format(tick->text, 18, "%.*s", (int)strlen(json) - 2, json + 1);
    else
        text_fit(tick->text, 18, json);
}

static void sweep_add_end_ticks(ChartAxis *axis, const Texts *values) {
    sweep_add_tick(axis, 0, values->at[0]);
    sweep_add_tick(axis, 1, values->at[values->count - 1]);
}

// The places of the cells along the axis: to scale where all values are numbers, else evenly.
static bool sweep_places(const SweepCells *cells, double *x, ChartAxis *axis) {
    const Texts *values = &cells->x->values;
    double least = (double)INFINITY, most = -least;
    bool is_numeric = true;
    for (size_t i = 0; i < values->count && is_numeric; i++) {
        const double value = strtod(values->at[i], NULL);
        is_numeric = sweep_is_number(values->at[i]);
        least = fmin(least, value);
        most = fmax(most, value);
    }
    for (size_t i = 0; i < cells->columns; i++)
        x[i] = is_numeric ? strtod(values->at[i * cells->group], NULL) : (double)(i * cells->group);
    axis->is_logarithmic = is_numeric && least > 0 && most > 30 * least;
    axis->padding = is_numeric ? 0.015 : 0.08; // room for half a word
    const size_t ticks = values->count < CHART_TICKS ? values->count : CHART_TICKS;
    for (size_t i = 0; i < ticks && !is_numeric; i++) {
        const size_t index = sweep_cells_index(i, ticks, values->count);
        sweep_add_tick(axis, (double)index, values->at[index]);
    }
    chart_quantity(axis->title, cells->x->pointer, cells->x->unit);
    return is_numeric;
}

static void sweep_add_notes(Chart *chart, const Sweep *sweep, const SweepSource *source,
                            size_t metrics, bool is_map) {
    const unsigned long long points = sweep->points, failed = sweep->table.failed;
    char done[CHART_LABEL] = "", failures[CHART_LABEL] = "";
    bytes_format(&chart->description,
                 "%zu of %llu points, %llu failed. Gaps and grey cells: not there.", source->rows,
                 points, failed);
    for (size_t i = 0; is_map && i + 2 < sweep->axes.count; i++)
        chart_note(chart, " Drawn at the first value of ", sweep->axes.at[i].pointer);
    for (size_t i = metrics; i < sweep->metrics.count; i++)
        chart_note(chart, " Not drawn: ", sweep->metrics.at[i]);
    if (source->rows < sweep->points)
        chart_format(done, sizeof done, "%zu of ", source->rows);
    if (failed > 0)
        chart_format(failures, sizeof failures, ", %llu failed", failed);
    chart_format(chart->title, CHART_TEXT, "A sweep of %llu points", points);
    chart_format(chart->heading, CHART_TEXT, "%s%llu points%s", done, points, failures);
}

// Panels of all metrics: one below the other, or maps in two columns.
static void sweep_add_panels(Chart *chart, const Sweep *sweep, const SweepCells *cells,
                             size_t metrics, double *x) {
    ChartAxis axis = {.is_logarithmic = false};
    const size_t count = cells->columns * cells->rows;
    const bool is_map = cells->y != NULL, is_numeric = !is_map && sweep_places(cells, x, &axis);
    for (size_t i = 0; i < metrics; i++) {
        const double *low = cells->low + i * count;
        const double left = is_map ? 88 + 306 * (double)(i % 2) : 66;
        const double top = is_map ? 102 + 244 * (double)(i / 2) : 62 + 144 * (double)i;
        ChartPanel *panel =
            chart_panel(chart, left, is_map ? left + 208 : 622, top, top + (is_map ? 168 : 110));
        char name[CHART_LABEL];
        charts_words(name, sizeof name, sweep->metrics.at[i]);
        chart_quantity(panel->heading, name, sweep_metric_unit(sweep->metrics.at[i]));
        panel->is_small = true;
        if (is_map) {
            chart_series(panel, CHART_MAP, NULL, low, NULL, count)->columns = cells->columns;
            sweep_add_end_ticks(&panel->x, &cells->x->values);
            sweep_add_end_ticks(&panel->y, &cells->y->values);
        } else {
            panel->x = axis;
            panel->x.is_unlabelled = i + 1 < metrics;
            panel->empty = "not known";
            const bool has_markers = count <= SWEEP_DOTS || !is_numeric;
            ChartSeries *series =
                chart_series(panel, has_markers ? CHART_MARKERS : CHART_LINE, x, low,
                             has_markers ? NULL : cells->high + i * count, count);
            series->shape = CHART_DOT;
            series->is_joined = is_numeric;
            chart_series(panel, CHART_MARKERS, x, cells->failed + i * count, NULL, count)->shape =
                CHART_CROSS;
        }
        chart->height = panel->bottom + (is_map ? 60 : 52);
    }
    if (!is_map)
        return;
    char name[CHART_TEXT];
    chart_quantity(name, cells->x->pointer, cells->x->unit);
    chart_format(chart->notes[0], CHART_TEXT, "across: %s", name);
    chart_quantity(name, cells->y->pointer, cells->y->unit);
    chart_format(chart->notes[1], CHART_TEXT, "upwards: %s", name);
}

bool charts_sweep(const Sweep *sweep, const SweepSource *source, Bytes *bytes) {
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
    cells.low = chart_allocate(&chart, count * metrics, sizeof *cells.low);
    cells.high = chart_allocate(&chart, count * metrics, sizeof *cells.high);
    cells.failed = chart_allocate(&chart, count * metrics, sizeof *cells.failed);
    double *x = chart_allocate(&chart, count, sizeof *x);
    const bool is_read = chart.is_failed || sweep_cells_read(&cells, source, metrics);
    sweep_add_notes(&chart, sweep, source, metrics, is_map);
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
    chart_text(bytes, row->from);
    bytes_format(bytes, ": %.4g%s", value.value,
                 value.is_outlier ? ", an outlier that counts" : "");
    if (row->excluded != NULL) {
        bytes_text(bytes, ", excluded: ");
        chart_text(bytes, row->excluded);
    }
}

// The readings that count, the others as crosses, and rings about outliers.
static void quantity_add_readings(Chart *chart, ChartPanel *panel, const Quantity *quantity) {
    static const ChartShape shapes[] = {CHART_DOT, CHART_CROSS, CHART_RING};
    const EvaluationRows *rows = &quantity->evaluation->rows;
    const size_t count = rows->count < READINGS_DRAWN ? rows->count : READINGS_DRAWN;
    double *x = chart_allocate(chart, 4 * count, sizeof *x);
    for (size_t i = 0; i < count && x != NULL; i++) {
        const QuantityValue value = quantity_value(quantity, &rows->at[i]);
        const double speed = rows->at[i].approach_speed;
        x[i] = isnan(speed) ? charts_edges[0] : speed;
        x[count + i] = value.counts ? value.value : (double)NAN;
        x[2 * count + i] = value.counts ? (double)NAN : value.value;
        x[3 * count + i] = value.is_outlier ? value.value : (double)NAN;
    }
    for (size_t i = 0; i < COUNT(shapes) && x != NULL; i++) {
        ChartSeries *series =
            chart_series(panel, CHART_MARKERS, x, x + (i + 1) * count, NULL, count);
        series->shape = shapes[i];
        series->colour = shapes[i] == CHART_RING ? 3 : 0;
        series->look = shapes[i] == CHART_RING ? "ring" : NULL;
        series->describe = quantity_describe;
        series->context = quantity;
    }
}

static void evaluation_add_mean(Chart *chart, ChartPanel *panel, const Statistic *statistic) {
    const Trend *trend = &statistic->trend;
    if (trend->verdict == TREND_NOT_CONSTANT) {
        const double from = trend->least_speed, to = trend->most_speed;
        const double *y =
            charts_pair(chart, trend->mean_value + trend->slope * (from - trend->mean_speed),
                        trend->mean_value + trend->slope * (to - trend->mean_speed));
        ChartSeries *line =
            chart_series(panel, CHART_LINE, charts_pair(chart, from, to), y, NULL, 2);
        line->colour = 1;
        line->look = "trend";
        chart_format(line->name, CHART_TEXT, "%.3g per m/s", trend->slope);
    }
    if (isnan(statistic->mean))
        return;
    ChartSeries *mean = charts_add_level(chart, panel, statistic->mean, (double)NAN);
    chart_format(mean->name, CHART_TEXT, "mean %.4g", statistic->mean);
    if (!isnan(statistic->low))
        charts_add_level(chart, panel, statistic->low, statistic->high);
}

static void evaluation_add_panel(Chart *chart, const Evaluation *evaluation, bool is_time) {
    const Statistic *statistic = is_time ? &evaluation->contact_time : &evaluation->restitution;
    const char *name = is_time ? "Contact time T_c" : "Restitution e", *unit = is_time ? " s" : "";
    const double top = is_time ? 356 : 44;
    ChartPanel *panel = chart_panel(chart, 78, 664, top, top + 230);
    Quantity *quantity = chart_allocate(chart, 1, sizeof *quantity);
    char interval[CHART_LABEL + 16] = "";
    text_fit(panel->x.title, CHART_TEXT, "approach speed [m/s]");
    panel->x.padding = 0.06;
    if (!isnan(statistic->low))
        chart_format(interval, sizeof interval, ", 95 %% within %.4g to %.4g", statistic->low,
                     statistic->high);
    if (statistic->count == 0)
        chart_format(panel->heading, CHART_TEXT, "%s: not known", name);
    else
        chart_format(panel->heading, CHART_TEXT, "%s: %.4g%s%s, %llu reading%s", name,
                     statistic->mean, unit, interval, (unsigned long long)statistic->count,
                     statistic->count == 1 ? "" : "s");
    if (quantity == NULL)
        return;
    *quantity = (Quantity){.evaluation = evaluation, .is_time = is_time};
    quantity_add_readings(chart, panel, quantity);
    evaluation_add_mean(chart, panel, statistic);
}

void charts_evaluation(const Evaluation *evaluation, const char *slug, Bytes *bytes) {
    Chart chart = {.width = 680, .height = 640, .left = 78};
    chart_format(chart.title, CHART_TEXT, "Drop tests of %.63s", slug);
    bytes_text(&chart.description,
               "Dots: readings that count; rings: outliers, which count; crosses: readings that do "
               "not. Band: 95 % interval of the mean.");
    chart_note(&chart, " ", evaluation->restitution.trend.detail);
    chart_note(&chart, " ", evaluation->contact_time.trend.detail);
    evaluation_add_panel(&chart, evaluation, false);
    evaluation_add_panel(&chart, evaluation, true);
    chart_write(&chart, bytes);
}
