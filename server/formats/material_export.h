// All materials as one document or table, made piece by piece: what materials/exchange_json.h and
// exchange_csv.h read, to the byte the same from the same rows. Used by api/material_exchange.c.
#ifndef SERVER_FORMATS_MATERIAL_EXPORT_H
#define SERVER_FORMATS_MATERIAL_EXPORT_H

#include "server/db/material_export.h"
#include "server/util/bytes.h"

typedef enum MaterialExportStage {
    EXCHANGE_BETWEEN, // materials
    EXCHANGE_REVISIONS,
    EXCHANGE_MEASUREMENTS
} MaterialExportStage;

// How far it is.
typedef struct MaterialExport {
    Db *db;
    MaterialMoment moment;
    bool is_table;
    bool has_begun;
    MaterialExportStage stage;
    size_t measurements;              // of this material so far
    char slug[MATERIAL_SLUG_MAX + 1]; // the material's; "" before the first
    uint64_t number;                  // of its last revision, or measurement
} MaterialExport;

Status material_export_open(Db *db, bool is_table, MaterialExport *text, Problem *problem);

// Appends the next piece, at most one revision with its reviews or one measurement; *is_last behind
// it all.
Status material_export_next(MaterialExport *text, Bytes *bytes, bool *is_last, Problem *problem);

#endif
