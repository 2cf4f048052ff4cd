#include "server/formats/study_formats.h"

#include <math.h>
#include <stdio.h>
#include <string.h>

#include "core/study/ensemble.h"
#include "core/study/fragility.h"
#include "core/study/model_comparison.h"
#include "core/study/sensitivity.h"
#include "server/jobs/documents.h"

// A row for each seed, with the drawn inputs.
static void ensemble_table(const Variant *answer, StudyTable *table) {
    const Ensemble *ensemble = (const Ensemble *)(const void *)answer;
    for (size_t i = 0; i < ensemble->table.count; i++) {
        const RunRecord *run = &ensemble->table.at[i];
        study_table_row(table);
        study_table_number(table, "seed", NULL, (double)run->number);
        study_table_number(table, "steps", NULL, run->steps);
        study_table_members(table, NULL, summary_fields, &run->summary);
        for (size_t k = 0; k < ensemble->inputs.count; k++) {
            const EnsembleInput *input = &ensemble->inputs.at[k];
            study_table_number(table, input->pointer, input->is_factor ? "factor" : input->unit,
                               k < run->inputs.count ? run->inputs.at[k] : (double)NAN);
        }
        study_table_text(table, "why", run->why);
    }
}

// A row for each variant, with k_b and c_b of its first stop.
static void compare_table(const Variant *answer, StudyTable *table) {
    const Comparison *comparison = (const Comparison *)(const void *)answer;
    for (size_t i = 0; i < comparison->entries.count; i++) {
        const CompareEntry *entry = &comparison->entries.at[i];
        const bool has_stop = entry->derived.count > 0;
        const bool has_separation = entry->separation != CHOICE_ABSENT;
        study_table_row(table);
        study_table_text(table, "model", entry->contact_model);
        study_table_text(table, "separation",
                         has_separation ? separation_names[entry->separation] : NULL);
        study_table_text(table, "status", compare_status_names[entry->status]);
        study_table_number(table, "stiffness", NULL,
                           has_stop ? entry->derived.at[0].stiffness : (double)NAN);
        study_table_number(table, "damping", "N s/m",
                           has_stop ? entry->derived.at[0].damping : (double)NAN);
        study_table_number(table, "steps", NULL, entry->steps);
        study_table_members(table, NULL, summary_fields, &entry->summary);
        study_table_members(table, "contacts", compare_contacts_fields, &entry->contacts);
        study_table_members(table, "difference", compare_differences_fields, &entry->differences);
        study_table_members(table, "psd", spectrum_distance_fields, &entry->psd);
        study_table_members(table, "displacement", signal_comparison_fields, &entry->displacement);
        study_table_number(table, "divergence", "s", entry->divergence.time);
        study_table_text(table, "why", entry->why);
    }
}

static void sensitivity_add(StudyTable *table, const char *parameter, const char *statistic,
                            double value, double derivative, double spread, bool is_settled) {
    study_table_row(table);
    study_table_text(table, "parameter", parameter);
    study_table_text(table, "statistic", statistic);
    study_table_number(table, "value", NULL, value);
    study_table_number(table, "derivative", NULL, derivative);
    study_table_number(table, "spread", NULL, spread);
    study_table_text(table, "is_settled", is_settled ? "true" : "false");
}

// The closed forms of k_b and c_b of a stop.
static void sensitivity_add_stop(StudyTable *table, const SensitivityStop *stop) {
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
        sensitivity_add(table, rows[i].parameter, statistic, rows[i].value, rows[i].derivative, 0,
                        !isnan(rows[i].derivative));
    }
}

// A row for each parameter and statistic, stops first. The drawn runs are in the JSON alone.
static void sensitivity_table(const Variant *answer, StudyTable *table) {
    const Sensitivity *sensitivity = (const Sensitivity *)(const void *)answer;
    for (size_t i = 0; i < sensitivity->contact.count; i++)
        if (sensitivity->contact.at[i].why == NULL)
            sensitivity_add_stop(table, &sensitivity->contact.at[i]);
    for (size_t i = 0; i < sensitivity->response.count; i++) {
        const SensitivityRow *row = &sensitivity->response.at[i];
        for (size_t k = 0; k < row->slopes.count; k++) {
            const SensitivitySlope *slope = &row->slopes.at[k];
            sensitivity_add(table, sensitivity_parameter_names[row->parameter],
                            statistics_metric_names[slope->metric], slope->value, slope->derivative,
                            slope->spread, slope->is_settled);
        }
    }
}

