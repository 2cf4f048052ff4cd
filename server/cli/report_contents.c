// Runs and studies as reports. Tables of lists take names, units and values from their Field rows;
// what a kind has beside its lists is in its own function.
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

enum { IMPACTS_SHOWN = 10, TICKS_MAX = 900, MODES_SHOWN = 3, LISTS_MAX = 4 };

// --- tables of lists ---

// A scalar as JSON text, without quotes.
static const char *scalar_text(char target[200], const char *json) {
    char *end;
    const double value = strtod(json, &end);
    if (end > json && *end == '\0')
        snprintf(target, 200, "%.6g", value);
    else
        snprintf(target, 200, "%.*s", (int)strlen(json) - 2 * (*json == '"'),
                 json + (*json == '"'));
    return target;
}

// The row of a member, or of a member of one ("errors.psd"); *item moves to the struct that has it.
static const Field *member_find(const Field *fields, const char *path, const char **item) {
    char name[80];
    size_t offset = 0;
    const size_t length = strcspn(path, ".");
    snprintf(name, sizeof name, "%.*s", (int)length, path);
    const Field *row = fields_find(fields, name, &offset);
    if (row == NULL)
        return NULL;
    *item += offset;
    if (path[length] == '\0')
        return row;
    *item += row->offset;
    return member_find(row->fields, path + length + 1, item);
}

static void member_add(PrintTable *table, const Field *row, const char *item) {
    const void *at = item + row->offset;
    char text[200] = "", one[200];
    const Reals *reals = at;
    const List *list = at;
    if (row->kind == FIELD_KIND_REAL) {
        report_real(table, *(const double *)at);
        return;
    }
    if (field_is_absent(row, item))
        text[0] = '\0';
    else if (row->kind == FIELD_KIND_COUNT)
        snprintf(text, sizeof text, "%llu", (unsigned long long)*(const uint64_t *)at);
    else if (row->kind == FIELD_KIND_FLAG)
        snprintf(text, sizeof text, "%s", *(const bool *)at ? "yes" : "no");
    else if (row->kind == FIELD_KIND_CHOICE)
        snprintf(text, sizeof text, "%s",
                 row->flags & FIELD_SCALARS ? *(const int *)at ? "yes" : "no"
                                            : row->choices[*(const int *)at]);
    else if (row->kind == FIELD_KIND_TEXT)
        text_fit(text, sizeof text,
                 row->flags & FIELD_SCALARS ? scalar_text(one, *(char *const *)at)
                                            : *(char *const *)at);
    for (size_t i = 0; row->kind == FIELD_KIND_REALS && i < reals->count; i++) {
        snprintf(one, sizeof one, "%.6g", reals->at[i]);
        text_list(text, sizeof text, one);
    }
    for (size_t i = 0; row->kind == FIELD_KIND_LIST && i < list->count; i++) { // each its "value"
        const char *inner = (const char *)list->at + i * row->size;
        const Field *value = member_find(row->fields, "value", &inner);
        text_list(text, sizeof text,
                  scalar_text(one, *(char *const *)(const void *)(inner + value->offset)));
    }
    if (row->kind == FIELD_KIND_CHOICE)
        report_quantity(table, text, NULL);
    else
        print_table_add(table, "%s",
                        strcmp(text, "1") == 0 && text_same(row->name, "unit") ? "" : text);
}

// A table of a list, or of an object whose members are alike.
typedef struct ReportList {
    const char *list; // NULL: none
    const char *heading;
    const char *columns; // MEMBER or MEMBER=head, between '|'; "" is the name of an object
    const char *only;    // items without this member are left out; NULL: none are
    bool is_page_only;
    size_t rows; // on a terminal; 0: all
} ReportList;

// A row; `item` NULL: the heads.
static void list_add_row(PrintTable *table, const char *columns, const Field *fields,
                         const char *name, const char *item) {
    for (const char *at = columns, *end; *at != '\0'; at = end + (*end == '|')) {
        char path[80];
        const size_t length = strcspn(at, "=|");
        end = at + strcspn(at, "|");
        snprintf(path, sizeof path, "%.*s", (int)length, at);
        const char *of = item;
        const Field *row = member_find(fields, path, item != NULL ? &of : &(const char *){path});
        if (item == NULL && at[length] == '=')
            print_table_add(table, "%.*s", (int)(end - at - (ptrdiff_t)length - 1),
                            at + length + 1);
        else if (row == NULL || item == NULL) // a head, or an object's name
            report_quantity(table, row != NULL ? row->name : name, row != NULL ? row->unit : NULL);
        else
            member_add(table, row, of);
    }
}

