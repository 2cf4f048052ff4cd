// The columns of the materials' tables, and how rows are added within a transaction. Used inside
// store/ alone.
#ifndef SERVER_DB_MATERIAL_COLUMNS_H
#define SERVER_DB_MATERIAL_COLUMNS_H

#include "server/db/db_private.h"
#include "server/db/materials.h"

extern const RowColumn material_revision_columns[], material_review_columns[],
    material_measurement_columns[], material_brief_columns[], material_deed_columns[];

// A material within the writer's transaction; all zero where there is none.
typedef struct MaterialKey {
    char *slug; // borrowed
    int64_t number;
    uint64_t revision; // asked for, or 0
    uint64_t latest, version, measurements;
    char status[16], author[72]; // of that revision, "" where there is none or nobody is known
} MaterialKey;
extern const RowColumn material_key_columns[];
Status material_key_find(Sqlite *database, const char *slug, uint64_t revision, MaterialKey *key,
                         Problem *problem);

// Adds a row each, without judging and without the trail; the material exists, but for the first.
Status material_row_add(Sqlite *database, const char *slug, Problem *problem);
Status material_revision_add(Sqlite *database, const MaterialRevision *revision, Problem *problem);
Status material_review_add(Sqlite *database, const MaterialReview *review, Problem *problem);
Status material_measurement_add(Sqlite *database, const MaterialMeasurement *measurement,
                                Problem *problem);
// Notes what was done to `slug`.
Status audit_entry_add(Sqlite *database, const char *slug, const AuditEntry *deed,
                       Problem *problem);

#endif
