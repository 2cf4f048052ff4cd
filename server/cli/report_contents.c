// Runs and studies as summaries. Quantities have the names and units of their Field rows.
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "core/study/calibrate.h"
#include "core/study/ensemble.h"
#include "core/study/fragility.h"
#include "core/study/model_comparison.h"
#include "core/study/optimize.h"
#include "core/study/response_curve.h"
#include "core/study/sensitivity.h"
#include "core/study/tradeoff.h"
#include "server/cli/report.h"
#include "server/formats/study_formats.h"
#include "server/formats/table_stream.h"

enum { ROWS_SHOWN = 8, IMPACTS_SHOWN = 10, TICKS_MAX = 900, STOPS_SHOWN = 4 };

static const char *const impact_heads =
    "number|start [s]|damper|side|approach [m/s]|restitution|duration [s]|peak force [N]|lost [J]";

// "8.1 ms"
static const char *seconds_text(char target[32], double seconds) {
    snprintf(target, 32, seconds < 1 ? "%.3g ms" : "%.3g s", seconds < 1 ? 1e3 * seconds : seconds);
    return target;
}

static const char *unit_text(const char *unit) {
    return unit != NULL ? unit : "";
}

// --- run ---

// "the rms displacement by 30.8 %" of each quantity whose reduction has this sign, 0: about none.
static bool effect_list(const Reduction *reduction, int sign, char *text, size_t size) {
    static const char *const names[] = {"peak displacement", "rms displacement",
                                        "peak acceleration", "rms acceleration"};
    const double of[] = {
        reduction->peak_displacement_reduction, reduction->rms_displacement_reduction,
        reduction->peak_acceleration_reduction, reduction->rms_acceleration_reduction};
    size_t count = 0, left = 0;
    for (size_t i = 0; i < COUNT(of); i++)
        left += !isnan(of[i]) && (of[i] > 5e-4) - (of[i] < -5e-4) == sign;
    const bool is_any = left > 0;
    for (size_t i = 0; i < COUNT(of); i++) {
        if (isnan(of[i]) || (of[i] > 5e-4) - (of[i] < -5e-4) != sign)
            continue;
        char by[40] = "";
        if (of[i] < -9)
            snprintf(by, sizeof by, " to %.3g times", 1 - of[i]);
        else if (sign != 0)
            snprintf(by, sizeof by, " by %.3g %%", 100 * fabs(of[i]));
        const size_t used = strlen(text);
        left--;
        snprintf(text + used, size - used, "%sthe %s%s",
                 count++ == 0 ? ""
                 : left == 0  ? " and "
                              : ", ",
                 names[i], by);
    }
    return is_any;
}

static void run_add_effect(Report *report, const Simulation *simulation,
                           const Reduction *reduction) {
    static const int signs[] = {1, -1, 0};
    const bool is_one = simulation->scene.dampers.count == 1;
    Bytes text = {.count = 0};
    bytes_text(&text, is_one ? "The damper" : "The dampers");
    size_t count = 0;
    for (size_t i = 0; i < COUNT(signs); i++) {
        char list[300] = "", verb[24];
        if (!effect_list(reduction, signs[i], list, sizeof list))
            continue;
        snprintf(verb, sizeof verb,
                 i == 0   ? " lower%s "
                 : i == 1 ? " raise%s "
                          : " leave%s ",
                 is_one ? "s" : "");
        bytes_format(&text, "%s%s%s%s", count++ > 0 ? is_one ? "; it" : "; they" : "", verb, list,
                     i < 2                           ? ""
                     : strstr(list, " and ") != NULL ? " as they are"
                                                     : " as it is");
    }
    if (count > 0 && !text.is_failed)
        report_sentence(report, "%s.", text.at);
    bytes_clear(&text);
}

// The numbers of the report, beside those without dampers where they are known.
static void run_add_numbers(Report *report, const Outcome *outcome, bool is_one) {
    const bool has_effect = outcome->has_reduction;
    PrintTable *table =
        report_table(report, NULL,
                     has_effect ? is_one ? "response|with damper|without|change [%]"
                                         : "response|with dampers|without|change [%]"
                                : "response|value");
    for (const Field *row = summary_fields; row->kind != FIELD_KIND_END; row++) {
        char name[80];
        size_t offset = 0;
        snprintf(name, sizeof name, "%.60s_reduction", row->name);
        const Field *reduction = fields_find(reduction_fields, name, &offset);
        const void *member = (const char *)&outcome->summary + row->offset;
        if (reduction == NULL || isnan(*(const double *)member))
            continue;
        const double value = *(const double *)member;
        const double part =
            *(const double *)(const void *)((const char *)&outcome->reduction + reduction->offset);
        report_quantity(table, row->name, row->unit);
        report_real(table, value);
        if (!has_effect)
            continue;
        report_real(table, part < 1 ? value / (1 - part) : (double)NAN);
        report_real(table, part == 0 ? 0 : -100 * part);
    }
}

static const Impact *run_largest_impact(const Response *response) {
    const Impact *largest = NULL;
    for (size_t i = 0; i < response->impacts.count; i++) {
        const Impact *impact = &response->impacts.at[i];
        if (impact->kind == IMPACT_IMPACT && !isnan(impact->peak_force) &&
            (largest == NULL || impact->peak_force > largest->peak_force))
            largest = impact;
    }
    return largest;
}

