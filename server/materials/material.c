#include "server/materials/material.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "server/json/encode.h"
#include "server/json/parse.h"
#include "server/util/base_path.h"
#include "server/util/clock.h"

Status slug_validate(const char *slug, const char *pointer, Problem *problem) {
    Fault fault = {0};
    const bool is_taken = strcmp(slug, "import") == 0;
    if (material_slug_is_valid(slug) && !is_taken)
        return STATUS_OK;
    text_fit(fault.pointer, sizeof fault.pointer, pointer);
    text_fit(fault.detail, sizeof fault.detail,
             is_taken ? "cannot name a material: /v1/materials/import is the address of imports"
                      : "must be 1 to 63 of a-z, 0-9, _ and -, as \"soft_rubber\"");
    text_quote(fault.value, sizeof fault.value, slug);
    return problem_add_fault(problem, STATUS_INVALID, &fault);
}

double material_count(uint64_t number) {
    return number > 0 ? (double)number : (double)NAN;
}

static void material_write_review(Bytes *bytes, const MaterialRevision *revision) {
    const bool is_own = text_same(revision->reviewer, revision->author) &&
                        strcmp(revision->status, "approved") == 0;
    if (revision->reviewed_unix_ms == 0)
        bytes_text(bytes, ", \"review\": null");
    else
        bytes_json(bytes,
                   ", \"review\": {\"status\": %s, \"reason\": %s, \"reviewer\": %s, "
                   "\"self_approved\": %p, \"created\": %s}",
                   revision->status, revision->reason, revision->reviewer, json_flag(is_own),
                   clock_rfc3339(revision->reviewed_unix_ms).at);
}

void material_write(Bytes *bytes, const MaterialRevision *revision) {
    const char *slug = revision->slug, *base = base_path();
    const unsigned long long number = revision->revision;
    bytes_format(bytes,
                 "{\"slug\": \"%s\", \"revision\": %llu, \"latest\": %llu, \"version\": %llu, "
                 "\"status\": \"%s\", ",
                 slug, number, (unsigned long long)revision->latest,
                 (unsigned long long)revision->version, revision->status);
    (void)encode_members(bytes, material_fields, &revision->material, WRITE_REPORT);
    bytes_json(bytes, ", \"author\": %s, \"comment\": %s, \"reverts\": %g, \"created\": %s",
               revision->author, revision->comment, material_count(revision->reverts),
               revision->created_unix_ms > 0 ? clock_rfc3339(revision->created_unix_ms).at : NULL);
    material_write_review(bytes, revision);
    bytes_format(bytes,
                 ", \"links\": {\"self\": \"%s/v1/materials/%s\", \"revision\": "
                 "\"%s/v1/materials/%s@%llu\", \"revisions\": \"%s/v1/materials/%s/revisions\", "
                 "\"measurements\": \"%s/v1/materials/%s/measurements\", \"history\": "
                 "\"%s/v1/materials/%s/history\", \"used_by\": \"%s/v1/materials/%s/used-by\"}}",
                 base, slug, base, slug, number, base, slug, base, slug, base, slug, base, slug);
}

void material_write_contents(Bytes *bytes, const MaterialRevision *revision) {
    bytes_format(bytes, "{\"slug\": \"%s\", \"revision\": %llu, \"status\": \"%s\", ",
                 revision->slug, (unsigned long long)revision->revision, revision->status);
    (void)encode_members(bytes, material_fields, &revision->material, WRITE_REPORT);
    bytes_text(bytes, "}");
}

void stored_test_clear(StoredTest *stored) {
    material_measurement_clear(&stored->row);
    fields_clear(drop_test_fields, &stored->test);
}

// A fault is the database's, not the client's.
// Of a row of a list, which has no document, its head.
static Status stored_test_read(const MaterialMeasurement *row, DropTest *test, Problem *problem) {
    Problem *fault = calloc(1, sizeof *fault);
    if (fault == NULL)
        return problem_set(problem, STATUS_NO_MEMORY, "no memory for the measurement");
    const char *text = row->document != NULL ? row->document : row->head;
    Status status = text != NULL ? json_parse(text, strlen(text), drop_test_fields, test, fault)
                                 : STATUS_INTERNAL;
    if (status != STATUS_OK)
        status = problem_set(problem, status == STATUS_NO_MEMORY ? status : STATUS_INTERNAL,
                             "measurement %llu of \"%.63s\" cannot be read: %s",
                             (unsigned long long)row->measurement, row->slug, fault->detail);
    free(fault);
    return status;
}

Status stored_test_load(Db *db, const char *slug, uint64_t number, StoredTest *stored,
                        Problem *problem) {
    TRY(db_material_measurement(db, slug, number, &stored->row, problem));
    const Status status = stored_test_read(&stored->row, &stored->test, problem);
    free(stored->row.document); // it may be as large as the test
    stored->row.document = NULL;
    return status;
}

void measurement_write_row(Bytes *bytes, const MaterialMeasurement *row) {
    bytes_json(bytes,
               "\"slug\": %s, \"measurement\": %llu, \"author\": %s, \"comment\": %s, "
               "\"created\": %s",
               row->slug, (unsigned long long)row->measurement, row->author, row->comment,
               row->created_unix_ms > 0 ? clock_rfc3339(row->created_unix_ms).at : NULL);
}

void measurement_write_links(Bytes *bytes, const char *slug, uint64_t number) {
    const char *base = base_path();
    const unsigned long long n = number;
    bytes_format(bytes,
                 "\"links\": {\"self\": \"%s/v1/materials/%s/measurements/%llu\", \"material\": "
                 "\"%s/v1/materials/%s\", \"proposal\": "
                 "\"%s/v1/materials/%s/proposal?measurements=%llu\"}",
                 base, slug, n, base, slug, base, slug, n);
}

Status measurement_write_head(Bytes *bytes, const MaterialMeasurement *row, Problem *problem) {
    DropTest test;
    memset(&test, 0, sizeof test);
    const Status status = stored_test_read(row, &test, problem);
    if (status == STATUS_OK) {
        bytes_text(bytes, "{");
        measurement_write_row(bytes, row);
        bytes_format(bytes, ", \"drops\": %llu, \"traces\": %llu, \"test\": ",
                     (unsigned long long)row->drops, (unsigned long long)row->traces);
        encode_item(bytes, drop_test_fields, &test, WRITE_SCENE);
        bytes_text(bytes, ", ");
        measurement_write_links(bytes, row->slug, row->measurement);
        bytes_text(bytes, "}");
    }
    fields_clear(drop_test_fields, &test);
    return status;
}

void evaluation_write(Bytes *bytes, const Evaluation *evaluation, bool has_evaluation) {
    bytes_text(bytes, "\"evaluation\": ");
    if (has_evaluation)
        encode_item(bytes, evaluation_fields, evaluation, WRITE_REPORT);
    else
        bytes_text(bytes, "null");
    bytes_text(bytes, ", \"warnings\": ");
    encode_list(bytes, warning_fields, evaluation->warnings.at, evaluation->warnings.count,
                sizeof *evaluation->warnings.at, WRITE_REPORT);
}
