// A measurement as the rest of the server takes it: the store's row with its drop test read, and
// the JSON that it and evaluations are told in. Not the evaluation itself
// (core/drop_test/evaluation.h). Used by api/.
#ifndef SERVER_MATERIALS_MEASUREMENT_H
#define SERVER_MATERIALS_MEASUREMENT_H

#include "core/drop_test/evaluation.h"
#include "server/db/materials.h"
#include "server/util/bytes.h"

typedef struct StoredTest {
    MaterialMeasurement row; // without its document
    DropTest test;
} StoredTest;

// STATUS_NOT_FOUND. Cleared by stored_test_clear in any case; `stored` is all zero before.
Status stored_test_load(Db *db, const char *slug, uint64_t number, StoredTest *stored,
                        Problem *problem);
void stored_test_clear(StoredTest *stored);

// Whose it is, and when: `"slug": ..., "measurement": ...` without braces.
void measurement_write_row(Bytes *bytes, const MaterialMeasurement *row);
// Of the test all but its readings, of which the numbers are told; a whole object.
Status measurement_write_brief(Bytes *bytes, const MeasurementSummary *brief, Problem *problem);
// `"links": {...}`.
void measurement_write_links(Bytes *bytes, const char *slug, uint64_t number);
// `"evaluation": {...}, "warnings": [...]`.
void evaluation_write(Bytes *bytes, const Evaluation *evaluation);
// The same of one that was given up: null, and its warnings say why.
void evaluation_write_none(Bytes *bytes, const Evaluation *evaluation);

#endif