static void list_add(Report *report, const Field *fields, const void *of, const ReportList *list) {
    const char *at = of;
    const Field *row = member_find(fields, list->list, &at);
    const bool is_list = row->kind == FIELD_KIND_LIST;
    const List *items = (const void *)(at + row->offset);
    PrintTable *table = &report_section(report, list->heading)->table;
    report->sections[report->count - 1].is_page_only = list->is_page_only;
    report->sections[report->count - 1].rows = list->rows;
    table->has_heads = true;
    list_add_row(table, list->columns, is_list ? row->fields : row->fields->fields, "quantity",
                 NULL);
    table->columns = table->count;
    size_t count = 0;
    for (size_t i = 0; is_list ? i < items->count : row->fields[i].kind != FIELD_KIND_END; i++) {
        const Field *rows = is_list ? row->fields : row->fields[i].fields;
        const char *item = is_list ? (const char *)items->at + i * row->size
                                   : at + row->offset + row->fields[i].offset;
        const char *inner = item;
        const Field *only = list->only != NULL ? member_find(rows, list->only, &inner) : NULL;
        const bool is_left =
            only != NULL && (only->kind == FIELD_KIND_FLAG ? !*(const bool *)(inner + only->offset)
                                                           : field_is_absent(only, inner));
        if (!is_left)
            list_add_row(table, list->columns, rows, is_list ? "" : row->fields[i].name, item);
        count += !is_left;
    }
    if (count == 0)
        print_table_clear(table);
}

// --- run ---

// "The damper lowers the rms displacement by 30.8 %, the rms acceleration by 36.3 %. Unchanged:
// peak displacement." A change below 0.05 % is none.
static void run_add_effect(Report *report, const Reduction *reduction, bool is_one) {
    static const char *const names[] = {"peak displacement", "rms displacement",
                                        "peak acceleration", "rms acceleration"};
    static const char *const words[] = {"lower", "raise", "unchanged"};
    const double of[] = {
        reduction->peak_displacement_reduction, reduction->rms_displacement_reduction,
        reduction->peak_acceleration_reduction, reduction->rms_acceleration_reduction};
    char lists[COUNT(words)][200] = {"", "", ""}, one[80];
    for (size_t i = 0; i < COUNT(of); i++) {
        const size_t which = !(fabs(of[i]) > 5e-4) ? 2 : of[i] > 0 ? 0 : 1;
        snprintf(one, sizeof one, which == 2 ? "%s" : "the %s by %.3g %%", names[i],
                 100 * fabs(of[i]));
        if (!isnan(of[i]))
            text_list(lists[which], sizeof lists[which], one);
    }
    for (size_t which = 0; which < 2; which++)
        if (lists[which][0] != '\0')
            report_sentence(report, "The damper%s %s%s %s.", is_one ? "" : "s", words[which],
                            is_one ? "s" : "", lists[which]);
    if (lists[2][0] != '\0' && (lists[0][0] != '\0' || lists[1][0] != '\0'))
        report_sentence(report, "Unchanged: %s.", lists[2]);
}

// The numbers of the summary, beside those without dampers where they are known.
static void run_add_numbers(Report *report, const Outcome *outcome) {
    PrintTable *table = report_table(
        report, NULL,
        outcome->has_reduction ? "response|with dampers|without|change [%]" : "response|value");
    for (const Field *row = summary_fields; row->kind != FIELD_KIND_END; row++) {
        char name[80];
        const char *of = (const char *)&outcome->reduction, *own = (const char *)&outcome->summary;
        snprintf(name, sizeof name, "%.60s_reduction", row->name);
        const Field *reduction = member_find(reduction_fields, name, &of);
        if (reduction == NULL || field_is_absent(row, own))
            continue;
        report_quantity(table, row->name, row->unit);
        member_add(table, row, own);
        if (!outcome->has_reduction)
            continue;
        const double part = *(const double *)(const void *)(of + reduction->offset);
        const double value = *(const double *)(const void *)(own + row->offset);
        report_real(table, part < 1 ? value / (1 - part) : (double)NAN);
        report_real(table, part == 0 ? 0 : -100 * part);
    }
}

static const Impact *run_largest_impact(const Impacts *impacts) {
    const Impact *largest = NULL;
    for (const Impact *one = impacts->at; one < impacts->at + impacts->count; one++)
        if (one->peak_force > (largest != NULL ? largest->peak_force : -1))
            largest = one;
    return largest;
}

