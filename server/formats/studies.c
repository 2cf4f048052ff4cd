#include "server/formats/study_formats.h"

#include <math.h>
#include <stdio.h>
#include <string.h>

#include "core/study/ensemble.h"
#include "core/study/fragility.h"
#include "core/study/model_comparison.h"
#include "core/study/sensitivity.h"
#include "server/jobs/documents.h"
#include "server/util/csv.h"

// A row for each seed, with the drawn inputs.
static void ensemble_csv(const Variant *answer, Bytes *bytes) {
    const Ensemble *ensemble = (const Ensemble *)(const void *)answer;
    const double unknown = (double)NAN;
    bytes_text(bytes, "seed,steps");
    csv_cells_header(bytes, NULL, summary_fields);
    for (size_t i = 0; i < ensemble->inputs.count; i++) {
        const char *unit = ensemble->inputs.at[i].unit;
        bytes_format(bytes, ",%s%s%s%s", ensemble->inputs.at[i].pointer, unit != NULL ? " [" : "",
                     unit != NULL ? unit : "", unit != NULL ? "]" : "");
    }
    bytes_text(bytes, ",why\n");
    for (size_t i = 0; i < ensemble->table.count; i++) {
        const RunRecord *run = &ensemble->table.at[i];
        bytes_format(bytes, "%llu", (unsigned long long)run->number);
        csv_cells_reals(bytes, &run->steps, 1);
        csv_cells_members(bytes, summary_fields, &run->summary);
        for (size_t k = 0; k < ensemble->inputs.count; k++)
            csv_cells_reals(bytes, k < run->inputs.count ? &run->inputs.at[k] : &unknown, 1);
        bytes_text(bytes, ",");
        csv_cells_text(bytes, run->why);
        bytes_text(bytes, "\n");
    }
}

// A row for each variant, with k_b and c_b of its first stop.
static void compare_csv(const Variant *answer, Bytes *bytes) {
    const Comparison *comparison = (const Comparison *)(const void *)answer;
    bytes_text(bytes, "model,separation,status,stiffness,damping [N s/m],steps");
    csv_cells_header(bytes, NULL, summary_fields);
    csv_cells_header(bytes, "contacts", compare_contacts_fields);
    csv_cells_header(bytes, "difference", compare_differences_fields);
    csv_cells_header(bytes, "psd", spectrum_distance_fields);
    csv_cells_header(bytes, "displacement", signal_comparison_fields);
    bytes_text(bytes, ",divergence [s],why\n");
    for (size_t i = 0; i < comparison->entries.count; i++) {
        const CompareEntry *entry = &comparison->entries.at[i];
        const DerivedList *derived = &entry->derived;
        const double numbers[] = {derived->count > 0 ? derived->at[0].stiffness : (double)NAN,
                                  derived->count > 0 ? derived->at[0].damping : (double)NAN,
                                  entry->steps};
        bytes_format(bytes, "%s,%s,%s", entry->contact_model,
                     entry->separation != CHOICE_ABSENT ? separation_names[entry->separation] : "",
                     compare_status_names[entry->status]);
        csv_cells_reals(bytes, numbers, COUNT(numbers));
        csv_cells_members(bytes, summary_fields, &entry->summary);
        csv_cells_members(bytes, compare_contacts_fields, &entry->contacts);
        csv_cells_members(bytes, compare_differences_fields, &entry->differences);
        csv_cells_members(bytes, spectrum_distance_fields, &entry->psd);
        csv_cells_members(bytes, signal_comparison_fields, &entry->displacement);
        csv_cells_reals(bytes, &entry->divergence.time, 1);
        bytes_text(bytes, ",");
        csv_cells_text(bytes, entry->why);
        bytes_text(bytes, "\n");
    }
}

static void sensitivity_csv_row(Bytes *bytes, const char *parameter, const char *statistic,
                                double value, double derivative, double spread, bool is_settled) {
    const double numbers[] = {value, derivative, spread};
    bytes_format(bytes, "%s,%s", parameter, statistic);
    csv_cells_reals(bytes, numbers, COUNT(numbers));
    bytes_format(bytes, ",%s\n", is_settled ? "true" : "false");
}

