#include "server/jobs/documents.h"

#include <string.h>

#include "server/json/encode.h"

void document_plan(Bytes *bytes, const PlanReport *plan) {
    encode_item(bytes, plan_report_fields, plan, WRITE_REPORT);
}

void document_summary(Bytes *bytes, const Outcome *outcome) {
    bytes_text(bytes, "{");
    (void)encode_members(bytes, summary_fields, &outcome->summary, WRITE_REPORT);
    if (outcome->has_reduction) {
        bytes_text(bytes, ", ");
        (void)encode_members(bytes, reduction_fields, &outcome->reduction, WRITE_REPORT);
    }
    bytes_text(bytes, "}");
}

void document_work(Bytes *bytes, const WorkCounters *work) {
    encode_item(bytes, work_counters_fields, work, WRITE_REPORT);
}

void document_warnings(Bytes *bytes, const Warnings *warnings) {
    encode_list(bytes, warning_fields, warnings->at, warnings->count, sizeof *warnings->at,
                WRITE_REPORT);
}

void document_join(Bytes *bytes, const char *first, const char *second) {
    static const char empty[] = "[]";
    if (first == NULL || strcmp(first, empty) == 0) {
        bytes_text(bytes, second != NULL ? second : empty);
        return;
    }
    if (second == NULL || strcmp(second, empty) == 0) {
        bytes_text(bytes, first);
        return;
    }
    bytes_put(bytes, first, strlen(first) - 1);
    bytes_text(bytes, ", ");
    bytes_text(bytes, second + 1);
}

void document_energy(Bytes *bytes, const Energy *energy) {
    bytes_text(bytes, "{\"unit\": \"J\", ");
    (void)encode_members(bytes, energy_fields, energy, WRITE_REPORT);
    bytes_text(bytes, "}");
}

enum { WATCH_IMPACTS = 1 << 12, WATCH_VALUES = 1 << 16 }; // written between two looks at the watch

bool document_impacts(Bytes *bytes, const Response *response, const Progress *watch) {
    const Impacts *impacts = &response->impacts;
    if (response->is_unlisted) {
        bytes_text(bytes, "null");
        return true;
    }
    bytes_format(bytes, "{\"count\": %llu, \"resting\": %llu, \"impacts\": [",
                 (unsigned long long)response->impact_count,
                 (unsigned long long)response->resting_count);
    for (size_t i = 0; i < impacts->count; i++) {
        if (i % WATCH_IMPACTS == 0 && !progress_advance(watch, 1))
            return false;
        bytes_text(bytes, i > 0 ? ", " : "");
        encode_item(bytes, impact_fields, &impacts->at[i], WRITE_REPORT);
    }
    bytes_text(bytes, "]}");
    return true;
}

static bool put_values(Bytes *bytes, const char *unit, const double *values, size_t count,
                       const Progress *watch) {
    bytes_text(bytes, "{\"unit\": ");
    bytes_json_string(bytes, unit);
    bytes_text(bytes, ", \"values\": [");
    for (size_t i = 0; i < count; i += WATCH_VALUES) {
        if (!progress_advance(watch, 1))
            return false;
        bytes_text(bytes, i > 0 ? "," : "");
        bytes_reals(bytes, values + i, count - i < WATCH_VALUES ? count - i : WATCH_VALUES);
    }
    bytes_text(bytes, "]}");
    return true;
}

bool document_psd(Bytes *bytes, const Spectrum *spectrum, const Progress *watch) {
    const WelchSettings *settings = &spectrum->settings;
    const Columns *densities = &spectrum->densities;
    if (densities->count == 0) {
        bytes_text(bytes, "null");
        return true;
    }
    bytes_format(bytes,
                 "{\"method\": \"welch\", \"segment\": %zu, \"overlap\": %zu, \"window\": \"%s\", ",
                 settings->segment, settings->overlap, welch_window_names[settings->window]);
    bytes_format(bytes, "\"detrend\": \"%s\", \"segments\": %zu, \"frequency\": ",
                 welch_detrend_names[settings->detrend], spectrum->segments);
    if (!put_values(bytes, "Hz", spectrum->frequency, densities->rows, watch))
        return false;
    bytes_text(bytes, ", \"channels\": {");
    for (size_t i = 0; i < densities->count; i++) {
        bytes_text(bytes, i > 0 ? ", " : "");
        bytes_json_string(bytes, densities->at[i].name);
        bytes_text(bytes, ": ");
        if (!put_values(bytes, densities->at[i].unit, densities->at[i].values, densities->rows,
                        watch))
            return false;
    }
    bytes_text(bytes, "}}");
    return true;
}

void document_scene(Bytes *bytes, const StudyRequest *inquiry) {
    StudyRequest plain = *inquiry; // a borrowed view: nothing is cleared
    plain.simulation.title = NULL;
    plain.simulation.labels = (Texts){NULL, 0};
    encode_item(bytes, study_request_fields, &plain, WRITE_SCENE);
}

void document_study(Bytes *bytes, const StudyAnswer *answer) {
    encode_item(bytes, study_answer_fields, answer, WRITE_SCENE);
}

void document_answer(Bytes *bytes, const Variant *answer) {
    bytes_text(bytes, "{\"kind\": ");
    bytes_json_string(bytes, answer->kind->name);
    bytes_text(bytes, ", ");
    (void)encode_members(bytes, answer->kind->fields, answer, WRITE_REPORT);
    bytes_text(bytes, "}");
}
