#include "server/jobs/documents.h"

#include <string.h>

#include "server/json/encode.h"

void document_warnings(Bytes *bytes, const Warnings *warnings) {
    encode_list(bytes, warning_fields, warnings->at, warnings->count, sizeof *warnings->at,
                WRITE_REPORT);
}

// Takes the text without the spaces between its members: a result without channels is stored in
// 4 KiB.
static Status document_take(Bytes *bytes, char **target) {
    char *text = *target = bytes_take(bytes, NULL);
    TRY(status_made(text != NULL));
    bool is_in_text = false;
    for (const char *from = text; *from != '\0'; from++) {
        is_in_text = is_in_text != (*from == '"');
        if (*from == '\\')
            *text++ = *from++;
        if (*from != ' ' || is_in_text)
            *text++ = *from;
    }
    *text = '\0';
    return STATUS_OK;
}

Status document_outcome(const Outcome *outcome, ResultRow *row) {
    Bytes plan = {0}, summary = {0}, work = {0}, notes = {0};
    encode_item(&plan, plan_report_fields, &outcome->plan, WRITE_REPORT);
    bytes_text(&summary, "{");
    (void)encode_members(&summary, summary_fields, &outcome->summary, WRITE_REPORT);
    if (outcome->has_reduction) {
        bytes_text(&summary, ", ");
        (void)encode_members(&summary, reduction_fields, &outcome->reduction, WRITE_REPORT);
    }
    bytes_text(&summary, "}");
    encode_item(&work, work_counters_fields, &outcome->work, WRITE_REPORT);
    document_warnings(&notes, &outcome->warnings);
    const Status all[] = {document_take(&plan, &row->plan), document_take(&summary, &row->summary),
                          document_take(&work, &row->work), document_take(&notes, &row->notes)};
    return status_first(all, COUNT(all));
}

void document_join(Bytes *bytes, const char *first, const char *second) {
    static const char empty[] = "[]";
    const bool has_first = first != NULL && strcmp(first, empty) != 0;
    const bool has_second = second != NULL && strcmp(second, empty) != 0;
    if (has_first && has_second) {
        bytes_put(bytes, first, strlen(first) - 1);
        bytes_text(bytes, ", ");
        bytes_text(bytes, second + 1);
    } else {
        bytes_text(bytes, has_first ? first : has_second ? second : empty);
    }
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

static void document_put_answer(Bytes *bytes, const Variant *answer, const char *result,
                                const char *scene) {
    bytes_json(bytes, "{\"kind\": %s, ", answer->kind->name);
    if (result != NULL)
        bytes_json(bytes, "\"result\": %s, \"scene\": %p, ", result, scene);
    (void)encode_members(bytes, answer->kind->fields, answer, WRITE_REPORT);
    bytes_text(bytes, "}");
}

void document_answer(Bytes *bytes, const Variant *answer) {
    document_put_answer(bytes, answer, NULL, NULL);
}

void document_study(Bytes *bytes, const StudyDocument *document) {
    document_put_answer(bytes, document->answer, document->result, document->scene);
    bytes_text(bytes, "\n");
}