static bool stop_is_same(const Derived *a, const Derived *b) {
    return a->damper == b->damper && real_same(a->restitution, b->restitution) &&
           real_same(a->contact_time, b->contact_time) && real_same(a->stiffness, b->stiffness) &&
           real_same(a->damping, b->damping);
}

static void stop_put(Bytes *text, const char *name, double value, const char *unit) {
    if (!isnan(value))
        bytes_format(text, "%s%s %.6g%s%s", text->count > 0 ? ", " : "", name, value,
                     unit[0] != '\0' ? " " : "", unit);
}

static void run_add_stops(PrintTable *table, const DerivedList *derived) {
    size_t shown = 0;
    for (size_t i = 0; i < derived->count; i++) {
        const Derived *stop = &derived->at[i];
        const bool is_pair = i + 1 < derived->count && stop_is_same(stop, stop + 1);
        if (shown++ == STOPS_SHOWN) {
            print_table_add(table, "%s", "contacts");
            print_table_add(table, "and %zu more stops", derived->count - i);
            return;
        }
        Bytes text = {.count = 0};
        stop_put(&text, "e", stop->restitution, "");
        stop_put(&text, "T_c", stop->contact_time, "s");
        stop_put(&text, "k_b", stop->stiffness, isnan(stop->exponent) ? "N/m" : "N/m^n");
        stop_put(&text, "n", stop->exponent, "");
        stop_put(&text, "c_b", isnan(stop->exponent) ? stop->damping : (double)NAN, "N s/m");
        stop_put(&text, "m_e", stop->effective_mass, "kg");
        print_table_add(table, "contact %llu%s%s", (unsigned long long)stop->damper,
                        is_pair ? "" : " ", is_pair ? "" : side_names[stop->side]);
        print_table_add(table, "%s%s%s", text.at != NULL ? text.at : "",
                        stop->material != NULL ? ", " : "", unit_text(stop->material));
        bytes_clear(&text);
        i += is_pair;
    }
}

static void run_add_facts(Report *report, const Outcome *outcome, double duration) {
    const Response *response = &outcome->response;
    const Impact *largest = run_largest_impact(response);
    const PlanModes *modes = &outcome->plan.modes;
    PrintTable *table = report_table(report, NULL, NULL);
    char rest[80] = "", where[120] = "";
    if (response->resting_count > 0)
        snprintf(rest, sizeof rest, ", %llu intervals of persistent contact",
                 (unsigned long long)response->resting_count);
    if (largest != NULL)
        snprintf(where, sizeof where, " at %.6g s (damper %llu, %s)", largest->start,
                 (unsigned long long)largest->damper, side_names[largest->side]);
    print_table_add(table, "%s", "impacts");
    if (isnan(outcome->summary.peak_contact_force))
        print_table_add(table, "%llu%s", (unsigned long long)response->impact_count, rest);
    else
        print_table_add(table, "%llu%s, largest contact force %.6g N%s",
                        (unsigned long long)response->impact_count, rest,
                        outcome->summary.peak_contact_force, where);
    run_add_stops(table, &outcome->plan.derived);
    if (modes->count > 0) {
        Bytes text = {.count = 0};
        for (size_t i = 0; i < modes->count && i < 3; i++)
            bytes_format(&text, "%s%.6g Hz (damping ratio %.3g)", i > 0 ? ", " : "",
                         modes->at[i].frequency, modes->at[i].damping_ratio);
        print_table_add(table, "%s", modes->count > 1 ? "modes" : "mode");
        print_table_add(table, "%s%s", text.at != NULL ? text.at : "",
                        modes->count > 3 ? " and more" : "");
        bytes_clear(&text);
    }
    print_table_add(table, "%s", "accuracy");
    if (isnan(outcome->summary.error_estimate))
        print_table_add(table, "not estimated by this solver; energy residual %.3g",
                        outcome->summary.energy_residual);
    else if (isnan(outcome->summary.trust_horizon))
        print_table_add(table,
                        "error estimate %.3g of the largest displacement; the whole run is "
                        "predictable; energy residual %.3g",
                        outcome->summary.error_estimate, outcome->summary.energy_residual);
    else
        print_table_add(table,
                        "predictable until %.6g s of %.6g s; beyond that only statistics are "
                        "valid; energy residual %.3g",
                        outcome->summary.trust_horizon, duration, outcome->summary.energy_residual);
}

// A part of the outcome as a chart. `column`: it alone; NULL: all.
static void run_add_chart(Report *report, const char *heading, const Outcome *outcome,
                          Status (*fill)(TableStream *stream, Problem *problem),
                          const Column *column, size_t panels, size_t height) {
    TableStream *stream = table_stream_new(outcome_ref((Outcome *)(uintptr_t)outcome));
    Chart *chart = report_chart(report, heading, panels, height);
    if (stream != NULL && chart != NULL && fill(stream, NULL) == STATUS_OK) {
        if (column != NULL) {
            stream->table.columns = &column;
            stream->table.column_count = 1;
        }
        chart_table(&stream->table, chart);
    }
    table_stream_free(stream);
}

// The displacement of the top storey, else the first column.
static const Column *run_motion(const Columns *series) {
    const Column *found = series->count > 0 ? &series->at[0] : NULL;
    size_t length, best = 0;
    for (size_t i = 0; i < series->count; i++) {
        const size_t number = field_name_number(series->at[i].name, &length);
        const Channel *channel = channel_find(series->at[i].name, &length);
        if (channel != &channels[CHANNEL_DISPLACEMENT] || number < best)
            continue;
        best = number;
        found = &series->at[i];
    }
    return found;
}

