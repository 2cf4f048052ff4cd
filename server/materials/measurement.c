#include "server/materials/measurement.h"

#include <stdlib.h>
#include <string.h>

#include "server/json/encode.h"
#include "server/json/parse.h"
#include "server/materials/material.h"
#include "server/util/base_path.h"

void stored_test_clear(StoredTest *stored) {
    material_measurement_clear(&stored->row);
    fields_clear(drop_test_fields, &stored->test);
}

// A fault is the store's, not the client's.
static Status read_test(const MaterialMeasurement *row, DropTest *test, Problem *problem) {
    Problem *fault = calloc(1, sizeof *fault);
    if (fault == NULL)
        return problem_set(problem, STATUS_NO_MEMORY, "no memory for the measurement");
    Status status = json_parse(row->document, strlen(row->document), drop_test_fields, test, fault);
    if (status != STATUS_OK)
        status = problem_set(problem, STATUS_INTERNAL,
                             "measurement %llu of \"%.63s\" cannot be read: %s",
                             (unsigned long long)row->measurement, row->slug, fault->detail);
    free(fault);
    return status;
}

Status stored_test_load(Db *db, const char *slug, uint64_t number, StoredTest *stored,
                        Problem *problem) {
    TRY(db_material_measurement(db, slug, number, &stored->row, problem));
    const Status status = read_test(&stored->row, &stored->test, problem);
    free(stored->row.document); // it may be as large as the test
    stored->row.document = NULL;
    return status;
}

void measurement_write_row(Bytes *bytes, const MaterialMeasurement *row) {
    bytes_format(bytes, "\"slug\": \"%s\", \"measurement\": %llu", row->slug,
                 (unsigned long long)row->measurement);
    material_put_text(bytes, "author", row->author);
    material_put_text(bytes, "comment", row->comment);
    material_put_time(bytes, "created", row->created_unix_ms);
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

Status measurement_write_brief(Bytes *bytes, const MeasurementSummary *brief, Problem *problem) {
    DropTest test;
    memset(&test, 0, sizeof test);
    const Status status = read_test(&brief->row, &test, problem);
    if (status == STATUS_OK) {
        bytes_text(bytes, "{");
        measurement_write_row(bytes, &brief->row);
        bytes_format(bytes, ", \"drops\": %llu, \"traces\": %llu, \"test\": ",
                     (unsigned long long)brief->drops, (unsigned long long)brief->traces);
        encode_item(bytes, drop_test_fields, &test, WRITE_SCENE);
        bytes_text(bytes, ", ");
        measurement_write_links(bytes, brief->row.slug, brief->row.measurement);
        bytes_text(bytes, "}");
    }
    fields_clear(drop_test_fields, &test);
    return status;
}

static void write_warnings(Bytes *bytes, const Evaluation *evaluation) {
    bytes_text(bytes, ", \"warnings\": ");
    encode_list(bytes, warning_fields, evaluation->warnings.at, evaluation->warnings.count,
                sizeof *evaluation->warnings.at, WRITE_REPORT);
}

void evaluation_write(Bytes *bytes, const Evaluation *evaluation) {
    bytes_text(bytes, "\"evaluation\": ");
    encode_item(bytes, evaluation_fields, evaluation, WRITE_REPORT);
    write_warnings(bytes, evaluation);
}

void evaluation_write_none(Bytes *bytes, const Evaluation *evaluation) {
    bytes_text(bytes, "\"evaluation\": null");
    write_warnings(bytes, evaluation);
}
