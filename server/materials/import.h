// Files of materials: a JSON document or a CSV table, as materials/export.h writes them, into the
// database.
#ifndef SERVER_MATERIALS_IMPORT_H
#define SERVER_MATERIALS_IMPORT_H

#include "server/db/material_import.h"

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

#endif