// The motion, with a tick for each impact.
static void run_add_motion(Report *report, const Outcome *outcome, double duration) {
    const Impacts *impacts = &outcome->response.impacts;
    const Column *motion = run_motion(&outcome->response.series);
    if (motion == NULL)
        return;
    run_add_chart(report, "Motion", outcome, table_stream_series, motion, 1, 7);
    Chart *chart = report->sections[report->count - 1].chart;
    double *x = chart_new(chart, TICKS_MAX + 1, sizeof *x),
           *y = chart_new(chart, TICKS_MAX + 1, sizeof *y);
    size_t count = 0;
    for (size_t i = 0; i < impacts->count && count < TICKS_MAX && x != NULL && y != NULL; i++) {
        const double start = impacts->at[i].start;
        if (impacts->at[i].kind != IMPACT_IMPACT ||
            (count > 0 && start - x[count - 1] < duration / TICKS_MAX))
            continue;
        x[count] = start;
        y[count++] = -(double)INFINITY;
    }
    if (count > 0 && chart->count > 0)
        chart_add(&chart->panels[0], (ChartSeries){CHART_MARKERS, x, y, NULL, count, .colour = 1,
                                                   .shape = CHART_TICK, .legend = "impacts"});
}

static void impact_add(PrintTable *table, const Impacts *impacts, size_t i) {
    const Impact *impact = &impacts->at[i];
    print_table_add(table, "%zu", i + 1);
    report_real(table, impact->start);
    report_count(table, impact->damper);
    print_table_add(table, "%s", side_names[impact->side]);
    report_real(table, impact->approach_speed);
    report_real(table, impact->restitution);
    report_real(table, impact->duration);
    report_real(table, impact->peak_force);
    report_real(table, impact->energy_lost);
}

// Only a page has room for these: all channels, the largest impact, impacts and decisions.
static void run_add_details(Report *report, const Simulation *simulation, const Outcome *outcome) {
    const Impacts *impacts = &outcome->response.impacts;
    const Impact *largest = run_largest_impact(&outcome->response);
    const size_t number = largest != NULL ? (size_t)(largest - impacts->at) + 1 : 0;
    if (outcome->response.series.count > 1)
        run_add_chart(report, "All channels", outcome, table_stream_series, NULL, 0, 0);
    ImpactHistory history = {.impact.start = 0};
    if (largest != NULL && impact_history_make(simulation, number, IMPACT_HISTORY_POINTS, NULL,
                                               NULL, NULL, &history, NULL) == STATUS_OK) {
        TableStream *stream = table_stream_new(NULL);
        Chart *chart = report_chart(report, "Largest impact", 0, 0);
        if (stream != NULL && chart != NULL &&
            table_stream_columns(stream, &history.columns, true, NULL) == STATUS_OK)
            chart_table(&stream->table, chart);
        table_stream_free(stream);
    }
    impact_history_clear(&history);
    if (impacts->count > 0) {
        PrintTable *table = report_table(
            report, impacts->count > IMPACTS_SHOWN ? "First impacts and the largest" : "Impacts",
            impact_heads);
        for (size_t i = 0; i < impacts->count && i < IMPACTS_SHOWN; i++)
            impact_add(table, impacts, i);
        if (number > IMPACTS_SHOWN)
            impact_add(table, impacts, number - 1);
    }
    const Decisions *decisions = &outcome->plan.decisions;
    if (decisions->count == 0)
        return;
    PrintTable *table = report_table(report, "Decisions of the plan", "about|choice|reason");
    for (size_t i = 0; i < decisions->count; i++) {
        print_table_add(table, "%s", decisions->at[i].about);
        print_table_add(table, "%s", decisions->at[i].chose);
        print_table_add(table, "%s", decisions->at[i].why);
    }
}

void report_of_run(Report *report, const Simulation *simulation, const Outcome *outcome,
                   double seconds) {
    const Scene *scene = &simulation->scene;
    char took[32];
    report_sentence(report, "%.6g s at %.6g Hz, contact model %s, solver %s, computed in %s.",
                    scene->duration, scene->sample_rate, outcome->plan.contact_model,
                    outcome->plan.solver, seconds_text(took, seconds));
    if (outcome->has_reduction)
        run_add_effect(report, simulation, &outcome->reduction);
    run_add_numbers(report, outcome, scene->dampers.count == 1);
    run_add_facts(report, outcome, scene->duration);
    run_add_motion(report, outcome, scene->duration);
    if (outcome->spectrum.densities.count > 0)
        run_add_chart(report, "Spectrum", outcome, table_stream_psd, NULL, 1, 6);
    if (report->is_page)
        run_add_details(report, simulation, outcome);
    report_notes(report, &outcome->warnings);
}

// --- parts of studies ---

static void study_add_runs(Report *report, const StudyRuns *made, const char *what,
                           double seconds) {
    char took[32], failed[40] = "none failed";
    if (made->failed > 0)
        snprintf(failed, sizeof failed, "%llu failed", (unsigned long long)made->failed);
    report_sentence(report, "%s%llu runs, %s, in %s.", what, (unsigned long long)made->runs, failed,
                    seconds_text(took, seconds));
    report_notes(report, &made->warnings);
}