// A row for each run.
static void fragility_table(const Variant *variant, StudyTable *table) {
    const Fragility *answer = (const Fragility *)(const void *)variant;
    for (size_t r = 0; r < answer->curves.count; r++) {
        const FragilityCurve *curve = &answer->curves.at[r];
        for (size_t l = 0; l < curve->points.count; l++) {
            const FragilityPoint *point = &curve->points.at[l];
            study_table_row(table);
            study_table_text(table, "record", curve->record);
            study_table_number(table, "level", "m/s^2", point->level);
            for (int m = 0; m < STUDY_METRIC_COUNT; m++)
                if (!study_metric_is_reduction(m))
                    study_table_number(table, study_metric_names[m], study_metric_unit(m),
                                       point->metrics.of[m]);
        }
    }
}

static void sweep_chart(const Variant *answer, Chart *chart) {
    const Sweep *sweep = (const Sweep *)(const void *)answer;
    const SweepDocument document = sweep_document(sweep);
    (void)chart_sweep(&document, chart);
}

static const TableFormat *const json_only[] = {&format_json, NULL};
static const TableFormat *const with_chart[] = {&format_json, &format_svg, NULL};
static const TableFormat *const with_table[] = {&format_json, &format_csv, &format_npz, &format_svg,
                                                NULL};

typedef struct AnswerFormats {
    const StudyKind *study;
    const TableFormat *const *formats;
    void (*table)(const Variant *answer, StudyTable *table); // NULL: none, or one of its own
    void (*chart)(const Variant *answer, Chart *chart);
} AnswerFormats;

static const AnswerFormats all[] = {
    {&study_tradeoff, with_chart, NULL, chart_tradeoff},
    {&study_ensemble, with_table, ensemble_table, chart_ensemble},
    {&study_sweep, table_formats, NULL, sweep_chart},
    {&study_compare, with_table, compare_table, chart_compare},
    {&study_response, with_table, response_table, chart_response},
    {&study_sensitivity, with_table, sensitivity_table, chart_sensitivity},
    {&study_fragility, with_table, fragility_table, chart_fragility},
    {&study_calibrate, with_table, calibration_table, chart_calibration},
    {&study_optimize, with_table, optimum_table, chart_optimum},
    {NULL, json_only, NULL, NULL}, // of any other
};

// The row of a kind of answers; the last one if it has none.
static const AnswerFormats *answer_formats(const Kind *kind) {
    size_t i = 0;
    while (i + 1 < COUNT(all) && all[i].study->answer != kind)
        i++;
    return &all[i];
}

const TableFormat *const *study_formats(const Kind *kind) {
    return answer_formats(kind)->formats;
}

const TableFormat *study_format_find(const Kind *kind, const char *extension) {
    const TableFormat *const *formats = study_formats(kind);
    while (*formats != NULL && strcmp((*formats)->extension, extension) != 0)
        formats++;
    return *formats;
}

void study_chart(const Variant *answer, Chart *chart) {
    answer_formats(answer->kind)->chart(answer, chart);
}

static void study_format_table(const TableFormat *format, const Table *table, Bytes *bytes) {
    if (format_write(format, table, bytes, NULL) != STATUS_OK)
        bytes->is_failed = true;
}

void study_format_write(const TableFormat *format, const StudyDocument *document, Bytes *bytes) {
    const Variant *answer = document->answer;
    const AnswerFormats *own = answer_formats(answer->kind);
    if (format == &format_svg) {
        Chart chart;
        own->chart(answer, &chart);
        chart_write(&chart, bytes);
    } else if (answer->kind == study_sweep.answer) {
        SweepDocument sweep = sweep_document((const Sweep *)(const void *)answer);
        const Table table = sweep_document_table(&sweep);
        study_format_table(format, &table, bytes);
    } else if (format == &format_json) {
        document_study(bytes, document);
    } else {
        StudyTable rows = {.rows = 0};
        own->table(answer, &rows);
        const TableSource source = study_table_source(&rows);
        const Table table = study_table_view(&rows, &source);
        study_format_table(format, &table, bytes);
        bytes->is_failed = bytes->is_failed || rows.is_failed;
        study_table_clear(&rows);
    }
}

void study_formats_names(const TableFormat *const *formats, const char *before, char *target,
                         size_t size) {
    *target = '\0';
    for (; *formats != NULL; formats++) {
        char name[16];
        snprintf(name, sizeof name, "%.4s%.8s", before, (*formats)->extension);
        text_list(target, size, name);
    }
}
