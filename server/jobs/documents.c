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