// The closed forms of k_b and c_b of a stop.
static void sensitivity_csv_stop(Bytes *bytes, const SensitivityStop *stop) {
    const struct {
        const char *parameter, *what;
        double value, derivative;
    } rows[] = {
        {"restitution", "stiffness", stop->stiffness, stop->stiffness_by_restitution},
        {"contact_time", "stiffness", stop->stiffness, stop->stiffness_by_contact_time},
        {"mass", "stiffness", stop->stiffness, stop->by_damper_mass},
        {"restitution", "damping", stop->damping, stop->damping_by_restitution},
        {"contact_time", "damping", stop->damping, stop->damping_by_contact_time},
        {"mass", "damping", stop->damping, stop->by_damper_mass},
    };
    for (size_t i = 0; i < COUNT(rows); i++) {
        char statistic[64];
        snprintf(statistic, sizeof statistic, "%s %llu %s", rows[i].what,
                 (unsigned long long)stop->damper, side_names[stop->side]);
        sensitivity_csv_row(bytes, rows[i].parameter, statistic, rows[i].value, rows[i].derivative,
                            0, !isnan(rows[i].derivative));
    }
}

// A row for each parameter and statistic, stops first. The drawn runs are in the JSON alone.
static void sensitivity_csv(const Variant *answer, Bytes *bytes) {
    const Sensitivity *sensitivity = (const Sensitivity *)(const void *)answer;
    bytes_text(bytes, "parameter,statistic,value,derivative,spread,is_settled\n");
    for (size_t i = 0; i < sensitivity->contact.count; i++)
        if (sensitivity->contact.at[i].why == NULL)
            sensitivity_csv_stop(bytes, &sensitivity->contact.at[i]);
    for (size_t i = 0; i < sensitivity->response.count; i++) {
        const SensitivityRow *row = &sensitivity->response.at[i];
        for (size_t k = 0; k < row->slopes.count; k++) {
            const SensitivitySlope *slope = &row->slopes.at[k];
            sensitivity_csv_row(bytes, sensitivity_parameter_names[row->parameter],
                                statistics_metric_names[slope->metric], slope->value,
                                slope->derivative, slope->spread, slope->is_settled);
        }
    }
}

static void sweep_chart(const Variant *answer, Bytes *bytes) {
    const Sweep *sweep = (const Sweep *)(const void *)answer;
    const SweepDocument document = sweep_document(sweep);
    (void)chart_sweep(&document, bytes);
}

// A row for each run.
static void fragility_table(const Variant *variant, StudyTable *table) {
    const Fragility *answer = (const Fragility *)(const void *)variant;
    size_t columns[STUDY_METRIC_COUNT], row = 0;
    for (size_t r = 0; r < answer->curves.count; r++)
        table->rows += answer->curves.at[r].points.count;
    const size_t record = study_table_add(table, "record", NULL),
                 level = study_table_add(table, "level", "m/s^2");
    for (int m = 0; m < STUDY_METRIC_COUNT; m++)
        if (!study_metric_is_reduction(m))
            columns[m] = study_table_add(table, study_metric_names[m], study_metric_unit(m));
    for (size_t r = 0; r < answer->curves.count; r++) {
        const FragilityCurve *curve = &answer->curves.at[r];
        for (size_t l = 0; l < curve->points.count; l++, row++) {
            study_table_set_word(table, record, row, curve->record);
            study_table_set(table, level, row, curve->points.at[l].level);
            for (int m = 0; m < STUDY_METRIC_COUNT; m++)
                if (!study_metric_is_reduction(m))
                    study_table_set(table, columns[m], row, curve->points.at[l].metrics.of[m]);
        }
    }
}

static const char csv_type[] = "text/csv; charset=utf-8";

