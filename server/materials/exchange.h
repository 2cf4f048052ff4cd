// Files of materials: a JSON document or a CSV table. An export is made piece by piece, an import
// reads either, and the same rows are always the same bytes.
#ifndef SERVER_MATERIALS_EXCHANGE_H
#define SERVER_MATERIALS_EXCHANGE_H

#include "server/db/material_import.h"
#include "server/util/bytes.h"

enum { MATERIALS_FORMAT_VERSION = 1 };
extern const char materials_format[]; // "impactd-materials"

// How a file has the members of an ImportRow: in a document, and as the columns of a table.
extern const Field import_revision_fields[], import_measurement_fields[], import_row_fields[];

// Whether a text in a cell is written as a JSON string with its quotes, as an export writes what is
// unsafe in a spreadsheet or on a terminal.
bool import_is_json_text(const char *text);

typedef struct ImportOptions {
    bool is_table, is_dry;
    const char *who; // the importer; NULL: the local user
    bool may_all;    // may import rows of other authors, times and reviews
} ImportOptions;

// Reads and imports a file, all of it or nothing. STATUS_INVALID: all faults; those of a table have
// row and column. STATUS_UNREADABLE: it is not JSON.
Status import_file(Db *db, const char *text, size_t size, const ImportOptions *options,
                   ImportTally *tally, Problem *problem);

typedef enum ExportStage { EXPORT_START, EXPORT_REVISIONS, EXPORT_MEASUREMENTS } ExportStage;

// An export in progress.
typedef struct MaterialExport {
    Db *db;
    MaterialMoment moment;
    bool is_table;
    ExportStage stage;
    char slug[MATERIAL_SLUG_MAX + 1]; // of this material; "" before the first
    uint64_t number;                  // of its last revision or measurement; 0 before the first
} MaterialExport;

Status material_export_open(Db *db, bool is_table, MaterialExport *export, Problem *problem);
// Appends the next piece, at most one revision with its reviews or one measurement; *is_last after
// the last one.
Status material_export_next(MaterialExport *export, Bytes *bytes, bool *is_last, Problem *problem);

#endif