static Chart *study_add_chart(Report *report, const char *heading, const Variant *answer,
                              size_t panels, size_t height) {
    Chart *chart = report_chart(report, heading, panels, height);
    if (chart != NULL)
        study_chart(answer, chart);
    return chart;
}

// A scalar as JSON text, short and without quotes.
static void scalar_add(PrintTable *table, const char *json) {
    char *end;
    const double value = strtod(json, &end);
    if (end > json && *end == '\0')
        report_real(table, value);
    else if (*json == '"')
        print_table_add(table, "%.*s", (int)strlen(json) - 2, json + 1);
    else
        print_table_add(table, "%s", json);
}

static double interval_end(const Reals *interval, size_t end) {
    return interval->count == 2 ? interval->at[end] : (double)NAN;
}

static void statistics_add(Report *report, const RunStatistic *statistics, size_t count) {
    static const struct {
        const char *heading, *heads;
    } tables[] = {
        {"Statistics over the runs", "quantity|mean|95 % from|95 % to|standard deviation"},
        {"Quantiles over the runs", "quantity|smallest|5 %|16 %|median|84 %|95 %|largest"}};
    for (int t = 0; t < 2; t++) {
        PrintTable *table = report_table(report, tables[t].heading, tables[t].heads);
        report->sections[report->count - 1].is_page_only = t == 1;
        for (size_t i = 0; i < count; i++) {
            const RunStatistic *of = &statistics[i];
            const double shown[2][7] = {
                {of->mean, of->low, of->high, of->standard_deviation},
                {of->minimum, of->q05, of->q16, of->median, of->q84, of->q95, of->maximum}};
            if (isnan(of->mean))
                continue;
            report_quantity(table, statistics_metric_names[of->metric], of->unit);
            for (size_t k = 0; k + 1 < table->columns; k++)
                report_real(table, shown[t][k]);
        }
    }
}

// --- studies ---

static void tradeoff_add_points(Report *report, const Tradeoff *tradeoff, bool is_all) {
    PrintTable *table =
        report_table(report, is_all ? "All settings" : "Settings that no other one beats",
                     is_all ? "setting|CPU [s]|error|steps|remark" : "setting|CPU [s]|error|steps");
    report->sections[report->count - 1].is_page_only = is_all;
    for (size_t i = 0; i < tradeoff->points.count; i++) {
        const TradeoffPoint *point = &tradeoff->points.at[i];
        if (!is_all && !point->is_best)
            continue;
        print_table_add(table, "%s", point->name);
        report_real(table, point->cpu_minimum);
        report_real(table, error_metrics_by(&point->errors, tradeoff->metric));
        report_real(table, point->steps);
        if (is_all)
            print_table_add(table, "%s",
                            point->why != NULL ? point->why
                            : point->is_best   ? "no other is cheaper and closer"
                                               : " ");
    }
}

static void tradeoff_report(Report *report, const Variant *answer, double seconds) {
    const Tradeoff *tradeoff = (const Tradeoff *)(const void *)answer;
    char took[32];
    report_sentence(report, "%zu settings against the solver %s, in %s. Errors are those of %s%s.",
                    tradeoff->points.count, tradeoff->reference.solver, seconds_text(took, seconds),
                    metric_names[tradeoff->metric],
                    tradeoff->metric == METRIC_PSD ? ", in dB" : "");
    report_sentence(report, "Recommended: %s.", tradeoff->recommendation.why);
    tradeoff_add_points(report, tradeoff, false);
    (void)study_add_chart(report, "Error against CPU time", answer, 1, 12);
    tradeoff_add_points(report, tradeoff, true);
}

static void ensemble_report(Report *report, const Variant *answer, double seconds) {
    const Ensemble *ensemble = (const Ensemble *)(const void *)answer;
    const RunTrust *trust = &ensemble->trust;
    study_add_runs(report, &ensemble->made, "", seconds);
    if (ensemble->target.why != NULL)
        report_sentence(report, "Target: %s.", ensemble->target.why);
    if (trust->beyond > 0)
        report_sentence(report,
                        "%llu of these runs are predictable to their end, the others at least "
                        "to %.6g s; the statistics are valid beyond that.",
                        (unsigned long long)trust->whole, trust->shortest_horizon);
    statistics_add(report, ensemble->statistics.of, STATISTICS_METRICS);
    if (ensemble->indices.count > 0) {
        PrintTable *table = report_table(report, "Sobol indices: parts of the variance",
                                         "quantity|input|alone|in all|95 % from|95 % to");
        report->sections[report->count - 1].rows = ROWS_SHOWN;
        for (size_t i = 0; i < ensemble->indices.count; i++) {
            const EnsembleIndex *index = &ensemble->indices.at[i];
            if (isnan(index->sobol.first))
                continue;
            report_quantity(table, statistics_metric_names[index->metric], NULL);
            print_table_add(table, "%s", index->pointer);
            report_real(table, index->sobol.first);
            report_real(table, index->sobol.total);
            report_real(table, interval_end(&index->sobol.total_interval_95, 0));
            report_real(table, interval_end(&index->sobol.total_interval_95, 1));
        }
    }
    (void)study_add_chart(report, "Spectra and spread", answer, 1, 10);
}