static void run_add_modes(PrintTable *table, const PlanModes *modes) {
    Bytes text = {0};
    for (size_t i = 0; i < modes->count && i < MODES_SHOWN; i++)
        bytes_format(&text, "%s%.6g Hz (damping ratio %.3g)", i > 0 ? ", " : "",
                     modes->at[i].frequency, modes->at[i].damping_ratio);
    if (modes->count > MODES_SHOWN)
        bytes_format(&text, ", and %zu more", modes->count - MODES_SHOWN);
    if (modes->count > 0)
        report_fact(table, modes->count > 1 ? "modes" : "mode", &text);
}

static void run_add_facts(Report *report, const Outcome *outcome, double duration) {
    const Response *response = &outcome->response;
    const Impact *largest = run_largest_impact(&response->impacts);
    const double force = outcome->summary.peak_contact_force;
    PrintTable *table = report_table(report, NULL, NULL);
    Bytes text = {0};
    bytes_format(&text, "%llu", (unsigned long long)response->impact_count);
    if (response->resting_count > 0)
        bytes_format(&text, ", %llu intervals of persistent contact",
                     (unsigned long long)response->resting_count);
    const bool has_force = force > 0;
    if (response->impact_count > 0 && !has_force)
        bytes_text(&text, ", of impulses, which have no contact force");
    else if (!isnan(force) && response->impact_count > 0)
        bytes_format(&text, ", largest contact force %.6g N", force);
    if (largest != NULL && has_force)
        bytes_format(&text, " at %.6g s (damper %llu, %s)", largest->start,
                     (unsigned long long)largest->damper, side_names[largest->side]);
    report_fact(table, "impacts", &text);
    run_add_modes(table, &outcome->plan.modes);
    if (isnan(outcome->summary.error_estimate))
        bytes_text(&text, "not estimated by this solver");
    else if (isnan(outcome->summary.trust_horizon))
        bytes_format(&text,
                     "error estimate %.3g of the largest displacement; the whole run is "
                     "predictable",
                     outcome->summary.error_estimate);
    else
        bytes_format(&text,
                     "predictable until %.6g s of %.6g s; beyond that only statistics are valid",
                     outcome->summary.trust_horizon, duration);
    bytes_format(&text, "; energy residual %.3g", outcome->summary.energy_residual);
    report_fact(table, "accuracy", &text);
}

// A part of the outcome as a chart. `column`: it alone; NULL: all.
static Chart *run_add_chart(Report *report, const char *heading, const Outcome *outcome,
                            Status (*fill)(TableStream *stream, Problem *problem),
                            const Column *column, size_t height) {
    TableStream *stream = table_stream_new(outcome_ref((Outcome *)(uintptr_t)outcome));
    Chart *chart = report_chart(report, heading, height > 0, height);
    if (stream != NULL && chart != NULL && fill(stream, NULL) == STATUS_OK) {
        if (column != NULL) {
            stream->table.columns = &column;
            stream->table.column_count = 1;
        }
        chart_table(&stream->table, chart);
    }
    table_stream_free(stream);
    return chart;
}

// The displacement of the top storey, else the first channel.
static const Column *run_motion(const Columns *series) {
    const Column *found = NULL;
    for (size_t i = 0, number; i < series->count; i++)
        if (channel_find(series->at[i].name, &number) == &channels[CHANNEL_DISPLACEMENT])
            found = &series->at[i];
    return found != NULL || series->count == 0 ? found : &series->at[0];
}

// The motion, with a tick for each impact.
static void run_add_motion(Report *report, const Outcome *outcome, double duration) {
    const Impacts *impacts = &outcome->response.impacts;
    const Column *motion = run_motion(&outcome->response.series);
    if (motion == NULL)
        return;
    Chart *chart = run_add_chart(report, "Motion", outcome, table_stream_series, motion, 6);
    double *x = chart_new(chart, TICKS_MAX, sizeof *x), *y = chart_new(chart, TICKS_MAX, sizeof *y);
    size_t count = 0;
    for (size_t i = 0; i < impacts->count && count < TICKS_MAX && x != NULL && y != NULL; i++) {
        const double start = impacts->at[i].start;
        if (count > 0 && start - x[count - 1] < duration / TICKS_MAX)
            continue;
        x[count] = start;
        y[count++] = -(double)INFINITY;
    }
    if (count > 0 && chart->count > 0)
        chart_add(&chart->panels[0], (ChartSeries){CHART_MARKERS, x, y, NULL, count, .colour = 1,
                                                   .shape = CHART_TICK, .legend = "impacts"});
}

