// Rows of materials within a transaction, for the files of db/ alone.
#ifndef SERVER_DB_MATERIAL_ROWS_H
#define SERVER_DB_MATERIAL_ROWS_H

#include "server/db/db_private.h"
#include "server/db/materials.h"

const SqlColumn *material_revision_columns(void);
extern const SqlColumn material_review_columns[], material_measurement_columns[];

// What rows are found by.
typedef struct MaterialRowKey {
    char *slug;
    uint64_t number; // of a revision, a measurement, an audit entry
    uint64_t max;
    MaterialMoment moment;
} MaterialRowKey;
extern const SqlColumn material_row_key_columns[];

// A material; all zero if it does not exist.
typedef struct MaterialKey {
    int64_t number;
    uint64_t latest, version, measurements;
    char status[16], author[72]; // of the revision asked for; "": there is none, or unknown
} MaterialKey;
Status material_key_find(Sqlite *database, const char *slug, uint64_t revision, MaterialKey *key,
                         Problem *problem);

// Each adds a row without validation and without an audit entry. The material exists, except for
// the first. STATUS_LIMIT.
Status material_row_add(Sqlite *database, const char *slug, Problem *problem);
Status material_revision_add(Sqlite *database, const MaterialRevision *revision, Problem *problem);
Status material_review_add(Sqlite *database, const MaterialReview *review, Problem *problem);
Status material_measurement_add(Sqlite *database, const MaterialMeasurement *measurement,
                                Problem *problem);
Status audit_entry_add(Sqlite *database, const AuditEntry *entry, Problem *problem);

// Reads revision->lists into the lists of its material. STATUS_INTERNAL: it is damaged.
Status material_lists_read(MaterialRevision *revision, Problem *problem);

#endif