// The values of the axes in a row; SIZE_MAX: none.
static void sweep_add_place(PrintTable *table, const Sweep *sweep, size_t row) {
    char text[200] = "";
    for (size_t a = 0; a < sweep->axes.count && row != SIZE_MAX; a++) {
        const size_t point = (size_t)sweep->table.points.at[row];
        const char *json = sweep->axes.at[a].values.at[sweep_value_index(sweep, a, point)];
        PrintTable one = {.columns = 1};
        scalar_add(&one, json);
        if (!one.is_failed)
            text_list(text, sizeof text, one.cells[0]);
        print_table_clear(&one);
    }
    print_table_add(table, "%s", text);
}

static void sweep_add_axes(Report *report, const Sweep *sweep, double seconds) {
    char text[600] = "", one[200], took[32], failed[60] = "";
    for (size_t a = 0; a < sweep->axes.count; a++) {
        const SweepAxisValues *axis = &sweep->axes.at[a];
        const char *first = axis->values.at[0], *last = axis->values.at[axis->values.count - 1];
        char *end;
        (void)strtod(first, &end);
        if (*end == '\0' && end > first)
            snprintf(one, sizeof one, "%.100s from %.6g to %.6g%s%.20s (%zu values)", axis->pointer,
                     strtod(first, NULL), strtod(last, NULL), axis->unit != NULL ? " " : "",
                     unit_text(axis->unit), axis->values.count);
        else
            snprintf(one, sizeof one, "%.100s (%zu values)", axis->pointer, axis->values.count);
        text_list(text, sizeof text, one);
    }
    if (sweep->table.failed > 0)
        snprintf(failed, sizeof failed, ", of which %llu failed",
                 (unsigned long long)sweep->table.failed);
    report_sentence(report, "%llu points%s, in %s: %s.", (unsigned long long)sweep->points, failed,
                    seconds_text(took, seconds), text);
}

// The points of the smallest and the largest value; false: none is known.
static bool sweep_find_ends(const Sweep *sweep, size_t metric, size_t ends[2]) {
    const size_t metrics = sweep->metrics.count;
    bool is_known = false;
    for (size_t i = 0; i < sweep->table.points.count; i++) {
        const double *values = sweep->table.values.at + metric, value = values[i * metrics];
        if (isnan(value))
            continue;
        if (!is_known || value < values[ends[0] * metrics])
            ends[0] = i;
        if (!is_known || value > values[ends[1] * metrics])
            ends[1] = i;
        is_known = true;
    }
    return is_known;
}

static void sweep_report(Report *report, const Variant *answer, double seconds) {
    const Sweep *sweep = (const Sweep *)(const void *)answer;
    const bool is_map = sweep->axes.count > 1 && sweep->mode == SWEEP_GRID;
    sweep_add_axes(report, sweep, seconds);
    // Values of several axes need a table for each end.
    const size_t tables = sweep->axes.count > 1 ? 2 : 1;
    for (size_t t = 0; t < tables; t++) {
        PrintTable *table = report_table(report, NULL,
                                         tables == 1 ? "quantity|smallest|at|largest|at"
                                         : t == 0    ? "quantity|smallest|at"
                                                     : "quantity|largest|at");
        for (size_t m = 0; m < sweep->metrics.count; m++) {
            size_t ends[2] = {0};
            const bool is_known = sweep_find_ends(sweep, m, ends);
            report_quantity(table, sweep->metrics.at[m], sweep_metric_unit(sweep->metrics.at[m]));
            for (size_t end = t; end < (tables == 1 ? 2 : t + 1); end++) {
                const double *values = sweep->table.values.at + m;
                report_real(table,
                            is_known ? values[ends[end] * sweep->metrics.count] : (double)NAN);
                sweep_add_place(table, sweep, is_known ? ends[end] : SIZE_MAX);
            }
        }
    }
    Chart *chart =
        study_add_chart(report, "Metrics over the axis", answer, is_map ? 1 : 2, is_map ? 10 : 7);
    // The first of these where it is among the metrics.
    for (size_t m = 0; m < sweep->metrics.count && m < CHART_PANELS; m++)
        if (strcmp(sweep->metrics.at[m], "rms_displacement") == 0)
            report->sections[report->count - 1].first = m;
    for (size_t i = 0; chart != NULL && i < chart->count && !is_map; i++) {
        const ChartSeries *line = &chart->panels[i].series[0];
        size_t best = 0;
        for (size_t k = 1; k < line->count; k++)
            best = isnan(line->y[best]) || line->y[k] < line->y[best] ? k : best;
        if (line->count == 0)
            continue;
        chart_add(&chart->panels[i],
                  (ChartSeries){CHART_MARKERS, line->x + best, line->y + best, NULL, 1, .colour = 1,
                                .shape = CHART_RING, .legend = "smallest"});
        // In front.
        ChartSeries *series = chart->panels[i].series, *last = &series[chart->panels[i].count - 1];
        const ChartSeries first = series[0];
        series[0] = *last;
        *last = first;
    }
}