// Only a page has room for these: all channels, the largest impact, impacts and decisions.
static void run_add_details(Report *report, const Simulation *simulation, const Outcome *outcome) {
    static const char impact_columns[] = "kind|start|end|damper|side|approach_speed|restitution|"
                                         "peak_force|impulse|energy_lost";
    const Impacts *impacts = &outcome->response.impacts;
    const Impact *largest = run_largest_impact(impacts);
    if (outcome->response.series.count > 1)
        (void)run_add_chart(report, "All channels", outcome, table_stream_series, NULL, 0);
    const SimulationLimits limits = {.bytes = SIMULATION_BYTES};
    ImpactHistory history = {.impact = {0}};
    TableStream *stream = table_stream_new(NULL);
    if (stream != NULL && largest != NULL &&
        impact_history_make(simulation, (size_t)(largest - impacts->at) + 1, IMPACT_HISTORY_POINTS,
                            &limits, NULL, NULL, &history, NULL) == STATUS_OK &&
        table_stream_columns(stream, &history.columns, true, NULL) == STATUS_OK) {
        Chart *chart = report_chart(report, "Largest impact, pressing is positive", 0, 0);
        if (chart != NULL)
            chart_table(&stream->table, chart);
    }
    table_stream_free(stream);
    impact_history_clear(&history);
    const Field rows[] = {{.name = "impacts",
                           .kind = FIELD_KIND_LIST,
                           .fields = impact_fields,
                           .size = sizeof(Impact)},
                          FIELD_END};
    const Impacts first = {impacts->at,
                           impacts->count < IMPACTS_SHOWN ? impacts->count : IMPACTS_SHOWN};
    list_add(report, rows, &first,
             &(ReportList){"impacts", "First impacts", impact_columns, NULL, true, 0});
    list_add(report, plan_report_fields, &outcome->plan,
             &(ReportList){"decisions", "Decisions of the plan", "about|chose|value|unit|why", NULL,
                           true, 0});
}

static const char stop_columns[] = "damper|side|material|restitution=e|contact_time=T_c [s]|"
                                   "stiffness=k_b [N/m]|damping=c_b [N s/m]";

void report_of_run(Report *report, const Simulation *simulation, const Outcome *outcome,
                   double seconds) {
    const Scene *scene = &simulation->scene;
    char took[32];
    report_sentence(report, "%.6g s at %.6g Hz, contact model %s, solver %s, computed in %s.",
                    scene->duration, scene->sample_rate, outcome->plan.contact_model,
                    outcome->plan.solver, report_seconds(took, seconds));
    if (outcome->has_reduction)
        run_add_effect(report, &outcome->reduction, scene->dampers.count == 1);
    run_add_numbers(report, outcome);
    run_add_facts(report, outcome, scene->duration);
    list_add(report, plan_report_fields, &outcome->plan,
             &(ReportList){"derived", NULL, stop_columns, NULL, false, 4});
    run_add_motion(report, outcome, scene->duration);
    if (outcome->spectrum.densities.count > 0)
        (void)run_add_chart(report, "Spectrum", outcome, table_stream_psd, NULL, 6);
    if (report->is_page)
        run_add_details(report, simulation, outcome);
    report_notes(report, &outcome->warnings);
}

void report_of_check(Report *report, const StudyRequest *request, const PlanReport *plan,
                     const Cost *cost) {
    const Scene *scene = &request->simulation.scene;
    char took[32];
    const double megabytes = 1e-6 * cost->bytes;
    report_sentence(report, "The scene has no faults: %.6g s at %.6g Hz, %zu samples%s%s.",
                    scene->duration, scene->sample_rate, scene_sample_count(scene),
                    request->study != NULL ? ", with the study " : "",
                    request->study != NULL ? request->study->kind->name : "");
    report_sentence(report, "Predicted cost: %s of CPU time, %.3g MB of memory.",
                    report_seconds(took, cost->cpu_seconds), megabytes);
    PrintTable *table = report_table(report, NULL, NULL);
    for (size_t i = 0; i < plan->decisions.count; i++) {
        const Decision *one = &plan->decisions.at[i];
        char value[80] = "";
        if (!isnan(one->value))
            snprintf(value, sizeof value, " (%.6g%s%.40s)", one->value,
                     one->unit != NULL ? " " : "", one->unit != NULL ? one->unit : "");
        report_quantity(table, one->about, NULL);
        print_table_add(table, "%s: %s%s", one->chose, one->why, value);
    }
    run_add_modes(table, &plan->modes);
    list_add(report, plan_report_fields, plan,
             &(ReportList){"derived", NULL,
                           "damper|side|material|restitution=e|contact_time=T_c [s]|"
                           "effective_mass=m_e [kg]|stiffness=k_b [N/m]|damping=c_b [N s/m]",
                           NULL, false, 0});
}

