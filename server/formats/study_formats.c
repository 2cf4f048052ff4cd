#include "server/formats/study_formats.h"

#include <stdio.h>
#include <string.h>

#include "server/formats/chart.h"
#include "server/formats/charts.h"
#include "server/formats/compare_csv.h"
#include "server/formats/ensemble_csv.h"
#include "server/formats/mat.h"
#include "server/formats/npy.h"
#include "server/formats/sensitivity_csv.h"
#include "server/formats/sweep_columns.h"
#include "server/formats/sweep_npz.h"
#include "server/formats/sweep_table.h"
#include "server/jobs/documents.h"

static void json_write(const Variant *answer, Bytes *bytes) {
    document_answer(bytes, answer);
    bytes_text(bytes, "\n");
}

static void tradeoff_chart(const Variant *answer, Bytes *bytes) {
    charts_tradeoff((const Tradeoff *)(const void *)answer, bytes);
}

static void ensemble_chart(const Variant *answer, Bytes *bytes) {
    charts_ensemble((const Ensemble *)(const void *)answer, bytes);
}

static void ensemble_table(const Variant *answer, Bytes *bytes) {
    ensemble_csv((const Ensemble *)(const void *)answer, bytes);
}

static void sweep_whole(const Variant *answer, Bytes *bytes) {
    sweep_json((const Sweep *)(const void *)answer, NULL, bytes);
}

static void sweep_archive(const Variant *answer, Bytes *bytes) {
    sweep_npz((const Sweep *)(const void *)answer, bytes);
}

static void sweep_array(const Variant *answer, Bytes *bytes) {
    sweep_columns((const Sweep *)(const void *)answer, &encoder_npy, bytes);
}

static void sweep_variables(const Variant *answer, Bytes *bytes) {
    sweep_columns((const Sweep *)(const void *)answer, &encoder_mat, bytes);
}

static void sweep_chart(const Variant *answer, Bytes *bytes) {
    const Sweep *sweep = (const Sweep *)(const void *)answer;
    const SweepSource source = sweep_source(sweep);
    (void)charts_sweep(sweep, &source, bytes);
}

static void sweep_table(const Variant *answer, Bytes *bytes) {
    sweep_csv((const Sweep *)(const void *)answer, bytes);
}

static void compare_chart(const Variant *answer, Bytes *bytes) {
    charts_compare((const Comparison *)(const void *)answer, bytes);
}

static void compare_table(const Variant *answer, Bytes *bytes) {
    compare_csv((const Comparison *)(const void *)answer, bytes);
}

static void sensitivity_chart(const Variant *answer, Bytes *bytes) {
    charts_sensitivity((const Sensitivity *)(const void *)answer, bytes);
}

static void sensitivity_table(const Variant *answer, Bytes *bytes) {
    sensitivity_csv((const Sensitivity *)(const void *)answer, bytes);
}

static const char csv_type[] = "text/csv; charset=utf-8";

static const struct {
    const StudyKind *study;
    StudyFormat formats[STUDY_FORMATS_MAX];
} all[] = {
    {&study_tradeoff,
     {{"json", "application/json", false, json_write},
      {"svg", chart_type, false, tradeoff_chart},
      {NULL, NULL, false, NULL}}},
    {&study_ensemble,
     {{"json", "application/json", false, json_write},
      {"csv", csv_type, false, ensemble_table},
      {"svg", chart_type, false, ensemble_chart},
      {NULL, NULL, false, NULL}}},
    {&study_sweep,
     {{"json", "application/json", false, sweep_whole},
      {"csv", csv_type, false, sweep_table},
      {"npy", "application/x-npy", true, sweep_array},
      {"npz", "application/x-npz", true, sweep_archive},
      {"mat", "application/x-matlab-data", true, sweep_variables},
      {"svg", chart_type, false, sweep_chart},
      {NULL, NULL, false, NULL}}},
    {&study_compare,
     {{"json", "application/json", false, json_write},
      {"csv", csv_type, false, compare_table},
      {"svg", chart_type, false, compare_chart},
      {NULL, NULL, false, NULL}}},
    {&study_sensitivity,
     {{"json", "application/json", false, json_write},
      {"csv", csv_type, false, sensitivity_table},
      {"svg", chart_type, false, sensitivity_chart},
      {NULL, NULL, false, NULL}}},
};

static const StudyFormat none[] = {{"json", "application/json", false, json_write},
                                   {NULL, NULL, false, NULL}};

const StudyFormat *study_formats(const Kind *kind) {
    for (size_t i = 0; i < COUNT(all); i++)
        if (all[i].study->answer == kind)
            return all[i].formats;
    return none;
}

const StudyFormat *study_format_find(const StudyFormat *formats, const char *extension) {
    while (formats->extension != NULL && strcmp(formats->extension, extension) != 0)
        formats++;
    return formats->extension != NULL ? formats : NULL;
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