static void compare_report(Report *report, const Variant *answer, double seconds) {
    const Comparison *comparison = (const Comparison *)(const void *)answer;
    char took[32];
    report_sentence(report,
                    "%zu contact models and separation rules, in %s. The first is the scene as it "
                    "is; \"apart\" is the time at which a displacement differs from it by %.3g of "
                    "its peak.",
                    comparison->entries.count, seconds_text(took, seconds), comparison->part);
    PrintTable *table = report_table(report, "Contact models",
                                     "model|rms x [m]|impacts|force [N]|spectra [dB]|apart [s]");
    for (size_t i = 0; i < comparison->entries.count; i++) {
        const CompareEntry *entry = &comparison->entries.at[i];
        const bool is_force = entry->separation == SEPARATION_ZERO_FORCE;
        print_table_add(table, "%s%s", entry->contact_model, is_force ? ", zero force" : "");
        report_real(table, entry->summary.rms_displacement);
        report_count(table, entry->summary.impacts);
        report_real(table, entry->summary.peak_contact_force);
        if (isnan(entry->psd.level))
            print_table_add(table, "%s", "");
        else
            print_table_add(table, "%.3g", entry->psd.level);
        report_real(table, entry->divergence.time);
    }
    for (size_t i = 0; i < comparison->entries.count; i++)
        if (comparison->entries.at[i].why != NULL &&
            warnings_add(&report->notes, "", "%s: %s", comparison->entries.at[i].name,
                         comparison->entries.at[i].why) != STATUS_OK)
            report->is_failed = true;
    (void)study_add_chart(report, "Spectra and motions", answer, 1, 10);
}

static void sensitivity_add_stops(Report *report, const Sensitivity *sensitivity) {
    PrintTable *table =
        report_table(report, "Contact parameters: relative change over that of e and of T_c",
                     "stop|k_b [N/m]|by e|by T_c|c_b [N s/m]|by e|by T_c");
    for (size_t i = 0; i < sensitivity->contact.count; i++) {
        const SensitivityStop *stop = &sensitivity->contact.at[i];
        if (stop->why != NULL)
            continue;
        print_table_add(table, "%llu %s", (unsigned long long)stop->damper, side_names[stop->side]);
        report_real(table, stop->stiffness);
        report_real(table, stop->stiffness_by_restitution);
        report_real(table, stop->stiffness_by_contact_time);
        report_real(table, stop->damping);
        report_real(table, stop->damping_by_restitution);
        report_real(table, stop->damping_by_contact_time);
    }
}

static void sensitivity_report(Report *report, const Variant *answer, double seconds) {
    const Sensitivity *sensitivity = (const Sensitivity *)(const void *)answer;
    char took[32];
    report_sentence(report,
                    "%zu parameters, %llu drawn runs, in %s. A slope of 0.5 is a change of 0.5 %% "
                    "for 1 %% of the parameter; \"-\" is a slope that does not settle.",
                    sensitivity->response.count, (unsigned long long)sensitivity->made,
                    seconds_text(took, seconds));
    if (sensitivity->why != NULL)
        report_sentence(report, "%s", sensitivity->why);
    PrintTable *table = report_table(report, "Slopes of the response",
                                     "parameter|peak x|rms x|peak a|rms a|impacts|peak force");
    for (size_t i = 0; i < sensitivity->response.count; i++) {
        const SensitivityRow *row = &sensitivity->response.at[i];
        report_quantity(table, sensitivity_parameter_names[row->parameter], NULL);
        for (int metric = 0; metric < STATISTICS_USUAL; metric++) {
            double slope = (double)NAN;
            for (size_t k = 0; k < row->slopes.count; k++)
                if (row->slopes.at[k].metric == metric && row->slopes.at[k].is_settled)
                    slope = row->slopes.at[k].derivative;
            if (isnan(slope))
                print_table_add(table, "%s", "");
            else
                print_table_add(table, "%.3g", fabs(slope) < 1e-9 ? 0 : slope);
        }
    }
    sensitivity_add_stops(report, sensitivity);
    if (sensitivity->statistics.count > 0)
        statistics_add(report, sensitivity->statistics.at, sensitivity->statistics.count);
    (void)study_add_chart(report, "Spectra and slopes", answer,
                          sensitivity->spectra.count > 0 ? 1 : 0, 8);
}

static const char *optimum_change(char target[32], double best, double given) {
    snprintf(target, 32, "%+.3g", 100 * (best / given - 1));
    return isfinite(best / given) ? target : "";
}

static void optimum_add_gain(Report *report, const Optimum *optimum) {
    PrintTable *table =
        report_table(report, "Gain", "quantity|best|as given|change [%]|without dampers");
    for (int m = 0; m < STUDY_METRIC_COUNT; m++) {
        char change[32];
        const double given = optimum->given.metrics.of[m], best = optimum->best.metrics.of[m];
        if (isnan(given) || study_metric_is_reduction(m))
            continue;
        report_quantity(table, study_metric_names[m], study_metric_unit(m));
        report_real(table, best);
        report_real(table, given);
        print_table_add(table, "%s", optimum_change(change, best, given));
        report_real(table, optimum->undamped.metrics.of[m]);
    }
}

static void optimum_add_best(Report *report, const Optimum *optimum) {
    const OptimumBest *best = &optimum->best;
    PrintTable *table =
        report_table(report, "Best values", "variable|best|within 2 % from|within 2 % to");
    for (size_t i = 0; i < best->values.count; i++) {
        const char *pointer = best->values.at[i].member.pointer, *json = best->values.at[i].value;
        const bool has_region = i < optimum->region.count;
        print_table_add(table, "%s", pointer);
        scalar_add(table, json);
        report_real(table, has_region ? optimum->region.at[i].low : (double)NAN);
        report_real(table, has_region ? optimum->region.at[i].high : (double)NAN);
    }
}