// --- studies ---

static void tradeoff_report(Report *report, const Variant *answer) {
    const Tradeoff *tradeoff = (const Tradeoff *)(const void *)answer;
    report_sentence(report, "Recommended: %s.", tradeoff->recommendation.why);
}

static void ensemble_report(Report *report, const Variant *answer) {
    const Ensemble *ensemble = (const Ensemble *)(const void *)answer;
    if (ensemble->target.why != NULL)
        report_sentence(report, "Target: %s.", ensemble->target.why);
    if (ensemble->trust.beyond > 0)
        report_sentence(report,
                        "%llu runs are predictable to their end, the others at least to %.6g s; "
                        "the statistics are valid beyond that.",
                        (unsigned long long)ensemble->trust.whole,
                        ensemble->trust.shortest_horizon);
}

// The values of the axes in a row.
static void sweep_add_place(PrintTable *table, const Sweep *sweep, size_t row) {
    char text[200] = "", one[200];
    const size_t point = (size_t)sweep->table.points.at[row];
    for (size_t a = 0; a < sweep->axes.count; a++)
        text_list(
            text, sizeof text,
            scalar_text(one, sweep->axes.at[a].values.at[sweep_value_index(sweep, a, point)]));
    print_table_add(table, "%s", text);
}

// A metric's smallest (0) or largest value (1) and its place.
static void sweep_add_end(PrintTable *table, const Sweep *sweep, size_t metric, int end) {
    size_t found = SIZE_MAX;
    const double *values = sweep->table.values.at + metric;
    const size_t step = sweep->metrics.count;
    for (size_t i = 0; i < sweep->table.points.count; i++)
        if (!isnan(values[i * step]) &&
            (found == SIZE_MAX || (end == 0 ? values[i * step] < values[found * step]
                                            : values[i * step] > values[found * step])))
            found = i;
    report_real(table, found != SIZE_MAX ? values[found * step] : (double)NAN);
    if (found != SIZE_MAX)
        sweep_add_place(table, sweep, found);
    else
        print_table_add(table, "%s", "");
}

static void sweep_report(Report *report, const Variant *answer) {
    const Sweep *sweep = (const Sweep *)(const void *)answer;
    const bool is_narrow = sweep->axes.count == 1; // a table has room for both ends
    char text[600] = "", axis[300], first[200], last[200];
    for (size_t a = 0; a < sweep->axes.count; a++) {
        const SweepAxisValues *of = &sweep->axes.at[a];
        snprintf(axis, sizeof axis, "%.80s from %.60s to %.60s%s%.20s (%zu values)", of->pointer,
                 scalar_text(first, of->values.at[0]),
                 scalar_text(last, of->values.at[of->values.count - 1]),
                 of->unit != NULL ? " " : "", of->unit != NULL ? of->unit : "", of->values.count);
        text_list(text, sizeof text, axis);
    }
    report_sentence(report, "%s.", text);
    for (int t = 0; t < (is_narrow ? 1 : 2); t++) {
        PrintTable *table = report_table(report, NULL,
                                         is_narrow ? "quantity|smallest|at|largest|at"
                                         : t == 0  ? "quantity|smallest|at"
                                                   : "quantity|largest|at");
        for (size_t m = 0; m < sweep->metrics.count; m++) {
            report_quantity(table, sweep->metrics.at[m], sweep_metric_unit(sweep->metrics.at[m]));
            sweep_add_end(table, sweep, m, t);
            if (is_narrow)
                sweep_add_end(table, sweep, m, 1);
        }
    }
}

// On a terminal the first chart is that of the rms displacement, where there is one; the smallest
// value of a line has a ring, in front.
static void sweep_finish(ReportSection *section, const Variant *answer) {
    const Sweep *sweep = (const Sweep *)(const void *)answer;
    const bool is_map = sweep->axes.count > 1 && sweep->mode == SWEEP_GRID;
    for (size_t i = 0; i < section->chart->count; i++) {
        ChartPanel *panel = &section->chart->panels[i];
        const ChartSeries line = panel->series[0];
        size_t best = 0;
        if (strcmp(sweep->metrics.at[i], "rms_displacement") == 0)
            section->first = i;
        for (size_t k = 1; k < line.count && !is_map; k++)
            best = isnan(line.y[best]) || line.y[k] < line.y[best] ? k : best;
        if (is_map || line.count == 0)
            continue;
        chart_add(panel, line);
        panel->series[0] =
            (ChartSeries){CHART_MARKERS, line.x + best,       line.y + best,       NULL, 1,
                          .colour = 1,   .shape = CHART_RING, .legend = "smallest"};
    }
}