static const struct {
    const StudyKind *study;
    void (*table)(const Variant *answer, StudyTable *table); // of csv and the like; NULL: own ones
    StudyFormat formats[STUDY_FORMATS_MAX];                  // ended by one without extension
} all[] = {
    {&study_tradeoff,
     NULL,
     {{"json", "application/json", false, NULL}, {"svg", chart_type, false, chart_tradeoff}}},
    {&study_ensemble,
     NULL,
     {{"json", "application/json", false, NULL},
      {"csv", csv_type, false, ensemble_csv},
      {"svg", chart_type, false, chart_ensemble}}},
    {&study_sweep,
     NULL,
     {{"json", "application/json", false, NULL},
      {"csv", csv_type, false, NULL},
      {"npy", "application/x-npy", true, NULL},
      {"npz", "application/x-npz", true, NULL},
      {"mat", "application/x-matlab-data", true, NULL},
      {"svg", chart_type, false, sweep_chart}}},
    {&study_compare,
     NULL,
     {{"json", "application/json", false, NULL},
      {"csv", csv_type, false, compare_csv},
      {"svg", chart_type, false, chart_compare}}},
    {&study_response,
     response_curve_table,
     {{"json", "application/json", false, NULL},
      {"csv", csv_type, false, NULL},
      {"npz", "application/x-npz", true, NULL},
      {"svg", chart_type, false, chart_response}}},
    {&study_sensitivity,
     NULL,
     {{"json", "application/json", false, NULL},
      {"csv", csv_type, false, sensitivity_csv},
      {"svg", chart_type, false, chart_sensitivity}}},
    {&study_fragility,
     fragility_table,
     {{"json", "application/json", false, NULL},
      {"csv", csv_type, false, NULL},
      {"npz", "application/x-npz", true, NULL},
      {"svg", chart_type, false, chart_fragility}}},
    {&study_calibrate,
     calibration_table,
     {{"json", "application/json", false, NULL},
      {"csv", csv_type, false, NULL},
      {"npz", "application/x-npz", true, NULL},
      {"svg", chart_type, false, chart_calibration}}},
    {&study_optimize,
     table_optimum,
     {{"json", "application/json", false, NULL},
      {"csv", csv_type, false, NULL},
      {"npz", "application/x-npz", true, NULL},
      {"svg", chart_type, false, chart_optimum}}},
    {NULL, NULL, {{"json", "application/json", false, NULL}}}, // of any other
};

// The row of a kind of answers; the last one if it has none.
static size_t study_format_row(const Kind *kind) {
    size_t i = 0;
    while (i + 1 < COUNT(all) && all[i].study->answer != kind)
        i++;
    return i;
}

const StudyFormat *study_formats(const Kind *kind) {
    return all[study_format_row(kind)].formats;
}

const StudyFormat *study_format_find(const StudyFormat *formats, const char *extension) {
    while (formats->extension != NULL && strcmp(formats->extension, extension) != 0)
        formats++;
    return formats->extension != NULL ? formats : NULL;
}

static void study_format_table(const StudyFormat *format, const Table *table, Bytes *bytes) {
    if (format_write(format_find(format->extension), table, bytes, NULL) != STATUS_OK)
        bytes->is_failed = true;
}

void study_format_write(const StudyFormat *format, const StudyDocument *document, Bytes *bytes) {
    const Variant *answer = document->answer;
    const size_t row = study_format_row(answer->kind);
    if (format->write != NULL) {
        format->write(answer, bytes);
    } else if (answer->kind == study_sweep.answer) {
        SweepDocument sweep = sweep_document((const Sweep *)(const void *)answer);
        const Table table = sweep_document_table(&sweep);
        study_format_table(format, &table, bytes);
    } else if (all[row].table != NULL && strcmp(format->extension, "json") != 0) {
        StudyTable columns = {.rows = 0};
        all[row].table(answer, &columns);
        const TableSource source = study_table_source(&columns);
        const Table table = study_table_view(&columns, &source);
        study_format_table(format, &table, bytes);
        bytes->is_failed = bytes->is_failed || columns.is_failed;
        study_table_clear(&columns);
    } else {
        document_study(bytes, document);
    }
}

void study_formats_names(const StudyFormat *formats, const char *before, char *target,
                         size_t size) {
    *target = '\0';
    for (; formats->extension != NULL; formats++) {
        char name[16];
        snprintf(name, sizeof name, "%.4s%.8s", before, formats->extension);
        text_list(target, size, name);
    }
}