static void optimum_report(Report *report, const Variant *answer, double seconds) {
    const Optimum *optimum = (const Optimum *)(const void *)answer;
    const OptimumBest *best = &optimum->best;
    char what[60];
    snprintf(what, sizeof what, "%llu candidates, ", (unsigned long long)optimum->candidates);
    study_add_runs(report, &optimum->made, what, seconds);
    for (size_t i = 0; i < best->objectives.count; i++) {
        const OptimumObjective *objective = &best->objectives.at[i];
        const double change =
            100 * (objective->value / optimum->given.metrics.of[objective->metric] - 1);
        const char *unit = study_metric_unit(objective->metric);
        char interval[80] = "", against[60] = "";
        if (objective->interval_95.count == 2)
            snprintf(interval, sizeof interval, " (95 %% from %.6g to %.6g)",
                     objective->interval_95.at[0], objective->interval_95.at[1]);
        if (isfinite(change))
            snprintf(against, sizeof against, ", %.3g %% %s than as given", fabs(change),
                     change < 0 ? "lower" : "higher");
        report_sentence(report, "Best %s: %.6g%s%s%s%s.", study_metric_names[objective->metric],
                        objective->value, unit != NULL ? " " : "", unit_text(unit), interval,
                        against);
    }
    if (best->values.count > 0)
        optimum_add_best(report, optimum);
    optimum_add_gain(report, optimum);
    (void)study_add_chart(report, "Search", answer, 1, 8);
    const bool has_front = optimum->front.count > 0;
    const size_t count = has_front ? optimum->front.count : optimum->rivals.count;
    if (count == 0)
        return;
    PrintTable *table = report_table(report, has_front ? "Front" : "Nearly as good",
                                     has_front ? "values|first objective|second objective"
                                               : "values|difference|95 % from|95 % to");
    report->sections[report->count - 1].rows = 3;
    for (size_t i = 0; i < count; i++) {
        const OptimumValues *values =
            has_front ? &optimum->front.at[i].values : &optimum->rivals.at[i].values;
        char text[200] = "";
        for (size_t k = 0; k < values->count; k++) {
            PrintTable one = {.columns = 1};
            scalar_add(&one, values->at[k].value);
            if (!one.is_failed)
                text_list(text, sizeof text, one.cells[0]);
            print_table_clear(&one);
        }
        print_table_add(table, "%s", text);
        if (has_front) {
            report_real(table, optimum->front.at[i].objectives.at[0]);
            report_real(table, optimum->front.at[i].objectives.at[1]);
        } else {
            report_real(table, optimum->rivals.at[i].difference);
            report_real(table, interval_end(&optimum->rivals.at[i].interval_95, 0));
            report_real(table, interval_end(&optimum->rivals.at[i].interval_95, 1));
        }
    }
}

static void calibration_report(Report *report, const Variant *answer, double seconds) {
    const Calibration *calibration = (const Calibration *)(const void *)answer;
    static const char *const determined[] = {"no", "yes"};
    study_add_runs(report, &calibration->made, "", seconds);
    report_sentence(report, "Verdict: %s; %s.", calibrate_verdict_names[calibration->verdict],
                    unit_text(calibration->detail));
    PrintTable *table =
        report_table(report, "Fitted values", "parameter|value|95 % from|95 % to|determined");
    for (size_t i = 0; i < calibration->parameters.count; i++) {
        const CalibratedParameter *parameter = &calibration->parameters.at[i];
        print_table_add(table, "%s%s%s%s", parameter->member.pointer,
                        parameter->unit != NULL ? " [" : "", unit_text(parameter->unit),
                        parameter->unit != NULL ? "]" : "");
        report_real(table, parameter->value);
        report_real(table, interval_end(&parameter->interval_95, 0));
        report_real(table, interval_end(&parameter->interval_95, 1));
        print_table_add(
            table, "%s",
            parameter->identifiable == CHOICE_ABSENT ? "" : determined[parameter->identifiable]);
    }
    table = report_table(report, "Residuals", "channel|rms difference|rms measured|noise|samples");
    for (size_t i = 0; i < calibration->residuals.count; i++) {
        const CalibrationResidual *residual = &calibration->residuals.at[i];
        report_quantity(table, residual->channel, residual->unit);
        report_real(table, residual->rms);
        report_real(table, residual->measured_rms);
        report_real(table, residual->deviation);
        report_count(table, residual->samples);
    }
    (void)study_add_chart(report, "Measured and fitted", answer, 2, 7);
}

// Where the curves of rising and falling values differ: the first and the last value.
static bool response_find_jumps(const ResponseCurve *curve, double ends[2]) {
    ends[0] = ends[1] = (double)NAN;
    for (size_t i = 0; i < curve->points.count; i++)
        for (size_t k = i + 1; k < curve->points.count; k++) {
            const ResponsePoint *a = &curve->points.at[i], *b = &curve->points.at[k];
            if (a->value != b->value || a->direction == b->direction ||
                !(fabs(a->peak_displacement - b->peak_displacement) > 0.05 * a->peak_displacement))
                continue;
            ends[0] = fmin(ends[0], a->value);
            ends[1] = fmax(ends[1], a->value);
        }
    return !isnan(ends[0]);
}