static void compare_report(Report *report, const Variant *answer) {
    const Comparison *comparison = (const Comparison *)(const void *)answer;
    report_sentence(report, "The first is the scene as it is; PSD is the distance of spectra from "
                            "its own.");
    for (const CompareEntry *entry = comparison->entries.at;
         entry < comparison->entries.at + comparison->entries.count; entry++)
        if (entry->why != NULL &&
            warnings_add(&report->notes, entry->name, "%s", entry->why) != STATUS_OK)
            report->is_failed = true;
}

static void sensitivity_report(Report *report, const Variant *answer) {
    const Sensitivity *sensitivity = (const Sensitivity *)(const void *)answer;
    report_sentence(report, "A slope of 0.5 is a change of 0.5 %% for 1 %% of the parameter; \"-\" "
                            "is a slope that does not settle.");
    if (sensitivity->why != NULL)
        report_sentence(report, "%s.", sensitivity->why);
    PrintTable *table = report_table(report, "Slopes of the response",
                                     "parameter|peak x|rms x|peak a|rms a|impacts|peak force");
    for (size_t i = 0; i < sensitivity->response.count; i++) {
        const SensitivityRow *row = &sensitivity->response.at[i];
        double slopes[STATISTICS_USUAL] = {0};
        report_quantity(table, sensitivity_parameter_names[row->parameter], NULL);
        for (int m = 0; m < STATISTICS_USUAL; m++)
            slopes[m] = (double)NAN;
        for (size_t k = 0; k < row->slopes.count; k++)
            if (row->slopes.at[k].is_settled && row->slopes.at[k].metric < STATISTICS_USUAL)
                slopes[row->slopes.at[k].metric] = row->slopes.at[k].derivative;
        for (int m = 0; m < STATISTICS_USUAL; m++)
            report_real(table, fabs(slopes[m]) < 1e-9 ? 0 : slopes[m]);
    }
}

static void optimum_report(Report *report, const Variant *answer) {
    const Optimum *optimum = (const Optimum *)(const void *)answer;
    const OptimumBest *best = &optimum->best;
    for (size_t i = 0; i < best->objectives.count; i++) {
        const OptimumObjective *objective = &best->objectives.at[i];
        const double given = optimum->given.metrics.of[objective->metric];
        const double change = 100 * (objective->value / given - 1);
        const char *unit = study_metric_unit(objective->metric);
        char than[80];
        if (objective->value == given)
            snprintf(than, sizeof than, "the same as given");
        else if (!isfinite(change) || change > 200)
            snprintf(than, sizeof than, "%.6g as given", given);
        else
            snprintf(than, sizeof than, "%.3g %% %s than as given", fabs(change),
                     change < 0 ? "lower" : "higher");
        report_sentence(report, "Best %s of %llu candidates: %.6g%s%s, %s.",
                        study_metric_names[objective->metric],
                        (unsigned long long)optimum->candidates, objective->value,
                        unit != NULL ? " " : "", unit != NULL ? unit : "",
                        isnan(given) ? "not defined as given" : than);
    }
    list_add(report, answer->kind->fields, answer,
             &(ReportList){"best.values", "Best values", "pointer=variable|value", NULL, false, 0});
    list_add(report, answer->kind->fields, answer,
             &(ReportList){"region", "Within 2 % of the best", "pointer=variable|low|high", "low",
                           false, 0});
    for (size_t i = 0; i < best->values.count; i++) {
        char one[200];
        report_next(report, "%s --set %s=%s", i > 0 ? report->next : "--set study=null",
                    best->values.at[i].member.pointer, scalar_text(one, best->values.at[i].value));
    }
    PrintTable *table =
        report_table(report, "Gain", "quantity|best|as given|change [%]|without dampers");
    for (int m = 0; m < STUDY_METRIC_COUNT; m++) {
        const double given = optimum->given.metrics.of[m];
        const double value = best->values.count > 0 ? best->metrics.of[m] : (double)NAN;
        if (isnan(given) || study_metric_is_reduction(m))
            continue;
        report_quantity(table, study_metric_names[m], study_metric_unit(m));
        report_real(table, value);
        report_real(table, given);
        report_real(table, given != 0 ? 100 * (value / given - 1) : (double)NAN);
        report_real(table, optimum->undamped.metrics.of[m]);
    }
}

