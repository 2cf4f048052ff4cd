#include "server/materials/measurement.h"

#include <stdlib.h>
#include <string.h>

#include "server/base/link.h"
#include "server/codec/read.h"
#include "server/codec/write.h"
#include "server/materials/catalogue.h"

void stored_test_clear(StoredTest *stored) {
    material_measurement_clear(&stored->row);
    fields_clear(drop_test_fields, &stored->test);
}

Status stored_test_load(Store *store, const char *slug, uint64_t number, StoredTest *stored,
                        Problem *problem) {
    TRY(store_material_measurement(store, slug, number, &stored->row, problem));
    const char *text = stored->row.document;
    Problem *fault = calloc(1, sizeof *fault);
    if (fault == NULL)
        return problem_set(problem, STATUS_NO_MEMORY, "no memory for the measurement");
    const Status status = read_json(text, strlen(text), drop_test_fields, &stored->test, fault);
    // A fault here is ours, not the client's.
    if (status != STATUS_OK)
        problem_set(problem, STATUS_INTERNAL, "measurement %llu of \"%.63s\" cannot be read: %s",
                    (unsigned long long)number, slug, fault->detail);
    free(fault);
    return status == STATUS_OK ? STATUS_OK : STATUS_INTERNAL;
}

void measurement_write_row(Bytes *bytes, const MaterialMeasurement *row) {
    bytes_format(bytes, "\"slug\": \"%s\", \"measurement\": %llu", row->slug,
                 (unsigned long long)row->measurement);
    material_put_text(bytes, "author", row->author);
    material_put_text(bytes, "comment", row->comment);
    material_put_time(bytes, "created", row->created_unix_ms);
}

void measurement_write_links(Bytes *bytes, const char *slug, uint64_t number) {
    const char *base = link_base();
    const unsigned long long n = number;
    bytes_format(bytes,
                 "\"links\": {\"self\": \"%s/v1/materials/%s/measurements/%llu\", \"material\": "
                 "\"%s/v1/materials/%s\", \"proposal\": "
                 "\"%s/v1/materials/%s/proposal?measurements=%llu\"}",
                 base, slug, n, base, slug, base, slug, n);
}

void measurement_write_brief(Bytes *bytes, const StoredTest *stored) {
    DropTest brief = stored->test; // borrows
    brief.drops = (Drops){NULL, 0};
    brief.traces = (Traces){NULL, 0};
    bytes_text(bytes, "{");
    measurement_write_row(bytes, &stored->row);
    bytes_format(bytes, ", \"drops\": %zu, \"traces\": %zu, \"test\": ", stored->test.drops.count,
                 stored->test.traces.count);
    write_item(bytes, drop_test_fields, &brief, WRITE_SCENE);
    bytes_text(bytes, ", ");
    measurement_write_links(bytes, stored->row.slug, stored->row.measurement);
    bytes_text(bytes, "}");
}

void evaluation_write(Bytes *bytes, const Evaluation *evaluation) {
    bytes_text(bytes, "\"evaluation\": ");
    write_item(bytes, evaluation_fields, evaluation, WRITE_REPORT);
    bytes_text(bytes, ", \"warnings\": ");
    write_list(bytes, warning_fields, evaluation->warnings.at, evaluation->warnings.count,
               sizeof *evaluation->warnings.at, WRITE_REPORT);
}
