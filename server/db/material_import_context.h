// An import as far as it is: what its parts share. Not what an import is (material_import.h). Used
// by material_import*.c alone.
#ifndef SERVER_DB_MATERIAL_IMPORT_CONTEXT_H
#define SERVER_DB_MATERIAL_IMPORT_CONTEXT_H

#include "server/db/material_columns.h"
#include "server/db/material_import.h"

typedef struct ImportContext {
    const MaterialImport *import;
    bool writes;
    ImportTally *metrics;
    Problem *faults;
    size_t denied;                                 // rows that the importer may not bring
    char denied_place[sizeof((Fault){0}.pointer)]; // the first of them
    const char *denied_why;
} ImportContext;

// One material of the file, and how far it is.
typedef struct MaterialGroup {
    const char *slug;
    MaterialKey key;
    const ImportRevision *revisions;
    size_t revision_count;
    const ImportMeasurement *measurements;
    size_t measurement_count;
    uint64_t last_measurement;                // there, or in the file before
    bool revisions_drift, measurements_drift; // one has a number that could not be read
    ImportCount revisions_done, measurements_done, reviews_done;
} MaterialGroup;

// Adds a fault at `name` below `place`; "": at `place` itself. STATUS_INVALID.
Status import_fault(const ImportContext *context, const char *place, const char *name,
                    const char *format, ...) __attribute__((format(printf, 4, 5)));
// Counts what the importer may not bring.
void import_deny(ImportContext *context, const char *place, const char *name, const char *why);

const char *import_author(const ImportContext *context, const RowInfo *mark, const char *author);
// Of a row that is not there yet: who wrote it, and when.
void import_validate_origin(ImportContext *context, const RowInfo *mark, const char *author,
                            int64_t created_unix_ms);
// A time is told at "created" below `place` where it lies ahead, or before that of the revision
// reviewed; 0: of none.
void import_validate_time(const ImportContext *context, const char *place, int64_t unix_ms,
                          int64_t revised_unix_ms);
// Who, when and why, as far as the file tells it.
typedef struct ImportOrigin {
    const char *author, *comment;
    int64_t created_unix_ms;
} ImportOrigin;
void import_compare_origin(const ImportContext *context, const RowInfo *mark, const char *what,
                           const ImportOrigin *ours, const ImportOrigin *there);
// A number that is not there must be the one behind `last`, which it becomes; where numbers drift
// it may be any.
Status import_validate_number(const ImportContext *context, const RowInfo *mark, const char *name,
                              uint64_t number, uint64_t before, bool drifts, uint64_t *last);

typedef struct ImportKey {
    char *slug;
    uint64_t number;
} ImportKey;
extern const RowColumn import_key_columns[];
// The row of that number into `item`, which is all zero before and where there is none.
Status import_load(Sqlite *database, const char *sql, const char *slug, uint64_t number,
                   const RowColumn *columns, void *item, Problem *problem);

Status import_measurements(ImportContext *context, Sqlite *database, MaterialGroup *group,
                           Problem *problem);
// Those of one revision, `said`, which is there already or has been added.
Status import_reviews(ImportContext *context, Sqlite *database, const ImportRevision *ours,
                      const MaterialRevision *said, MaterialGroup *group, Problem *problem);

#endif