static void response_add_points(Report *report, const ResponseCurve *curve) {
    PrintTable *table = report_table(report, "Points",
                                     "value|direction|period [cycles]|impacts|stable|peak "
                                     "[m]|without dampers [m]|exponent [1/s]");
    report->sections[report->count - 1].is_page_only = true;
    for (size_t i = 0; i < curve->points.count; i++) {
        const ResponsePoint *point = &curve->points.at[i];
        report_real(table, point->value);
        print_table_add(table, "%s",
                        point->direction == CURVE_UP     ? "up"
                        : point->direction == CURVE_DOWN ? "down"
                                                         : "continued");
        report_count(table, point->period);
        report_count(table,
                     point->period == COUNT_ABSENT ? COUNT_ABSENT : point->impacts_per_period);
        print_table_add(table, "%s",
                        point->stable == CHOICE_ABSENT ? "" : field_flags[point->stable]);
        report_real(table, point->peak_displacement);
        report_real(table, point->undamped_peak_displacement);
        report_real(table, point->lyapunov);
    }
}

static void response_report(Report *report, const Variant *answer, double seconds) {
    const ResponseCurve *curve = (const ResponseCurve *)(const void *)answer;
    const ResponsePoint *peak = NULL, *bare = NULL;
    size_t stable = 0, unstable = 0, aperiodic = 0, chaotic = 0;
    double ends[2];
    for (size_t i = 0; i < curve->points.count; i++) {
        const ResponsePoint *point = &curve->points.at[i];
        stable += point->stable == 1;
        unstable += point->stable == 0;
        aperiodic += point->period == COUNT_ABSENT;
        chaotic += point->lyapunov > 0;
        if (peak == NULL || point->peak_displacement > peak->peak_displacement)
            peak = point;
        if (bare == NULL || point->undamped_peak_displacement > bare->undamped_peak_displacement)
            bare = point;
    }
    study_add_runs(report, &curve->made, "", seconds);
    PrintTable *table = report_table(report, "Steady motion", NULL);
    if (peak != NULL && bare != NULL) {
        const char *unit = unit_text(curve->unit);
        print_table_add(table, "%s", "largest peak");
        print_table_add(table, "%.6g m at %s = %.6g %s", peak->peak_displacement,
                        curve->member.pointer, peak->value, unit);
        print_table_add(table, "%s", "without dampers");
        print_table_add(table, "%.6g m at %.6g %s", bare->undamped_peak_displacement, bare->value,
                        unit);
        print_table_add(table, "%s", "periodic");
        print_table_add(table, "%zu stable, %zu unstable points", stable, unstable);
        print_table_add(table, "%s", "no period found");
        print_table_add(table, "%zu points, %zu of them with a positive Lyapunov exponent",
                        aperiodic, chaotic);
        if (response_find_jumps(curve, ends)) {
            print_table_add(table, "%s", "up and down");
            print_table_add(table, "differ by more than 5 %% between %.6g and %.6g %s", ends[0],
                            ends[1], unit);
        }
    }
    (void)study_add_chart(report, "Curve", answer, 1, 14);
    response_add_points(report, curve);
}

static void fragility_report(Report *report, const Variant *answer, double seconds) {
    const Fragility *fragility = (const Fragility *)(const void *)answer;
    char what[60];
    snprintf(what, sizeof what, "%zu ground motions, ", fragility->curves.count);
    study_add_runs(report, &fragility->made, what, seconds);
    PrintTable *table = report_table(report, "Intensity at which a limit is exceeded [m/s^2]",
                                     "limit|exceeded by|median|95 % from|95 % to|dispersion");
    for (size_t i = 0; i < fragility->limits.count; i++) {
        const FragilityState *limit = &fragility->limits.at[i];
        const char *unit = study_metric_unit(limit->metric);
        print_table_add(table, "%s > %g%s%s", study_metric_names[limit->metric], limit->value,
                        unit != NULL ? " " : "", unit_text(unit));
        report_count(table, limit->exceeded);
        report_real(table, limit->median);
        report_real(table, interval_end(&limit->median_interval_95, 0));
        report_real(table, interval_end(&limit->median_interval_95, 1));
        report_real(table, limit->dispersion);
    }
    (void)study_add_chart(report, "Fragility", answer, 1, 12);
    table = report_table(report, "Fractiles over the ground motions",
                         "quantity|level [m/s^2]|16 %|50 %|84 %");
    report->sections[report->count - 1].is_page_only = true;
    for (size_t i = 0; i < fragility->fractiles.count; i++) {
        const FragilityFractile *fractile = &fragility->fractiles.at[i];
        report_quantity(table, study_metric_names[fractile->metric],
                        study_metric_unit(fractile->metric));
        report_real(table, fractile->level);
        report_real(table, fractile->p16);
        report_real(table, fractile->p50);
        report_real(table, fractile->p84);
    }
}

typedef struct StudyReport {
    const StudyKind *kind;
    void (*fill)(Report *report, const Variant *answer, double seconds);
} StudyReport;

static const StudyReport all[] = {
    {&study_tradeoff, tradeoff_report},   {&study_ensemble, ensemble_report},
    {&study_sweep, sweep_report},         {&study_compare, compare_report},
    {&study_response, response_report},   {&study_sensitivity, sensitivity_report},
    {&study_fragility, fragility_report}, {&study_calibrate, calibration_report},
    {&study_optimize, optimum_report},
};

void report_of_study(Report *report, const Variant *answer, double seconds) {
    for (size_t i = 0; i < COUNT(all); i++)
        if (all[i].kind->answer == answer->kind)
            all[i].fill(report, answer, seconds);
}
