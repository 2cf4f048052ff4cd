// All materials as one JSON document or CSV table, made piece by piece. materials/import.h reads
// both, and the same rows are always the same bytes.
#ifndef SERVER_MATERIALS_EXPORT_H
#define SERVER_MATERIALS_EXPORT_H

#include "server/db/materials.h"
#include "server/util/bytes.h"

typedef enum ExportStage { EXPORT_START, EXPORT_REVISIONS, EXPORT_MEASUREMENTS } ExportStage;

// An export in progress.
typedef struct MaterialExport {
    Db *db;
    MaterialMoment moment;
    bool is_table;
    ExportStage stage;
    size_t measurements;              // of this material so far
    char slug[MATERIAL_SLUG_MAX + 1]; // of this material; "" before the first
    uint64_t number;                  // of its last revision or measurement; 0 before the first
} MaterialExport;

Status material_export_open(Db *db, bool is_table, MaterialExport *export, Problem *problem);

// Appends the next piece, at most one revision with its reviews or one measurement; *is_last after
// the last one.
Status material_export_next(MaterialExport *export, Bytes *bytes, bool *is_last, Problem *problem);

#endif