static void calibration_report(Report *report, const Variant *answer) {
    const Calibration *calibration = (const Calibration *)(const void *)answer;
    report_sentence(report, "Verdict: %s.", calibrate_verdict_names[calibration->verdict]);
    if (calibration->detail != NULL)
        report_sentence(report, "%s.", calibration->detail);
}

static void response_report(Report *report, const Variant *answer) {
    const ResponseCurve *curve = (const ResponseCurve *)(const void *)answer;
    const char *unit = curve->unit != NULL ? curve->unit : "";
    const ResponsePoint *peak = curve->points.at, *bare = peak;
    size_t stable = 0, unstable = 0, aperiodic = 0, chaotic = 0;
    Bytes text = {0};
    for (const ResponsePoint *at = peak; at < curve->points.at + curve->points.count; at++) {
        stable += at->stable == 1;
        unstable += at->stable == 0;
        aperiodic += at->period == COUNT_ABSENT;
        chaotic += at->lyapunov > 0;
        peak = at->peak_displacement > peak->peak_displacement ? at : peak;
        bare = at->undamped_peak_displacement > bare->undamped_peak_displacement ? at : bare;
    }
    if (peak == NULL)
        return;
    PrintTable *table = report_table(report, NULL, NULL);
    bytes_format(&text, "%.6g m at %s = %.6g %s", peak->peak_displacement, curve->member.pointer,
                 peak->value, unit);
    report_fact(table, "largest peak", &text);
    bytes_format(&text, "%.6g m at %.6g %s", bare->undamped_peak_displacement, bare->value, unit);
    report_fact(table, "without dampers", &text);
    bytes_format(&text, "%zu stable and %zu unstable points", stable, unstable);
    report_fact(table, "periodic", &text);
    bytes_format(&text, "%zu points, %zu of them with a positive Lyapunov exponent", aperiodic,
                 chaotic);
    report_fact(table, "no period found", &text);
}

// A kind of study: what is counted, its own sentences and tables, lists, the chart, further lists.
typedef struct StudyReport {
    const StudyKind *kind;
    const char *counted, *noun; // a member of the answer, and what it counts: "runs"
    void (*begin)(Report *report, const Variant *answer);          // NULL: nothing
    ReportList before[LISTS_MAX], after[LISTS_MAX];                // before and after the chart
    const char *heading;                                           // of the chart
    size_t panels, height;                                         // as in a section
    void (*finish)(ReportSection *section, const Variant *answer); // of the chart; NULL: nothing
} StudyReport;

#define STATISTICS_COLUMNS "unit|mean|low=95 % from|high=95 % to|standard_deviation=deviation"
#define QUANTILE_COLUMNS "unit|minimum|q05=5 %|median|q95=95 %|maximum"

