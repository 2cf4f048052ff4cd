// Materials and measurements as the rest of the server uses them: as JSON, and drop tests read.
#ifndef SERVER_MATERIALS_MATERIAL_H
#define SERVER_MATERIALS_MATERIAL_H

#include "core/drop_test/evaluation.h"
#include "server/db/materials.h"
#include "server/util/bytes.h"

// STATUS_INVALID with a fault at `pointer`: `slug` may not name a material, because of its
// characters, its length, or because it is part of another address.
Status slug_validate(const char *slug, const char *pointer, Problem *problem);

// The revision as an object with author, review and links.
void material_write(Bytes *bytes, const MaterialRevision *revision);
// Only slug, revision, status and the material itself.
void material_write_contents(Bytes *bytes, const MaterialRevision *revision);

// A number that counts from 1 as JSON has it; 0 is null.
double material_count(uint64_t number);

// A measurement with its drop test.
typedef struct StoredTest {
    MaterialMeasurement row; // without its document
    DropTest test;
} StoredTest;

// STATUS_NOT_FOUND; STATUS_INTERNAL: it is damaged. `stored` is all zero before and cleared by
// stored_test_clear in any case.
Status stored_test_load(Db *db, const char *slug, uint64_t number, StoredTest *stored,
                        Problem *problem);
void stored_test_clear(StoredTest *stored);

// `"slug": ..., "measurement": ...`, author, comment and time, without braces.
void measurement_write_row(Bytes *bytes, const MaterialMeasurement *row);
// A row of db_measurement_heads as an object.
Status measurement_write_head(Bytes *bytes, const MaterialMeasurement *row, Problem *problem);
// `"links": {...}`.
void measurement_write_links(Bytes *bytes, const char *slug, uint64_t number);
// `"evaluation": {...}, "warnings": [...]`; without `has_evaluation` it is null, and its warnings
// say why.
void evaluation_write(Bytes *bytes, const Evaluation *evaluation, bool has_evaluation);

#endif