// clang-format off
static const StudyReport all[] = {
    {&study_tradeoff, "points", "settings", tradeoff_report,
     {{"points", "Settings that no other one beats, with their errors", "name=setting|cpu_minimum=CPU [s]|steps|errors.displacement|errors.psd", "is_best", false, 0}},
     {{"points", "All settings", "name=setting|status|cpu_minimum=CPU [s]|steps|errors.displacement|errors.mean_acceleration|errors.peak_force|errors.impacts|errors.psd|why", NULL, true, 0}},
     "Error against CPU time", 1, 12, NULL},
    {&study_ensemble, "runs", "runs", ensemble_report,
     {{"statistics", NULL, "|" STATISTICS_COLUMNS, "mean", false, 0}},
     {{"statistics", "Quantiles over the runs", "|" QUANTILE_COLUMNS, "mean", true, 0},
      {"indices", "Sobol indices: parts of the variance", "metric|pointer=input|first=alone|total=in all|total_interval_95=95 %", "total", false, 6}},
     "Spectra and spread", 1, 10, NULL},
    {&study_sweep, "points", "points", sweep_report, {{0}}, {{0}}, "Metrics over the axes", 1, 10, sweep_finish},
    {&study_compare, "entries", "contact models and separation rules", compare_report,
     {{"entries", NULL, "contact_model=model|separation|summary.rms_displacement=rms x [m]|summary.impacts|summary.peak_contact_force=force [N]|psd.level=PSD [dB]", NULL, false, 0}},
     {{"entries", "Motions", "name=model|summary.peak_displacement|displacement.relative|displacement.correlation|divergence.time=apart at [s]|divergence.is_trusted=trusted", NULL, true, 0}},
     "Spectra and motions", 1, 10, NULL},
    {&study_response, "runs", "points", response_report, {{0}},
     {{"points", "Points", "value|direction|period|impacts_per_period|stable|peak_displacement|undamped_peak_displacement|lyapunov", NULL, true, 0}},
     "Curve", 1, 14, NULL},
    {&study_sensitivity, "made", "drawn runs", sensitivity_report,
     {{"contact", "Contact parameters", "damper|side|stiffness=k_b [N/m]|stiffness_by_restitution=by e|stiffness_by_contact_time=by T_c|damping=c_b [N s/m]|damping_by_restitution=by e|damping_by_contact_time=by T_c", "stiffness", false, 6},
      {"statistics", "Statistics over the drawn runs", "metric=quantity|" STATISTICS_COLUMNS, "mean", false, 0}},
     {{"statistics", "Quantiles over the drawn runs", "metric=quantity|" QUANTILE_COLUMNS, "mean", true, 0}},
     "Spectra and slopes", 1, 8, NULL},
    {&study_fragility, "runs", "runs", NULL,
     {{"limits", NULL, "metric|value=limit|exceeded|median|median_interval_95=95 %|dispersion", NULL, false, 0}},
     {{"fractiles", "Fractiles over the ground motions", "metric|level|count|p16|p50|p84", NULL, true, 0}},
     "Fragility", 1, 12, NULL},
    {&study_calibrate, "runs", "runs", calibration_report,
     {{"parameters", "Fitted values", "pointer=parameter|value|unit|interval_95=95 %|identifiable=determined", NULL, false, 0},
      {"residual_rms", "Residuals", "channel|unit|value=rms of difference|measured_rms=rms measured|deviation=noise", NULL, false, 0}},
     {{0}}, "Measured and fitted", 2, 6, NULL},
    {&study_optimize, "runs", "runs", optimum_report,
     {{0}},
     {{"rivals", "Nearly as good", "values|difference|interval_95=95 %", NULL, false, 3},
      {"front", "Best compromises", "values|objectives", NULL, false, 3}},
     "Search", 1, 8, NULL},
};
// clang-format on

// "44 runs in 326 ms, none failed." and the warnings of the runs.
static void study_add_count(Report *report, const StudyReport *of, const Variant *answer,
                            double seconds) {
    const Field *fields = answer->kind->fields;
    const char *at[3] = {(const char *)answer, (const char *)answer, (const char *)answer};
    const Field *counted = member_find(fields, of->counted, &at[0]);
    const Field *failed = member_find(fields, "failed", &at[1]);
    if (failed == NULL) // of a sweep
        failed = member_find(fields, "table.failed", &at[1]);
    const Field *warnings = member_find(fields, "warnings", &at[2]);
    const void *count = at[0] + counted->offset;
    const bool is_list = counted->kind == FIELD_KIND_LIST;
    char took[32], lost[40] = "";
    const uint64_t losses =
        failed != NULL ? *(const uint64_t *)(const void *)(at[1] + failed->offset) : 0;
    if (losses > 0)
        snprintf(lost, sizeof lost, ", %llu failed", (unsigned long long)losses);
    report_sentence(report, "%llu %s in %s%s.",
                    is_list ? (unsigned long long)((const List *)count)->count
                            : (unsigned long long)*(const uint64_t *)count,
                    of->noun, report_seconds(took, seconds),
                    losses > 0       ? lost
                    : failed != NULL ? ", none failed"
                                     : "");
    if (warnings != NULL)
        report_notes(report, (const void *)(at[2] + warnings->offset));
}

void report_of_study(Report *report, const Variant *answer, double seconds) {
    size_t k = 0;
    while (all[k].kind->answer != answer->kind)
        k++;
    const StudyReport *of = &all[k];
    study_add_count(report, of, answer, seconds);
    if (of->begin != NULL)
        of->begin(report, answer);
    for (const ReportList *list = of->before; list->list != NULL; list++)
        list_add(report, answer->kind->fields, answer, list);
    Chart *chart = report_chart(report, of->heading, of->panels, of->height);
    if (chart != NULL)
        study_chart(answer, chart);
    if (chart != NULL && of->finish != NULL)
        of->finish(&report->sections[report->count - 1], answer);
    for (const ReportList *list = of->after; list->list != NULL; list++)
        list_add(report, answer->kind->fields, answer, list);
}
